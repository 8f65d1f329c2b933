//! Bursts: groups of segments that Linux hands to the network as one segment, and the rate for the length of bursts. The last segment of a burst has the flag
//! PSH.

use cohaptic_units::Instant;

use super::Connection;
use crate::pace::{LONGEST_BURST, Pace};
use crate::sequence::Position;

/// Burst that is leaving, of new or of lost segments.
#[derive(Clone, Debug)]
pub(super) struct Burst {
    at: Instant,
    /// Position at which the next segment of the burst begins.
    next: Position,
    /// Number of segments of the burst that have not left.
    left: u32,
    /// The burst has more than one segment.
    has_several: bool,
}

impl Default for Burst {
    fn default() -> Self {
        Self { at: Instant::ZERO, next: 0, left: 0, has_several: false }
    }
}

impl Burst {
    /// Returns whether the segment at `start` that leaves at `now` belongs to another burst.
    fn is_over(&self, now: Instant, start: Position) -> bool {
        self.left == 0 || self.next != start || self.at != now
    }

    /// Returns the burst of `length` segments, at least one, whose first segment begins at `start` and leaves at `now`.
    const fn begin(now: Instant, start: Position, length: u32) -> Self {
        Self { at: now, next: start, left: length, has_several: length > 1 }
    }

    /// Notes that the next segment, which ends at `end`, leaves. Returns whether the segment is the last of the burst.
    const fn takes(&mut self, end: Position) -> bool {
        (self.left, self.next) = (self.left.saturating_sub(1), end);
        self.left == 0
    }
}

impl Connection {
    /// Returns the rate at which Linux would pace the sender (`tcp_update_pacing_rate`).
    pub(super) fn pace(&self) -> Pace {
        let Some(srtt) = self.round_trips.srtt_nanos() else { return Pace::UNBOUNDED };
        let percent = if self.congestion.window < self.congestion.threshold / 2 { 200 } else { 120 };
        Pace::new(u64::from(self.congestion.window.max(self.send.board.packets_out())) * self.send.mss as u64, percent, srtt)
    }

    /// Returns the number of segments of a burst, at most `most`: what the rate brings in about a millisecond, but at least two (`tcp_tso_autosize`).
    fn longest_burst(&self, most: u32) -> u32 {
        let mss = self.segment_size().max(1) as u64;
        let wanted = u64::from(most) * mss;
        // On a short path bursts may be longer. The shift is the least round trip in units of 512 µs.
        let near = self.round_trips.least().map_or(0, |least| least.as_micros() >> 9);
        let near = u32::try_from(near).ok().and_then(|shift| LONGEST_BURST.checked_shr(shift)).unwrap_or(0);
        // Most bursts are short, and need neither the rate nor a quotient.
        if most <= 2 || wanted <= near {
            return most;
        }
        let octets = (self.pace().rate() >> 10).saturating_add(near).min(LONGEST_BURST);
        whole(octets, mss, most).max(2)
    }

    /// Returns the most segments of the burst that begins now: what the rate and the congestion window allow, at most half of the congestion window.
    fn quota(&self) -> u32 {
        let window = self.congestion.window;
        let quota = window.saturating_sub(self.send.board.in_flight()).min((window / 2).max(1));
        self.longest_burst(quota).max(1)
    }

    /// Returns the number of segments in the burst that begins now: at most `quota`, and what the peer's window and the data allow.
    fn burst_length(&self, quota: u32) -> u32 {
        let mss = self.segment_size().max(1) as u64;
        let (unsent, open) = (self.send.buffer.end().saturating_sub(self.send.next), self.send.window_end().saturating_sub(self.send.next));
        // A last segment below the full size belongs to the burst if neither the window nor Nagle's algorithm holds it back.
        let takes_rest = unsent <= open && (self.config.nodelay || self.send.is_shut || self.send.small_end <= self.send.una);
        // One octet less than a segment is added, so that the division below rounds up and counts a last short segment.
        let octets = if takes_rest { unsent.saturating_add(mss - 1) } else { unsent.min(open) };
        // The octets that leave while the program writes are one buffer, of at most half of the peer's largest window (`tcp_bound_to_half_wnd`). Later a
        // buffer takes octets of the next one (`tcp_grow_skb`).
        let most = if self.send.pushes.is_writing { self.half_window() } else { u64::MAX };
        whole(octets.min(most), mss, quota).max(1)
    }

    /// Notes that the new segment from `start` to `end` leaves at `now`. Returns whether the segment is the last of a burst, and whether the burst has several
    /// segments. Called before the segment counts as sent.
    pub(super) fn ends_burst(&mut self, now: Instant, start: Position, end: Position) -> (bool, bool) {
        if self.send.burst.is_over(now, start) {
            let quota = self.quota();
            self.send.burst = Burst::begin(now, start, self.burst_length(quota));
            if !self.send.pushes.is_writing {
                self.send.pushes.grow(start + u64::from(quota) * self.segment_size() as u64, self.send.buffer.end());
            }
        }
        (self.send.burst.takes(end), self.send.burst.has_several)
    }

    /// Notes that the lost segment from `start` to `end` leaves again at `now`. Returns whether the segment ends a group of segments that Linux repeats as one
    /// segment: lost neighbours of one burst, as far as the congestion window and the rate allow (`tcp_xmit_retransmit_queue`). Called before the segment
    /// counts as sent again.
    pub(super) fn ends_repetition(&mut self, now: Instant, start: Position, end: Position) -> bool {
        if self.send.repetition.is_over(now, start) {
            let board = &self.send.board;
            let most = self.longest_burst(self.congestion.window.saturating_sub(board.in_flight()));
            self.send.repetition = Burst::begin(now, start, board.lost_in_burst(start, self.send.window_end(), most).max(1));
        }
        self.send.repetition.takes(end) && self.send.repetition.has_several
    }
}

/// Returns the number of whole segments of `mss` octets in `octets` octets, at most `most`. Divides only if there are fewer than `most`.
fn whole(octets: u64, mss: u64, most: u32) -> u32 {
    if octets >= u64::from(most).saturating_mul(mss) { most } else { u32::try_from(octets / mss).unwrap_or(most) }
}
