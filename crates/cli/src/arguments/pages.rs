//! `init`, `schema`, `completions` and `man`: files for authors of scenes, their shells and their editors.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use clap_complete::Shell;

use super::examples::{self, after};

#[derive(Debug, Args)]
#[command(after_help = after(examples::INIT))]
pub(crate) struct InitArguments {
    /// The file to write; - writes to standard output
    #[arg(value_name = "FILE", default_value = "scene.toml")]
    pub(crate) file: PathBuf,
    /// The scene to begin with, such as paper/5-1 or network/jitter-normal; --list names all
    #[arg(long, value_name = "SCENE", default_value = "coordination/two-people")]
    pub(crate) from: String,
    /// How many peers [default: as many as the scene has]. With another number what the scene expects is left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub(crate) peers: Option<u32>,
    /// Write over a file that is there
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the names that --from takes, each with the title of its scene, and do nothing else
    #[arg(long, conflicts_with_all = ["file", "from", "peers", "force"])]
    pub(crate) list: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::SCHEMA))]
pub(crate) struct SchemaArguments {
    /// Of which kind of file
    #[arg(value_enum, value_name = "KIND", default_value_t = FileKind::Scene)]
    pub(crate) kind: FileKind,
}

/// A kind of file that the program reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum FileKind {
    /// Of run, check and all other commands that take a scene
    Scene,
    /// Of relay
    Relay,
    /// Of router
    Router,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::COMPLETIONS))]
pub(crate) struct CompletionsArguments {
    /// The shell whose completions are printed
    #[arg(value_enum, value_name = "SHELL")]
    pub(crate) shell: Shell,
    /// The words that follow cohaptic in a command line: print what completes the last one, if that is a key, a peer or a scene. The script asks so
    #[arg(value_name = "WORD", last = true)]
    pub(crate) words: Vec<OsString>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::MAN))]
pub(crate) struct ManArguments {
    /// The command whose page is printed, such as stability map [default: the program itself]
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    pub(crate) command: Vec<String>,
    /// Write the page of the program and one of each command into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}
