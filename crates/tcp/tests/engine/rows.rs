//! Seconds from `connect` to the last octet, beside those of Linux 6.18 over the same links (docs/measured-tcp.md has more links and the quartiles).

use std::time::Duration;

use crate::world::{Program, World};

fn median(words: &str, octets: u64, seeds: u64) -> f64 {
    let mut seconds: Vec<f64> = (0..seeds)
        .map(|seed| {
            let mut world = World::new(words, seed).programs(Program::default(), Program::writes(octets)).connect();
            (world.is_encoded, world.is_checked) = (false, false);
            world.run_to_the_last_octet(Duration::from_secs(3600));
            world.programs[0].last_read_at.unwrap().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[seconds.len() / 2]
}

#[test]
fn clean_links_take_as_long_as_linux_does() {
    for (words, octets, seeds, linux) in
        [("delay 100ms", 100_000, 1, 0.80), ("delay 25ms rate 20mbit limit 100", 10_000_000, 1, 4.37), ("delay 20ms 5ms", 1_000_000, 21, 0.32)]
    {
        let ratio = median(words, octets, seeds) / linux;
        assert!((0.9..1.1).contains(&ratio), "`{words}`: {ratio} of Linux");
    }
}

#[test]
fn lossy_links_take_about_as_long_as_linux_does() {
    for (words, octets, linux) in [("delay 20ms 5ms loss 1%", 1_000_000, 1.47), ("delay 50ms loss 5%", 1_000_000, 13.5)] {
        let ratio = median(words, octets, 101) / linux;
        assert!((0.5..1.5).contains(&ratio), "`{words}`: {ratio} of Linux");
    }
}
