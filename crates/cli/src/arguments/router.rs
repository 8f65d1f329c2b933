//! `router`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use cohaptic_units::parse;

use super::RealTimeArguments;
use super::examples::{self, after};

#[derive(Debug, Args)]
#[command(after_help = after(examples::ROUTER))]
pub(crate) struct RouterArguments {
    /// A router file: two devices, the links between them, and rules that say which packets take which link; - reads it from
    /// standard input
    pub(crate) file: PathBuf,
    /// Override a key of the router file by its dotted path, again and again: --set links.wan.delay=8ms --set router.default=drop
    /// --set router.memory.packets=1000
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    /// End by itself after this time [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
}
