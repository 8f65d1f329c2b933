//! `init`, `schema`, `completions` and `man`: files for authors of scenes, their shells and their editors.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use clap_complete::Shell;

use super::examples::{self, after};

#[derive(Debug, Args)]
#[command(after_help = after(examples::INIT))]
pub(crate) struct InitArguments {
    /// File to write; - writes to standard output
    #[arg(value_name = "FILE", default_value = "scene.toml")]
    pub(crate) file: PathBuf,
    /// Scene to begin with, such as paper/5-1 or network/jitter-normal; --list names all
    #[arg(long, value_name = "SCENE", default_value = "coordination/two-people")]
    pub(crate) from: String,
    /// Number of peers [default: as many as the scene has]. With another number the expectations of the scene are left out
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub(crate) peers: Option<u32>,
    /// Overwrite a file that exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the names that --from takes, each with the title of its scene, and do nothing else
    #[arg(long, conflicts_with_all = ["file", "from", "peers", "force"])]
    pub(crate) list: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::SCHEMA))]
pub(crate) struct SchemaArguments {
    /// Kind of file that the schema describes
    #[arg(value_enum, value_name = "KIND", default_value_t = FileKind::Scene)]
    pub(crate) kind: FileKind,
}

/// A kind of file that the program reads.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum FileKind {
    /// Scenes: for run, check and all other commands that take a scene
    Scene,
    /// Relay files: for relay
    Relay,
    /// Relay files for TCP: for relay --tcp
    RelayTcp,
    /// Router files: for router
    Router,
    /// Files of hosts with commands: for exec
    Exec,
    /// Study files: for study
    Study,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::COMPLETIONS))]
pub(crate) struct CompletionsArguments {
    /// Shell whose completions are printed
    #[arg(value_enum, value_name = "SHELL")]
    pub(crate) shell: Shell,
    /// The words that follow cohaptic in a command line: print what completes the last one, if that is a key, a peer or a scene. The script asks so
    #[arg(value_name = "WORD", last = true)]
    pub(crate) words: Vec<OsString>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::MAN))]
pub(crate) struct ManArguments {
    /// Command whose page is printed, such as stability map [default: the program itself]
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    pub(crate) command: Vec<String>,
    /// Write the page of the program and one of each command into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}
