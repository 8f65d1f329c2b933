//! `admittance`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;

use super::examples::{self, after};
use super::numbers::{real, some};
use super::{PictureArguments, SceneArguments};

#[derive(Debug, Args)]
#[command(after_help = after(examples::ADMITTANCE))]
pub(crate) struct AdmittanceArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// The peer whose device is pushed
    #[arg(long, value_name = "NAME")]
    pub(crate) peer: String,
    /// The lowest frequency [default: 0.01]
    #[arg(long, value_name = "HZ", value_parser = real, allow_negative_numbers = true)]
    pub(crate) from: Option<f64>,
    /// The highest frequency, at most half the rate of the peer's ticks [default: 100, or less if that is too high]
    #[arg(long, value_name = "HZ", value_parser = real, allow_negative_numbers = true)]
    pub(crate) to: Option<f64>,
    /// How many frequencies from the lowest to the highest, each the same factor above the one before [default: 60]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = some)]
    pub(crate) points: Option<NonZeroUsize>,
    /// These frequencies instead: --at 0.01,1,10
    #[arg(long, value_name = "HZ,...", value_parser = real, value_delimiter = ',', allow_negative_numbers = true, conflicts_with_all = ["from", "to", "points"])]
    pub(crate) at: Vec<f64>,
    /// Another curve beside it, with these keys overridden too, again and again:
    /// --curve scene.count=3,coordination.strategy=proportional-derivative
    #[arg(long, value_name = "KEY=VALUE,...")]
    pub(crate) curve: Vec<String>,
    /// Write admittance.csv and a Bode plot, admittance.svg, into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
}
