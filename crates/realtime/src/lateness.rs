//! How late things were: a histogram of high dynamic range; and when a run in real time counts.

use core::fmt;
use std::time::Duration;

use cohaptic_units::print::Span;
use hdrhistogram::Histogram;

/// How late each tick or packet was.
///
/// A histogram with three significant digits from a nanosecond to an hour (later counts as an hour): 190 kB, and recording allocates nothing.
#[derive(Clone, Debug)]
pub struct Lateness {
    nanos: Histogram<u64>,
    sum: Duration,
}

/// An hour \[ns\].
const MOST: u64 = 3_600_000_000_000;

impl Default for Lateness {
    fn default() -> Self {
        Self::new()
    }
}

impl Lateness {
    /// Nothing recorded.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "the bounds are constants that the histogram takes")]
    pub fn new() -> Self {
        Self { nanos: Histogram::new_with_bounds(1, MOST, 3).expect("three digits from one nanosecond to an hour can be had"), sum: Duration::ZERO }
    }

    /// One thing was that late. On time is zero.
    #[inline]
    pub fn record(&mut self, lateness: Duration) {
        self.sum = self.sum.saturating_add(lateness);
        self.nanos.saturating_record(u64::try_from(lateness.as_nanos()).unwrap_or(MOST).min(MOST));
    }

    /// Adds what another one has recorded.
    #[expect(clippy::missing_panics_doc, reason = "all have the same bounds")]
    pub fn merge(&mut self, other: &Self) {
        self.sum = self.sum.saturating_add(other.sum);
        self.nanos.add(&other.nanos).expect("all histograms of lateness have the same bounds");
    }

    /// How many were recorded.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.nanos.len()
    }

    /// How many were later than `limit`, to three digits of `limit`.
    #[must_use]
    pub fn count_later_than(&self, limit: Duration) -> u64 {
        let limit = u64::try_from(limit.as_nanos()).unwrap_or(MOST).min(MOST);
        self.nanos.len() - self.nanos.count_between(0, limit)
    }

    /// The lateness that a share of all, from 0 to 1, does not exceed; zero if nothing was recorded.
    #[must_use]
    pub fn quantile(&self, share: f64) -> Duration {
        Duration::from_nanos(self.nanos.value_at_quantile(share))
    }

    /// The usual quantiles.
    #[must_use]
    pub fn summary(&self) -> LatenessSummary {
        LatenessSummary {
            count: self.count(),
            sum: self.sum,
            p50: self.quantile(0.5),
            p99: self.quantile(0.99),
            p999: self.quantile(0.999),
            max: Duration::from_nanos(self.nanos.max()),
        }
    }

    /// Every value that was recorded, to three digits, with how often: from the least late on.
    pub fn recorded(&self) -> impl Iterator<Item = (Duration, u64)> + '_ {
        self.nanos.iter_recorded().map(|step| (Duration::from_nanos(step.value_iterated_to()), step.count_at_value()))
    }
}

/// The usual quantiles of a [`Lateness`]; all zero if nothing was recorded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LatenessSummary {
    /// How many were recorded.
    pub count: u64,
    /// How late they were together.
    pub sum: Duration,
    /// The median.
    pub p50: Duration,
    /// 99 of 100 were at most that late.
    pub p99: Duration,
    /// 999 of 1000 were at most that late.
    pub p999: Duration,
    /// The latest.
    pub max: Duration,
}

/// How late things may be for a run to be valid: no more than one in a thousand later than `limit`, or a single one.
///
/// One in a thousand and not none, because on a system that does other things too the worst of a million wake-ups says more about that system than
/// about the run; the worst is reported all the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tolerance {
    /// Later than this is late.
    pub limit: Duration,
}

/// Whether a run counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Validity {
    /// It was on time.
    Valid,
    /// It was not: what it showed is not what was asked for.
    NotValid {
        /// The number of things that were late,
        late: u64,
        /// of this number,
        of: u64,
        /// by more than this.
        limit: Duration,
    },
}

impl Tolerance {
    /// Judges what was recorded.
    #[must_use]
    pub fn judge(&self, lateness: &Lateness) -> Validity {
        let (late, of) = (lateness.count_later_than(self.limit), lateness.count());
        // A single late one of a few is no fault of a short run: it must be more than one.
        if late > 1 && late > of / 1000 { Validity::NotValid { late, of, limit: self.limit } } else { Validity::Valid }
    }
}

impl Validity {
    /// Whether the run counts.
    #[must_use]
    pub const fn is_valid(&self) -> bool {
        matches!(self, Self::Valid)
    }
}

impl fmt::Display for Validity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Valid => f.write_str("valid"),
            Self::NotValid { late, of, limit } => {
                write!(f, "not valid: {late} of {of} were more than {} late, expected at most one in a thousand", Span(*limit))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_to_three_digits() {
        let mut lateness = Lateness::new();
        for micros in 1..=10_000 {
            lateness.record(Duration::from_micros(micros));
        }
        let summary = lateness.summary();
        let near = |found: Duration, micros: u64| {
            let wanted = Duration::from_micros(micros);
            assert!(found.abs_diff(wanted) <= wanted / 1000, "{found:?} for {wanted:?}");
        };
        assert_eq!(summary.count, 10_000);
        assert_eq!(summary.sum, Duration::from_micros(10_000 * 10_001 / 2));
        near(summary.p50, 5000);
        near(summary.p99, 9900);
        near(summary.p999, 9990);
        near(summary.max, 10_000);
        assert!(lateness.count_later_than(Duration::from_micros(9000)).abs_diff(1000) <= 10);
        assert_eq!(lateness.recorded().map(|(_, count)| count).sum::<u64>(), 10_000);
    }

    #[test]
    fn nothing_is_too_early_or_too_late_to_be_counted() {
        let mut lateness = Lateness::new();
        assert_eq!(lateness.summary(), LatenessSummary::default());
        lateness.record(Duration::ZERO);
        lateness.record(Duration::MAX);
        let mut twice = lateness.clone();
        twice.merge(&lateness);
        assert_eq!((lateness.count(), twice.count()), (2, 4));
        assert_eq!(twice.count_later_than(Duration::from_secs(3000)), 2);
        assert_eq!(twice.quantile(0.25), Duration::ZERO);
    }

    #[test]
    fn a_run_is_valid_up_to_one_late_in_a_thousand() {
        let tolerance = Tolerance { limit: Duration::from_millis(1) };
        let run = |on_time: u64, late: u64| {
            let mut lateness = Lateness::new();
            (0..on_time).for_each(|_| lateness.record(Duration::from_micros(60)));
            (0..late).for_each(|_| lateness.record(Duration::from_millis(3)));
            tolerance.judge(&lateness)
        };
        assert_eq!(run(0, 0), Validity::Valid);
        assert_eq!(run(9_990, 10), Validity::Valid);
        assert_eq!(run(9_989, 11), Validity::NotValid { late: 11, of: 10_000, limit: Duration::from_millis(1) });
        assert_eq!(run(10, 1), Validity::Valid);
        let text = run(10, 2).to_string();
        assert_eq!(text, "not valid: 2 of 12 were more than 1ms late, expected at most one in a thousand");
    }
}
