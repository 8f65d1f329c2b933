//! What can be said on the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Several people feel and move one virtual object together, over a bad network.
///
/// A scene is one TOML file: the object, the peers, the links between them, and what is expected. docs/scenes.md lists every key.
#[derive(Debug, Parser)]
#[command(name = "cohaptic", version, after_help = EXIT_STATUS)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXIT_STATUS: &str = "Exit status: 0 done, 1 an expectation failed, 2 a bad argument or scene, 3 an input or output error, 130 interrupted.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Simulates a scene in virtual time and says what happened
    Run(RunArguments),
    /// Runs scenes as tests: each against its own \[expect\]
    Check(CheckArguments),
    /// Says what a scene makes the program model, what it leaves out and why, and what it costs
    Explain(ExplainArguments),
}

/// What all commands on one scene take.
#[derive(Debug, Args)]
pub(crate) struct SceneArguments {
    /// The scene, a TOML file
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Overrides {
    /// Override a key of the scene by its dotted path, again and again: --set coordination.stiffness=1000 --set link.delay=8ms
    /// --set peers.left.contact=none
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Run the scene a second time with these keys overridden too, with the same random numbers, and show both:
    /// --against coordination.strategy=proportional-derivative
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) against: Vec<String>,
    /// Write trajectory.csv, packets.csv, links.csv and plots (SVG) into this folder; the second run goes into its folder `against`
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Do not draw positions in the terminal. Nothing is looked at then but counters, which is fastest
    #[arg(long)]
    pub(crate) no_plot: bool,
    /// Simulate everything the program has, needed or not: slower, and the same answer to the last bit
    #[arg(long)]
    pub(crate) general: bool,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct CheckArguments {
    /// Scenes, or folders of scenes
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// How many scenes run at the same time [default: one a core]. Results do not depend on it
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
    /// Simulate everything the program has, needed or not: slower, and the same answer to the last bit
    #[arg(long)]
    pub(crate) general: bool,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct ExplainArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
}
