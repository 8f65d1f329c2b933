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
    /// Instant at which the position began to be awaited whose arrival takes at least a round trip. For connections without timestamps.
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

    /// Takes the echo of a timestamp on data. `ticks` are the milliseconds since this end sent the timestamp, `None` if the segment is not full: the peer may
    /// have waited with it.
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

    /// Takes a round trip. Samples without timestamps are too long rather than too short, so only the least of them counts.
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
            free.next_multiple_of(unit)
        } else if offered + full <= free || offered > free {
            free - free % full.max(1)
        } else {
            offered
        };
        (window, is_little)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn established() -> Tuning {
        let mut tuning = Tuning::new(131_072, 6 << 20);
        let window = u64::from(tuning.first_window(1448));
        assert_eq!((window, tuning.first_window(1460)), (65_160, 64_240));
        tuning.begin(Instant::ZERO, window, 1448, 0);
        tuning.learn_segment(1448, window);
        tuning
    }

    /// Measured on Linux 6.18.
    #[test]
    fn the_buffer_grows_with_what_the_program_reads() {
        let mut tuning = established();
        for (copied, space, buffer) in [(57_920, 18_824, 955_232), (196_928, 57_920, 3_654_982), (392_784, 196_928, 3_757_040)] {
            (tuning.space, tuning.buffer) = (space, 131_072);
            tuning.enlarge(copied, 0);
            assert_eq!(tuning.buffer, buffer, "{copied}, {space}");
        }
        (tuning.space, tuning.buffer) = (14_480, 131_072);
        tuning.enlarge(500_000, 0);
        assert_eq!(tuning.buffer, 6 << 20);
        // Data out of order adds its own octets. A buffer never shrinks: for 14,481 octets, 46,345 would do.
        (tuning.space, tuning.buffer) = (18_824, 131_072);
        tuning.enlarge(57_920, 100_000);
        assert_eq!(tuning.buffer, 955_232 + 160_000);
        (tuning.space, tuning.buffer) = (14_480, 131_072);
        tuning.enlarge(14_481, 0);
        assert_eq!(tuning.buffer, 131_072);
    }

    /// Measured on Linux 6.18: four segments arrive, and then the program reads three of them.
    #[test]
    fn the_window_grows_with_full_segments_as_far_as_memory_lasts() {
        let mut tuning = established();
        assert_eq!((tuning.threshold, tuning.space), (65_160, 14_480));
        for count in 1..=4 {
            assert!(tuning.grow(1448, 2304 * count, 1448, 1448));
        }
        assert_eq!((tuning.threshold, tuning.window_of(tuning.buffer - 2304)), (76_160, 80_480));
    }

    /// A peer with a smaller MSS opens the window by two of this end's segments (`tcp_grow_window`), but takes more memory for its data: of a segment of 1000
    /// octets, 111/256 of the memory is data, and of a segment of 80 octets 24/256. The measure of the program is bounded by the window of the buffer.
    #[test]
    fn segments_of_a_smaller_peer() {
        let mut tuning = established();
        tuning.learn_segment(1000, 65_160);
        assert_eq!((tuning.ratio, tuning.threshold), (111, 131_072 * 111 / 256));
        tuning.threshold = 20_000;
        assert!(tuning.grow(1000, 2304, 1000, 1448));
        assert_eq!(tuning.threshold, 22_896);
        tuning.learn_segment(80, 65_160);
        assert_eq!((tuning.ratio, tuning.space), (24, 12_288));
    }

    /// `__tcp_grow_window`: a segment of 150 octets takes 832 octets of memory, half of whose window is 260. The window of a buffer of 6 MiB is halved once
    /// until 260 is below 150, and is still above the threshold. Half of the window of 256 KiB is 81,920, and a half of that is below the threshold.
    #[test]
    fn segments_that_waste_memory_open_the_window_of_a_large_buffer_only() {
        for (greatest, grows) in [(6 << 20, true), (256 << 10, false)] {
            let mut tuning = established();
            tuning.greatest = greatest;
            assert_eq!(tuning.grow(150, 832, 1448, 1448), grows);
        }
    }

    /// `__tcp_select_window`.
    #[test]
    fn a_window_of_less_than_a_sixteenth_or_a_segment_is_closed() {
        let tuning = established();
        let held = |tuning: &Tuning, rest: usize| usize::try_from(tuning.buffer).unwrap() - rest;
        // Of 8192 octets of memory, 5120 are window: a sixteenth of 81,920.
        assert_eq!(tuning.window(held(&tuning, 8192), 128, 1448, 6000), (5120, true));
        assert_eq!(tuning.window(held(&tuning, 8191), 128, 1448, 6000), (0, true));
        // A sixteenth of 10,240 is less than a segment.
        let small = Tuning { buffer: 16_384, ..tuning.clone() };
        assert_eq!(small.window(held(&small, 2560), 128, 1448, 6000), (1536, true));
        assert_eq!(small.window(held(&small, 2240), 128, 1448, 6000), (0, true));
        // A window without scale changes by whole segments: 20 of them fit into 30,000 octets.
        let unscaled = Tuning { threshold: 30_000, ..tuning };
        assert_eq!([29_000, 28_552, 20_000, 30_001].map(|offered| unscaled.window(0, 1, 1448, offered).0), [29_000, 28_960, 28_960, 28_960]);
    }

    /// `tcp_rcv_rtt_measure_ts` and `tcp_rcv_rtt_update`: an eighth of each sample counts, a shorter sample counts alone. An echo counts once, and lasts a
    /// millisecond at least.
    #[test]
    fn the_round_trip_of_the_receiver() {
        let mut tuning = established();
        let seen = [(1, Some(100)), (1, Some(10)), (2, Some(180)), (3, None), (4, Some(20)), (5, Some(0))].map(|(echo, ticks)| {
            tuning.hear_echo(echo, ticks);
            tuning.rtt_8 / 8 / 1_000_000
        });
        assert_eq!(seen, [100, 100, 110, 110, 20, 1]);
    }

    #[test]
    fn a_measure_lasts_a_round_trip_and_leaves_out_what_is_unread() {
        let mut tuning = established();
        tuning.hear_echo(1, Some(100));
        tuning.adapt(Instant::from_nanos(99_000_000), 50_000, 50_000, 0);
        assert_eq!((tuning.space, tuning.buffer), (14_480, 131_072), "too early");
        tuning.adapt(Instant::from_nanos(100_000_000), 50_000, 90_000, 0);
        assert_eq!((tuning.space, tuning.buffer), (14_480, 131_072), "40,000 octets are unread");
        tuning.adapt(Instant::from_nanos(200_000_000), 90_000, 95_000, 0);
        assert_eq!(tuning.space, 35_000);
    }
}
