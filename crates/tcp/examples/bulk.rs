//! Processor time for a gigabyte over 1 Gbit/s and 1 ms, both ends and the links together; octets or whole segments on the links.
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::cast_precision_loss, clippy::disallowed_methods, reason = "it measures and prints")]
#![allow(dead_code, reason = "the world of the tests has more")]

#[path = "../tests/engine/world.rs"]
mod world;

use std::time::Duration;

use world::{Program, World};

fn main() {
    let rows = [
        ("delay 1ms rate 1gbit limit 1000", 1_000_000_000),
        ("delay 10ms rate 1gbit limit 10000", 1_000_000_000),
        ("delay 20ms 5ms loss 1%", 100_000_000),
    ];
    for ((words, octets), is_encoded) in rows.into_iter().flat_map(|row| [(row, false), (row, true)]) {
        let mut world = World::new(words, 1).programs(Program::default(), Program::writes(octets)).connect();
        (world.is_encoded, world.is_checked) = (is_encoded, false);
        let begin = std::time::Instant::now();
        world.run_to_the_last_octet(Duration::from_secs(36_000));
        let spent = begin.elapsed().as_secs_f64();
        let form = if is_encoded { "IP packets" } else { "segments" };
        println!("`{words}`, {form}: {octets} octets in {} and {spent:.2} s, {:.2} µs a data segment", world.now, spent / octets as f64 * 1448e6);
    }
}
