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
