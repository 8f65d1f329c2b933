//! Laws of a run, which hit packets.

use std::collections::BTreeMap;
use std::fmt::Write as _;

#[cfg(feature = "tcp")]
use cohaptic_tcp::Segment;
use cohaptic_units::Instant;
use cohaptic_units::print::Counted;
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Network, Path};

use super::exits::Exits;
use super::parcel::Parcel;
use crate::hit::{Laws, PacketLaw, Seen, SentPacket, Verdict};
use crate::trace::PacketName;

/// The laws of a run, with counts of judged and hit packets.
pub(super) struct Hitting<A> {
    paths: BTreeMap<Path, OnPath>,
    pub(super) exits: Exits<A>,
}

/// The laws of a path, and their counts.
struct OnPath {
    from: String,
    to: String,
    laws: Vec<Running>,
    seen: Seen,
    /// Number of packets judged.
    judged: u64,
    /// Number of packets hit.
    hit: u64,
}

/// A law of a path, in the given order.
struct Running {
    name: String,
    law: Box<dyn PacketLaw + Send>,
    /// Random stream of the law.
    stream: Stream,
    hit: u64,
}

/// Counts of a law in a run, for reports.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct HitCount {
    pub(crate) from: String,
    pub(crate) to: String,
    /// Name of the law: its words, or the place where the test gave the law.
    pub(crate) name: String,
    pub(crate) hit: u64,
    /// Number of packets that the law has judged.
    pub(crate) judged: u64,
}

impl HitCount {
    /// Returns the report in words: `client -> server: drop first SYN: hit 1 of 12 packets`.
    pub(crate) fn words(&self) -> String {
        let Self { from, to, name, hit, judged } = self;
        let hit = if *hit == 0 { "nothing".to_owned() } else { hit.to_string() };
        format!("{from} -> {to}: {name}: hit {hit} of {}", Counted(*judged, "packet"))
    }
}

impl<A: Clone + Send + Sync + 'static> Hitting<A> {
    /// Returns the laws in their initial state, and the network with the filters of the laws. `None` if there are no laws.
    pub(super) fn new(laws: &Laws, names: &[String], seed: u64, network: Network<Box<Parcel<A>>>) -> (Option<Box<Self>>, Network<Box<Parcel<A>>>) {
        let mut hitting = Self { paths: BTreeMap::new(), exits: Exits::default() };
        let mut network = network;
        for given in laws.iter() {
            let Path { from, to } = given.path;
            // A path needs a single filter for all laws: the packet carries the verdict to the link, over an uplink too.
            if !hitting.paths.contains_key(&given.path) {
                network = network.with_filter(from, to, |packet| packet.payload.is_hit).expect("the hosts of laws are checked");
            }
            let on_path = hitting.paths.entry(given.path).or_insert_with(|| {
                let [from, to] = [from, to].map(|host| names[host.index()].clone());
                OnPath { from, to, laws: Vec::new(), seen: Seen::default(), judged: 0, hit: 0 }
            });
            // Names of links contain no blanks, so no link has this label.
            let label = format!("law {} of {}->{}", on_path.laws.len(), on_path.from, on_path.to);
            let stream = Stream::new(seed, label.as_bytes());
            on_path.laws.push(Running { name: given.name.clone(), law: given.fresh(), stream, hit: 0 });
        }
        ((!hitting.paths.is_empty()).then(|| Box::new(hitting)), network)
    }
}

impl<A: Clone> Hitting<A> {
    /// Asks the laws about a packet before the packet is offered to its path. The first verdict other than `Pass` counts.
    pub(super) fn judge(&mut self, packet: PacketName, at: Instant, bytes: &[u8]) -> Verdict {
        let Some(on_path) = self.paths.get_mut(&packet.path) else { return Verdict::Pass };
        #[cfg(feature = "tcp")]
        let segment = Segment::parse(bytes).ok();
        #[cfg(feature = "tcp")]
        let is_retransmission = match &segment {
            Some(segment) => on_path.seen.note_segment(segment),
            None => on_path.seen.note(bytes),
        };
        #[cfg(not(feature = "tcp"))]
        let is_retransmission = on_path.seen.note(bytes);
        let sent = SentPacket {
            path: packet.path,
            from: &on_path.from,
            to: &on_path.to,
            number: packet.sequence,
            at,
            bytes,
            is_retransmission,
            #[cfg(feature = "tcp")]
            segment: segment.as_ref(),
        };
        let mut verdict = Verdict::Pass;
        on_path.judged += 1;
        // Every law is asked, so that a law that counts has seen every packet.
        for running in &mut on_path.laws {
            let said = running.law.judge(&sent, &mut running.stream.packet(packet.sequence).draws(Purpose::Loss));
            if said != Verdict::Pass && verdict == Verdict::Pass {
                verdict = said;
                running.hit += 1;
            }
        }
        on_path.hit += u64::from(verdict != Verdict::Pass);
        if !matches!(verdict, Verdict::Pass | Verdict::Drop) {
            self.exits.expect(packet.path, packet.sequence, verdict);
        }
        verdict
    }

    /// Returns how many packets of `path` were hit.
    pub(super) fn hits(&self, path: Path) -> u64 {
        self.paths.get(&path).map_or(0, |on_path| on_path.hit)
    }

    /// Returns what each law has done so far.
    pub(super) fn counts(&self) -> Vec<HitCount> {
        let of = |(path, on_path): (&Path, &OnPath)| {
            let mut waiting = String::new();
            for (number, left) in self.exits.waiting(*path) {
                // Writing to a `String` cannot fail.
                let _ = write!(waiting, " (packet {number} waits for {left} more packets)");
            }
            let OnPath { from, to, judged, .. } = on_path;
            let count = |law: &Running| HitCount {
                from: from.clone(),
                to: to.clone(),
                name: format!("{}{waiting}", law.name),
                hit: law.hit,
                judged: *judged,
            };
            on_path.laws.iter().map(count).collect::<Vec<_>>()
        };
        self.paths.iter().flat_map(of).collect()
    }
}
