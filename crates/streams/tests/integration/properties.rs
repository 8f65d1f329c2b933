//! Properties over drawn traffic: order, completeness, the laws of delay and rate, and the bounds of memory.

use cohaptic_tests_common::properties;
use proptest::collection::vec;
use proptest::prelude::*;

use super::*;

/// Reads of one connection: the wait before each \[µs\], and the number of bytes.
fn reads() -> impl Strategy<Value = Vec<(u64, usize)>> {
    vec((0_u64..4000, 1_usize..5000), 1..40)
}

/// Content that tells each byte's place.
fn content(from: usize, count: usize) -> Vec<u8> {
    (from..from + count).map(|place| (place % 251) as u8).collect()
}

properties! {
    /// With a constant delay and a rate the arrival of each byte follows from D(n) = max(a(n), D(n−1)) + S, in whole nanoseconds.
    #[test]
    fn every_byte_arrives_in_order_at_the_instant_of_the_law(reads in reads(), delay in 0_u64..30_000_000, bits in 500_000_u64..1_000_000_000) {
        let mut driver = Driver::new(config(&format!("delay={delay}ns rate={bits}bit buffer=100MB"), ""));
        let connection = driver.engine.open(at(0), 0);
        let rate = cohaptic_units::Rate::bits_per_sec(bits).unwrap();
        let (mut now, mut place, mut free) = (Instant::ZERO, 0, Instant::ZERO);
        let mut expected: Vec<(Instant, usize)> = Vec::new();
        for (wait, count) in reads {
            now += Duration::from_micros(wait);
            driver.run(now);
            let bytes = content(place, count);
            driver.engine.handle_bytes(now, connection, Side::Client, &bytes);
            for piece in bytes.chunks(cohaptic_streams::PIECE) {
                free = free.max(now) + rate.serialisation_time(Bytes::new(piece.len() as u64));
                place += piece.len();
                expected.push((free + Duration::from_nanos(delay), place));
            }
        }
        driver.engine.handle_end(now, connection, Side::Client);
        driver.run(free + Duration::from_secs(1));
        prop_assert_eq!(driver.bytes(connection, Side::Server), content(0, place));
        // At each instant of the law exactly the bytes of the pieces so far have arrived.
        let mut arrived = 0;
        let mut instants = Vec::new();
        for seen in driver.seen(connection, Side::Server) {
            if let Seen::Bytes(at, bytes) = seen {
                arrived += bytes.len();
                instants.push((at, arrived));
            }
        }
        instants.dedup_by(|later, earlier| later.0 == earlier.0 && { earlier.1 = later.1; true });
        expected.dedup_by(|later, earlier| later.0 == earlier.0 && { earlier.1 = later.1; true });
        prop_assert_eq!(instants, expected);
        driver.check_balance();
    }

    /// With any faults that lose nothing, any jitter and receivers that take a few bytes at a time, all bytes arrive in order, and no more than the window is
    /// held.
    #[test]
    fn nothing_is_lost_or_exchanged_and_memory_is_bounded(
        reads in reads(),
        takes in vec(1_usize..3000, 1..20),
        slice in 1_u64..4000,
        stall in 0_u64..40,
        buffer in 1_usize..20_000,
    ) {
        let keys = format!(
            "delay=5ms jitter=3ms rate=50Mbit buffer={buffer}B slice={{size=\"{slice}B\",gap=\"30us\"}} stall={{after=\"{stall}ms\",length=\"20ms\"}}"
        );
        let mut engine = Engine::new(config(&keys, ""));
        let connection = engine.open(at(0), 0);
        let (mut now, mut sent, mut got) = (Instant::ZERO, 0, Vec::new());
        let total: usize = reads.iter().map(|(_, count)| count).sum();
        let mut waits = reads.iter();
        let mut takes = takes.iter().cycle();
        let mut is_finished = false;
        for _ in 0..200_000 {
            if is_finished {
                break;
            }
            let room = engine.room(connection, Side::Client);
            if sent < total && room > 0 {
                if let Some((wait, _)) = waits.next() {
                    now += Duration::from_micros(*wait);
                }
                let count = room.min(total - sent);
                engine.handle_bytes(now, connection, Side::Client, &content(sent, count));
                sent += count;
                if sent == total {
                    engine.handle_end(now, connection, Side::Client);
                }
            } else if let Some(due) = engine.poll_timeout() {
                now = now.max(due);
            }
            prop_assert!(engine.held().get() <= buffer as u64);
            engine.handle_timeout(now);
            while let Some(event) = engine.poll_event() {
                match event {
                    Event::Ready(_, Side::Server) => {
                        while let Some(bytes) = engine.writable(connection, Side::Server) {
                            prop_assert!(bytes.len() as u64 <= slice);
                            let count = bytes.len().min(*takes.next().unwrap());
                            got.extend_from_slice(&bytes[..count]);
                            engine.wrote(now, connection, Side::Server, count);
                        }
                    }
                    Event::Finish(_, Side::Server) => is_finished = true,
                    Event::Ready(..) | Event::Finish(..) | Event::FinishBoth(_) | Event::Close(..) => prop_assert!(false, "{:?}", event),
                }
            }
        }
        prop_assert!(is_finished, "{} of {total} bytes", got.len());
        prop_assert_eq!(got, content(0, total));
    }
}
