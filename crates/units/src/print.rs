//! Prints quantities exactly, in the forms read by [`crate::parse`].

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use core::fmt;
use core::time::Duration;

use crate::Instant;

/// Prints an instant as exact decimal seconds without trailing zeros and without a unit: `0.024`.
#[derive(Clone, Copy, Debug)]
pub struct Seconds(pub Instant);

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        decimal(f, nanos / 1_000_000_000, nanos % 1_000_000_000, 9)
    }
}

impl fmt::Display for Instant {
    /// Writes the time since the beginning exactly, in seconds without trailing zeros: `0.024s`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Seconds(*self).fmt(f)?;
        f.write_str("s")
    }
}

/// Prints a span exactly, in the largest unit not longer than the span: `24ms`, `1.5s`, `250us`. Zero prints as `0s`.
#[derive(Clone, Copy, Debug)]
pub struct Span(pub Duration);

impl Span {
    /// Returns a measured time, cut to whole milliseconds. Finer digits of a clock differ from run to run without a meaning.
    #[must_use]
    pub fn measured(time: Duration) -> Self {
        Self(Duration::from_millis(u64::try_from(time.as_millis()).unwrap_or(u64::MAX)))
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        let (scale, digits, unit) = match nanos {
            // No unit is short enough for zero. Seconds are the base unit.
            0 => (1_000_000_000, 9, "s"),
            1..1_000 => (1, 0, "ns"),
            1_000..1_000_000 => (1_000, 3, "us"),
            1_000_000..1_000_000_000 => (1_000_000, 6, "ms"),
            _ => (1_000_000_000, 9, "s"),
        };
        let whole = u64::try_from(nanos / scale).unwrap_or(u64::MAX);
        let rest = u64::try_from(nanos % scale).unwrap_or(u64::MAX);
        decimal(f, whole, rest, digits)?;
        f.write_str(unit)
    }
}

/// Prints a number and a noun, which is given in the singular and takes the plural where needed: `1 change`, `2 changes`, `0 entries`, `3 axes`,
/// `2 people`.
#[derive(Clone, Copy, Debug)]
pub struct Counted<'a, N>(pub N, pub &'a str);

impl<N: Copy + fmt::Display + PartialEq + From<u8>> fmt::Display for Counted<'_, N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number, one) = *self;
        if number == N::from(1) {
            return write!(f, "{number} {one}");
        }
        if one == "person" {
            return write!(f, "{number} people");
        }
        match (one.strip_suffix('y'), one.strip_suffix("is")) {
            // After a vowel the y stays: delays, keys.
            (Some(stem), _) if !stem.ends_with(['a', 'e', 'o', 'u']) => write!(f, "{number} {stem}ies"),
            (_, Some(stem)) => write!(f, "{number} {stem}es"),
            _ => write!(f, "{number} {one}s"),
        }
    }
}

/// Prints a number in plain decimals (`0.45`, `1000`), or in powers of ten (`1e300`) if the size is at least 1e15 or below 1e-6. Parsing either form gives
/// the same number.
#[derive(Clone, Copy, Debug)]
pub struct Number(pub f64);

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = if self.0 < 0.0 { -self.0 } else { self.0 };
        // NaN and infinities take the second branch, and print as words in both forms.
        let is_plain = size == 0.0 || (1e-6..1e15).contains(&size);
        if is_plain { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

/// Rounds a number to six significant decimal digits.
#[must_use]
pub fn six_digits(number: f64) -> f64 {
    // Printing rounds the decimal digits exactly. Arithmetic with powers of ten would round a second time.
    format!("{number:.5e}").parse().unwrap_or(number)
}

/// Prints a number for messages: rounded to six significant digits, and otherwise like [`Number`]. Numbers of seven or more digits before the point use
/// powers of ten if rounding has changed them. Examples: `0.0311812`, `1.23457e8`.
#[derive(Clone, Copy, Debug)]
pub struct SixDigits(pub f64);

impl fmt::Display for SixDigits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rounded = six_digits(self.0);
        // Without a power of ten, 123456789 would print as 123457000, and a reader would take the zeros for measured digits.
        let size = if rounded < 0.0 { -rounded } else { rounded };
        if size >= 1e6 && rounded.to_bits() != self.0.to_bits() { write!(f, "{rounded:e}") } else { fmt::Display::fmt(&Number(rounded), f) }
    }
}

/// Returns a field of a file of comma-separated values, quoted if necessary (RFC 4180).
#[must_use]
pub fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { csv_quoted(text) } else { text.to_owned() }
}

/// Returns a field of a file of comma-separated values in quotes, with inner quotes doubled (RFC 4180).
#[must_use]
pub fn csv_quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// Writes `whole` and the fraction `rest`/10^`digits`, without trailing zeros. `rest` is below 10^`digits`.
fn decimal(f: &mut fmt::Formatter<'_>, whole: u64, mut rest: u64, mut digits: usize) -> fmt::Result {
    write!(f, "{whole}")?;
    if rest == 0 {
        return Ok(());
    }
    // Trailing zeros are removed together with their digits, so that the remaining width keeps the zeros after the point.
    while rest.is_multiple_of(10) {
        rest /= 10;
        digits -= 1;
    }
    write!(f, ".{rest:0digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_quoted_where_they_must_be() {
        let quoted = ["plain", "", "a,b", "say \"a\"", "two\nlines"].map(csv_field);
        assert_eq!(quoted, ["plain", "", "\"a,b\"", "\"say \"\"a\"\"\"", "\"two\nlines\""]);
    }

    #[test]
    fn what_is_counted_is_one_or_many() {
        let print = |number: usize, one| format!("{}", Counted(number, one));
        assert_eq!([print(1, "change"), print(2, "change"), print(0, "entry"), print(3, "axis")], ["1 change", "2 changes", "0 entries", "3 axes"]);
        assert_eq!([print(1, "axis"), print(2, "delay"), print(1, "copy")], ["1 axis", "2 delays", "1 copy"]);
        assert_eq!([print(1, "person"), print(3, "person")], ["1 person", "3 people"]);
    }

    #[test]
    fn numbers_with_many_digits_are_written_with_an_exponent() {
        let print = |number| format!("{}", Number(number));
        assert_eq!([print(0.45), print(1000.0), print(-2.5), print(0.0)], ["0.45", "1000", "-2.5", "0"]);
        assert_eq!([print(1e300), print(-1.5e-9), print(1e15), print(f64::INFINITY)], ["1e300", "-1.5e-9", "1e15", "inf"]);
        assert_eq!([print(999_999_999_999_999.0), print(1e-6)], ["999999999999999", "0.000001"]);
    }

    #[test]
    fn messages_have_six_digits() {
        let print = |number| format!("{}", SixDigits(number));
        assert_eq!([print(0.031_181_185_153), print(1000.0), print(-7.692_307_692_3), print(0.0)], ["0.0311812", "1000", "-7.69231", "0"]);
        assert_eq!([print(1.832_847e189), print(-1.234_567_89e-300), print(123_456_789.0)], ["1.83285e189", "-1.23457e-300", "1.23457e8"]);
        assert_eq!([print(1_000_000.0), print(-1_234_567.0), print(999_999.7)], ["1000000", "-1.23457e6", "1e6"]);
        assert_eq!([print(f64::INFINITY), print(f64::MAX)], ["inf", "1.79769e308"]);
    }

    #[test]
    fn seconds_are_exact() {
        assert_eq!(format!("{}", Seconds(Instant::from_nanos(24_000_000))), "0.024");
        assert_eq!(format!("{}", Seconds(Instant::from_nanos(7_000_000_001))), "7.000000001");
        assert_eq!(format!("{}", Seconds(Instant::from_nanos(10_000_000_000))), "10");
    }

    #[test]
    fn spans_take_the_unit_that_reads_best() {
        let print = |nanos| format!("{}", Span(Duration::from_nanos(nanos)));
        assert_eq!([print(0), print(250_000), print(24_500_000), print(1_500_000_000), print(7)], ["0s", "250us", "24.5ms", "1.5s", "7ns"]);
        let measured = |nanos| format!("{}", Span::measured(Duration::from_nanos(nanos)));
        assert_eq!([measured(507_011_033), measured(61_000_999_999), measured(999_999)], ["507ms", "61s", "0s"]);
    }
}
