//! Pattern of chosen losses: the packets with given numbers, or all packets sent in given spans (KauNet's data-driven and time-driven patterns).

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;
use core::ops::Range;
use core::time::Duration;

use cohaptic_units::Instant;

/// Spans of packet numbers or of nanoseconds, optionally repeated.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Pattern {
    spans: Arc<[Range<u64>]>,
    period: Option<u64>,
    counts: Counts,
}

/// Unit of a pattern's counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Counts {
    /// Packets offered to the link, from 0.
    Packets,
    /// Nanoseconds since the begin of time.
    Nanoseconds,
}

/// Reason for the refusal of a pattern.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum PatternError {
    /// A span ends before its begin, or at its begin.
    Empty {
        /// Index of the span, from 0.
        index: usize,
    },
    /// A span begins before the previous span in the list has ended.
    Order {
        /// Index of the span, from 0.
        index: usize,
    },
    /// A span ends after the period, or the period is zero.
    Period {
        /// Period, in the unit of the pattern.
        period: u64,
        /// End of the last span, in the unit of the pattern.
        end: u64,
    },
}

impl fmt::Display for PatternError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { index } => write!(f, "span {index} is empty: expected an end after its begin"),
            Self::Order { index } => write!(f, "span {index} begins before the one listed before it has ended: expected spans in order"),
            Self::Period { period, end } => {
                write!(f, "the pattern begins anew after {period}, before its last span has ended at {end}: expected a period that holds all spans")
            }
        }
    }
}

impl core::error::Error for PatternError {}

impl Pattern {
    /// Returns a pattern of the packets with the given numbers, counted from 0. The pattern repeats after `every` packets, if `every` is given.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if a span is empty or out of order, or does not fit the period.
    pub fn of_packets(packets: Vec<Range<u64>>, every: Option<u64>) -> Result<Self, PatternError> {
        Self::new(packets, every, Counts::Packets)
    }

    /// Returns a pattern of all packets offered in the given spans, from the start included to the end excluded. The pattern repeats after `every`, if
    /// `every` is given.
    ///
    /// # Errors
    ///
    /// [`PatternError`] if a span is empty or out of order, or does not fit the period.
    pub fn in_time(spans: &[Range<Instant>], every: Option<Duration>) -> Result<Self, PatternError> {
        let spans = spans.iter().map(|span| span.start.as_nanos()..span.end.as_nanos()).collect();
        Self::new(spans, every.map(|every| u64::try_from(every.as_nanos()).unwrap_or(u64::MAX)), Counts::Nanoseconds)
    }

    fn new(spans: Vec<Range<u64>>, period: Option<u64>, counts: Counts) -> Result<Self, PatternError> {
        let mut end = 0;
        for (index, span) in spans.iter().enumerate() {
            if span.start >= span.end {
                return Err(PatternError::Empty { index });
            }
            // Spans may touch: the end is not part of a span.
            if span.start < end {
                return Err(PatternError::Order { index });
            }
            end = span.end;
        }
        // A span beyond the period would overlap the spans of the next period.
        if let Some(period) = period.filter(|period| *period < end || *period == 0) {
            return Err(PatternError::Period { period, end });
        }
        Ok(Self { spans: spans.into(), period, counts })
    }

    /// Returns the unit of the pattern.
    #[must_use]
    pub const fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns the period in the unit of the pattern, or `None` if the pattern does not repeat.
    #[must_use]
    pub const fn period(&self) -> Option<u64> {
        self.period
    }

    /// Returns the covered long-run fraction of the unit, or `None` for a pattern without a period. Its fraction tends to zero.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a fraction")]
    pub fn mean_loss(&self) -> Option<f64> {
        let lost: u64 = self.spans.iter().map(|span| span.end - span.start).sum();
        self.period.map(|period| lost as f64 / period as f64)
    }

    /// Returns the longest covered run without a gap, in the unit of the pattern, or `None` if the pattern covers everything from some place on.
    #[must_use]
    pub fn longest_run(&self) -> Option<u64> {
        let once = self.spans.iter().cloned();
        // Two successive periods contain every run that continues from a period into the next.
        let again = self.period.into_iter().flat_map(|period| self.spans.iter().map(move |span| span.start + period..span.end + period));
        let (mut longest, mut run, mut end) = (0, 0, None);
        for span in once.chain(again) {
            // Spans that touch form one run.
            run = if end == Some(span.start) { run } else { 0 } + (span.end - span.start);
            longest = longest.max(run);
            end = Some(span.end);
        }
        // A run longer than a period covers a whole period without a gap, and so every later period as well.
        let covers_all = self.period.is_some_and(|period| longest > period) || longest == u64::MAX;
        (!covers_all).then_some(longest)
    }

    /// Returns whether the pattern covers the packet `number` offered at `now`. A pattern looks at only one of both, depending on its unit.
    #[must_use]
    pub(crate) fn covers(&self, number: u64, now: Instant) -> bool {
        let counted = match self.counts {
            Counts::Packets => number,
            Counts::Nanoseconds => now.as_nanos(),
        };
        let place = self.period.map_or(counted, |period| counted % period);
        // Spans are ordered and do not overlap, so only the first span with an end after `place` can cover `place`.
        let next = self.spans.partition_point(|span| span.end <= place);
        self.spans.get(next).is_some_and(|span| span.start <= place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chosen_packets_are_covered_again_and_again() {
        let pattern = Pattern::of_packets(vec![1..2, 4..7], Some(10)).unwrap();
        let covered: Vec<u64> = (0..20).filter(|number| pattern.covers(*number, Instant::ZERO)).collect();
        assert_eq!(covered, [1, 4, 5, 6, 11, 14, 15, 16]);
        assert_eq!(pattern.mean_loss(), Some(0.4));
    }

    #[test]
    fn a_span_of_time_begins_with_its_first_instant() {
        let at = Instant::from_nanos;
        let pattern = Pattern::in_time(&[at(10)..at(20)], None).unwrap();
        let covered: Vec<u64> = (0..40).filter(|t| pattern.covers(0, at(*t))).collect();
        assert_eq!(covered, (10..20).collect::<Vec<_>>());
    }

    #[test]
    fn the_longest_run_goes_on_into_the_next_period() {
        let run = |packets: Vec<Range<u64>>, every: Option<u64>| Pattern::of_packets(packets, every).unwrap().longest_run();
        assert_eq!(run(vec![1..2, 4..7], Some(10)), Some(3));
        assert_eq!(run(vec![0..2, 8..10], Some(10)), Some(4));
        assert_eq!(run(vec![0..2, 8..10], None), Some(2));
        assert_eq!(run(vec![3..5, 5..6], Some(7)), Some(3));
        assert_eq!(run(vec![0..4], Some(4)), None);
        assert_eq!(run(Vec::new(), Some(4)), Some(0));
    }

    #[test]
    fn what_is_no_pattern_is_refused() {
        assert_eq!(Pattern::of_packets(vec![3..3], None), Err(PatternError::Empty { index: 0 }));
        assert_eq!(Pattern::of_packets(vec![3..5, 4..9], None), Err(PatternError::Order { index: 1 }));
        assert!(matches!(Pattern::of_packets(vec![3..5], Some(4)), Err(PatternError::Period { .. })));
        assert!(matches!(Pattern::of_packets(vec![], Some(0)), Err(PatternError::Period { .. })));
    }
}
