//! Situations in which other implementations have failed.

use std::time::Duration;

use cohaptic_tcp::{Connection, Ecn, EcnFallback, Error, Flags, Options, Segment, State, TcpConfig};
use cohaptic_units::Instant;

use crate::world::{Program, World, millis, octet};

/// Returns a connection that was established and has been idle since, at 1 s.
fn pair(words: &str) -> World {
    let mut world = World::new(words, 1).logged().connect();
    world.run_until(millis(1000));
    world
}

/// Returns a segment in the client's name that the client did not send. Its sequence number is by `ahead` larger than the number that the server expects.
fn forged(world: &World, flags: Flags, ahead: u32, payload: &'static [u8]) -> Segment<'static> {
    let last = world.log.iter().flatten().rfind(|left| left.from == 1).unwrap();
    Segment {
        source: last.segment.destination,
        destination: last.segment.source,
        sequence: last.segment.acknowledgement.wrapping_add(ahead),
        acknowledgement: last.segment.sequence.wrapping_add(u32::try_from(last.segment.sequence_length()).unwrap()),
        flags,
        window: 1000,
        options: Options::default(),
        ecn: Default::default(),
        ttl: 64,
        payload: payload.into(),
    }
}

impl World {
    fn inject(&mut self, side: usize, segment: &Segment<'_>) {
        self.ends[side].as_mut().unwrap().handle_segment(self.now, segment);
        self.flush();
    }
    fn at(&self, side: usize) -> &Connection {
        self.ends[side].as_ref().unwrap()
    }
}

#[test]
fn data_after_a_fin_is_dropped() {
    let mut world = pair("delay 10ms");
    world.programs[0].shuts = true;
    world.flush();
    world.run_until(millis(1100));
    assert_eq!(world.at(1).state(), State::CloseWait);
    let more = forged(&world, Flags::ACK, 0, b"more");
    world.inject(1, &more);
    assert_eq!((world.at(1).info().unread, world.programs[1].read, world.at(1).state()), (0, 0, State::CloseWait));
}

#[test]
fn a_fin_that_overtakes_data_waits_for_it() {
    let mut world = pair("delay 10ms");
    let fin = forged(&world, Flags::ACK | Flags::FIN, 3, b"");
    world.inject(1, &fin);
    assert_eq!(world.at(1).state(), State::Established);
    let data = Segment { payload: (0..3).map(octet).collect::<Vec<u8>>().into(), ..forged(&world, Flags::ACK, 0, b"") };
    world.inject(1, &data);
    assert_eq!((world.at(1).state(), world.programs[1].read, world.programs[1].end_at), (State::CloseWait, 3, Some(world.now)));
}

#[test]
fn a_reset_one_off_is_challenged_and_an_exact_one_counts() {
    let mut world = pair("delay 10ms");
    let before = world.log.as_ref().unwrap().len();
    let off = forged(&world, Flags::RST, 1, b"");
    world.inject(1, &off);
    assert_eq!(world.at(1).state(), State::Established);
    let answer = &world.log.as_ref().unwrap()[before..];
    assert!(answer.len() == 1 && answer[0].segment.flags == Flags::ACK, "{answer:?}");
    let exact = forged(&world, Flags::RST, 0, b"");
    world.inject(1, &exact);
    assert_eq!(world.programs[1].error, Some((world.now, Error::ConnectionReset)));
}

#[test]
fn a_syn_in_an_open_connection_is_challenged() {
    let mut world = pair("delay 10ms");
    let syn = forged(&world, Flags::SYN, 5000, b"");
    world.inject(1, &syn);
    assert_eq!((world.at(1).state(), world.log.as_ref().unwrap().last().unwrap().segment.flags), (State::Established, Flags::ACK));
}

#[test]
fn an_acknowledgement_of_what_was_never_sent_counts_for_nothing() {
    let mut world = pair("delay 10ms");
    let mut far = forged(&world, Flags::ACK, 0, b"data");
    far.acknowledgement = far.acknowledgement.wrapping_add(1);
    world.inject(1, &far);
    assert_eq!((world.at(1).state(), world.at(1).info().unread, world.programs[1].read), (State::Established, 0, 0));
}

#[test]
fn a_restarted_host_resets_a_round_trip_after_the_write() {
    let mut world = pair("delay 10ms");
    (world.ends[1], world.is_listening) = (None, false);
    world.programs[0].to_write = 10;
    world.flush();
    world.run_until(millis(60_000));
    assert_eq!(world.programs[0].error, Some((millis(1020), Error::ConnectionReset)));
}

#[test]
fn a_client_that_comes_back_from_the_same_port_gets_through() {
    let mut world = pair("delay 10ms");
    world.ends[0] = None;
    world.programs[0].connected_at = None;
    world.configs[0].initial_sequence = Some(500_000_000);
    let mut world = world.connect();
    world.run_until(millis(60_000));
    // SYN, challenge, RST: the old connection is gone, and the SYN that follows the RST by two ticks finds the listener.
    assert_eq!(world.left(1, |segment| segment.flags == Flags::ACK), [millis(1010)]);
    assert_eq!(world.left(0, |segment| segment.flags == Flags::RST), [millis(1020)]);
    assert_eq!(world.programs[1].error, Some((millis(1030), Error::ConnectionReset)));
    assert_eq!(
        (world.programs[0].connected_at, world.at(0).state(), world.at(1).state()),
        (Some(millis(1042)), State::Established, State::Established)
    );
}

#[test]
fn both_open_at_once() {
    let mut world = World::new("delay 10ms", 1).logged();
    let (a, b) = ("10.0.0.1:5000".parse().unwrap(), "10.0.0.2:5000".parse().unwrap());
    world.ends = [
        Some(Connection::connect(world.now, TcpConfig::default(), a, b, 7).unwrap()),
        Some(Connection::connect(world.now, TcpConfig::default(), b, a, 1_000_000).unwrap()),
    ];
    world = world.programs(Program::writes(50_000), Program::writes(70_000));
    world.flush();
    world.run_to_the_last_octet(Duration::from_secs(10));
    assert_eq!(world.programs.each_ref().map(|program| program.connected_at), [Some(millis(20)); 2]);
    assert_eq!(world.ends.each_ref().map(|end| end.as_ref().unwrap().state()), [State::Established; 2]);
}

#[test]
fn sequence_numbers_wrap() {
    let config = TcpConfig { initial_sequence: Some(u32::MAX - 999), ..TcpConfig::default() };
    for words in ["delay 10ms", "delay 10ms 5ms loss 3%"] {
        let mut world = World::new(words, 1).config(&config).programs(Program::writes(500_000), Program::writes(500_000)).connect();
        world.run_to_the_last_octet(Duration::from_secs(600));
    }
}

#[test]
fn nagle_holds_small_segments_for_a_round_trip() {
    let mut world = pair("delay 10ms");
    let from = world.log.as_ref().unwrap().len();
    for _ in 0..20 {
        world.programs[0].to_write += 1;
        world.flush();
    }
    world.run_until(millis(2000));
    let sizes: Vec<_> =
        world.log.as_ref().unwrap()[from..].iter().filter(|left| left.from == 0).map(|left| (left.at, left.segment.payload.len())).collect();
    assert_eq!(sizes, [(millis(1000), 1), (millis(1020), 19)]);
}

#[test]
fn without_nagle_small_segments_leave_at_once() {
    let config = TcpConfig { nodelay: true, ..TcpConfig::default() };
    let mut world = World::new("delay 10ms", 1).config(&config).logged().connect();
    world.run_until(millis(1000));
    for _ in 0..10 {
        world.programs[0].to_write += 1;
        world.flush();
    }
    assert_eq!(world.left(0, |segment| segment.payload.len() == 1), [millis(1000); 10]);
}

#[test]
fn a_slow_reader_holds_the_writer_back() {
    let config = TcpConfig { receive_buffer: Some(30_000), send_buffer: 40_000, least_send_buffer: 40_000, ..TcpConfig::default() };
    let mut world =
        World::new("delay 10ms", 1).config(&config).programs(Program::writes(1_000_000), Program::default().but_does_not_read()).connect();
    let mut read = 0;
    for tenth in 1..=400u64 {
        world.run_until(millis(100 * tenth));
        let mut chunk = [0; 3000];
        if let Ok(count) = world.ends[1].as_mut().unwrap().read(&mut chunk) {
            assert!(chunk[..count].iter().zip(read..).all(|(seen, at)| *seen == octet(at)));
            read += count as u64;
        }
        world.flush();
        assert!(world.programs[0].written <= read + 70_000 + 128, "{} written, {read} read", world.programs[0].written);
    }
    assert!(read >= 390 * 3000 || read == 1_000_000, "only {read} octets were read");
}

#[test]
fn two_ends_that_do_not_read_are_stuck_and_go_on_when_they_do() {
    let config = TcpConfig { receive_buffer: Some(20_000), ..TcpConfig::default() };
    let programs = || Program::writes(500_000).but_does_not_read();
    let mut world = World::new("delay 10ms", 1).config(&config).programs(programs(), programs()).connect();
    world.run_until(millis(600_000));
    for side in 0..2 {
        let info = world.at(side).info();
        assert!(info.window_probes > 3 && info.send_window == 0 && world.at(side).is_held_by_window(), "{info:?}");
    }
    world.programs.iter_mut().for_each(|program| program.reads = true);
    world.flush();
    let at = world.now;
    world.run_to_the_last_octet(Duration::from_secs(60));
    assert!(world.now - at < Duration::from_secs(3), "it took {:?}", world.now - at);
    assert!(world.ends.iter().flatten().all(|end| !end.is_held_by_window()));
}

#[test]
fn a_reset_lets_what_arrived_be_read_and_is_told_once() {
    let mut world = pair("delay 10ms");
    world.programs[1].reads = false;
    world.programs[0].to_write = 100;
    world.flush();
    world.run_until(millis(1100));
    world.ends[0].as_mut().unwrap().abort();
    world.flush();
    world.run_until(millis(1200));
    let end = world.ends[1].as_mut().unwrap();
    let mut chunk = [0; 1000];
    assert!(end.is_readable() && end.is_writable());
    assert_eq!((end.peek(&mut chunk), end.read(&mut chunk)), (Ok(100), Ok(100)));
    assert_eq!((end.read(&mut chunk), end.read(&mut chunk), end.write(b"x")), (Err(Error::ConnectionReset), Ok(0), Err(Error::BrokenPipe)));
    assert_eq!(end.take_error(), None);
}

#[test]
fn a_reset_after_the_end_of_data_breaks_the_pipe_alone() {
    let mut world = pair("delay 10ms");
    world.programs[0].shuts = true;
    world.flush();
    world.run_until(millis(1100));
    let reset = forged(&world, Flags::RST, 0, b"");
    world.inject(1, &reset);
    let end = world.ends[1].as_mut().unwrap();
    assert_eq!((end.read(&mut [0; 8]), end.write(b"x"), end.write(b"x")), (Ok(0), Err(Error::BrokenPipe), Err(Error::BrokenPipe)));
}

#[test]
fn one_half_is_shut_and_the_other_goes_on() {
    let mut world = World::new("delay 10ms", 1).programs(Program::writes(5000).and_shuts(), Program::writes(300_000)).connect();
    world.run_to_the_last_octet(Duration::from_secs(10));
    assert_eq!(world.programs[1].end_at, Some(millis(30)));
    assert_eq!((world.at(0).state(), world.at(1).state()), (State::FinWait2, State::CloseWait));
    assert_eq!(world.ends[0].as_mut().unwrap().write(b"x"), Err(Error::BrokenPipe));
    world.programs[1].shuts = true;
    world.flush();
    world.run_until(world.now + Duration::from_secs(1));
    assert_eq!((world.at(0).state(), world.at(1).state()), (State::TimeWait, State::Closed));
    world.run_until(world.now + Duration::from_secs(61));
    assert_eq!(world.at(0).state(), State::Closed);
}

#[test]
fn a_lost_last_acknowledgement_is_given_again_in_time_wait() {
    let mut left = 0;
    let mut world = World::new("delay 10ms", 1).programs(Program::default().and_shuts(), Program::default()).logged();
    world = world
        .dropping(move |side, segment| {
            // The client's acknowledgement of the server's FIN, the first two times.
            let is_it = side == 0 && segment.flags == Flags::ACK && segment.acknowledgement == 99_002 && left < 2;
            left += u32::from(is_it);
            is_it
        })
        .connect();
    world.run_until(millis(100));
    world.programs[1].shuts = true;
    world.flush();
    world.run_until(millis(5000));
    assert_eq!((world.at(0).state(), world.at(1).state()), (State::TimeWait, State::Closed));
    let syn = Segment { flags: Flags::SYN, sequence: 500_000, ..forged(&world, Flags::SYN, 0, b"") };
    assert!(world.at(0).gives_way_to(&syn));
    assert!(!world.at(0).gives_way_to(&Segment { flags: Flags::ACK, ..syn }));
}

#[test]
fn a_dropped_stream_sends_on_and_resets_later_data() {
    let mut world = World::new("delay 10ms", 1).programs(Program::writes(60_000), Program::default()).connect();
    while world.programs[0].written < 60_000 {
        world.step();
    }
    let now = world.now;
    world.ends[0].as_mut().unwrap().close(now);
    world.flush();
    world.run_to_the_last_octet(Duration::from_secs(10));
    world.run_until(world.now + Duration::from_secs(1));
    assert_eq!((world.at(0).state(), world.at(1).state(), world.programs[1].error), (State::FinWait2, State::CloseWait, None));
    world.programs[1].to_write = 10;
    let written = world.now;
    world.flush();
    world.run_until(world.now + Duration::from_secs(1));
    assert_eq!(world.at(0).state(), State::Closed);
    assert_eq!(world.ends[1].as_mut().unwrap().write(b"x"), Err(Error::BrokenPipe));
    assert!(world.at(1).state() == State::Closed && world.now > written);
}

#[test]
fn a_dropped_stream_with_unread_data_resets() {
    let mut world = World::new("delay 10ms", 1).programs(Program::writes(100), Program::default().but_does_not_read()).connect();
    world.run_until(millis(1000));
    world.ends[1].as_mut().unwrap().close(millis(1000));
    world.flush();
    world.run_until(millis(2000));
    assert_eq!(world.programs[0].error, Some((millis(1010), Error::ConnectionReset)));
}

#[test]
fn a_dropped_stream_whose_peer_never_ends_is_forgotten_after_60_seconds() {
    let mut world = pair("delay 10ms");
    world.ends[0].as_mut().unwrap().close(millis(1000));
    world.flush();
    world.run_until(millis(61_000));
    assert_eq!(world.at(0).state(), State::FinWait2);
    world.run_until(millis(62_000));
    assert_eq!((world.at(0).state(), world.at(1).state()), (State::Closed, State::CloseWait));
}

#[test]
fn whoever_only_reads_waits_for_ever_when_the_host_crashes() {
    let mut world = pair("delay 10ms");
    world.drops = Box::new(|_, _| true);
    assert!(!world.step(), "an idle connection has no timer: {world:?}");
    assert_eq!(world.at(0).state(), State::Established);
}

#[test]
fn an_acknowledgement_waits_40_milliseconds_when_quick_ones_are_used_up() {
    // With a fixed buffer, because the acknowledgement that offers a larger window leaves at once.
    let config = TcpConfig { quick_acks: 0, receive_buffer: Some(1 << 20), ..TcpConfig::default() };
    let mut world = World::new("delay 10ms", 1).config(&config).programs(Program::writes(1448), Program::default()).logged().connect();
    world.run_until(millis(1000));
    assert_eq!(*world.left(1, |segment| segment.flags == Flags::ACK).last().unwrap(), millis(30 + 40));
}

/// An end that has sent and received 100,000 octets with some losses, and is idle now, keeps little memory.
#[test]
fn an_idle_connection_is_small() {
    let mut kept = None;
    let before = allocation_counter::measure(|| {
        let mut world = World::new("delay 10ms loss 2%", 3).programs(Program::writes(100_000), Program::writes(100_000)).connect();
        world.run_to_the_last_octet(Duration::from_secs(60));
        world.run_until(world.now + Duration::from_secs(60));
        kept = Some(world.ends.map(Box::new));
    });
    let bytes = u64::try_from(before.bytes_current).unwrap();
    assert!(kept.is_some() && bytes <= 2 * 4096, "{bytes} bytes for both ends, {} of them in the structure", 2 * size_of::<Connection>());
}

#[test]
fn segments_fit_the_mtu_of_both_versions() {
    let (from, to) = ("[fd00::1]:5".parse().unwrap(), "[fd00::2]:6".parse().unwrap());
    let mut a = Connection::connect(Instant::ZERO, TcpConfig::default(), from, to, 1).unwrap();
    let syn = a.poll_transmit(Instant::ZERO).unwrap();
    let mut b = Connection::accept(Instant::ZERO, TcpConfig::default(), &syn, 1).unwrap();
    a.handle_segment(Instant::ZERO, &b.poll_transmit(Instant::ZERO).unwrap());
    assert_eq!((syn.options.mss, a.info().segment_size), (Some(1440), 1428));
    assert_eq!(a.write(&[0; 5000]), Ok(5000));
    let lengths: Vec<_> = core::iter::from_fn(|| a.poll_transmit(Instant::ZERO)).map(|segment| segment.to_packet().len()).collect();
    assert_eq!(lengths, [1500, 1500, 1500, 788]);
}

/// Returns the configuration of an end that asks for ECN with the given fallback.
fn asks(fallback: EcnFallback) -> TcpConfig {
    TcpConfig { ecn: true, ecn_fallback: fallback, ..TcpConfig::default() }
}

const ASKS: [u8; 2] = [Flags::SYN.bits() | Flags::ECE.bits() | Flags::CWR.bits(), Flags::SYN.bits()];

/// Returns the instant of sending and the flags of each SYN of the client.
fn syns(world: &World) -> Vec<(Instant, u8)> {
    let left = world.log.iter().flatten().filter(|left| left.from == 0 && left.segment.flags.has(Flags::SYN));
    left.map(|left| (left.at, left.segment.flags.bits())).collect()
}

/// Returns whether the server has sent a segment marked as ECN-capable.
fn is_capable(world: &World) -> bool {
    world.log.iter().flatten().any(|left| left.from == 1 && left.segment.ecn == Ecn::Capable0)
}

#[test]
fn behind_a_box_that_drops_syns_with_ecn_the_second_syn_gets_through_without() {
    let [with, without] = ASKS;
    let connect = |fallback| {
        let world = World::new("delay 10ms", 1).config(&asks(fallback)).programs(Program::default(), Program::writes(10_000)).logged();
        let mut world = world.dropping(move |side, segment| side == 0 && segment.flags.bits() == with).connect();
        world.run_until(millis(200_000));
        world
    };
    for fallback in [EcnFallback::Lost, EcnFallback::LostOrReset] {
        let world = connect(fallback);
        assert_eq!(syns(&world), [(Instant::ZERO, with), (millis(1000), without)]);
        assert_eq!((world.programs[0].connected_at, world.programs[0].read), (Some(millis(1020)), 10_000));
        assert!(!is_capable(&world));
    }
    let world = connect(EcnFallback::Never);
    assert_eq!((syns(&world).len(), syns(&world).iter().all(|(_, flags)| *flags == with)), (11, true));
    assert_eq!(world.programs[0].error, Some((millis(131_000), Error::TimedOut)));
}

/// As in Linux, an answer that grants ECN counts even if the client has sent a SYN without ECN in the meantime.
#[test]
fn an_answer_that_grants_ecn_after_the_second_syn_counts() {
    let mut answers = 0;
    let world = World::new("delay 10ms", 1).config(&asks(EcnFallback::Lost)).programs(Program::default(), Program::writes(10_000)).logged();
    let mut world = world.dropping(move |side, segment| {
        answers += u32::from(side == 1 && segment.flags.has(Flags::SYN));
        side == 1 && segment.flags.has(Flags::SYN) && answers == 1
    });
    world = world.connect();
    world.run_until(millis(5000));
    assert_eq!(syns(&world), [(Instant::ZERO, ASKS[0]), (millis(1000), ASKS[1])]);
    assert_eq!(world.programs[0].read, 10_000);
    assert!(is_capable(&world));
}

#[test]
fn a_reset_in_answer_to_a_syn_with_ecn_is_final_as_in_linux_or_not_as_rfc_3168_says() {
    let (us, them) = ("10.0.0.1:1".parse().unwrap(), "10.0.0.2:2".parse().unwrap());
    let (now, later) = (millis(0), millis(20));
    for fallback in [EcnFallback::Never, EcnFallback::Lost, EcnFallback::LostOrReset] {
        let mut end = Connection::connect(now, asks(fallback), us, them, 7).unwrap();
        let syn = end.poll_transmit(now).unwrap();
        end.handle_segment(later, &syn.refusal(64).unwrap());
        if fallback == EcnFallback::LostOrReset {
            let again = end.poll_transmit(later).unwrap();
            assert_eq!((again.flags, again.sequence, end.poll_timeout()), (Flags::SYN, syn.sequence, Some(millis(1020))));
            assert_eq!((end.take_error(), end.poll_transmit(later)), (None, None));
            // That one is refused too: nobody listens.
            end.handle_segment(millis(40), &again.refusal(64).unwrap());
        }
        assert_eq!((end.take_error(), end.state(), end.poll_transmit(later)), (Some(Error::ConnectionRefused), State::Closed, None));
    }
}
