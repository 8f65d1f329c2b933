//! Tables that the tests of the engine are chosen from. They print, and no figure decides:
//! `cargo test --release -p cohaptic-tcp --test engine -- --ignored --nocapture tables`.
#![allow(clippy::print_stdout, clippy::disallowed_methods, reason = "it measures and prints")]

use std::time::Duration;

use cohaptic_tcp::{CongestionControl, TcpConfig};

use crate::world::{Program, World};

/// Words of the link, octets, and the median over Linux 6.18 \[s\].
const ROWS: [(&str, u64, f64); 6] = [
    ("delay 100ms", 100_000, 0.80),
    ("delay 25ms rate 20mbit limit 100", 10_000_000, 4.37),
    ("delay 20ms 5ms", 1_000_000, 0.32),
    ("delay 20ms 5ms loss 1%", 1_000_000, 1.47),
    ("delay 50ms loss 5%", 1_000_000, 13.5),
    ("delay 10ms loss 10%", 100_000, 0.24),
];

const SEEDS: u64 = 101;

/// Median seconds from `connect` to the last octet over links, beside Linux 6.18.
#[test]
#[ignore = "by hand: it prints a table"]
fn seconds_beside_linux() {
    let at_once = TcpConfig { delayed_ack: Duration::from_nanos(1), ..TcpConfig::default() };
    let reno = TcpConfig { congestion: CongestionControl::Reno, ..TcpConfig::default() };
    for (name, config) in [("default", TcpConfig::default()), ("acknowledgements at once", at_once), ("Reno", reno)] {
        println!("\n{name}\n\n| link | bytes | Linux | here | quartiles | ratio |\n|-|-|-|-|-|-|");
        for (words, octets, linux) in ROWS {
            let mut seconds: Vec<f64> = (0..SEEDS)
                .map(|seed| {
                    let mut world = World::new(words, seed).config(&config).programs(Program::default(), Program::writes(octets)).connect();
                    (world.is_encoded, world.is_checked) = (false, false);
                    world.run_to_the_last_octet(Duration::from_secs(3600));
                    world.programs[0].last_read_at.unwrap().as_secs_f64()
                })
                .collect();
            seconds.sort_by(f64::total_cmp);
            let at = |share: usize| seconds[seconds.len() * share / 4];
            println!("| `{words}` | {octets} | {linux} | {:.3} | {:.3}–{:.3} | {:.2} |", at(2), at(1), at(3), at(2) / linux);
        }
    }
}

/// Processor time for a gigabyte over 1 Gbit/s and 1 ms, both ends and the links together; octets or whole segments on the links.
#[test]
#[ignore = "by hand: it prints a table"]
fn processor_time_of_a_gigabyte() {
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
