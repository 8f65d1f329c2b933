//! Times in whole attoseconds, with all digits of a text.

/// Attoseconds in a second, as an exponent of ten.
const DIGITS: i32 = 18;

/// Time or span as a whole number of attoseconds, 10⁻¹⁸ s. The range is ±1.7·10²⁰ s.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Attoseconds(i128);

impl Attoseconds {
    /// Parses a decimal number, with or without sign, fraction and exponent, in the unit 10^`unit` s. Digits below 10⁻¹⁸ s are cut. Returns `None` if the text
    /// is no number (NaN and infinities are not numbers) or if the number is out of range.
    #[must_use]
    pub fn parse(text: &str, unit: i32) -> Option<Self> {
        let (number, exponent) = match text.split_once(['e', 'E']) {
            Some((number, exponent)) => (number, exponent.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let (negative, digits) = match number.strip_prefix('-') {
            Some(digits) => (true, digits),
            None => (false, number.strip_prefix('+').unwrap_or(number)),
        };
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        if whole.len() + fraction.len() == 0 || !whole.bytes().chain(fraction.bytes()).all(|byte| byte.is_ascii_digit()) {
            return None;
        }
        // Exponent of the digit before `whole`, with the attosecond as unit. The loop lowers the exponent by one before each digit.
        let mut place = exponent.checked_add(unit + DIGITS)?.checked_add(i32::try_from(whole.len()).ok()?)?;
        let mut value: i128 = 0;
        for digit in whole.bytes().chain(fraction.bytes()) {
            place -= 1;
            let digit = i128::from(digit - b'0');
            // Zeros are skipped, because the weight of a leading zero may be out of range although the number is not.
            if digit != 0 && place >= 0 {
                let weight = 10_i128.checked_pow(u32::try_from(place).ok()?)?;
                value = value.checked_add(digit.checked_mul(weight)?)?;
            }
        }
        Some(Self(if negative { -value } else { value }))
    }

    /// Converts nanoseconds, or returns `None` if the time is out of range.
    #[must_use]
    pub const fn from_nanos(nanos: i128) -> Option<Self> {
        match nanos.checked_mul(1_000_000_000) {
            Some(attos) => Some(Self(attos)),
            None => None,
        }
    }

    /// Returns the whole number of attoseconds.
    #[must_use]
    pub const fn get(self) -> i128 {
        self.0
    }

    /// Returns the time of this number of attoseconds.
    #[must_use]
    pub const fn new(attoseconds: i128) -> Self {
        Self(attoseconds)
    }

    /// Returns the difference in seconds, rounded once to the precision of a double, or `None` if the difference is out of range.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "rounded once, on purpose")]
    pub fn seconds_since(self, earlier: Self) -> Option<f64> {
        Some(self.0.checked_sub(earlier.0)? as f64 / 1e18)
    }

    /// Returns the time in seconds, rounded to the precision of a double.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "rounded once, on purpose")]
    pub const fn seconds(self) -> f64 {
        self.0 as f64 / 1e18
    }

    /// Returns the exact difference, or `None` if the difference is out of range.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Option<Self> {
        match self.0.checked_sub(earlier.0) {
            Some(attos) => Some(Self(attos)),
            None => None,
        }
    }

    /// Returns the time in nanoseconds, rounded to the nearest whole number, halves to the even number. Returns `None` below zero and from 2⁶⁴ on.
    #[must_use]
    pub(crate) fn nanos(self) -> Option<u64> {
        let (whole, rest) = (self.0.div_euclid(NANO), self.0.rem_euclid(NANO));
        let up = rest > NANO / 2 || (rest == NANO / 2 && whole % 2 != 0);
        // The sign is tested before rounding: −0.1 ns would round to 0.
        u64::try_from(whole + i128::from(up)).ok().filter(|_| self.0 >= 0)
    }
}

/// Attoseconds in a nanosecond.
const NANO: i128 = 1_000_000_000;

#[cfg(test)]
mod tests {
    use alloc::format;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn numbers_are_read_in_their_unit() {
        let seconds = |text, unit| Attoseconds::parse(text, unit).map(Attoseconds::seconds);
        assert_eq!(seconds("24", -3), Some(0.024));
        assert_eq!(seconds("-1.5", 0), Some(-1.5));
        assert_eq!(seconds("+.5e-3", 0), Some(0.0005));
        assert_eq!(seconds("2.E3", -9), Some(0.000_002));
        assert_eq!(seconds("0.0000000000000000000000000001", 0), Some(0.0));
        for text in ["", "-", ".", "NaN", "inf", "1e", "1,5", "0x10", "1e999999999", "99999999999999999999999", "1_000", "--1", " 1"] {
            assert_eq!(Attoseconds::parse(text, 0), None, "{text}");
        }
    }

    #[test]
    fn nanoseconds_since_1970_keep_their_digits() {
        let [sent, arrived] = ["1700000000.000000001", "1700000000.024000002"].map(|text| Attoseconds::parse(text, 0).unwrap());
        assert_eq!(arrived.seconds_since(sent), Some(0.024_000_001));
        assert_eq!(Attoseconds::parse("1700000000000000001", -9), Some(sent));
    }

    properties! {
        #[test]
        fn numbers_read_as_rust_reads_them(value in -1e6..1e6_f64) {
            // Cut below 1e-18 s and rounded once: within one unit of the last place, or of 1e-18.
            let read = Attoseconds::parse(&format!("{value:e}"), 0).unwrap().seconds();
            prop_assert!((read - value).abs() <= 1e-18 + value.abs() * f64::EPSILON);
        }

        #[test]
        fn any_text_is_answered(text in "[-+0-9.eE]{0,30}", unit in -9..=0) {
            let _ = Attoseconds::parse(&text, unit);
        }
    }

    #[test]
    fn nanoseconds_are_rounded_to_the_nearest_even() {
        let nanos = |text| Attoseconds::parse(text, -9).unwrap().nanos();
        assert_eq!(["0.5", "1.5", "1.49", "2.51", "0"].map(nanos), [0, 2, 1, 3, 0].map(Some));
        assert_eq!(["-0.1", "-1", "18446744073709551615.5"].map(nanos), [None; 3]);
        assert_eq!(nanos("18446744073709551615"), Some(u64::MAX));
    }
}
