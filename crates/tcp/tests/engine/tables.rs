//! Median seconds from `connect` to the last octet over links, beside Linux 6.18.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "it prints a table, and stops where it fails")]
#![allow(dead_code, reason = "the world of the tests has more")]

#[path = "../tests/engine/world.rs"]
mod world;

use std::time::Duration;

use world::{Program, World};

const ROWS: [(&str, u64, f64); 6] = [
    ("delay 100ms", 100_000, 0.80),
    ("delay 25ms rate 20mbit limit 100", 10_000_000, 4.37),
    ("delay 20ms 5ms", 1_000_000, 0.32),
    ("delay 20ms 5ms loss 1%", 1_000_000, 1.47),
    ("delay 50ms loss 5%", 1_000_000, 13.5),
    ("delay 10ms loss 10%", 100_000, 0.24),
];

fn main() {
    let seeds: u64 = std::env::args().nth(1).map_or(101, |word| word.parse().unwrap());
    println!("| link | bytes | Linux | here | quartiles | ratio |\n|-|-|-|-|-|-|");
    for (words, octets, linux) in ROWS {
        let mut seconds: Vec<f64> = (0..seeds)
            .map(|seed| {
                let mut config = cohaptic_tcp::TcpConfig::default();
                if std::env::var("ND").is_ok() {
                    config.delayed_ack = Duration::from_nanos(1);
                }
                if std::env::var("RENO").is_ok() {
                    config.congestion = cohaptic_tcp::CongestionControl::Reno;
                }
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
