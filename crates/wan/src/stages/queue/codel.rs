//! CoDel, controlled delay (Nichols, Jacobson, McGregor & Iyengar, RFC 8289, 2018).
//!
//! A packet that leaves the queue after more than `target` is dropped if all further packets of the last `interval` waited longer as well. Further packets are
//! then dropped at distances of interval/√1, interval/√2, interval/√3, …, until a packet waits less.

use core::time::Duration;

use crate::parameters::{Form, Table, usual};
use cohaptic_units::{Bytes, Instant};

/// Parameters of CoDel.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CoDel {
    /// Always acceptable wait, usually 5 ms.
    pub target: Duration,
    /// Time of waits above the target before a packet is dropped, usually 100 ms, about the longest round trip.
    pub interval: Duration,
    /// Number of waiting bytes without drops: one packet of the largest size.
    pub mtu: Bytes,
    /// `true` if an ECN-capable packet is marked instead of dropped.
    pub ecn: bool,
}

impl Default for CoDel {
    /// Returns a target of 5 ms, an interval of 100 ms, an MTU of 1500 bytes, and no ECN.
    fn default() -> Self {
        Self { target: Duration::from_millis(5), interval: Duration::from_millis(100), mtu: Bytes::new(1500), ecn: false }
    }
}

/// Memory of the control law. Fields have the names of RFC 8289.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct CoDelState {
    /// Instant of the end of an interval with waits above the target, or `None` while waits are below the target.
    first_above: Option<Instant>,
    /// `true` if packets are being dropped by the control law.
    dropping: bool,
    /// Instant of the next drop.
    drop_next: Instant,
    /// Number of packets dropped in this state of dropping. Sets the distance of drops.
    count: u64,
    /// Value of `count` at the begin of the latest state of dropping.
    last_count: u64,
    /// Drop at the present instant, if the previous call dropped a packet.
    dropped: Dropped,
}

/// Kind of drop of the previous packet at this instant: the line of the drop in the pseudocode.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum Dropped {
    #[default]
    /// The previous packet was not dropped.
    Not,
    /// First drop of a state of dropping. The next packet is sent, whatever its wait.
    Entering,
    /// Further drop of a state of dropping.
    Again,
}

/// Verdict of CoDel about a packet on its way out of the queue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Verdict {
    Send,
    /// Send the packet marked.
    Mark,
    /// Drop the packet, and ask about the next packet.
    Drop,
}

impl CoDelState {
    /// Decides about the packet on its way out of the queue `now` after waiting for `sojourn`, with `left_bytes` waiting after the packet. After
    /// [`Verdict::Drop`] the caller asks about the next packet at the same instant. Follows the pseudocode of RFC 8289, section 5, with one packet per call.
    pub(crate) fn verdict(&mut self, codel: &CoDel, now: Instant, sojourn: Duration, left_bytes: u128, ecn_capable: bool) -> Verdict {
        // Called for every leaving packet, dropped or not, because the call tracks the begin of waits above the target.
        let ok_to_drop = self.should_drop(codel, now, sojourn, left_bytes);
        match core::mem::take(&mut self.dropped) {
            // RFC 8289 sends the packet after the first drop without a further look at its wait.
            Dropped::Entering => return Verdict::Send,
            Dropped::Again if ok_to_drop => self.drop_next = control_law(self.drop_next, codel.interval, self.count),
            Dropped::Again | Dropped::Not => {}
        }
        // A mark replaces a drop, and the packet is sent: CoDel does not go on to the next packet.
        let marks = codel.ecn && ecn_capable;
        if self.dropping {
            // A wait below the target ends the state of dropping.
            if !ok_to_drop {
                self.dropping = false;
                return Verdict::Send;
            }
            if now < self.drop_next {
                return Verdict::Send;
            }
            self.count += 1;
            if marks {
                // A mark ends the loop of the pseudocode, so the next instant is set here and not at the next packet.
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
        // A queue that grew again soon after its control continues with the successful rate of drops. `count` is never below `last_count`: `count` grows while
        // dropping, and both are set together.
        let since = self.count - self.last_count;
        // Drops by another cause count before the first state of dropping too. `last_count` is zero until then, and `drop_next` is no instant of a drop.
        let recently = self.last_count > 0 && now.saturating_duration_since(self.drop_next) < codel.interval.saturating_mul(16);
        self.count = if since > 1 && recently { since } else { 1 };
        self.drop_next = control_law(now, codel.interval, self.count);
        self.last_count = self.count;
        if marks {
            return Verdict::Mark;
        }
        self.dropped = Dropped::Entering;
        Verdict::Drop
    }

    /// Notes that the queue has no packet for the transmitter: the pseudocode then has nothing to drop, and ends the state of dropping.
    pub(crate) fn finds_nothing(&mut self) {
        (self.first_above, self.dropping, self.dropped) = (None, false, Dropped::Not);
    }

    /// Counts a packet dropped by another cause as a drop of the control law, so that the next drops follow sooner.
    pub(crate) fn counts_drop(&mut self) {
        self.count += 1;
    }

    /// Returns whether waits have exceeded the target for an interval, and tracks the begin of the excess.
    fn should_drop(&mut self, codel: &CoDel, now: Instant, sojourn: Duration, left_bytes: u128) -> bool {
        // A queue of at most one packet of the largest size cannot be shortened without leaving the transmitter idle. The packet after an empty queue finds no
        // packet after itself, and so ends a state of dropping. RFC 8289 looks at the empty queue instead.
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

/// Returns the instant of the next drop, t + interval/√count.
#[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a time of some milliseconds")]
fn control_law(t: Instant, interval: Duration, count: u64) -> Instant {
    // More drops without success make the distance shorter: the rate of drops grows with the square root of their number.
    t.saturating_add(Duration::from_nanos(libm::rint(interval.as_nanos() as f64 / libm::sqrt(count as f64)) as u64))
}

/// Parameters of the discipline.
pub(crate) static CODEL: Table = Table::of(&[&[
    usual("target", Form::PositiveDuration, "\"5ms\"", "Wait that packets should not exceed"),
    usual("interval", Form::PositiveDuration, "\"100ms\"", "Time for which packets may wait longer than the target"),
    usual("mtu", Form::Size, "\"1500B\"", "Size of the queue up to which no packet is dropped"),
    usual("ecn", Form::Boolean, "false", "Whether packets are marked instead of dropped"),
]]);

#[cfg(test)]
mod tests {
    use super::*;

    fn millis(t: u64) -> Instant {
        Instant::from_nanos(t * 1_000_000)
    }

    /// The packets of a queue always wait 20 ms, and one leaves every millisecond. The first drop comes an interval after the first wait above the target.
    /// The next drops follow at distances of interval/√1, /√2, /√3 …, rounded up to the next packet.
    #[test]
    fn drops_follow_the_control_law() {
        let (codel, mut state) = (CoDel::default(), CoDelState::default());
        let mut ask = |t| state.verdict(&codel, millis(t), Duration::from_millis(20), 100_000, false);
        // After a drop, CoDel is asked about the next packet at the same instant.
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
