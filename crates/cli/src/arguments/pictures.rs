//! What commands that write pictures take.

use clap::Args;
use cohaptic_picture::Size;

#[derive(Debug, Args)]
pub(crate) struct PictureArguments {
    /// The size of pictures: one-column or two-columns of a paper, page, WIDTHxHEIGHT in pixels (960x400) or millimetres (85x60mm) [default: page]
    #[arg(long, value_name = "SIZE", requires = "out")]
    size: Option<Size>,
}

impl PictureArguments {
    /// The size that was asked for.
    pub(crate) fn size(&self) -> Size {
        self.size.unwrap_or_default()
    }
}
