//! Bursts: segments that Linux hands to the network as one, and the rate that sets their length. The last segment of a burst has the flag PSH.

use cohaptic_units::Instant;

use super::Connection;
use crate::sequence::Position;

/// Most octets of a burst: 64 KiB less the room that Linux keeps for headers (`sk_gso_max_size`).
pub(crate) const LONGEST_BURST: u64 = 65_536 - 257;

/// Burst that is leaving.
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

impl Connection {
    /// Returns the rate at which Linux would pace the sender \[byte/s\] (`tcp_update_pacing_rate`), or `None` before the first round trip. This crate paces
    /// nothing; the rate only sets the length of bursts, and a margin of `HyStart`.
    pub(super) fn pacing_rate(&self) -> Option<u64> {
        let srtt = self.round_trips.srtt()?.as_nanos().max(1);
        let percent = if self.congestion.window < self.congestion.threshold / 2 { 200 } else { 120 };
        let flight = u128::from(self.congestion.window.max(self.send.board.packets_out())) * self.send.mss as u128;
        Some(u64::try_from(flight * percent * 10_000_000 / srtt).unwrap_or(u64::MAX))
    }

    /// Returns the number of segments in the burst that begins now: what the windows and the data allow, at most half of the congestion window, and at most
    /// what the rate brings in about a millisecond (`tcp_tso_autosize`).
    fn burst_length(&self) -> u32 {
        let mss = self.segment_size().max(1) as u64;
        // On a short path bursts may be longer. The shift is the least round trip in units of 512 µs.
        let near = self.round_trips.least().map_or(0, |least| least.as_micros() >> 9);
        let near = u32::try_from(near).ok().and_then(|shift| LONGEST_BURST.checked_shr(shift)).unwrap_or(0);
        let by_rate = (self.pacing_rate().unwrap_or(u64::MAX) >> 10).saturating_add(near).min(LONGEST_BURST) / mss;
        let window = self.congestion.window;
        let quota = window.saturating_sub(self.send.board.in_flight()).min((window / 2).max(1));
        let (unsent, open) = (self.send.buffer.end().saturating_sub(self.send.next), self.send.window_end().saturating_sub(self.send.next));
        // A last segment below the full size belongs to the burst if neither the window nor Nagle's algorithm holds it back.
        let takes_rest = unsent <= open && (self.config.nodelay || self.send.is_shut || self.send.small_end <= self.send.una);
        let segments = if takes_rest { unsent.div_ceil(mss) } else { unsent.min(open) / mss };
        let by_octets = u32::try_from(segments).unwrap_or(u32::MAX);
        quota.min(u32::try_from(by_rate.max(2)).unwrap_or(u32::MAX)).min(by_octets).max(1)
    }

    /// Notes that the new segment from `start` to `end` leaves at `now`. Returns whether the segment is the last of a burst of several. Called before the
    /// segment counts as sent.
    pub(super) fn ends_burst(&mut self, now: Instant, start: Position, end: Position) -> bool {
        if self.send.burst.left == 0 || self.send.burst.next != start || self.send.burst.at != now {
            let left = self.burst_length();
            self.send.burst = Burst { at: now, next: start, left, has_several: left > 1 };
        }
        let burst = &mut self.send.burst;
        (burst.left, burst.next) = (burst.left - 1, end);
        burst.left == 0 && burst.has_several
    }
}
