//! `run`, `check` and `explain`.

use std::path::PathBuf;

use clap::Args;

use super::threads::threads;
use super::{EXIT_STATUS, Overrides, PictureArguments, SceneArguments};

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
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
    /// Replay a live session: its inputs.csv, with the scene and the --set of that session. Fates and motion are the same to the last bit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["against", "general"])]
    pub(crate) inputs: Option<PathBuf>,
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
    #[arg(long, value_name = "N", value_parser = threads())]
    pub(crate) jobs: Option<u16>,
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
