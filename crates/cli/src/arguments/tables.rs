//! Options of the commands that fill a table of runs: `campaign` and `compare`.

use std::num::NonZeroU64;

use clap::{Args, ValueEnum};
use cohaptic_campaign::Format;

use super::numbers::{integer, threads};

#[derive(Debug, Args)]
pub(crate) struct TableArguments {
    /// Format of the table of runs
    #[arg(long, value_enum, default_value_t = TableFormat::Parquet)]
    pub(crate) format: TableFormat,
    /// Number of runs made at the same time [default: one per core]. Results do not depend on it
    #[arg(long, value_name = "N", visible_alias = "jobs", allow_negative_numbers = true, value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Number of runs saved together: if the program is killed, each thread loses at most these [default: some seconds' worth]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<NonZeroU64>(1, u64::MAX))]
    part: Option<NonZeroU64>,
}

impl TableArguments {
    /// Returns the number of runs saved together; `None` lets the campaign choose.
    pub(crate) fn part(&self) -> Option<u64> {
        self.part.map(NonZeroU64::get)
    }
}

/// Format of a table.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum TableFormat {
    /// runs.parquet
    Parquet,
    /// runs.csv
    Csv,
}

impl From<TableFormat> for Format {
    fn from(format: TableFormat) -> Self {
        match format {
            TableFormat::Parquet => Self::Parquet,
            TableFormat::Csv => Self::Csv,
        }
    }
}
