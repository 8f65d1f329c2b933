//! How quantities are printed: exactly, and so that [`crate::parse`] reads the same value back.

use core::fmt;
use core::time::Duration;

use crate::Instant;

/// An instant as exact decimal seconds without trailing zeros and without a unit: `0.024`.
#[derive(Clone, Copy, Debug)]
pub struct Seconds(pub Instant);

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        decimal(f, nanos / 1_000_000_000, nanos % 1_000_000_000, 9)
    }
}

/// A span in the unit that reads best, exactly: `24ms`, `1.5s`, `250us`.
#[derive(Clone, Copy, Debug)]
pub struct Span(pub Duration);

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let nanos = self.0.as_nanos();
        let (scale, digits, unit) = match nanos {
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

fn decimal(f: &mut fmt::Formatter<'_>, whole: u64, mut rest: u64, mut digits: usize) -> fmt::Result {
    write!(f, "{whole}")?;
    if rest == 0 {
        return Ok(());
    }
    while rest.is_multiple_of(10) {
        rest /= 10;
        digits -= 1;
    }
    write!(f, ".{rest:0digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::format;

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
    }
}
