//! `paper`.

use std::path::PathBuf;

use clap::Args;

use super::PictureArguments;
use super::examples::{self, after};

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
