//! Tests of the relay of TCP: the engine in virtual time, and real sockets on loopback.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::cast_possible_truncation, reason = "contents of bytes, and small numbers")]

mod engine;
mod faults;
mod loopback;
mod properties;

use std::time::Duration;

use cohaptic_linkfile::LinkKeys;
use cohaptic_linkfile::reading::FileReader;
use cohaptic_linkfile::stream::{StreamConfig, split_faults, stream_of_keys};
use cohaptic_streams::{Close, ConnectionId, Engine, Event, Proxy, Side, StreamsConfig};
use cohaptic_units::{Bytes, Instant};

/// Returns the stream with these keys, such as `delay=20ms stall=2s`.
fn stream(spec: &str) -> StreamConfig {
    let spec: Vec<String> = spec.split_whitespace().map(str::to_owned).collect();
    let split = split_faults(&spec).unwrap();
    let link = split.link.iter().map(|text| text.split_once('=').unwrap());
    let keys = link.fold(LinkKeys::default(), |keys, (key, value)| keys.with(key, value));
    let keys = split.faults.iter().fold(keys, |keys, (key, value)| keys.with(key, value));
    stream_of_keys(&keys, std::path::Path::new(""), FileReader(&|_| unreachable!("no key names a file"))).unwrap()
}

fn config(forth: &str, back: &str) -> StreamsConfig {
    let proxy = Proxy {
        name: "proxy".to_owned(),
        listen: ([127, 0, 0, 1], 0).into(),
        to: ([127, 0, 0, 1], 9).into(),
        forth: stream(forth),
        back: stream(back),
    };
    StreamsConfig { seed: 1, proxies: vec![proxy], most_bytes: StreamsConfig::MOST_BYTES }
}

fn at(ms: u64) -> Instant {
    Instant::ZERO + Duration::from_millis(ms)
}

/// Bytes or end that an end of a connection receives, with the instant.
#[derive(Clone, PartialEq, Eq, Debug)]
enum Seen {
    Bytes(Instant, Vec<u8>),
    Finish(Instant),
    Reset(Instant),
    Closed(Instant),
}

/// Driver in virtual time, whose ends take all bytes at once.
struct Driver {
    engine: Engine,
    /// Observed event, with the connection and the end. A close and a reset are noted at the client's end.
    seen: Vec<(ConnectionId, Side, Seen)>,
}

impl Driver {
    fn new(config: StreamsConfig) -> Self {
        Self { engine: Engine::new(config), seen: Vec::new() }
    }

    /// Handles all deadlines up to `until`, each at its instant.
    fn run(&mut self, until: Instant) {
        while let Some(due) = self.engine.poll_timeout().filter(|due| *due <= until) {
            self.at(due);
        }
        self.at(until);
    }

    fn at(&mut self, now: Instant) {
        self.engine.handle_timeout(now);
        while let Some(event) = self.engine.poll_event() {
            let mut see = |connection, side, seen| self.seen.push((connection, side, seen));
            match event {
                Event::Ready(connection, side) => {
                    while let Some(bytes) = self.engine.writable(connection, side).map(<[u8]>::to_vec) {
                        assert!(self.engine.take_due(connection, side).is_none_or(|due| due == now), "a deadline is told in time");
                        self.engine.wrote(now, connection, side, bytes.len());
                        self.seen.push((connection, side, Seen::Bytes(now, bytes)));
                    }
                }
                Event::Finish(connection, side) => see(connection, side, Seen::Finish(now)),
                Event::FinishBoth(connection) => {
                    see(connection, Side::Client, Seen::Finish(now));
                    see(connection, Side::Server, Seen::Finish(now));
                }
                Event::Close(connection, Close::Ordinary) => see(connection, Side::Client, Seen::Closed(now)),
                Event::Close(connection, Close::Reset) => see(connection, Side::Client, Seen::Reset(now)),
            }
        }
    }

    /// Returns what an end of a connection has seen.
    fn seen(&self, connection: ConnectionId, side: Side) -> Vec<Seen> {
        self.seen.iter().filter(|(of, at, _)| (*of, *at) == (connection, side)).map(|(_, _, seen)| seen.clone()).collect()
    }

    /// Returns all bytes that an end has got.
    fn bytes(&self, connection: ConnectionId, side: Side) -> Vec<u8> {
        let bytes = |seen| if let Seen::Bytes(_, bytes) = seen { bytes } else { Vec::new() };
        self.seen(connection, side).into_iter().flat_map(bytes).collect()
    }

    /// Checks that each received byte is sent, lost or held.
    fn check_balance(&self) {
        let lines = self.engine.config().proxies.len() * 2;
        let counts: Vec<_> = (0..lines).map(|line| self.engine.line(line).unwrap().0).collect();
        let kept: u64 = counts.iter().map(|counts| counts.received - counts.sent - counts.lost).sum();
        assert_eq!(Bytes::new(kept), self.engine.held());
    }
}
