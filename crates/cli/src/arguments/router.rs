//! `router`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use cohaptic_units::parse;

use super::{EXIT_STATUS, Overrides, RealTimeArguments};

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct RouterArguments {
    /// A router file: two devices, the links between them, and rules that say which packets take which link
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    /// End by itself after this time [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
}
