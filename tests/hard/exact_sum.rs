//! Sums of doubles without any rounding.

/// A whole number of 2⁻¹⁰⁷⁴, the smallest double, in digits of 32 bits. Every finite double and every sum of up to 2³⁰ of them is one.
#[derive(Clone, Debug)]
pub(crate) struct ExactSum {
    digits: [i64; 68],
}

impl ExactSum {
    pub(crate) const ZERO: Self = Self { digits: [0; 68] };

    /// The sum of these.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sum = Self::ZERO;
        values.into_iter().for_each(|value| sum.add(value));
        sum
    }

    pub(crate) fn add(&mut self, value: f64) {
        assert!(value.is_finite());
        let bits = value.to_bits();
        let exponent = (bits >> 52) & 0x7ff;
        // A subnormal number counts in the same unit as the smallest normal ones, without their leading one.
        let (mantissa, shift) = if exponent == 0 { (bits & ((1 << 52) - 1), 0) } else { (bits & ((1 << 52) - 1) | 1 << 52, exponent - 1) };
        let (place, within) = ((shift / 32) as usize, shift % 32);
        let wide = u128::from(mantissa) << within;
        for digit in 0..3 {
            let part = i64::from((wide >> (32 * digit)) as u32);
            self.digits[place + digit] += if value.is_sign_negative() { -part } else { part };
        }
    }

    /// Subtracts `value` times `factor`, the product without rounding: it and its error are doubles.
    pub(crate) fn subtract_product(&mut self, value: f64, factor: f64) {
        let product = value * factor;
        self.add(-product);
        self.add(-libm::fma(value, factor, -product));
    }

    /// The size of the sum, to a part in 10¹⁵.
    pub(crate) fn size(mut self) -> f64 {
        // Digits between −2³¹ and 2³¹, so that the first one that is not zero gives the sign.
        for place in 0..67 {
            let carry = (self.digits[place] + (1 << 31)) >> 32;
            self.digits[place] -= carry << 32;
            self.digits[place + 1] += carry;
        }
        let power = |place: usize| 32 * place as i32 - 1074;
        // Each digit by itself is a double; those far below the first do not count.
        self.digits.iter().enumerate().rev().fold(0.0, |sum: f64, (place, digit)| sum + libm::ldexp(*digit as f64, power(place))).abs()
    }
}

#[test]
fn what_cancels_leaves_the_smallest_double_there_is() {
    let smallest = f64::from_bits(1);
    assert_eq!(ExactSum::of([1e308, smallest, 1.0, -1e308, -1.0]).size(), smallest);
    assert_eq!(ExactSum::of([0.1, 0.2, -0.3]).size(), 2.0_f64.powi(-55));
    assert_eq!(ExactSum::of([f64::MIN_POSITIVE, -f64::MIN_POSITIVE]).size(), 0.0);
}

#[test]
fn a_product_is_subtracted_with_its_error() {
    // 3·fl(1/3) = 1 − 2⁻⁵⁴.
    let mut sum = ExactSum::of([1.0]);
    sum.subtract_product(1.0 / 3.0, 3.0);
    assert_eq!(sum.size(), 2.0_f64.powi(-54));
}
