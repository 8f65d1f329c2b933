//! Quantiles of any number of values in constant memory.
//!
//! Values are counted in bins, 128 in each octave from 2⁻⁴⁰ to 2²⁴. The bin of a value is its exponent with the first seven bits of its mantissa. No logarithm
//! is needed, so a value has the same bin on every machine. The middle of a bin differs from each value in the bin by at most 2⁻⁸ of the value.

/// Least value of the bins. Smaller values count as zero.
const LEAST: f64 = f64::from_bits((1023 - 40) << 52);
/// Number of low bits of a double without influence on its bin: the mantissa without its first seven bits.
const BEHIND: u32 = 52 - 7;
/// High bits of the values in the first bin.
const FIRST: u64 = LEAST.to_bits() >> BEHIND;
const BINS: usize = 64 << 7;

/// Counts of all values so far, by bin.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct QuantileSketch {
    /// Number of values, indexed by bin. 64 kB.
    bins: Box<[u64]>,
    /// Number of values below the first bin.
    below: u64,
    /// Number of all values, including values above the last bin.
    count: u64,
}

impl Default for QuantileSketch {
    fn default() -> Self {
        Self { bins: vec![0; BINS].into(), below: 0, count: 0 }
    }
}

impl QuantileSketch {
    /// Counts a value. Values below 2⁻⁴⁰ count as zero; values from 2²⁴ on, and NaN, count as infinite.
    pub(crate) fn insert(&mut self, value: f64) {
        self.insert_many(value, 1);
    }

    /// Counts a value `times` times.
    pub(crate) fn insert_many(&mut self, value: f64, times: u64) {
        self.count += times;
        if value < LEAST {
            self.below += times;
            return;
        }
        // The positive doubles are ordered as their bits. Values above the last bin and NaN have no bin and are counted only in `count`.
        let bin = usize::try_from((value.to_bits() >> BEHIND).wrapping_sub(FIRST)).unwrap_or(usize::MAX);
        if let Some(bin) = self.bins.get_mut(bin) {
            *bin += times;
        }
    }

    /// Returns the quantile of p per cent: the ⌈p·n/100⌉-th smallest of n values, counted from 1, with a relative error of at most 2⁻⁸. Returns `None` without
    /// values.
    #[must_use]
    pub(crate) fn quantile(&self, percent: u64) -> Option<f64> {
        if self.count == 0 {
            return None;
        }
        let rank = (u128::from(percent) * u128::from(self.count)).div_ceil(100).max(1);
        // The rank is compared with the number of values up to each bin, in ascending order of the bins.
        let mut below = u128::from(self.below);
        if below >= rank {
            return Some(0.0);
        }
        for (bin, count) in (FIRST..).zip(&self.bins) {
            below += u128::from(*count);
            if below >= rank {
                // The middle of the bin.
                return Some(f64::from_bits(bin << BEHIND | 1 << (BEHIND - 1)));
            }
        }
        // The rank lies among the values above the last bin.
        Some(f64::INFINITY)
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "values that must come out exactly")]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    const END: f64 = 16_777_216.0;

    fn sketch(values: &[f64]) -> QuantileSketch {
        let mut sketch = QuantileSketch::default();
        values.iter().for_each(|value| sketch.insert(*value));
        sketch
    }

    /// Returns values over all octaves and beyond both ends, many of them equal.
    fn values() -> impl Strategy<Value = Vec<f64>> {
        let value = prop_oneof![
            8 => (-45.0..26.0_f64).prop_map(libm::exp2),
            2 => (-45..26_i32).prop_map(|exponent| libm::ldexp(1.0, exponent)),
            1 => Just(0.0),
            1 => (0..20_u32).prop_map(f64::from),
        ];
        proptest::collection::vec(value, 1..300)
    }

    properties! {
        #[test]
        fn a_quantile_is_the_value_of_its_rank_within_a_256th(mut values in values(), percent in 0..=100_u64) {
            let found = sketch(&values).quantile(percent).unwrap();
            values.sort_by(f64::total_cmp);
            let rank = (percent * values.len() as u64).div_ceil(100).max(1);
            let exact = values[usize::try_from(rank - 1).unwrap()];
            if exact < LEAST {
                prop_assert_eq!(found, 0.0);
            } else if exact >= END {
                prop_assert_eq!(found, f64::INFINITY);
            } else {
                prop_assert!((found - exact).abs() <= exact / 256.0, "{} for {}", found, exact);
            }
        }

        #[test]
        fn the_order_of_values_changes_nothing(values in values(), at in any::<prop::sample::Index>()) {
            let (one, other) = values.split_at(at.index(values.len()));
            let turned = sketch(&[other, one].concat());
            prop_assert_eq!(turned.count, values.len() as u64);
            prop_assert_eq!(turned, sketch(&values));
        }

        #[test]
        fn a_value_counts_as_often_as_it_is_said(values in values(), times in 0..20_u64) {
            let mut many = QuantileSketch::default();
            values.iter().for_each(|value| many.insert_many(*value, times));
            let each: Vec<f64> = values.iter().flat_map(|value| (0..times).map(|_| *value)).collect();
            prop_assert_eq!(many, sketch(&each));
        }
    }

    #[test]
    fn the_ends_of_the_range_are_where_they_are_said_to_be() {
        assert_eq!(QuantileSketch::default().quantile(50), None);
        let of = |value: f64| sketch(&[value]).quantile(50).unwrap();
        assert_eq!((of(LEAST.next_down()), of(-1.0), of(-0.0)), (0.0, 0.0, 0.0));
        assert_eq!(of(LEAST), LEAST * (1.0 + 1.0 / 256.0));
        assert_eq!(of(END.next_down()), END * (1.0 - 1.0 / 512.0));
        assert_eq!((of(END), of(f64::INFINITY), of(f64::NAN)), (f64::INFINITY, f64::INFINITY, f64::INFINITY));
        // A bin has the width of a 128th of its octave, and contains its lower end.
        assert_eq!(of(1.0), 1.0 + 1.0 / 256.0);
        assert_eq!(of(1.0 + 1.0 / 128.0), 1.0 + 3.0 / 256.0);
        assert_eq!(of((1.0_f64 + 1.0 / 128.0).next_down()), 1.0 + 1.0 / 256.0);
    }
}
