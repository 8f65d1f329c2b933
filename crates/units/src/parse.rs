//! Parses quantities from text.
//!
//! Decimals are read exactly, as integers, and rounded once, half up, to the unit of the quantity. Every error contains the expected form.

use alloc::string::{String, ToString};
use core::fmt;
use core::time::Duration;

use crate::{Bytes, Probability, Rate, Visible};

/// Error for a text without the expected quantity.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ParseError {
    /// Error for a text without a decimal number at the beginning, or with a sign or an exponent.
    Number {
        /// Text as given.
        text: String,
        /// Expected form, with examples.
        expected: &'static str,
    },
    /// Error for a number without a unit, or with a unit unknown to the quantity.
    Unit {
        /// Text as given.
        text: String,
        /// Text found in the place of the unit; possibly empty.
        unit: String,
        /// Expected form, with examples.
        expected: &'static str,
        /// Known units, separated by commas.
        units: &'static str,
    },
    /// Error for a number too large for the quantity, or for zero where zero has no meaning.
    Range {
        /// Text as given.
        text: String,
        /// Expected form, with examples.
        expected: &'static str,
    },
}

impl fmt::Display for ParseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { text, expected } => write!(f, "\"{}\" does not begin with a plain decimal number: expected {expected}", Visible(text)),
            Self::Unit { text, unit, expected, units } => {
                write!(f, "{} in \"{}\": expected {expected} (units: {units})", no_unit(unit), Visible(text))
            }
            Self::Range { text, expected } => write!(f, "\"{}\" is out of range: expected {expected}", Visible(text)),
        }
    }
}

impl core::error::Error for ParseError {}

/// Describes a wrong unit for the message of [`ParseError::Unit`].
fn no_unit(unit: &str) -> String {
    if unit.is_empty() { "no unit".to_string() } else { alloc::format!("unknown unit \"{}\"", Visible(unit)) }
}

/// Parses a duration: a decimal number and `ns`, `us` (or `µs`, with the micro sign U+00B5 or the Greek letter U+03BC), `ms`, `s`, `min` or `h`. The names
/// `nsec`, `usec`, `msec` and `sec` are accepted too. Rounds once, to the nearest nanosecond.
///
/// # Errors
///
/// [`ParseError`] for a missing number, an unknown unit, or more than 584 years.
pub fn duration(text: &str) -> Result<Duration, ParseError> {
    const EXPECTED: &str = "a duration such as \"8ms\", \"1.5s\" or \"250us\"";
    const UNITS: &str = "ns, us, ms, s, min, h";
    const US: u64 = 1_000;
    const MS: u64 = 1_000_000;
    const S: u64 = 1_000_000_000;
    let units = [
        ("ns", 1),
        ("nsec", 1),
        ("us", US),
        ("usec", US),
        ("\u{b5}s", US),
        ("\u{3bc}s", US),
        ("ms", MS),
        ("msec", MS),
        ("s", S),
        ("sec", S),
        ("min", 60 * S),
        ("h", 3600 * S),
    ];
    let nanos = quantity(text, &units, EXPECTED, UNITS)?;
    Ok(Duration::from_nanos(nanos))
}

/// Parses a rate: a decimal number and `bit`, `kbit`, `Mbit` or `Gbit`, in bits per second and powers of ten.
///
/// # Errors
///
/// [`ParseError`] for a missing number, an unknown unit, zero, or more than 2⁶⁴ bit/s.
pub fn rate(text: &str) -> Result<Rate, ParseError> {
    const EXPECTED: &str = "a rate above zero such as \"10Mbit\" or \"64kbit\" (bits per second)";
    let units = [("bit", 1), ("kbit", 1_000), ("Mbit", 1_000_000), ("Gbit", 1_000_000_000)];
    // Rounded to whole bits per second before the check for zero, so that 0.1bit is refused, too.
    let bits = quantity(text, &units, EXPECTED, "bit, kbit, Mbit, Gbit")?;
    Rate::bits_per_sec(bits).ok_or_else(|| ParseError::Range { text: text.to_string(), expected: EXPECTED })
}

/// Parses a size: a decimal number and `B`, `kB` or `MB`, in powers of ten.
///
/// # Errors
///
/// [`ParseError`] for a missing number, an unknown unit, or more than 2⁶⁴ bytes.
pub fn size(text: &str) -> Result<Bytes, ParseError> {
    const EXPECTED: &str = "a size such as \"64B\", \"1500B\" or \"64kB\"";
    quantity(text, &[("B", 1), ("kB", 1_000), ("MB", 1_000_000)], EXPECTED, "B, kB, MB").map(Bytes::new)
}

/// Parses a probability in percent: `"1.5%"`. Scenes write a probability from 0 to 1 as a plain number, not as text, so this function refuses a number
/// without the percent sign.
///
/// # Errors
///
/// [`ParseError`] for a missing number, a missing percent sign, or more than 100 %.
pub fn probability(text: &str) -> Result<Probability, ParseError> {
    const EXPECTED: &str = "a probability such as 0.015 or \"1.5%\"";
    let (number, unit) = split(text, EXPECTED)?;
    // A bare number could mean a share or a percentage, so the sign is required.
    if unit != "%" {
        let (text, unit) = (text.to_string(), unit.to_string());
        return Err(ParseError::Unit { text, unit, expected: EXPECTED, units: "%" });
    }
    // Read as a double and not by `quantity`: a probability is a double, and needs no whole number of units.
    let percent: f64 = number.parse().map_err(|_| ParseError::Number { text: text.to_string(), expected: EXPECTED })?;
    Probability::new(percent / 100.0).map_err(|_| ParseError::Range { text: text.to_string(), expected: EXPECTED })
}

/// Splits `"24.5ms"` into `"24.5"` and `"ms"`. Spaces between the two are allowed.
fn split<'a>(text: &'a str, expected: &'static str) -> Result<(&'a str, &'a str), ParseError> {
    let trimmed = text.trim();
    // A sign or an exponent ends the number here, and is refused as a number or as a unit.
    let end = trimmed.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(trimmed.len());
    let (number, unit) = trimmed.split_at(end);
    // A number has at least one digit and at most one point, the only other character in `number`.
    let digits = number.bytes().filter(u8::is_ascii_digit).count();
    if digits == 0 || number.len() - digits > 1 {
        return Err(ParseError::Number { text: text.to_string(), expected });
    }
    Ok((number, unit.trim_start()))
}

/// Returns the value of `text` in the base unit, exact except for a single rounding, half up. `scales` has the units with their sizes in base units.
fn quantity(text: &str, scales: &[(&str, u64)], expected: &'static str, units: &'static str) -> Result<u64, ParseError> {
    let (number, unit) = split(text, expected)?;
    let out_of_range = || ParseError::Range { text: text.to_string(), expected };
    let unknown = || ParseError::Unit { text: text.to_string(), unit: unit.to_string(), expected, units };
    let &(_, scale) = scales.iter().find(|(name, _)| *name == unit).ok_or_else(unknown)?;
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let mut value: u128 = 0;
    for digit in whole.bytes() {
        // Checked arithmetic, because a text may have any number of digits.
        value = value.checked_mul(10).and_then(|v| v.checked_add(u128::from(digit - b'0'))).ok_or_else(out_of_range)?;
    }
    let mut value = value.checked_mul(u128::from(scale)).ok_or_else(out_of_range)?;
    // Digits beyond the 18th cannot change the rounded result, because the largest scale is 3.6e12. The cut keeps the products below in range: 10^18 ·
    // 3.6e12 · 2 < 2^128.
    let fraction = &fraction[..fraction.len().min(18)];
    let mut numerator: u128 = 0;
    let mut denominator: u128 = 1;
    for digit in fraction.bytes() {
        numerator = numerator * 10 + u128::from(digit - b'0');
        denominator *= 10;
    }
    // Adds the fraction, numerator/denominator · scale, rounded half up: doubling both sides and adding the denominator is adding one half.
    value += (numerator * u128::from(scale) * 2 + denominator) / (2 * denominator);
    u64::try_from(value).map_err(|_| out_of_range())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_exact_in_every_unit() {
        let nanos = |text| duration(text).map(|d| d.as_nanos());
        assert_eq!(nanos("8ms"), Ok(8_000_000));
        assert_eq!(nanos("1.5s"), Ok(1_500_000_000));
        assert_eq!(nanos("250us"), Ok(250_000));
        assert_eq!(nanos("0.1 ms"), Ok(100_000));
        assert_eq!(nanos("1h"), Ok(3_600_000_000_000));
        assert_eq!(nanos("18446744073709551615ns"), Ok(u128::from(u64::MAX)));
    }

    #[test]
    fn a_duration_is_rounded_once_half_up() {
        assert_eq!(duration("0.4ns").unwrap().as_nanos(), 0);
        assert_eq!(duration("0.5ns").unwrap().as_nanos(), 1);
        assert_eq!(duration("0.33333333333333333333333333333333333333333s").unwrap().as_nanos(), 333_333_333);
    }

    #[test]
    fn what_is_wrong_is_said_with_what_was_expected() {
        assert!(matches!(duration("8"), Err(ParseError::Unit { .. })));
        assert!(matches!(duration("8 parsecs"), Err(ParseError::Unit { .. })));
        assert!(matches!(duration("-8ms"), Err(ParseError::Number { .. })));
        assert!(matches!(duration("ms"), Err(ParseError::Number { .. })));
        assert!(matches!(duration("1.2.3s"), Err(ParseError::Number { .. })));
        assert!(matches!(duration("."), Err(ParseError::Number { .. })));
        assert!(matches!(duration(""), Err(ParseError::Number { .. })));
        assert!(matches!(duration("18446744073709551616ns"), Err(ParseError::Range { .. })));
        assert!(matches!(duration("999999999999999999999999999999999999999999999h"), Err(ParseError::Range { .. })));
        assert!(matches!(rate("0bit"), Err(ParseError::Range { .. })));
        assert!(matches!(rate("10Mb"), Err(ParseError::Unit { .. })));
        assert!(matches!(size("64"), Err(ParseError::Unit { .. })));
        assert!(matches!(probability("101%"), Err(ParseError::Range { .. })));
        assert!(matches!(probability("0.5"), Err(ParseError::Unit { .. })));
        assert_eq!(
            duration("8 parsecs").unwrap_err().to_string(),
            "unknown unit \"parsecs\" in \"8 parsecs\": expected a duration such as \"8ms\", \"1.5s\" or \"250us\" (units: ns, us, ms, s, min, h)"
        );
        assert!(rate("10mbit").unwrap_err().to_string().ends_with("(units: bit, kbit, Mbit, Gbit)"));
        assert!(size("64K").unwrap_err().to_string().ends_with("(units: B, kB, MB)"));
    }

    #[test]
    fn a_unit_of_time_has_many_spellings() {
        for text in ["250us", "250usec", "250\u{b5}s", "250\u{3bc}s", "0.25ms", "0.25msec", "0.00025sec", "250000nsec", "0.25 \u{3bc}s"] {
            let nanos = if text == "0.25 \u{3bc}s" { 250 } else { 250_000 };
            assert_eq!(duration(text), Ok(Duration::from_nanos(nanos)), "{text}");
        }
    }

    #[test]
    fn rates_sizes_and_probabilities_read_as_they_print() {
        assert_eq!(rate("10Mbit").unwrap().as_bits_per_sec(), 10_000_000);
        assert_eq!(rate("1.5kbit").unwrap().as_bits_per_sec(), 1_500);
        assert_eq!(size("64kB").unwrap().get(), 64_000);
        assert!((probability("1.5%").unwrap().get() - 0.015).abs() < 1e-18);
    }
}
