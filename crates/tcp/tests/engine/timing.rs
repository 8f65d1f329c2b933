//! Runs over links without randomness, whose instants follow from the delays and timers exactly.

use std::time::Duration;

use cohaptic_tcp::{Error, Flags, TcpConfig};
use cohaptic_units::Instant;

use crate::world::{Program, World, millis};

#[test]
fn connect_takes_a_round_trip_and_accept_half_of_one_more() {
    let mut world = World::new("delay 1234567ns", 1).connect();
    world.run_until(millis(100));
    let at = world.programs.map(|program| program.connected_at.unwrap().as_nanos());
    assert_eq!(at, [2_469_134, 3_703_701]);
}

#[test]
fn a_syn_that_is_lost_n_times_costs_n_seconds_and_doubles_from_the_sixth_time_on() {
    for (lost, seconds) in (0..=8u32).zip([0, 1, 2, 3, 4, 5, 7, 11, 19]) {
        let mut left = lost;
        let mut world = World::new("delay 10ms", 1).dropping(move |side, segment| {
            let is_lost = side == 0 && segment.flags.has(Flags::SYN) && left > 0;
            left -= u32::from(is_lost);
            is_lost
        });
        world = world.connect();
        world.run_until(millis(200_000));
        let expected = Duration::from_secs(seconds) + Duration::from_millis(20);
        assert_eq!(world.programs[0].connected_at, Some(Instant::ZERO + expected), "{lost} lost");
    }
}

#[test]
fn a_host_that_is_down_is_given_up_after_131_seconds() {
    let mut world = World::new("delay 10ms", 1).logged().dropping(|_, _| true).connect();
    world.run_until(millis(300_000));
    assert_eq!(world.left(0, |_| true), [0, 1, 2, 3, 4, 5, 7, 11, 19, 35, 67].map(|second| millis(second * 1000)));
    assert_eq!(world.programs[0].error, Some((millis(131_000), Error::TimedOut)));
}

/// Measured on Linux 6.18 with four repetitions at equal distance. Without them, the schedule is that of Linux before 6.5.
#[test]
fn a_syn_is_given_up_when_its_repetitions_or_their_time_are_spent() {
    for (syn_retries, linear_syn_retries, end) in [(1, 4, 3), (2, 4, 7), (4, 4, 35), (6, 4, 131), (6, 0, 127), (0, 0, 1)] {
        let config = TcpConfig { syn_retries, linear_syn_retries, ..TcpConfig::default() };
        let mut world = World::new("delay 10ms", 1).config(&config).dropping(|_, _| true).connect();
        world.run_until(millis(300_000));
        assert_eq!(world.programs[0].error, Some((millis(end * 1000), Error::TimedOut)), "{syn_retries}, {linear_syn_retries}");
    }
    // A long user timeout does not add repetitions.
    let config = TcpConfig { user_timeout: Some(Duration::from_secs(1000)), ..TcpConfig::default() };
    let mut world = World::new("delay 10ms", 1).config(&config).dropping(|_, _| true).connect();
    world.run_until(millis(1_100_000));
    assert_eq!(world.programs[0].error, Some((millis(131_000), Error::TimedOut)));
    let config = TcpConfig { user_timeout: Some(Duration::from_millis(2500)), ..TcpConfig::default() };
    let mut world = World::new("delay 10ms", 1).config(&config).logged().dropping(|_, _| true).connect();
    world.run_until(millis(300_000));
    assert_eq!(world.programs[0].error, Some((millis(2500), Error::TimedOut)));
    assert_eq!(world.left(0, |_| true), [0, 1000, 2000].map(millis));
}

#[test]
fn no_listener_refuses_after_a_round_trip() {
    let mut world = World::new("delay 10ms", 1);
    world.is_listening = false;
    let mut world = world.connect();
    world.run_until(millis(5000));
    assert_eq!(world.programs[0].error, Some((millis(20), Error::ConnectionRefused)));
}

/// N octets take R·(1 + ⌈log₂(N/(10·MSS) + 1)⌉ over a link without a rate limit: one round trip R for the handshake, and one for each window, of which each is
/// twice the window before.
#[test]
fn slow_start_doubles_every_round_trip() {
    for octets in [1, 10 * 1448, 10 * 1448 + 1, 30 * 1448, 30 * 1448 + 1, 100_000, 1_000_000] {
        let mut world = World::new("delay 100ms", 1).programs(Program::default(), Program::writes(octets)).connect();
        world.run_to_the_last_octet(Duration::from_secs(60));
        let round_trips = 1 + (octets as f64 / 14_480.0 + 1.0).log2().ceil() as u64;
        assert_eq!(world.programs[0].last_read_at, Some(millis(200 * round_trips)), "{octets}");
    }
}

#[test]
fn the_first_row_takes_exactly_800_milliseconds() {
    let mut world = World::new("delay 100ms", 1).programs(Program::default(), Program::writes(100_000)).connect();
    world.run_to_the_last_octet(Duration::from_secs(60));
    assert_eq!(world.programs[0].last_read_at, Some(millis(800)));
}

#[test]
fn data_that_nobody_answers_is_repeated_as_linux_does() {
    let mut world = World::new("delay 50ms", 1).logged().connect();
    world.run_until(millis(1000));
    world.drops = Box::new(|_, _| true);
    world.programs[0].to_write = 1;
    world.flush();
    world.run_until(millis(1_200_000));
    let sent: Vec<_> = world.left(0, |segment| !segment.payload.is_empty()).iter().map(|at| at.as_nanos() / 1_000_000 - 1000).collect();
    assert_eq!(sent[..6], [0, 300, 600, 1200, 2400, 4800]);
    assert_eq!(*sent.last().unwrap(), 873_600);
    assert_eq!(world.programs[0].error, Some((millis(994_600), Error::TimedOut)));
}

#[test]
fn a_user_timeout_ends_it_earlier() {
    let config = TcpConfig { user_timeout: Some(Duration::from_secs(10)), ..TcpConfig::default() };
    let mut world = World::new("delay 50ms", 1).config(&config).connect();
    world.run_until(millis(1000));
    world.drops = Box::new(|_, _| true);
    world.programs[0].to_write = 1;
    world.flush();
    world.run_until(millis(1_200_000));
    // The first timeout was 600 ms after the data.
    assert_eq!(world.programs[0].error, Some((millis(11_600), Error::TimedOut)));
}

#[test]
fn a_closed_window_is_probed_less_and_less_often() {
    let config = TcpConfig { receive_buffer: Some(10_000), ..TcpConfig::default() };
    let mut world =
        World::new("delay 50ms", 1).config(&config).programs(Program::writes(1_000_000), Program::default().but_does_not_read()).logged().connect();
    world.run_until(millis(3_600_000));
    assert_eq!(world.programs[0].error, None, "a window that is closed but answered is no failure");
    let probes = world.left(0, |segment| segment.payload.is_empty() && !segment.flags.has(Flags::SYN));
    let probes = &probes[1..];
    // Each answer, a round trip after the probe, sets the timer anew.
    let gaps: Vec<_> = probes.windows(2).map(|pair| (pair[1] - pair[0]).as_millis()).collect();
    assert_eq!(gaps[..10], [700, 1300, 2500, 4900, 9700, 19_300, 38_500, 76_900, 120_100, 120_100]);
    // It opens: the next probe finds it, and the reader's own word comes before.
    world.programs[1].reads = true;
    world.flush();
    world.run_to_the_last_octet(Duration::from_secs(60));
    assert_eq!(world.programs[1].read, 1_000_000);
}

#[test]
fn keepalive_finds_a_peer_that_is_gone() {
    let config = TcpConfig { keepalive: Some(cohaptic_tcp::Keepalive::default()), ..TcpConfig::default() };
    let mut world = World::new("delay 50ms", 1).config(&config).logged().connect();
    world.run_until(millis(1000));
    world.drops = Box::new(|_, _| true);
    world.run_until(millis(10_000_000));
    // The server heard the client last at 150 ms, the client the server at 100 ms.
    assert_eq!(world.programs[0].error, Some((millis(100 + (7200 + 9 * 75) * 1000), Error::TimedOut)));
    let probes = world.left(0, |segment| segment.flags == Flags::ACK).len();
    assert_eq!(probes, 1 + 9);
}
