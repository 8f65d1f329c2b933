//! The router's engine: packets and frames through rules and links. Every packet is counted once, and one that no link damages leaves as it came.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_router::{Content, Engine, Framing, Packet};
use cohaptic_units::Instant;

use crate::{Input, internet};

/// The memory is that of a few packets, so that there is overload, too. The link `damages` is for what goes to port 7.
const FILE: &str = r#"
    router = { default = "wan", memory = { packets = 24, bytes = "20 kB" } }
    left = { tun = "a" }
    right = { tun = "b" }
    links = { wan = { delay = "3ms", jitter = "1ms", loss = "10%", duplicate = "20%" }, marks = { loss = "50%", mark-instead-of-loss = true, delay = "1ms" }, damages = { delay = "1ms", corrupt = { probability = 0.9, bits = 3, checksum = "passes" }, duplicate = "30%" } }
    rules = [
        { destination-port = 7, link = "damages" },
        { protocol = "tcp", from = "left", link = "marks" },
        { source = "10.1.0.0/16", port = "5000-6000", link = "marks" },
        { destination = "fd00::/8", link = "pass" },
        { protocol = "icmp", link = "drop" },
    ]
"#;
const MOST_STEPS: usize = 100_000;

fn file() -> &'static RouterFile {
    static FILE_READ: OnceLock<RouterFile> = OnceLock::new();
    FILE_READ.get_or_init(|| RouterFile::parse(FILE, Path::new("router.toml"), &[]).unwrap_or_else(|error| panic!("{error}")))
}

struct World {
    engine: Engine,
    now: Instant,
    /// The bytes of packets that came, as the engine read them. Those of the link that damages are known by their length alone.
    came: BTreeSet<Vec<u8>>,
    lengths: BTreeSet<usize>,
    /// `true` if every packet that came had right checksums.
    are_right: bool,
    departed: [u64; 2],
}

/// The bytes are a sequence of packets and of spans of time.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let mut world =
        World { engine: Engine::new(file()), now: Instant::ZERO, came: BTreeSet::new(), lengths: BTreeSet::new(), are_right: true, departed: [0; 2] };
    while !input.is_empty() {
        let action = input.byte();
        if action & 7 == 0 {
            world.now = world.now.saturating_add(Duration::from_micros(u64::from(input.byte()) * 100));
            world.engine.handle_timeout(world.now);
        } else {
            world.packet(action, &mut input);
        }
        world.drain();
    }
    for step in 0.. {
        let Some(due) = world.engine.poll_timeout() else { break };
        assert!(step < MOST_STEPS, "the router never rests");
        world.now = world.now.max(due);
        world.engine.handle_timeout(due);
        world.drain();
    }
    // Quantiles of delays, which belong to the counters, take milliseconds.
    if data.len().is_multiple_of(32) {
        world.check();
    }
}

impl World {
    fn packet(&mut self, action: u8, input: &mut Input<'_>) {
        let side = if action & 8 == 0 { Side::Left } else { Side::Right };
        let length = if action & 16 == 0 { usize::from(input.byte()) } else { usize::from(input.word() % 1600) };
        let mut bytes = input.take(length).to_vec();
        let framing = if action & 32 == 0 { Framing::Ip } else { Framing::Ethernet };
        if action & 64 == 0 {
            let begin = if framing == Framing::Ip { 0 } else { 14.min(bytes.len()) };
            internet::repair(&mut bytes[begin..], action & 128 != 0);
        }
        let packet = Packet::new(bytes, framing);
        if let Content::Ip { at, headers } = packet.content() {
            assert!(at + headers.length <= packet.bytes().len());
            self.are_right &= internet::is_right(&packet.bytes()[*at..at + headers.length]);
        }
        self.came.insert(packet.bytes().to_vec());
        self.lengths.insert(packet.bytes().len());
        self.engine.handle_packet(self.now, side, packet);
    }

    fn drain(&mut self) {
        while let Some(departure) = self.engine.poll_departure() {
            assert!(departure.at <= self.now);
            self.departed[departure.to.index()] += 1;
            let bytes = departure.packet.bytes();
            assert!(self.lengths.contains(&bytes.len()));
            let Content::Ip { at, headers } = departure.packet.content() else {
                assert!(self.came.contains(bytes));
                continue;
            };
            let is_marked = headers.ecn.bits() == 3;
            let is_damaged = headers.ports.is_some_and(|ports| ports[1] == 7);
            assert!(is_marked || is_damaged || self.came.contains(bytes), "a link changed bytes that it should not");
            assert!(is_damaged || !self.are_right || internet::is_right(&bytes[*at..at + headers.length]), "a mark made a checksum wrong");
        }
    }

    fn check(&mut self) {
        let counters = self.engine.counters();
        assert_eq!((counters.held.packets, counters.held.bytes.get()), (0, 0));
        for side in Side::BOTH {
            let received = counters.received[side.index()];
            let lanes = || counters.lanes.iter().filter(move |lane| lane.from == side);
            let into_links: u64 = lanes().map(|lane| lane.stats.offered() + lane.overload).sum();
            assert_eq!(received.all.packets, received.not_ip + received.malformed + received.passed + received.dropped + into_links);
            let delivered: u64 = lanes().map(|lane| lane.stats.delivered()).sum();
            assert_eq!(self.departed[side.opposite().index()], received.not_ip + received.passed + delivered);
        }
    }
}
