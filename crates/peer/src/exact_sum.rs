//! Exact sums of binary64 numbers, and means that do not depend on the order of their numbers.
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "digits are cut on purpose; places and exponents are small; a mantissa has 53 bits"
)]

/// Bits of a digit.
const BITS: u32 = 32;
/// Number of digits, enough for any binary64 number and the carries above. Bit 0 of digit [`FRACTION`] is the least bit of the smallest number, 2^−1074.
const DIGITS: usize = 71;
/// Number of digits below all binary64 numbers. Only the quotient of a mean uses them.
const FRACTION: usize = 3;
/// Number of additions after which digits must be carried: an addition changes a digit by less than 2³², so 2³⁰ additions stay below 2⁶².
const MOST_ADDITIONS: u32 = 1 << 30;

/// A sum of binary64 numbers without rounding, from which numbers can be subtracted again.
///
/// Each number is added to three digits of base 2³² in an integer that can hold all finite numbers (the small superaccumulator of Neal 2015, *Fast exact
/// summation using small and large superaccumulators*). The sum is therefore the same in any order, and [`ExactSum::mean`] rounds once.
#[derive(Clone, Debug)]
pub(crate) struct ExactSum {
    /// Digits of base 2³² with signs, the least digit first. Between two carries a digit may exceed its base.
    digits: [i64; DIGITS],
    /// First digit ever changed, and the digit after the last digit ever changed.
    reached: (u8, u8),
    /// Additions since the last carry.
    additions: u32,
}

impl Default for ExactSum {
    fn default() -> Self {
        Self::new()
    }
}

impl ExactSum {
    /// Returns a sum of zero.
    #[must_use]
    pub(crate) const fn new() -> Self {
        Self { digits: [0; DIGITS], reached: (DIGITS as u8, 0), additions: 0 }
    }

    /// Adds a finite number. After an infinite number or a NaN the sum is unspecified.
    #[inline]
    pub(crate) fn add(&mut self, number: f64) {
        self.change(number.to_bits());
    }

    /// Subtracts a finite number.
    #[inline]
    pub(crate) fn subtract(&mut self, number: f64) {
        self.change((-number).to_bits());
    }

    /// Subtracts the finite number `before` and adds the finite number `now`. Two close numbers need one change of digits instead of two.
    ///
    /// The difference of close numbers is exact (Sterbenz 1974), and six operations compute the error of any difference ([Knuth's 2Sum][1]). A second change
    /// of the same digits must wait for the first one to be stored, so one change per replacement is preferred.
    ///
    /// [1]: https://en.wikipedia.org/wiki/2Sum
    #[inline]
    pub(crate) fn replace(&mut self, before: f64, now: f64) {
        let difference = now - before;
        let rounded = difference - now;
        let error = (now - (difference - rounded)) - (before + rounded);
        if error == 0.0 {
            self.change(difference.to_bits());
        } else {
            // A rounded difference takes two changes. A difference that overflows has a NaN as its error, and comes here too.
            self.subtract(before);
            self.add(now);
        }
    }

    /// Adds the finite number with the bits `bits` to its three digits.
    #[inline]
    fn change(&mut self, bits: u64) {
        // Fields of binary64: one bit of sign, 11 bits of exponent, 52 bits of mantissa. Normal numbers have a hidden bit.
        let exponent = ((bits >> 52) & 0x7ff) as usize;
        let mantissa = (bits & ((1 << 52) - 1)) | (u64::from(exponent != 0) << 52);
        // Place of the least bit, from 2^−1074. Subnormal numbers have the place of the smallest normal number.
        let place = exponent.max(1) - 1;
        let (digit, shift) = (place / BITS as usize + FRACTION, place % BITS as usize);
        // 53 bits shifted by at most 31 fill at most 84 bits, which are three digits.
        let wide = u128::from(mantissa) << shift;
        let sign = 1 - 2 * (bits >> 63).cast_signed();
        for (part, digit) in self.digits[digit..digit + 3].iter_mut().enumerate() {
            *digit += sign * i64::from((wide >> (BITS * part as u32)) as u32);
        }
        self.reached = (self.reached.0.min(digit as u8), self.reached.1.max(digit as u8 + 3));
        self.additions += 1;
        if self.additions == MOST_ADDITIONS {
            self.carry();
        }
    }

    /// Reduces every digit except the last to 0 ≤ digit < 2³².
    #[cold]
    fn carry(&mut self) {
        // A carry can pass beyond the last changed digit, so the loop goes to the end.
        let (first, end) = (usize::from(self.reached.0), DIGITS - 1);
        for digit in first..end {
            // The arithmetic shift rounds down, so the rest is not negative.
            let carried = self.digits[digit] >> BITS;
            self.digits[digit] -= carried << BITS;
            self.digits[digit + 1] += carried;
        }
        self.reached.1 = DIGITS as u8;
        // Each digit now has the size of a digit after a single addition.
        self.additions = 1;
    }

    /// Returns the binary64 number nearest to the sum divided by `count`; the even one of two equally near numbers. Zero has the sign +.
    ///
    /// # Panics
    ///
    /// If `count` is zero.
    #[must_use]
    pub(crate) fn mean(&self, count: u32) -> f64 {
        assert!(count > 0, "a mean is one of something");
        let Some((digits, is_negative)) = self.magnitude() else { return 0.0 };
        // Digits below FRACTION are zero, so the most significant digit is at FRACTION or above, and `top - 3` does not underflow.
        let top = (FRACTION..DIGITS).rev().find(|digit| digits[*digit] != 0).unwrap_or(FRACTION);
        // Long division by four digits. The first digit of the quotient can be zero, but then the second digit is not: four digits have more bits than a
        // mantissa of 53 bits and a rounding bit.
        let (mut rest, mut quotient, last) = (0_u64, 0_u128, top - 3);
        for digit in (last..=top).rev() {
            // `rest` is below `count`, so the dividend fits into 64 bits and the quotient digit into 32.
            let dividend = rest << BITS | u64::from(digits[digit]);
            quotient = quotient << BITS | u128::from(dividend / u64::from(count));
            rest = dividend % u64::from(count);
        }
        let is_more = rest != 0 || digits[..last].iter().any(|digit| *digit != 0);
        let magnitude = nearest(quotient, last, is_more);
        if is_negative { -magnitude } else { magnitude }
    }

    /// Returns [`ExactSum::mean`] of the `count` numbers that remain without `number`.
    #[must_use]
    pub(crate) fn mean_without(&self, number: f64, count: u32) -> f64 {
        let mut others = self.clone();
        others.subtract(number);
        others.mean(count)
    }

    /// Returns the digits of the absolute value, each below 2³², and whether the sum is negative; `None` for a sum of zero.
    fn magnitude(&self) -> Option<([u32; DIGITS], bool)> {
        let (first, end) = (usize::from(self.reached.0), usize::from(self.reached.1));
        // The carry out of the last digit is negative exactly for a negative sum.
        let carry = self.digits.get(first..end)?.iter().fold(0, |carry, digit| (digit + carry) >> BITS);
        let sign = if carry < 0 { -1 } else { 1 };
        let (mut digits, mut carry, mut all) = ([0; DIGITS], 0_i64, 0);
        for (place, (sum, digit)) in self.digits.iter().zip(&mut digits).enumerate().skip(first) {
            if place >= end && carry == 0 {
                break;
            }
            // The sign makes the number positive before the carries, so every digit ends below the base.
            let sum = sign * sum + carry;
            *digit = sum as u32;
            carry = sum >> BITS;
            all |= *digit;
        }
        (all != 0).then_some((digits, sign < 0))
    }
}

/// Returns the binary64 number nearest to `quotient`, plus a remainder below its bit 0 if `is_more`. Bit 0 of the quotient is bit 0 of the digit `digit`.
fn nearest(quotient: u128, digit: usize, is_more: bool) -> f64 {
    // Exponents of the least bit of the quotient and of the result.
    let least = (BITS as i32) * (digit as i32 - FRACTION as i32) - 1074;
    let bits = 128 - quotient.leading_zeros() as i32;
    // Subnormal results keep the least bit 2^−1074 and have fewer than 53 bits.
    let unit = (least + bits - 53).max(-1074);
    let shift = unit - least;
    let (mantissa, cut) = (quotient >> shift, quotient & ((1 << shift) - 1));
    let half = 1_u128 << (shift - 1);
    // Round half to even. A remainder below the quotient makes a half more than a half.
    let is_up = cut > half || cut == half && (is_more || mantissa & 1 == 1);
    let mantissa = (mantissa + u128::from(is_up)) as u64;
    // Both factors and their product are exact.
    let power = if unit >= -1022 { ((unit + 1023) as u64) << 52 } else { 1 << (unit + 1074) };
    mantissa as f64 * f64::from_bits(power)
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    fn sum_of(numbers: &[f64]) -> ExactSum {
        let mut sum = ExactSum::new();
        numbers.iter().for_each(|number| sum.add(*number));
        sum
    }

    /// Returns a number as a multiple of 2^−90. The numbers of the test are such multiples.
    fn units(number: f64) -> i128 {
        let scaled = number * 2_f64.powi(45);
        // Two steps, since a whole number beyond 2^63 is exact as an i128 only if the number is.
        let whole = scaled.trunc();
        ((whole as i128) << 45) + ((scaled - whole) * 2_f64.powi(45)) as i128
    }

    properties! {
        /// No other number is nearer to the exact mean. The inputs are multiples of 2^−30 below 2^30, whose sum and mean are whole in units of 2^−90.
        #[test]
        fn a_mean_is_the_nearest_number(numbers in prop::collection::vec(-(1_i64 << 60)..1 << 60, 1..50), cuts in 0..60_u32) {
            let numbers: Vec<f64> = numbers.iter().map(|number| (number >> cuts) as f64 * 2_f64.powi(-30)).collect();
            let count = numbers.len() as u32;
            let mean = sum_of(&numbers).mean(count);
            let exact: i128 = numbers.iter().map(|number| units(*number)).sum();
            let distance = |mean: f64| (units(mean) * i128::from(count) - exact).abs();
            for other in [mean.next_up(), mean.next_down()] {
                // A neighbour of zero is far below the unit.
                prop_assert!(mean == 0.0 || distance(mean) <= distance(other), "{mean:e}, {other:e}");
            }
            prop_assert!(mean != 0.0 || exact == 0);
        }

        /// Any finite numbers in any order, with other numbers added and subtracted before, give the same bits.
        #[test]
        fn the_order_and_the_past_do_not_matter(
            numbers in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO, 1..40),
            gone in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL, 0..20),
        ) {
            let count = numbers.len() as u32;
            let mean = sum_of(&numbers).mean(count);
            let mut other = sum_of(&gone);
            numbers.iter().rev().for_each(|number| other.add(*number));
            other.carry();
            gone.iter().for_each(|number| other.subtract(*number));
            prop_assert_eq!(other.mean(count).to_bits(), mean.to_bits());
            let mut replaced = sum_of(&gone);
            numbers.iter().zip(&gone).for_each(|(number, gone)| replaced.replace(*gone, *number));
            numbers.iter().skip(gone.len()).for_each(|number| replaced.replace(0.0, *number));
            gone.iter().skip(numbers.len()).for_each(|gone| replaced.replace(*gone, -0.0));
            prop_assert_eq!(replaced.mean(count).to_bits(), mean.to_bits());
            other.add(1.5);
            prop_assert_eq!(other.mean_without(1.5, count).to_bits(), mean.to_bits());
        }

        /// The mean of equal numbers is that number. The mean of a number and its opposite is zero.
        #[test]
        fn the_mean_of_equal_numbers_is_that_number(number in prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL, count in 1..200_u32) {
            let mut sum = sum_of(&Vec::from_iter((0..count).map(|_| number)));
            prop_assert_eq!(sum.mean(count).to_bits(), number.to_bits());
            sum.add(f64::MAX);
            (0..count).for_each(|_| sum.subtract(number));
            sum.subtract(f64::MAX);
            prop_assert_eq!(sum.mean(count).to_bits(), 0);
        }
    }

    properties! {
        /// Pairs of close numbers, whose differences are mostly exact, and pairs of distant numbers, whose differences never are.
        #[test]
        fn a_number_takes_the_place_of_another(pairs in prop::collection::vec((-1e3..1e3_f64, -1.0..1.0_f64, -60..4_i32), 1..40)) {
            let near = |(number, part, power): &(f64, f64, i32)| number + part * 2_f64.powi(*power);
            let numbers: Vec<f64> = pairs.iter().map(near).collect();
            let mut replaced = sum_of(&Vec::from_iter(pairs.iter().map(|(number, ..)| *number)));
            pairs.iter().zip(&numbers).for_each(|((before, ..), now)| replaced.replace(*before, *now));
            let count = numbers.len() as u32;
            prop_assert_eq!(replaced.mean(count).to_bits(), sum_of(&numbers).mean(count).to_bits());
        }
    }

    #[test]
    fn a_difference_beyond_all_numbers_is_none() {
        let mut sum = sum_of(&[f64::MAX]);
        sum.replace(f64::MAX, -f64::MAX);
        assert_eq!(sum.mean(1).to_bits(), (-f64::MAX).to_bits());
    }

    #[test]
    fn ties_go_to_even_and_the_smallest_numbers_are_rounded_too() {
        let least = f64::from_bits(1);
        for (numbers, count, expected) in [
            (&[least][..], 2, 0.0),
            (&[least, least, least], 2, 2.0 * least),
            (&[least, least, least], 4, least),
            (&[-least, -least, -least], 4, -least),
            (&[1.0, f64::EPSILON / 2.0], 1, 1.0),
            (&[1.0 + f64::EPSILON, f64::EPSILON / 2.0], 1, 1.0 + 2.0 * f64::EPSILON),
            (&[1.0, f64::EPSILON / 2.0, least], 1, 1.0 + f64::EPSILON),
            (&[f64::MAX, f64::MAX, f64::MAX], 3, f64::MAX),
            (&[f64::MAX, f64::MAX, -1.0], 2, f64::MAX),
            (&[1e300, 1.0, -1e300], 1, 1.0),
        ] {
            assert_eq!(sum_of(numbers).mean(count).to_bits(), f64::to_bits(expected), "{numbers:?}/{count}");
        }
    }
}
