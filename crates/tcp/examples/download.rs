//! A download of 5 MB over lines of 20 Mbit/s that lose packets or delay them, with two kinds of congestion control.
//!
//! The example shows a whole network of one loop: a client and a server of `cohaptic-tcp`, and between them a link of `cohaptic-wan` in each direction. The
//! loop asks all four when they must be called again, and lets time jump there. So it prints what minutes of real downloads would, at once, and the same on
//! every run.
//!
//! ```text
//! cargo run -p cohaptic-tcp --example download
//! ```
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::fmt::Write as _;

use cohaptic_tcp::{CongestionControl, Connection, Info, Segment, TcpConfig};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{Fate, Link, LinkName};

const SIZE: usize = 5_000_000;

/// Hands all that a connection sends now to its link.
fn send(now: Instant, from: &mut Connection, link: &mut Link<Segment<'static>>) -> Result<(), Box<dyn Error>> {
    while let Some(segment) = from.poll_transmit(now) {
        link.handle_packet(now, Bytes::new(segment.packet_length() as u64), segment)?;
    }
    Ok(())
}

/// Returns the time of a download over a line in the words of `tc-netem`, and what the server knows of its connection at the end.
fn download(line: &str, congestion: CongestionControl) -> Result<(Instant, Info), Box<dyn Error>> {
    let config = Netem::parse(line)?.to_link_config(&mut |_| None)?;
    let mut up = Link::new(7, &LinkName::between("client", "server"), config.clone());
    let mut down = Link::new(7, &LinkName::between("server", "client"), config);
    let tcp = TcpConfig { congestion, ..TcpConfig::default() };
    let mut now = Instant::ZERO;
    let mut client = Connection::connect(now, tcp.clone(), "10.0.0.1:50000".parse()?, "10.0.0.2:80".parse()?, 1)?;
    let mut server: Option<Connection> = None;
    let (mut block, mut left, mut received) = (vec![0; 65_536], SIZE, 0);
    loop {
        // Both programs act: the server writes, the client reads.
        if let Some(server) = &mut server {
            while left > 0
                && let Ok(count) = server.write(&block[..left.min(65_536)])
            {
                left -= count;
            }
            send(now, server, &mut down)?;
        }
        while let Ok(count @ 1..) = client.read(&mut block) {
            received += count;
        }
        send(now, &mut client, &mut up)?;
        if let Some(server) = server.as_ref().filter(|_| received == SIZE) {
            return Ok((now, server.info()));
        }
        // Time goes on to whatever comes next: an arrival, or a timer of either end.
        let timers = [client.poll_timeout(), server.as_ref().and_then(Connection::poll_timeout)];
        now = [up.poll_timeout(), down.poll_timeout()].into_iter().chain(timers).flatten().min().ok_or("nothing will ever happen again")?;
        up.handle_timeout(now)?;
        while let Some(event) = up.poll_event() {
            match (&mut server, event.fate) {
                (Some(server), Fate::Delivered(_)) => server.handle_segment(now, &event.payload),
                (None, Fate::Delivered(_)) => server = Some(Connection::accept(now, tcp.clone(), &event.payload, 2)?),
                _ => {}
            }
        }
        down.handle_timeout(now)?;
        while let Some(event) = down.poll_event() {
            if let Fate::Delivered(_) = event.fate {
                client.handle_segment(now, &event.payload);
            }
        }
        client.handle_timeout(now);
        if let Some(server) = &mut server {
            server.handle_timeout(now);
        }
    }
}

const LINES: [&str; 4] =
    ["delay 20ms rate 20mbit limit 100", "delay 20ms rate 20mbit limit 10", "delay 20ms rate 20mbit loss 0.1%", "delay 20ms 5ms rate 20mbit loss 1%"];

/// Returns the table of the README.
fn table() -> Result<String, Box<dyn Error>> {
    let mut text = format!("{:<34} {:>9} {:>10} {:>9} {:>10}\n", "5 MB over", "CUBIC [s]", "sent again", "Reno [s]", "sent again");
    for line in LINES {
        let [cubic, reno] = [download(line, CongestionControl::Cubic)?, download(line, CongestionControl::Reno)?];
        let [(cubic, of_cubic), (reno, of_reno)] = [cubic, reno].map(|(at, info)| (at.as_secs_f64(), info.retransmissions));
        writeln!(text, "{line:<34} {cubic:>9.2} {of_cubic:>10} {reno:>9.2} {of_reno:>10}")?;
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
