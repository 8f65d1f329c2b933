//! `compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::examples::{self, after};
use super::numbers::any_integer;
use super::{SceneArguments, ShardArguments, TableArguments};

#[derive(Debug, Args)]
#[command(after_help = after(examples::COMPARE))]
pub(crate) struct CompareArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Strategies, with commas between them; the others are compared with the first. Parameters follow the name, and other keys have their
    /// dotted path: --strategies 'average-position,local-damping{damping=58},extrapolated{horizon=50ms,coordination.damping=0}'
    #[arg(long, value_name = "A,B{KEY=VALUE},...", required_unless_present = "preset", conflicts_with = "preset")]
    pub(crate) strategies: Option<String>,
    /// Vary a key, as campaign does. The first key is the horizontal axis of the pictures, and each value of the others has a panel
    #[arg(long, value_name = "KEY=VALUES", conflicts_with = "preset")]
    pub(crate) vary: Vec<String>,
    /// Named set of strategies and values
    #[arg(long, value_enum, value_name = "NAME")]
    pub(crate) preset: Option<PresetName>,
    /// Number of runs of each combination, with the same seeds for all strategies [default: 10]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 10, hide_default_value = true)]
    pub(crate) runs: u64,
    /// Folder of the comparison: the table of runs, verdicts, compare.csv, compare.html, and pictures of a task. Repeat the command to go on from there
    #[arg(long, value_name = "DIR", required_unless_present_any = ["merge", "status"])]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shards: ShardArguments,
    #[command(flatten)]
    pub(crate) table: TableArguments,
}

/// Named set of strategies and values.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum PresetName {
    /// Every strategy with its parameters at their defaults, and a dead band of 10 % of the velocity, over link delays of 0 to 200 ms and losses of 0 to 30 %
    Field,
}
