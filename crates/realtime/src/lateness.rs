//! Lateness of events as a histogram, and the verdict on a run in real time.

use core::fmt;
use std::time::Duration;

use cohaptic_units::print::Span;
use hdrhistogram::Histogram;

/// Distribution of the lateness of ticks or packets.
///
/// Histogram with three significant digits from a nanosecond to an hour; more than an hour counts as an hour. The histogram takes 190 kB, and recording
/// allocates nothing.
#[derive(Clone, Debug)]
pub struct Lateness {
    /// Counts by lateness \[ns\].
    nanos: Histogram<u64>,
    /// Sum of all recorded values, without the bound of an hour.
    sum: Duration,
}

/// Greatest value of the histogram: an hour \[ns\].
const MOST: u64 = 3_600_000_000_000;

impl Default for Lateness {
    fn default() -> Self {
        Self::new()
    }
}

impl Lateness {
    /// Returns an empty distribution.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "the bounds are constants that the histogram takes")]
    pub fn new() -> Self {
        Self { nanos: Histogram::new_with_bounds(1, MOST, 3).expect("three digits from one nanosecond to an hour can be had"), sum: Duration::ZERO }
    }

    /// Records the lateness of one event; zero if the event was on time.
    pub fn record(&mut self, lateness: Duration) {
        self.sum = self.sum.saturating_add(lateness);
        // Clamped first: the histogram refuses values above its bound.
        self.nanos.saturating_record(u64::try_from(lateness.as_nanos()).unwrap_or(MOST).min(MOST));
    }

    /// Adds all values of another distribution.
    #[expect(clippy::missing_panics_doc, reason = "all have the same bounds")]
    pub fn merge(&mut self, other: &Self) {
        self.sum = self.sum.saturating_add(other.sum);
        self.nanos.add(&other.nanos).expect("all histograms of lateness have the same bounds");
    }

    /// Returns the number of recorded values.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.nanos.len()
    }

    /// Returns the number of values above `limit`. Values within the third digit of `limit` may count as equal.
    #[must_use]
    pub fn count_later_than(&self, limit: Duration) -> u64 {
        let limit = u64::try_from(limit.as_nanos()).unwrap_or(MOST).min(MOST);
        self.nanos.len() - self.nanos.count_between(0, limit)
    }

    /// Returns count, sum, maximum and the usual quantiles.
    #[must_use]
    pub fn summary(&self) -> LatenessSummary {
        // A search for a quantile of nothing passes over all 24,000 counts, and a router has a distribution for each of its lanes.
        if self.nanos.is_empty() {
            return LatenessSummary::default();
        }
        // One pass over the counts for the three quantiles.
        let mut quantiles = self.nanos.value_at_quantiles([0.5, 0.99, 0.999]).map(Duration::from_nanos);
        let [p50, p99, p999] = core::array::from_fn(|_| quantiles.next().unwrap_or_default());
        LatenessSummary { count: self.count(), sum: self.sum, p50, p99, p999, max: Duration::from_nanos(self.nanos.max()) }
    }

    /// Returns each distinct value, to three digits, with its count, in increasing order.
    pub fn recorded(&self) -> impl Iterator<Item = (Duration, u64)> + '_ {
        self.nanos.iter_recorded().map(|step| (Duration::from_nanos(step.value_iterated_to()), step.count_at_value()))
    }
}

/// Usual quantiles of a [`Lateness`]; all zero if nothing was recorded.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LatenessSummary {
    /// Number of recorded values.
    pub count: u64,
    /// Sum of all values.
    pub sum: Duration,
    /// Median.
    pub p50: Duration,
    /// Lateness that 99 of 100 values do not exceed.
    pub p99: Duration,
    /// Lateness that 999 of 1000 values do not exceed.
    pub p999: Duration,
    /// Greatest value.
    pub max: Duration,
}

/// Limit of lateness for a valid run: at most one in a thousand values, or a single value, may exceed `limit`.
///
/// The rule allows one in a thousand, because on a system with other work the worst of a million wake-ups says more about the system than about the run. The
/// greatest value is reported all the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tolerance {
    /// Lateness from which on an event counts as late.
    pub limit: Duration,
}

/// Verdict on a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Validity {
    /// The run was on time.
    Valid,
    /// The run was too late too often: the network or scene shown is not the configured one.
    NotValid {
        /// Number of late events.
        late: u64,
        /// Number of all events.
        of: u64,
        /// Name of the events, in the plural: what was late.
        what: &'static str,
        /// Limit of the tolerance, see [`Tolerance::limit`].
        limit: Duration,
    },
}

impl Tolerance {
    /// Judges a distribution. `what` names its events in the plural, such as `"ticks"`.
    #[must_use]
    pub fn judge(&self, lateness: &Lateness, what: &'static str) -> Validity {
        let (late, of) = (lateness.count_later_than(self.limit), lateness.count());
        // A single late event among fewer than a thousand is no fault of a short run.
        if late > 1 && late > of / 1000 { Validity::NotValid { late, of, what, limit: self.limit } } else { Validity::Valid }
    }
}

impl Validity {
    /// Returns whether the run is valid.
    #[must_use]
    pub const fn is_valid(&self) -> bool {
        matches!(self, Self::Valid)
    }

    /// Returns the reason for which the run is not valid, as a sentence without its full stop; `None` for a valid run.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        let Self::NotValid { late, of, what, limit } = self else { return None };
        let late_by = if limit.is_zero() { "late".to_owned() } else { format!("more than {} late", Span(*limit)) };
        Some(format!("{late} of {of} {what} were {late_by}, and at most one in a thousand may be"))
    }
}

impl fmt::Display for Validity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.reason() {
            None => f.write_str("valid"),
            Some(reason) => write!(f, "not valid: {reason}"),
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
        assert_eq!(twice.summary().p50, Duration::ZERO);
    }

    #[test]
    fn a_run_is_valid_up_to_one_late_in_a_thousand() {
        let tolerance = Tolerance { limit: Duration::from_millis(1) };
        let run = |on_time: u64, late: u64| {
            let mut lateness = Lateness::new();
            (0..on_time).for_each(|_| lateness.record(Duration::from_micros(60)));
            (0..late).for_each(|_| lateness.record(Duration::from_millis(3)));
            tolerance.judge(&lateness, "ticks")
        };
        assert_eq!(run(0, 0), Validity::Valid);
        assert_eq!(run(9_990, 10), Validity::Valid);
        assert_eq!(run(9_989, 11), Validity::NotValid { late: 11, of: 10_000, what: "ticks", limit: Duration::from_millis(1) });
        assert_eq!(run(10, 1), Validity::Valid);
        assert_eq!(run(10, 2).to_string(), "not valid: 2 of 12 ticks were more than 1ms late, and at most one in a thousand may be");
        assert_eq!((run(10, 1).to_string(), run(10, 1).reason()), ("valid".to_owned(), None));
    }
}
