//! Quantiles of the runs of a combination, without holding more runs than those of one combination.

/// The most runs of a combination of which quantiles are kept: all of them are held at once, 128 MB at most.
pub const MOST_RUNS_OF_QUANTILES: u64 = 16_000_000;
/// The most combinations of which quantiles are kept: 144 MB at most.
pub const MOST_COMBINATIONS_OF_QUANTILES: u64 = 3_000_000;

/// Quantiles of the largest discrepancy of those runs of a combination that did not diverge \[m\].
///
/// The quantile of p % of n runs is the smallest of their values that at least p % of them do not exceed: by rank, the ⌈p·n/100⌉-th smallest, counted from 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Quantiles {
    /// Of 5 %.
    pub p5: f64,
    /// Of 25 %.
    pub p25: f64,
    /// Of 50 %.
    pub median: f64,
    /// Of 75 %.
    pub p75: f64,
    /// Of 95 %.
    pub p95: f64,
}

impl Quantiles {
    /// Of these values, which are put in order; `None` of none.
    pub(crate) fn of(values: &mut [f64]) -> Option<Self> {
        values.sort_unstable_by(f64::total_cmp);
        let values = &*values;
        let of = |percent: usize| values.get((percent * values.len()).div_ceil(100).checked_sub(1)?).copied();
        Some(Self { p5: of(5)?, p25: of(25)?, median: of(50)?, p75: of(75)?, p95: of(95)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition itself: the least value that at least p % do not exceed.
    #[test]
    fn a_quantile_is_the_least_value_that_its_share_does_not_exceed() {
        for count in 1..=203_u32 {
            // 7 is prime to every count but its multiples, which repeat values: ties are part of the definition.
            let mut values: Vec<f64> = (0..count).map(|n| f64::from(n * 7 % count)).collect();
            let defined = |percent: u32| {
                let enough = |value: &f64| values.iter().filter(|other| *other <= value).count() * 100 >= (percent * count) as usize;
                values.iter().copied().filter(enough).fold(f64::INFINITY, f64::min)
            };
            let expected = Quantiles { p5: defined(5), p25: defined(25), median: defined(50), p75: defined(75), p95: defined(95) };
            assert_eq!(Quantiles::of(&mut values), Some(expected), "{count}");
        }
        assert_eq!(Quantiles::of(&mut []), None);
    }
}
