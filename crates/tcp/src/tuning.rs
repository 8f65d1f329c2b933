//! Receive buffer and window by the laws of Linux 6.18: the window grows with the segments that arrive, the buffer as the program reads.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::memory;
use crate::sequence::Position;

/// Data in a segment below which the segment is no reason to open the window \[byte\].
const LEAST_DATA: usize = 128;

/// Share of data in the memory of segments before the first full segment \[1/256\] (`TCP_DEFAULT_SCALING_RATIO`).
const FIRST_RATIO: u64 = 128;

/// Segments of data in the first round trip, as far as the receiver knows (`TCP_INIT_CWND`).
const FIRST_SEGMENTS: u64 = 10;

/// Receive buffer that the system adapts to the program and the path.
#[derive(Clone, Debug)]
pub(crate) struct Tuning {
    /// Memory for segments that have arrived and were not read \[byte\] (`sk_rcvbuf`).
    buffer: u64,
    /// Upper bound of `buffer` (`tcp_rmem[2]`).
    greatest: u64,
    /// Share of data in the memory of full segments \[1/256\].
    ratio: u64,
    /// Window up to which segments have been seen to fit \[byte\] (`rcv_ssthresh`).
    threshold: u64,
    /// Octets that the program has read in the best round trip so far (`rcvq_space.space`).
    space: u64,
    /// Instant and position of the read data at which the present measure began.
    measure: (Instant, Position),
    /// Eight times the round trip as the receiver sees it \[ns\]. Zero before the first sample.
    rtt_8: u64,
    /// Last echo of a timestamp that gave a sample of the round trip.
    echo: u32,
    /// Instant of a measurement's beginning, and the end of the window offered at that instant. Data from beyond this end arrives at least a round trip later.
    /// For connections without timestamps.
    awaited: Option<(Instant, Position)>,
}

impl Tuning {
    pub(crate) const fn new(least: usize, greatest: usize) -> Self {
        Self {
            buffer: least as u64,
            greatest: greatest as u64,
            ratio: FIRST_RATIO,
            threshold: 0,
            space: 0,
            measure: (Instant::ZERO, 0),
            rtt_8: 0,
            echo: 0,
            awaited: None,
        }
    }

    /// Returns the window for which `memory` suffices.
    const fn window_of(&self, memory: u64) -> u64 {
        self.ratio * memory / 256
    }

    /// Returns the largest window at present (`window_clamp`).
    pub(crate) const fn most(&self) -> u64 {
        self.window_of(self.buffer)
    }

    /// Returns the window of the SYN: whole segments of `mss` octets (`tcp_select_initial_window`).
    pub(crate) fn first_window(&self, mss: usize) -> u16 {
        let (most, mss) = (self.most(), mss as u64);
        let window = if most > mss { most - most % mss } else { most };
        u16::try_from(window).unwrap_or(u16::MAX)
    }

    /// Begins the measures, when the connection is established. `window` was offered with the SYN, `next` is the position of the first octet of data
    /// (`tcp_init_buffer_space`).
    pub(crate) fn begin(&mut self, now: Instant, window: u64, mss: usize, next: Position) {
        let mss = mss as u64;
        // Room for one segment stays reserved.
        self.threshold = window.min((2 * mss).max(self.most().saturating_sub(mss)));
        self.space = self.threshold.min(window).min(FIRST_SEGMENTS * mss);
        self.measure = (now, next);
    }

    /// Notes that the peer's full segments have `octets` of data (`tcp_measure_rcv_mss`). `offered` is the window offered last.
    pub(crate) fn learn_segment(&mut self, octets: usize, offered: u64) {
        let before = self.most();
        self.ratio = ((octets as u64 * 256) / memory::of_received(octets).0 as u64).max(1);
        let most = self.most();
        self.threshold = if most < before { self.threshold.min(most) } else { self.threshold.max(offered.min(most)) };
        self.space = self.space.min(most);
    }

    /// Lets the window grow after the arrival of `octets` of data (`tcp_grow_window`). `held` is the memory of all segments that were not read, with this one.
    /// `full` is the length of the peer's full segments, `mss` of this end's. Returns whether the window has grown.
    pub(crate) fn grow(&mut self, octets: usize, held: usize, full: usize, mss: usize) -> bool {
        let most = self.most().min(self.window_of(self.buffer.saturating_sub(held as u64)));
        if octets < LEAST_DATA || most <= self.threshold {
            return false;
        }
        let octets = octets as u64;
        let by_memory = self.window_of(memory::of_received(usize::try_from(octets).unwrap_or(usize::MAX)).0 as u64);
        let step = if by_memory <= octets { 2 * mss as u64 } else { self.step_of_small(by_memory / 2, octets, 2 * full as u64) };
        if step == 0 {
            return false;
        }
        self.threshold += step.min(most - self.threshold);
        true
    }

    /// Returns `step` if segments that waste memory still fit into a buffer of the greatest size, and zero otherwise.
    fn step_of_small(&self, half: u64, octets: u64, step: u64) -> u64 {
        let (mut half, mut window) = (half, self.window_of(self.greatest) / 2);
        while self.threshold <= window {
            if half <= octets {
                return step;
            }
            (half, window) = (half / 2, window / 2);
        }
        0
    }

    /// Takes the echo of a timestamp on data. `ticks` are the milliseconds since this end sent the timestamp. `None` if the segment is not full, because the
    /// peer may have held such a segment back.
    pub(crate) fn hear_echo(&mut self, echo: u32, ticks: Option<u32>) {
        if core::mem::replace(&mut self.echo, echo) != echo
            && let Some(ticks) = ticks.filter(|ticks| *ticks < 1 << 31)
        {
            self.sample(Duration::from_millis(u64::from(ticks.max(1))), true);
        }
    }

    /// Notes arriving data on a connection without timestamps: the octets beyond the window offered before arrive a round trip later at the earliest. `next` is
    /// the first missing position, `edge` the end of the offered window.
    pub(crate) fn hear_data(&mut self, now: Instant, next: Position, edge: Position) {
        if let Some((since, position)) = self.awaited {
            if next < position {
                return;
            }
            self.sample(now.saturating_duration_since(since), false);
        }
        self.awaited = Some((now, edge));
    }

    /// Takes a sample of the round trip into the estimate. A sample without timestamps (`is_exact` is `false`) is rather too long than too short, and counts
    /// only if the sample is shorter than the estimate.
    fn sample(&mut self, round_trip: Duration, is_exact: bool) {
        let nanos = u64::try_from(round_trip.as_nanos()).unwrap_or(u64::MAX / 16).clamp(1, u64::MAX / 16);
        if self.rtt_8 == 0 || nanos * 8 < self.rtt_8 {
            self.rtt_8 = nanos * 8;
        } else if is_exact {
            self.rtt_8 = self.rtt_8 - self.rtt_8 / 8 + nanos;
        }
    }

    /// Adapts the buffer after the program has read up to the position `read` (`tcp_rcv_space_adjust`). `next` is the first missing position, and `waiting` the
    /// distance from there to the end of the data out of order.
    pub(crate) fn adapt(&mut self, now: Instant, read: Position, next: Position, waiting: u64) {
        let (since, from) = self.measure;
        let spent = now.saturating_duration_since(since);
        if self.rtt_8 == 0 || spent < Duration::from_nanos(self.rtt_8 / 8) {
            return;
        }
        let copied = (read - from).saturating_sub(next.saturating_sub(read));
        if copied > self.space {
            self.enlarge(copied, waiting);
        }
        self.measure = (now, read);
    }

    /// Enlarges the buffer after a round trip in which the program has read `copied` octets (`tcp_rcvbuf_grow`).
    fn enlarge(&mut self, copied: u64, waiting: u64) {
        // The measure is a round trip late, and the peer may double its rate.
        let mut window = 2 * copied;
        window += 2 * (window * (copied - self.space) / self.space.max(1)) + waiting;
        self.space = copied;
        self.buffer = self.buffer.max((window * 256 / self.ratio).min(self.greatest));
    }

    /// Returns the window to offer while segments take `held` octets of memory (`__tcp_select_window`), and whether little memory is left. `unit` is the unit
    /// of the window scale, `full` the length of the peer's full segments, and `offered` the window offered last.
    pub(crate) fn window(&self, held: usize, unit: u64, full: usize, offered: u64) -> (u64, bool) {
        let (most, mut free) = (self.most(), self.window_of(self.buffer.saturating_sub(held as u64)));
        let full = (full as u64).min(most);
        let is_little = free < most / 2;
        if is_little {
            free &= !(unit - 1);
            // The peer must hear of a closed window before memory runs out.
            if free < most / 16 || free < full {
                return (0, true);
            }
        }
        free = free.min(self.threshold);
        let window = if unit > 1 {
            whole_units(free, unit)
        } else if offered + full <= free || offered > free {
            free - free % full.max(1)
        } else {
            offered
        };
        (window, is_little)
    }
}

/// Returns `octets` rounded up to a multiple of `unit`, a power of two. Each segment offers a window, and a mask takes less time than a division.
pub(crate) const fn whole_units(octets: u64, unit: u64) -> u64 {
    (octets + (unit - 1)) & !(unit - 1)
}

#[cfg(test)]
mod tests;
