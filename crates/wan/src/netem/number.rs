//! Numbers with units, as read by `tc`.
//!
//! A number is the longest prefix in the decimal form of C's `strtod` (sign, point, exponent), and the rest of the word is the unit. Units ignore case.
//! Hexadecimal floats, `inf` and `nan`, valid for `strtod`, are refused. Integers are read like `strtol` does: octal after `0`, hexadecimal after `0x`.

use alloc::format;
use alloc::string::String;
use core::num::NonZeroU64;
use core::time::Duration;

use super::Percent;

/// A number and the unit after the number.
struct Number<'a> {
    value: f64,
    /// The value of a plain integer, exact even if `value` is rounded; else `None`.
    integer: Option<u128>,
    unit: &'a str,
}

/// Splits a text into a finite number of at least zero and the number's unit. Returns `None` if the text does not begin with such a number.
fn number(text: &str) -> Option<Number<'_>> {
    let bytes = text.as_bytes();
    let digits_from = |from: usize| bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits_from(sign);
    let mut end = sign + whole;
    let mut digits = whole;
    if bytes.get(end) == Some(&b'.') {
        let decimals = digits_from(end + 1);
        digits += decimals;
        // A point without any digit is no number.
        if digits > 0 {
            end += 1 + decimals;
        }
    }
    if digits == 0 {
        return None;
    }
    let is_integer = end == sign + whole;
    let mut is_plain = is_integer;
    // As in `strtod`, an `e` belongs to the number only if digits follow. Otherwise the unit begins with the `e`.
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits_from((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
            is_plain = false;
        }
    }
    let (written, unit) = text.split_at(end);
    let value: f64 = written.parse().ok()?;
    let integer = if is_plain { written.parse().ok() } else { None };
    (value.is_finite() && value >= 0.0).then_some(Number { value, integer, unit })
}

impl Number<'_> {
    /// Returns the scale of the number's unit among `units`, or `None` if the unit is not there.
    fn scale(&self, units: &[(&str, u64)]) -> Option<u64> {
        units.iter().find(|(name, _)| name.eq_ignore_ascii_case(self.unit)).map(|&(_, scale)| scale)
    }

    /// Returns the number times `scale`: as an integer if the number was written as one and the product fits, else as a real number.
    fn times(&self, scale: u64) -> Scaled {
        // An integer product keeps every nanosecond and every bit; only fractions go through a real number.
        let product = self.integer.and_then(|integer| integer.checked_mul(u128::from(scale)));
        product.map_or_else(|| Scaled::Real(self.value * real(scale)), Scaled::Integer)
    }
}

/// A number times the scale of the number's unit.
enum Scaled {
    Integer(u128),
    Real(f64),
}

/// Returns the readings of a number without unit in each notation, and the words to write instead. Returns `None` for a number with a unit, for zero, and for
/// a word that is no number.
///
/// `tc` changed the default unit of a delay between versions, and a scene reads a number as a fraction, but `tc` as a percentage.
pub(super) fn without_unit(text: &str, kind: Plain) -> Option<String> {
    let number = number(text).filter(|number| number.unit.is_empty() && number.value != 0.0)?;
    Some(match kind {
        Plain::Percentage => {
            // Rounding to binary makes the digits of the product after the twelfth. These digits are cut off.
            let fraction = libm::rint(number.value * 1e12) / 1e10;
            format!("tc reads {text} %, a scene would read the fraction {text}, which is {fraction} %: expected {text}%")
        }
        Plain::Delay => {
            format!(
                "tc reads {text} us up to version 6.8 and {text} ns from 6.9 on, and a scene reads no time without its unit: expected {text}us or {text}ns"
            )
        }
        Plain::Cross => format!("expected {text}ms, or another unit (s, us, ns)"),
        Plain::Slot => format!("tc reads {text} ns, and a scene reads no time without its unit: expected {text}ns"),
    })
}

/// The option in which a number without unit was written.
#[derive(Clone, Copy)]
pub(super) enum Plain {
    Percentage,
    Delay,
    Slot,
    /// `cross`, which `tc` does not read.
    Cross,
}

/// Converts a scale to a real number. Every scale is below 2⁵³ or has few bits set, and is exact.
#[expect(clippy::cast_precision_loss, reason = "the scales of the tables below are exact")]
fn real(scale: u64) -> f64 {
    scale as f64
}

/// 2³², with the square 2⁶⁴.
const TWO_POW_32: f64 = 4_294_967_296.0;

/// Returns the integer part of a value, or `None` outside of 0..2⁶⁴.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be in 0..2^64; the fraction is cut off as in C")]
fn truncated(value: f64) -> Option<u64> {
    (0.0..TWO_POW_32 * TWO_POW_32).contains(&value).then_some(value as u64)
}

pub(super) const TIME: &str = "a time such as 10ms, 250us or 1.5s, below 292 years (units: s, ms, us, ns)";

/// Reads a time, rounded to the nearest nanosecond. Callers refuse nonzero numbers without unit: see [`without_unit`].
pub(super) fn time(text: &str) -> Option<Duration> {
    const S: u64 = 1_000_000_000;
    const MS: u64 = 1_000_000;
    const US: u64 = 1_000;
    let units = [
        ("s", S),
        ("sec", S),
        ("secs", S),
        ("ms", MS),
        ("msec", MS),
        ("msecs", MS),
        ("us", US),
        ("usec", US),
        ("usecs", US),
        // The micro sign and the Greek letter mu, unknown to `tc`.
        ("\u{b5}s", US),
        ("\u{3bc}s", US),
        ("ns", 1),
        ("nsec", 1),
        ("nsecs", 1),
        ("", 1),
    ];
    let number = number(text)?;
    let nanos = match number.times(number.scale(&units)?) {
        Scaled::Integer(nanos) => u64::try_from(nanos).ok()?,
        Scaled::Real(nanos) => truncated(libm::rint(nanos))?,
    };
    // The kernel holds times in signed 64 bits.
    (nanos <= i64::MAX.unsigned_abs()).then_some(Duration::from_nanos(nanos))
}

pub(super) const PERCENT: &str = "a percentage from 0 to 100";

/// Reads a percentage, with or without the percent sign: see [`without_unit`].
pub(super) fn percent(text: &str) -> Option<Percent> {
    let number = number(text)?;
    matches!(number.unit, "" | "%").then_some(())?;
    Percent::new(number.value)
}

pub(super) const RATE: &str = "a rate of at least 8bit such as 10mbit, 64kbit or 1.5mbps (units: bit, kbit, mbit, gbit, tbit and, for bytes per second, bps, kbps, mbps, gbps, tbps)";

/// Reads a rate in bytes per second, rounded down as in `tc`.
pub(super) fn rate(text: &str) -> Option<NonZeroU64> {
    const KI: u64 = 1 << 10;
    let units = [
        ("", 1),
        ("bit", 1),
        ("kibit", KI),
        ("kbit", 1_000),
        ("mibit", KI * KI),
        ("mbit", 1_000_000),
        ("gibit", KI * KI * KI),
        ("gbit", 1_000_000_000),
        ("tibit", KI * KI * KI * KI),
        ("tbit", 1_000_000_000_000),
        ("bps", 8),
        ("kibps", 8 * KI),
        ("kbps", 8_000),
        ("mibps", 8 * KI * KI),
        ("mbps", 8_000_000),
        ("gibps", 8 * KI * KI * KI),
        ("gbps", 8_000_000_000),
        ("tibps", 8 * KI * KI * KI * KI),
        ("tbps", 8_000_000_000_000),
    ];
    let number = number(text)?;
    let bytes = match number.times(number.scale(&units)?) {
        Scaled::Integer(bits) => u64::try_from(bits / 8).ok()?,
        Scaled::Real(bits) => truncated(bits / 8.0)?,
    };
    NonZeroU64::new(bytes)
}

/// Reads a size in bytes, or a count of packets, because `tc` reads `limit` like a size. Prefixes are binary.
pub(super) fn size(text: &str) -> Option<u32> {
    const KI: u64 = 1 << 10;
    let units = [
        ("", 1),
        // In sizes `tc` takes k as 1024.
        ("b", 1),
        ("k", KI),
        ("kb", KI),
        ("kbit", KI / 8),
        ("m", KI * KI),
        ("mb", KI * KI),
        ("mbit", KI * KI / 8),
        ("g", KI * KI * KI),
        ("gb", KI * KI * KI),
        ("gbit", KI * KI * KI / 8),
    ];
    let number = number(text)?;
    match number.times(number.scale(&units)?) {
        Scaled::Integer(size) => u32::try_from(size).ok(),
        Scaled::Real(size) => u32::try_from(truncated(size)?).ok(),
    }
}

/// Reads an integer of at least zero, in base 8, 10 or 16 according to the integer's prefix.
pub(super) fn unsigned(text: &str) -> Option<u64> {
    let digits = text.strip_prefix('+').unwrap_or(text);
    let (digits, radix) = match digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        Some(hexadecimal) => (hexadecimal, 16),
        None if digits.len() > 1 && digits.starts_with('0') => (&digits[1..], 8),
        None => (digits, 10),
    };
    // `from_str_radix` would accept a second sign.
    digits.starts_with(|c: char| c.is_digit(radix)).then_some(())?;
    u64::from_str_radix(digits, radix).ok()
}

/// Reads a signed integer, in base 8, 10 or 16 according to the integer's prefix.
pub(super) fn signed(text: &str) -> Option<i64> {
    let magnitude = |digits| i64::try_from(unsigned(digits)?).ok();
    match text.strip_prefix('-') {
        Some(digits) if digits.starts_with('+') => None,
        Some(digits) => magnitude(digits).map(|magnitude| -magnitude),
        None => magnitude(text),
    }
}

/// Reads a real number of at least zero, without a unit.
pub(super) fn real_number(text: &str) -> Option<f64> {
    number(text).filter(|number| number.unit.is_empty()).map(|number| number.value)
}

/// Reads a decimal integer of at least zero, without a sign.
pub(super) fn decimal(text: &str) -> Option<u64> {
    text.starts_with(|c: char| c.is_ascii_digit()).then_some(())?;
    text.parse().ok()
}
