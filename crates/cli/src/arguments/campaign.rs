//! `campaign`.

use std::num::NonZeroU64;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::examples::{self, after};
use super::numbers::{any_integer, integer, threads};
use super::{PictureArguments, SceneArguments};

#[derive(Debug, Args)]
#[command(after_help = after(examples::CAMPAIGN))]
pub(crate) struct CampaignArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Vary a key: --vary coordination.stiffness=0..6000/13 (13 values, both ends among them), --vary coordination.stiffness=10..1000/5:log (equal ratios),
    /// --vary link.delay=8ms,24ms (these values). Again and again: every combination is run, the last key varying fastest
    #[arg(long, value_name = "KEY=VALUES")]
    pub(crate) vary: Vec<String>,
    /// How many runs there are of each combination: with the seed of the scene, with the next one, and so on
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 1)]
    pub(crate) runs: u64,
    /// The folder of the campaign: the table, and until that is there the parts. The same command goes on with what is there
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Judge each combination as stability point does, and write the verdict into the rows of its runs
    #[arg(long)]
    pub(crate) verdicts: bool,
    /// As what the table is written
    #[arg(long, value_enum, default_value_t = TableFormat::Parquet)]
    pub(crate) format: TableFormat,
    /// How many runs are made at the same time [default: one a core]. Results do not depend on it
    #[arg(long, value_name = "N", visible_alias = "jobs", allow_negative_numbers = true, value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// How many runs are kept together, the most that a kill can cost on each thread [default: some seconds' worth]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<NonZeroU64>(1, u64::MAX))]
    pub(crate) part: Option<NonZeroU64>,
    /// Do not draw pictures
    #[arg(long)]
    pub(crate) no_plot: bool,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
}

/// As what a table is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum TableFormat {
    /// runs.parquet
    Parquet,
    /// runs.csv
    Csv,
}
