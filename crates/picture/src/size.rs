//! Sizes of pictures and of their letters.

use std::str::FromStr;

use thiserror::Error;

/// Size of a picture. Letters have 8 points in print, and 13 px on a screen.
///
/// On a command line a size is a word: `one-column`, `two-columns`, `page`, `960x400` \[CSS px\], `85x60mm`.
///
/// ```
/// use cohaptic_picture::Size;
///
/// assert_eq!("one-column".parse(), Ok(Size::ONE_COLUMN));
/// assert_eq!("85x60mm".parse(), Size::millimetres(85.0, 60.0));
/// assert!("85x0mm".parse::<Size>().is_err());
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Size {
    /// Width \[px\], 96 px per inch.
    pub(crate) width: f64,
    /// Height \[px\]; `None` for the height of the content.
    pub(crate) height: Option<f64>,
    /// Size of letters \[px\].
    pub(crate) font: f64,
    /// `true` if the document states its size in millimetres.
    pub(crate) print: bool,
}

/// Length of a millimetre \[px\].
pub(crate) const MILLIMETRE: f64 = 96.0 / 25.4;
/// Size of letters in print, 8 points \[px\].
const PRINTED: f64 = 8.0 * 96.0 / 72.0;
/// Size of letters on a screen \[px\].
const ON_SCREEN: f64 = 13.0;

/// Error of making a size.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum SizeError {
    /// The word is not a size.
    #[error(
        "`{0}` is not a size of a picture: expected one-column, two-columns, page, WIDTHxHEIGHT in pixels (960x400), or WIDTHxHEIGHTmm (85x60mm)"
    )]
    Unknown(String),
    /// The size is too small for text, or too large for any page.
    #[error("a picture is 160 px (42 mm) to 10000 px (2645 mm) wide, and 100 px (26 mm) to 10000 px high")]
    OutOfRange,
}

impl Size {
    /// A column of a paper: 85 mm wide, with the height of the content.
    pub const ONE_COLUMN: Self = Self { width: 85.0 * MILLIMETRE, height: None, font: PRINTED, print: true };
    /// Two columns of a paper: 175 mm wide, with the height of the content.
    pub const TWO_COLUMNS: Self = Self { width: 175.0 * MILLIMETRE, height: None, font: PRINTED, print: true };
    /// A page on a screen: 800 px wide, with the height of the content.
    pub const PAGE: Self = Self { width: 800.0, height: None, font: ON_SCREEN, print: false };

    /// Returns a size for a screen \[CSS px\].
    ///
    /// # Errors
    ///
    /// [`SizeError::OutOfRange`].
    pub fn pixels(width: f64, height: f64) -> Result<Self, SizeError> {
        Self { width, height: Some(height), font: ON_SCREEN, print: false }.checked()
    }

    /// Returns a size for print \[mm\].
    ///
    /// # Errors
    ///
    /// [`SizeError::OutOfRange`].
    pub fn millimetres(width: f64, height: f64) -> Result<Self, SizeError> {
        Self { width: width * MILLIMETRE, height: Some(height * MILLIMETRE), font: PRINTED, print: true }.checked()
    }

    /// Returns whether the size is too narrow for two plots with colour bars side by side, like a column of a paper.
    #[must_use]
    pub const fn is_narrow(self) -> bool {
        self.width < 45.0 * self.font
    }

    fn checked(self) -> Result<Self, SizeError> {
        // NaN lies in no range, so NaN is refused, too.
        let fits = (160.0..=10_000.0).contains(&self.width) && self.height.is_none_or(|height| (100.0..=10_000.0).contains(&height));
        if fits { Ok(self) } else { Err(SizeError::OutOfRange) }
    }
}

impl Default for Size {
    /// Returns [`Size::PAGE`].
    fn default() -> Self {
        Self::PAGE
    }
}

impl FromStr for Size {
    type Err = SizeError;

    fn from_str(word: &str) -> Result<Self, SizeError> {
        match word {
            "one-column" => return Ok(Self::ONE_COLUMN),
            "two-columns" => return Ok(Self::TWO_COLUMNS),
            "page" => return Ok(Self::PAGE),
            _ => {}
        }
        // The word comes from a command line and may have any length and any character: an error must stay a readable line.
        let unknown = || SizeError::Unknown(word.chars().take(40).flat_map(char::escape_debug).collect());
        let (numbers, print) = word.strip_suffix("mm").map_or_else(|| (word.strip_suffix("px").unwrap_or(word), false), |numbers| (numbers, true));
        let (width, height) = numbers.split_once('x').ok_or_else(unknown)?;
        // `85mmx60mm` is accepted as well as `85x60mm`.
        let width = width.strip_suffix("mm").filter(|_| print).unwrap_or(width);
        let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(unknown);
        let (width, height) = (number(width)?, number(height)?);
        if print { Self::millimetres(width, height) } else { Self::pixels(width, height) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_column_is_narrow_and_a_page_is_not() {
        assert_eq!([Size::ONE_COLUMN, Size::TWO_COLUMNS, Size::PAGE].map(Size::is_narrow), [true, false, false]);
    }

    #[test]
    fn a_size_is_a_word_or_two_numbers() {
        assert_eq!("two-columns".parse(), Ok(Size::TWO_COLUMNS));
        assert_eq!("960x400".parse(), Size::pixels(960.0, 400.0));
        assert_eq!("960x400px".parse(), Size::pixels(960.0, 400.0));
        assert_eq!("85mmx60mm".parse(), Size::millimetres(85.0, 60.0));
        for word in ["", "x", "960", "960x", "large", "NaNxNaN", "infx1", "1e9x\u{202e}"] {
            assert!(matches!(word.parse::<Size>(), Err(SizeError::Unknown(_))), "{word:?}");
        }
        for word in ["0x0", "-5x100", "1e9x100", "20x20mm"] {
            assert_eq!(word.parse::<Size>(), Err(SizeError::OutOfRange), "{word:?}");
        }
    }
}
