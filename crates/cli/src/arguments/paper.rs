//! `paper` and `accuracy`.

use std::path::PathBuf;

use clap::Args;
#[cfg(target_os = "linux")]
use cohaptic_accuracy::Subject;

use super::PictureArguments;
use super::examples::{self, after};

/// Elsewhere the command `accuracy` is refused whatever its subjects are.
#[cfg(not(target_os = "linux"))]
type Subject = String;

#[derive(Debug, Args)]
#[command(after_help = after(examples::PAPER))]
pub(crate) struct PaperArguments {
    /// Write index.html, the figures (SVG), the data behind them (CSV) and claims.json into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
    /// Coarser grids: some seconds, and areas to about a percent
    #[arg(long)]
    pub(crate) quick: bool,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

/// Elsewhere the command is refused whatever its subjects are.
#[cfg(not(target_os = "linux"))]
type Subject = String;

#[derive(Debug, Args)]
#[command(after_help = after(examples::ACCURACY))]
pub(crate) struct AccuracyArguments {
    /// Write index.html, the plots (SVG) and rows.csv into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
    /// Fewer settings and less work: under a minute
    #[arg(long)]
    pub(crate) quick: bool,
    /// Only these: motion, rotation, time, network, analysis, real-time, least-model
    #[arg(long, value_name = "SUBJECT", value_delimiter = ',', value_parser = subject)]
    pub(crate) only: Vec<Subject>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[cfg(not(target_os = "linux"))]
fn subject(text: &str) -> Result<Subject, String> {
    Ok(text.to_owned())
}

#[cfg(target_os = "linux")]
fn subject(text: &str) -> Result<Subject, String> {
    Subject::ALL.into_iter().find(|subject| subject.name() == text).ok_or_else(|| {
        let names = Subject::ALL.map(Subject::name).join(", ");
        format!("there is no such subject; expected one of {names}")
    })
}
