//! The command line.

use std::path::PathBuf;

use clap::Parser;
use cohaptic_benches::effort::Effort;

use crate::steps::Step;

/// Measures, and writes docs/measured.md and the pages beside it.
///
/// Each step is on the page as soon as it is done, with its own date; steps that are not named keep what the page says of them. A step that fails changes
/// nothing. Pages of figures that need a quiet machine and privileges are not written: relay-speed.md, live-speed.md and soak.md name their own commands.
#[derive(Debug, Parser)]
#[command(name = "benches/measure", version)]
pub(crate) struct Arguments {
    /// Only these [default: all]
    #[arg(value_enum, value_name = "STEP")]
    only: Vec<Step>,
    /// Fewer rounds and less work, some minutes in all; testkit and peers have no shorter form
    #[arg(long)]
    quick: bool,
    /// The least work that prints every row: figures that say nothing. For tests
    #[arg(long, conflicts_with = "quick")]
    smoke: bool,
    /// The folder that the pages are written to
    #[arg(long, value_name = "DIR", default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs"))]
    pub(crate) into: PathBuf,
}

impl Arguments {
    pub(crate) const fn effort(&self) -> Effort {
        match (self.quick, self.smoke) {
            (_, true) => Effort::Smoke,
            (true, false) => Effort::Quick,
            (false, false) => Effort::Full,
        }
    }

    /// In the order of the page, each once.
    pub(crate) fn steps(&self) -> Vec<Step> {
        Step::ALL.into_iter().filter(|step| self.only.is_empty() || self.only.contains(step)).collect()
    }
}
