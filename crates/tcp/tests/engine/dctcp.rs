//! DCTCP: codepoints, reports of marks, and the window against its law.

use std::time::Duration;

use cohaptic_tcp::{CongestionControl, Connection, Ecn, Flags, Segment, TcpConfig};
use cohaptic_units::Instant;

use crate::world::{Program, World, millis};

fn dctcp() -> TcpConfig {
    TcpConfig { congestion: CongestionControl::Dctcp, ..TcpConfig::default() }
}

#[test]
fn every_segment_has_ect_1_if_both_ends_have_ecn() {
    let run = |configs: [TcpConfig; 2]| {
        let mut world = World::new("delay 10ms", 1).programs(Program::writes(20_000).and_shuts(), Program::writes(20_000).and_shuts()).logged();
        world.configs = configs;
        let mut world = world.connect();
        world.run_to_the_last_octet(Duration::from_secs(10));
        world
    };
    let codepoints = |world: &World, side: usize| -> Vec<Ecn> {
        let mut seen: Vec<Ecn> = world.log.iter().flatten().filter(|left| left.from == side).map(|left| left.segment.ecn).collect();
        seen.dedup();
        seen
    };
    let world = run([dctcp(), dctcp()]);
    assert_eq!([codepoints(&world, 0), codepoints(&world, 1)], [[Ecn::Capable1], [Ecn::Capable1]]);
    // A peer with ECN alone marks its data with ECT(0), and a peer without ECN leaves no codepoint but the one on the SYN.
    let world = run([dctcp(), TcpConfig { ecn: true, ..TcpConfig::default() }]);
    assert_eq!(codepoints(&world, 0), [Ecn::Capable1]);
    assert!(codepoints(&world, 1).contains(&Ecn::Capable0) && !codepoints(&world, 1).contains(&Ecn::Capable1));
    let world = run([dctcp(), TcpConfig::default()]);
    assert_eq!([codepoints(&world, 0), codepoints(&world, 1)], [vec![Ecn::Capable1, Ecn::NotCapable], vec![Ecn::NotCapable]]);
}

/// Without ECN at the other end, DCTCP is Reno, segment for segment.
#[test]
fn without_ecn_it_is_reno() {
    let log = |congestion| {
        let config = TcpConfig { congestion, ..TcpConfig::default() };
        let mut world = World::new("delay 20ms 5ms loss 2%", 3).programs(Program::writes(400_000), Program::writes(400_000)).logged();
        world.configs = [config, TcpConfig::default()];
        let mut world = world.connect();
        world.run_to_the_last_octet(Duration::from_secs(100));
        // The first SYN of DCTCP asks for ECN.
        world.log.unwrap().into_iter().skip(1).map(|left| (left.at, left.from, left.segment)).collect::<Vec<_>>()
    };
    assert_eq!(log(CongestionControl::Dctcp), log(CongestionControl::Reno));
}

/// Two ends whose handshake is over, and 20 segments of data of the first one.
fn pair() -> (Connection, Connection, Vec<Segment<'static>>) {
    let (us, them) = ("10.0.0.1:1".parse().unwrap(), "10.0.0.2:2".parse().unwrap());
    // Acknowledgements wait from the beginning, and 20 segments may leave at once.
    let config = TcpConfig { quick_acks: 0, initial_window: 20, receive_buffer: Some(1 << 20), ..dctcp() };
    let mut a = Connection::connect(Instant::ZERO, config.clone(), us, them, 1).unwrap();
    let mut b = Connection::accept(millis(10), config, &a.poll_transmit(Instant::ZERO).unwrap(), 2).unwrap();
    a.handle_segment(millis(20), &b.poll_transmit(millis(10)).unwrap());
    b.handle_segment(millis(30), &a.poll_transmit(millis(20)).unwrap());
    a.write(&[7; 1448 * 20]).unwrap();
    let data = std::iter::from_fn(|| a.poll_transmit(millis(40))).collect();
    (a, b, data)
}

/// RFC 8257, section 3.2, figure 1: an acknowledgement for every second segment while the marks stay the same. Where they change, the delayed one leaves first
/// with the state before, and the arriving segment is acknowledged at once with its own.
#[test]
fn acknowledgements_report_the_mark_of_each_segment() {
    let (_, mut b, data) = pair();
    let marks = [false, false, false, true, true, true, false, true, true, true, false, false];
    let mut reports = Vec::new();
    for (segment, is_marked) in data.iter().zip(marks) {
        let segment = Segment { ecn: if is_marked { Ecn::Congestion } else { Ecn::Capable1 }, ..segment.clone() };
        b.handle_segment(millis(50), &segment);
        reports.extend(std::iter::from_fn(|| b.poll_transmit(millis(50))).map(|answer| {
            let octets = answer.acknowledgement.wrapping_sub(data[0].sequence);
            (octets / 1448, answer.flags.has(Flags::ECE))
        }));
        let mut octets = [0; 4096];
        while b.read(&mut octets).is_ok_and(|count| count > 0) {}
    }
    // Segments 1 and 2; 3 alone before the change and 4 after it; 5 and 6; 7; 8; 9 and 10; 11 behind the change; 12 waits.
    assert_eq!(reports, [(2, false), (3, false), (4, true), (6, true), (7, false), (8, true), (10, true), (11, false)]);
}

/// A segment after a reduction tells the peer about the reduction, as in RFC 3168, and later segments do not (RFC 8257, section 3.3).
#[test]
fn the_segment_after_a_reduction_has_cwr() {
    let (mut a, mut b, data) = pair();
    for (place, segment) in data.iter().enumerate() {
        let segment = Segment { ecn: if place == 0 { Ecn::Congestion } else { Ecn::Capable1 }, ..segment.clone() };
        b.handle_segment(millis(50), &segment);
        while let Some(answer) = b.poll_transmit(millis(50)) {
            a.handle_segment(millis(60), &answer);
        }
    }
    // An acknowledgement without data tells nothing (RFC 3168, section 6.1.5).
    b.write(&[7; 1448 * 2]).unwrap();
    while let Some(data) = b.poll_transmit(millis(60)) {
        a.handle_segment(millis(65), &data);
    }
    let answers: Vec<_> =
        std::iter::from_fn(|| a.poll_transmit(millis(65))).map(|answer| (answer.payload.len(), answer.flags.has(Flags::CWR))).collect();
    assert_eq!(answers, [(0, false)]);
    a.write(&[7; 1448 * 3]).unwrap();
    let told: Vec<bool> = std::iter::from_fn(|| a.poll_transmit(millis(70))).map(|segment| segment.flags.has(Flags::CWR)).collect();
    assert_eq!(told, [true, false, false]);
}

/// A SYN that does not ask for ECN has no codepoint either, because a middlebox may have dropped the first SYN for its codepoint.
#[test]
fn a_syn_without_ecn_has_no_codepoint() {
    let world = World::new("delay 10ms", 1).config(&dctcp()).programs(Program::default(), Program::writes(10_000)).logged();
    let mut world = world.dropping(|side, segment| side == 0 && segment.flags.has(Flags::SYN | Flags::ECE)).connect();
    world.run_until(millis(5_000));
    let syns = world.log.iter().flatten().map(|left| &left.segment).filter(|syn| syn.flags.has(Flags::SYN) && !syn.flags.has(Flags::ACK));
    let seen: Vec<(bool, Ecn)> = syns.map(|syn| (syn.flags.has(Flags::ECE), syn.ecn)).collect();
    assert_eq!(seen, [(true, Ecn::Capable1), (false, Ecn::NotCapable)]);
    assert_eq!(world.programs[0].read, 10_000);
}

/// W·p/2 segments less in each round, and 1 − p more: 2·(1 − p)/p. Where every n-th segment is marked, the share is 1/n.
#[test]
fn the_window_settles_at_two_marks_a_round() {
    for (every, round_trip) in [(20, 0.1), (50, 0.05)] {
        let words = if every == 20 { "delay 50ms" } else { "delay 25ms" };
        let mut world = World::new(words, 1).config(&TcpConfig { receive_buffer: Some(1 << 24), ..dctcp() });
        (world.is_encoded, world.is_checked) = (false, false);
        let mut count = 0;
        world.marks = Box::new(move |side, segment| {
            count += u64::from(side == 1 && !segment.payload.is_empty());
            side == 1 && !segment.payload.is_empty() && count.is_multiple_of(every)
        });
        let mut world = world.programs(Program::default(), Program::writes(u64::MAX)).connect();
        world.run_until(millis(30_000));
        let (from, read) = (world.now, world.programs[0].read);
        world.run_until(millis(90_000));
        let rounds = (world.now - from).as_secs_f64() / round_trip;
        let window = (world.programs[0].read - read) as f64 / 1448.0 / rounds;
        let share = 1.0 / every as f64;
        let expected = 2.0 * (1.0 - share) / share;
        assert!((0.9..1.1).contains(&(window / expected)), "every {every}: {window}, expected {expected}");
        let info = world.ends[1].as_ref().unwrap().info();
        assert_eq!((info.retransmissions, info.recoveries), (0, 0));
    }
}

/// A loss halves the window as with Reno, whatever the share of marks.
#[test]
fn a_loss_halves_the_window() {
    let mut count = 0;
    // The rate spreads the acknowledgements, so that the window grows by at most two segments in a step.
    let world = World::new("delay 20ms rate 40mbit", 1).config(&dctcp()).programs(Program::default(), Program::writes(3_000_000));
    let mut world = world.dropping(move |side, segment| {
        count += u64::from(side == 1 && !segment.payload.is_empty());
        side == 1 && !segment.payload.is_empty() && count == 600
    });
    world = world.connect();
    let (mut before, mut after) = (0, None);
    while after.is_none() {
        assert!(world.step());
        let Some(info) = world.ends[1].as_ref().map(Connection::info) else { continue };
        if info.recoveries == 0 {
            before = info.congestion_window;
        } else {
            after = Some(info.slow_start_threshold);
        }
    }
    assert_eq!(after, Some(before / 2));
}
