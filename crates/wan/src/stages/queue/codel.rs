//! CoDel, controlled delay (Nichols, Jacobson, McGregor & Iyengar, RFC 8289, 2018).
//!
//! A packet that leaves the queue after more than `target` while all others of the last `interval` did too is dropped, and then one more after
//! interval/√2, interval/√3, …, until one waits less.

use core::time::Duration;

use crate::parameters::{Form, Table, usual};
use cohaptic_units::{Bytes, Instant};

/// The parameters of CoDel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CoDel {
    /// The wait that is always acceptable; 5 ms by custom.
    pub target: Duration,
    /// How long it must be exceeded; 100 ms by custom, about the longest round trip.
    pub interval: Duration,
    /// With at most this number of bytes waiting nothing is dropped: one packet of the largest size.
    pub mtu: Bytes,
    /// Whether a capable packet is marked where another is dropped.
    pub ecn: bool,
}

impl Default for CoDel {
    /// 5 ms, 100 ms, 1500 bytes, no ECN.
    fn default() -> Self {
        Self { target: Duration::from_millis(5), interval: Duration::from_millis(100), mtu: Bytes::new(1500), ecn: false }
    }
}

/// The control law's memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct CoDelState {
    /// When the wait will have been above the target for an interval; `None` while it is below.
    first_above: Option<Instant>,
    dropping: bool,
    drop_next: Instant,
    count: u64,
    last_count: u64,
    /// What was dropped just now.
    dropped: Dropped,
}

/// Whether the packet before was dropped at this instant, and at which line of the pseudocode.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Dropped {
    #[default]
    Not,
    /// The first one: the next packet is sent, whatever it waited.
    Entering,
    /// One of those that follow.
    Again,
}

/// What CoDel says to a packet that leaves the queue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    Send,
    /// Send it marked, whatever comes.
    Mark,
    /// Drop it, and ask about the next one.
    Drop,
}

impl CoDelState {
    /// Decides about the packet that leaves the queue `now` after so long; `left_bytes` wait behind it. After [`Verdict::Drop`] it is asked about the next
    /// packet at once. Follows the pseudocode of RFC 8289, section 5, one packet a call.
    pub(crate) fn verdict(&mut self, codel: &CoDel, now: Instant, sojourn: Duration, left_bytes: u128, ecn_capable: bool) -> Verdict {
        let ok_to_drop = self.should_drop(codel, now, sojourn, left_bytes);
        match core::mem::take(&mut self.dropped) {
            Dropped::Entering => return Verdict::Send,
            Dropped::Again if ok_to_drop => self.drop_next = control_law(self.drop_next, codel.interval, self.count),
            Dropped::Again | Dropped::Not => {}
        }
        let marks = codel.ecn && ecn_capable;
        if self.dropping {
            if !ok_to_drop {
                self.dropping = false;
                return Verdict::Send;
            }
            if now < self.drop_next {
                return Verdict::Send;
            }
            self.count += 1;
            if marks {
                self.drop_next = control_law(self.drop_next, codel.interval, self.count);
                return Verdict::Mark;
            }
            self.dropped = Dropped::Again;
            return Verdict::Drop;
        }
        if !ok_to_drop {
            return Verdict::Send;
        }
        self.dropping = true;
        // A queue that grew again soon after it was controlled is dropped from at the rate that controlled it.
        let since = self.count - self.last_count;
        let recently = now.saturating_duration_since(self.drop_next) < codel.interval.saturating_mul(16);
        self.count = if since > 1 && recently { since } else { 1 };
        self.drop_next = control_law(now, codel.interval, self.count);
        self.last_count = self.count;
        if marks {
            return Verdict::Mark;
        }
        self.dropped = Dropped::Entering;
        Verdict::Drop
    }

    /// The queue has run empty.
    pub(crate) const fn empty(&mut self) {
        self.first_above = None;
        self.dropping = false;
        self.dropped = Dropped::Not;
    }

    fn should_drop(&mut self, codel: &CoDel, now: Instant, sojourn: Duration, left_bytes: u128) -> bool {
        if sojourn < codel.target || left_bytes <= u128::from(codel.mtu.get()) {
            self.first_above = None;
            return false;
        }
        match self.first_above {
            None => {
                self.first_above = Some(now.saturating_add(codel.interval));
                false
            }
            Some(first_above) => now >= first_above,
        }
    }
}

/// When the next packet is dropped: t + interval/√count.
#[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a time of some milliseconds")]
fn control_law(t: Instant, interval: Duration, count: u64) -> Instant {
    t.saturating_add(Duration::from_nanos(libm::rint(interval.as_nanos() as f64 / libm::sqrt(count as f64)) as u64))
}

/// The parameters of the discipline.
pub(crate) static CODEL: Table = Table::of(&[&[
    usual("target", Form::PositiveDuration, "\"5ms\"", "How long packets may wait"),
    usual("interval", Form::PositiveDuration, "\"100ms\"", "For how long they may wait longer"),
    usual("mtu", Form::Size, "\"1500B\"", "Nothing is dropped with this size or less waiting"),
    usual("ecn", Form::Boolean, "false", "Packets are marked where they would be dropped"),
]]);

#[cfg(test)]
mod tests {
    use super::*;

    fn millis(t: u64) -> Instant {
        Instant::from_nanos(t * 1_000_000)
    }

    /// A queue whose packets always wait 20 ms, seen every millisecond: the first drop comes an interval after the first wait above the target, the
    /// next ones interval/√1, /√2, /√3 … after each other, rounded up to the next packet.
    #[test]
    fn drops_follow_the_control_law() {
        let (codel, mut state) = (CoDel::default(), CoDelState::default());
        let mut ask = |t| state.verdict(&codel, millis(t), Duration::from_millis(20), 100_000, false);
        // After a drop the packet behind it is asked about at the same instant.
        let dropped: Vec<u64> = (0..600).filter(|t| ask(*t) == Verdict::Drop && ask(*t) == Verdict::Send).collect();
        let mut expected = vec![100];
        let mut next = 100.0;
        for count in 1..20 {
            next += 100.0 / f64::from(count).sqrt();
            expected.push(next.ceil() as u64);
        }
        expected.retain(|t| *t < 600);
        assert_eq!(dropped, expected);
    }

    #[test]
    fn a_short_wait_or_a_short_queue_ends_it() {
        let (codel, mut state) = (CoDel::default(), CoDelState::default());
        let mut at = |t, wait, left| state.verdict(&codel, millis(t), Duration::from_millis(wait), left, false);
        assert_eq!(at(0, 20, 100_000), Verdict::Send);
        assert_eq!([at(100, 20, 100_000), at(100, 20, 100_000)], [Verdict::Drop, Verdict::Send]);
        assert_eq!(at(250, 20, 1500), Verdict::Send);
        assert_eq!(at(251, 4, 100_000), Verdict::Send);
        assert_eq!(at(260, 20, 100_000), Verdict::Send);
        assert_eq!(at(359, 20, 100_000), Verdict::Send);
        assert_eq!(at(360, 20, 100_000), Verdict::Drop);
    }

    #[test]
    fn a_capable_packet_is_marked() {
        let codel = CoDel { ecn: true, ..CoDel::default() };
        let mut state = CoDelState::default();
        let mut at = |t, capable| state.verdict(&codel, millis(t), Duration::from_millis(20), 100_000, capable);
        at(0, true);
        assert_eq!(at(100, true), Verdict::Mark);
        assert_eq!(at(200, false), Verdict::Drop);
    }
}
