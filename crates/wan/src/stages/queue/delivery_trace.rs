//! Delivery trace: a line with its capacity recorded as instants, each for a fixed number of bytes (the format of mahimahi; Netravali et al.,
//! USENIX ATC 2015).

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;

use cohaptic_units::{Bytes, Instant};

/// Opportunities to deliver. At each opportunity up to [`DeliveryTrace::bytes`] leave, of one packet or of several; a large packet needs several opportunities.
/// Unused bytes are lost. A packet offered at the very instant of an opportunity waits for the next opportunity.
///
/// The recording repeats for ever: after its last line the recording begins anew, with its end as the new zero.
///
/// A capacity recorded under full load says little about a light load such as a haptic flow (Winstein et al. saturate the link to record its capacity).
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DeliveryTrace {
    /// Opportunities \[ns\] from the begin of a round, ascending. Equal entries are several opportunities at one instant. The last entry is the length of a
    /// round.
    opportunities: Arc<[u64]>,
    bytes: Bytes,
}

/// Reason for the refusal of a recording. Lines count from 1.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum DeliveryTraceError {
    /// A line is not a whole number of milliseconds, or is too large for an instant.
    Number {
        /// Number of the line.
        line: usize,
    },
    /// A line has an earlier time than the line above it.
    Order {
        /// Number of the line.
        line: usize,
        /// Time on the line \[ms\].
        found: u64,
        /// Time on the line above \[ms\].
        before: u64,
    },
    /// The recording has no length, so the recording cannot be repeated.
    NoLength,
    /// The recording has no line.
    Empty,
    /// An opportunity has no bytes, so no packet could ever leave.
    NoBytes,
}

impl fmt::Display for DeliveryTraceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { line } => write!(f, "line {line}: expected a whole number of milliseconds"),
            Self::Order { line, found, before } => write!(f, "line {line}: {found} ms comes after {before} ms: expected times in order"),
            Self::NoLength => f.write_str("the recording ends at 0 ms: expected a last line above 0"),
            Self::Empty => f.write_str("an empty recording: expected a whole number of milliseconds on each line"),
            Self::NoBytes => f.write_str("an opportunity to deliver 0 bytes: expected some"),
        }
    }
}

impl core::error::Error for DeliveryTraceError {}

/// Number of bytes for each opportunity in mahimahi. (The manual of mahimahi says 1500; with a tunnel's header 1504.)
pub const MAHIMAHI_BYTES: Bytes = Bytes::new(1504);

impl DeliveryTrace {
    /// Reads mahimahi's format: a whole number of milliseconds on each line, not descending. Blank lines are skipped.
    ///
    /// # Errors
    ///
    /// [`DeliveryTraceError`] with the line. No text makes this function panic.
    pub fn parse(text: &str, bytes: Bytes) -> Result<Self, DeliveryTraceError> {
        let mut opportunities = Vec::new();
        let mut before = 0;
        for (place, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let line_number = place + 1;
            let found: u64 = line.trim().parse().map_err(|_| DeliveryTraceError::Number { line: line_number })?;
            if found < before {
                return Err(DeliveryTraceError::Order { line: line_number, found, before });
            }
            opportunities.push(found.checked_mul(1_000_000).ok_or(DeliveryTraceError::Number { line: line_number })?);
            before = found;
        }
        Self::new(opportunities, bytes)
    }

    /// Returns a recording with the given opportunities \[ns\] in each round, in order.
    fn new(opportunities: Vec<u64>, bytes: Bytes) -> Result<Self, DeliveryTraceError> {
        match opportunities.last() {
            None => Err(DeliveryTraceError::Empty),
            // A round of no length would repeat its opportunities without end at one instant.
            Some(0) => Err(DeliveryTraceError::NoLength),
            Some(_) if bytes == Bytes::ZERO => Err(DeliveryTraceError::NoBytes),
            Some(_) => Ok(Self { opportunities: opportunities.into(), bytes }),
        }
    }

    /// Returns the number of bytes that may leave at each opportunity.
    #[must_use]
    pub const fn bytes(&self) -> Bytes {
        self.bytes
    }

    /// Returns the time after which the recording begins anew.
    #[must_use]
    pub fn period(&self) -> core::time::Duration {
        core::time::Duration::from_nanos(self.opportunities.last().copied().unwrap_or(0))
    }

    /// Returns the mean rate \[bit/s\].
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a mean")]
    pub fn mean_rate(&self) -> f64 {
        // The last opportunity is the length of a round.
        self.opportunities.len() as f64 * 8.0 * self.bytes.get() as f64 / (self.opportunities.last().copied().unwrap_or(1) as f64 / 1e9)
    }

    /// Returns the instant of the first opportunity after `now`, and the number of opportunities at this instant, or `None` beyond the end of time.
    pub(crate) fn next_after(&self, now: Instant) -> Option<(Instant, u64)> {
        let first = self.first_after(now)?;
        let at = self.instant(first)?;
        // Several opportunities can share an instant, even the last of a round and the first of the next round.
        let count = (first..).take_while(|index| self.instant(*index) == Some(at)).count();
        Some((at, count as u64))
    }

    /// Returns the instant of the n-th opportunity after `now`, with n from 1, or `None` beyond the end of time.
    pub(crate) fn nth_after(&self, now: Instant, n: u64) -> Option<Instant> {
        self.instant(self.first_after(now)?.checked_add(n.checked_sub(1)?)?)
    }

    /// Returns the index of the first opportunity after `now`. Indices continue over all rounds.
    fn first_after(&self, now: Instant) -> Option<u64> {
        // The last opportunity, the period, is above zero: `new` refuses a recording without length.
        let period = self.opportunities.last()?;
        let (round, place) = (now.as_nanos() / period, now.as_nanos() % period);
        let within = self.opportunities.partition_point(|opportunity| *opportunity <= place);
        round.checked_mul(self.opportunities.len() as u64)?.checked_add(within as u64)
    }

    /// Returns the instant of the opportunity with the index `index` over all rounds, or `None` beyond the end of time.
    fn instant(&self, index: u64) -> Option<Instant> {
        let count = self.opportunities.len() as u64;
        let within = self.opportunities[usize::try_from(index % count).ok()?];
        (index / count).checked_mul(*self.opportunities.last()?)?.checked_add(within).map(Instant::from_nanos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn millis(t: u64) -> Instant {
        Instant::from_nanos(t * 1_000_000)
    }

    #[test]
    fn the_recording_repeats() {
        let trace = DeliveryTrace::parse("0\n2\n2\n5\n", MAHIMAHI_BYTES).unwrap();
        let mut now = Instant::ZERO;
        let mut seen = Vec::new();
        for _ in 0..5 {
            let (at, count) = trace.next_after(now).unwrap();
            seen.push((at.as_nanos() / 1_000_000, count));
            now = at;
        }
        assert_eq!(seen, [(2, 2), (5, 2), (7, 2), (10, 2), (12, 2)]);
        assert_eq!(trace.next_after(millis(4)), Some((millis(5), 2)));
        assert_eq!([1, 2, 3, 4, 5].map(|n| trace.nth_after(millis(4), n).unwrap()), [5, 5, 7, 7, 10].map(millis));
    }

    #[test]
    fn one_a_millisecond_is_twelve_megabits() {
        let trace = DeliveryTrace::parse("1", Bytes::new(1500)).unwrap();
        assert_eq!(trace.mean_rate(), 12e6);
        assert_eq!(trace.next_after(Instant::MAX), None);
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let error = |text| DeliveryTrace::parse(text, MAHIMAHI_BYTES).unwrap_err();
        assert_eq!(error("1\nx\n"), DeliveryTraceError::Number { line: 2 });
        assert_eq!(error("3\n2\n"), DeliveryTraceError::Order { line: 2, found: 2, before: 3 });
        assert_eq!(error("0\n0\n"), DeliveryTraceError::NoLength);
        assert_eq!(error("\n"), DeliveryTraceError::Empty);
        assert_eq!(error("99999999999999999999"), DeliveryTraceError::Number { line: 1 });
        assert_eq!(error("9999999999999999999"), DeliveryTraceError::Number { line: 1 });
        assert_eq!(DeliveryTrace::parse("1", Bytes::ZERO), Err(DeliveryTraceError::NoBytes));
    }
}
