//! A call shares a line of 2 Mbit/s with an upload of photos, with a long queue before the line and with an active queue.
//!
//! The example shows how a program embeds a link in a loop of its own. Packets go in by `handle_packet`, `poll_timeout` says when the link must be called
//! again, `handle_timeout` tells it the time, and packets and their fates come out of `poll_event`. The loop owns the time: nothing sleeps, and eight
//! seconds of the call take milliseconds.
//!
//! ```text
//! cargo run -p cohaptic-wan --example call
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::fmt::Write as _;
use std::time::Duration;

use cohaptic_units::{Bytes, Instant, parse};
use cohaptic_wan::{Bottleneck, CoDel, Delay, Discipline, Fate, Link, LinkConfig, LinkName, QueueLimit};

#[derive(Clone, Copy, PartialEq)]
enum Packet {
    Call,
    Photo,
}

/// Returns the longest delay of a packet of the call in each of eight seconds.
fn call(discipline: Discipline) -> Result<[Duration; 8], Box<dyn Error>> {
    let line = Bottleneck { limit: Some(QueueLimit::Packets(100)), discipline, ..Bottleneck::at_rate(parse::rate("2Mbit")?) };
    let config = LinkConfig { bottleneck: Some(line), delay: Delay::constant(parse::duration("20ms")?), ..LinkConfig::default() };
    let mut link = Link::new(1, &LinkName::between("home", "internet"), config);

    let (mut now, mut next_call, mut longest) = (Instant::ZERO, Instant::ZERO, [Duration::ZERO; 8]);
    // The upload has a window as TCP has: a packet more for each window that arrived, and half of it after a loss, once in a fifth of a second at most.
    let (mut window, mut under_way, mut halved) = (2.0_f64, 0_u32, Instant::ZERO);
    while now < Instant::ZERO + Duration::from_secs(8) {
        // The link tells what has happened to packets …
        while let Some(event) = link.poll_event() {
            match (event.payload, event.fate) {
                (Packet::Call, Fate::Delivered(at)) => {
                    let second = &mut longest[usize::try_from(event.offered.as_nanos() / 1_000_000_000)?];
                    *second = (*second).max(at - event.offered);
                }
                (Packet::Photo, Fate::Delivered(_)) => (under_way, window) = (under_way - 1, window + 1.0 / window),
                (Packet::Photo, Fate::Dropped(_)) => {
                    under_way -= 1;
                    if now >= halved + Duration::from_millis(200) {
                        (window, halved) = ((window / 2.0).max(1.0), now);
                    }
                }
                _ => {}
            }
        }
        // … the program sends what it has to send …
        if now >= next_call {
            link.handle_packet(now, Bytes::new(200), Packet::Call)?;
            next_call += Duration::from_millis(20);
        }
        while (2.0..6.0).contains(&now.as_secs_f64()) && f64::from(under_way) < window {
            link.handle_packet(now, Bytes::new(1500), Packet::Photo)?;
            under_way += 1;
        }
        // … and time goes on to whatever comes next.
        now = link.poll_timeout().map_or(next_call, |at| at.min(next_call));
        link.handle_timeout(now)?;
    }
    Ok(longest)
}

/// Returns the table of the README.
fn table() -> Result<String, Box<dyn Error>> {
    let mut text = String::from("Longest delay of the call in each second; the upload lasts from second 3 to second 6 [ms]\n");
    for (name, discipline) in [("tail drop", Discipline::TailDrop), ("CoDel", Discipline::CoDel(CoDel::default()))] {
        writeln!(text, "{name:<10}{}", call(discipline)?.map(|delay| format!("{:6}", delay.as_millis())).concat())?;
    }
    Ok(text)
}

fn main() -> Result<(), Box<dyn Error>> {
    print!("{}", table()?);
    Ok(())
}

#[test]
fn the_readme_shows_the_table() -> Result<(), Box<dyn Error>> {
    assert!(include_str!("../README.md").contains(&table()?), "{}", table()?);
    Ok(())
}
