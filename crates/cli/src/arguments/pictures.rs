//! What commands that write pictures take.

use clap::Args;
use cohaptic_picture::{Size, SizeError};

#[derive(Debug, Args)]
pub(crate) struct PictureArguments {
    /// The size of pictures: one-column or two-columns of a paper, page, WIDTHxHEIGHT in pixels (960x400) or millimetres (85x60mm) [default: page]
    #[arg(long, value_name = "SIZE", requires = "out")]
    size: Option<NamedSize>,
}

/// A size with the word that named it.
#[derive(Clone, Debug)]
struct NamedSize {
    word: String,
    size: Size,
}

impl std::str::FromStr for NamedSize {
    type Err = SizeError;

    fn from_str(word: &str) -> Result<Self, SizeError> {
        Ok(Self { word: word.to_owned(), size: word.parse()? })
    }
}

impl PictureArguments {
    /// The size that was asked for.
    pub(crate) fn size(&self) -> Size {
        self.size.as_ref().map(|asked| asked.size).unwrap_or_default()
    }

    /// The word that asked for it, if one did.
    pub(crate) fn word(&self) -> Option<&str> {
        self.size.as_ref().map(|asked| asked.word.as_str())
    }
}
