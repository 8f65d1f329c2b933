//! Buffers and windows that grow, beside those of Linux 6.18.

use std::time::Duration;

use cohaptic_tcp::{State, TcpConfig};

use crate::world::{Program, World, millis};

/// Measured on Linux 6.18 over a TUN device with a round trip of 100 ms: the peer holds 82,736 octets, and the writer is rid of 421,440.
#[test]
fn a_peer_that_does_not_read_takes_what_linux_takes() {
    let mut world = World::new("delay 50ms", 1).programs(Program::default().but_does_not_read(), Program::writes(10_000_000)).connect();
    world.run_until(millis(30_000));
    let (unread, written) = (world.ends[0].as_ref().unwrap().info().unread, world.programs[1].written);
    assert!((81_000..=84_300).contains(&unread), "the peer holds {unread}");
    assert!((330_000..=480_000).contains(&written), "the writer is rid of {written}");
    assert!(world.ends[1].as_ref().unwrap().is_held_by_window());
    // The program reads at last: everything goes on.
    world.programs[0].reads = true;
    world.flush();
    world.run_to_the_last_octet(Duration::from_secs(30));
}

/// A fixed buffer is offered as it is, rounded up to whole units of the window scale.
#[test]
fn a_buffer_that_is_set_stays() {
    let config = TcpConfig { receive_buffer: Some(1_000_000), ..TcpConfig::default() };
    let mut world =
        World::new("delay 50ms", 1).config(&config).programs(Program::default().but_does_not_read(), Program::writes(10_000_000)).connect();
    world.run_until(millis(30_000));
    let unread = world.ends[0].as_ref().unwrap().info().unread;
    assert!((930_000..=1_000_128).contains(&unread), "{unread}");
}

/// A program that reads at once is never what limits the transfer: the buffer grows ahead of slow start, as far as its upper bound.
#[test]
fn a_buffer_grows_as_the_program_reads() {
    let seconds = |config: TcpConfig| {
        let mut world = World::new("delay 50ms", 1).config(&config).programs(Program::default(), Program::writes(20_000_000)).connect();
        (world.is_encoded, world.is_checked) = (false, false);
        world.run_to_the_last_octet(Duration::from_secs(60));
        world.programs[0].last_read_at.unwrap().as_secs_f64()
    };
    let [grows, unstamped, fixed, small] = [
        TcpConfig::default(),
        // Without timestamps, the receiver measures the round trip by its own window.
        TcpConfig { timestamps: false, ..TcpConfig::default() },
        TcpConfig { receive_buffer: Some(6 << 20), ..TcpConfig::default() },
        TcpConfig { greatest_receive_buffer: 128 << 10, ..TcpConfig::default() },
    ]
    .map(seconds);
    assert!(grows < 1.3 * fixed && unstamped < 1.3 * fixed, "{grows} s and {unstamped} s beside {fixed} s");
    assert!(small > 10.0, "a window of 80,000 octets a round trip brings 20 MB in 25 s, and not in {small} s");
}

/// Small segments take the memory of larger ones. They do not open the window: of 150,000 octets, about what the first window allows arrives.
#[test]
fn small_segments_do_not_open_the_window() {
    let config = TcpConfig { nodelay: true, ..TcpConfig::default() };
    let mut world = World::new("delay 1ms", 1).config(&config).programs(Program::default(), Program::default().but_does_not_read()).connect();
    world.run_until(millis(100));
    for _ in 0..1000 {
        world.programs[0].to_write += 150;
        world.flush();
        world.run_until(world.now + Duration::from_millis(3));
    }
    let unread = world.ends[1].as_ref().unwrap().info().unread;
    assert_eq!(world.ends[1].as_ref().unwrap().state(), State::Established);
    assert!((60_000..70_000).contains(&unread), "{unread}");
}
