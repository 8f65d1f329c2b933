//! What a router has counted.

use cohaptic_linkfile::router::{Memory, Side};
use cohaptic_realtime::LatenessSummary;
use cohaptic_units::Bytes;
use cohaptic_wan::LinkStats;

/// Packets and their bytes: those of IP, without frames.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Count {
    /// Packets.
    pub packets: u64,
    /// Their bytes.
    pub bytes: u64,
}

impl Count {
    pub(crate) const fn add(&mut self, size: Bytes) {
        self.packets += 1;
        self.bytes += size.get();
    }
}

/// What came from one side, and what became of it outside of links.
///
/// For each side: `all = not_ip + malformed + passed + dropped + Σ (offered + overload)` over the links from that side.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Received {
    /// All of it.
    pub all: Count,
    /// Frames that carry something else than IP, such as ARP: they went to the other side at once.
    pub not_ip: u64,
    /// What claims to be a packet of IP and is none: it went nowhere.
    pub malformed: u64,
    /// Packets that a rule, or the default, lets pass.
    pub passed: u64,
    /// Packets that a rule, or the default, drops.
    pub dropped: u64,
}

/// One direction of a link.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LaneSnapshot {
    /// The name of the link.
    pub link: String,
    /// The side from which its packets come.
    pub from: Side,
    /// What the link counts.
    pub stats: LinkStats,
    /// The bytes of the packets that came out of it.
    pub delivered_bytes: u64,
    /// Packets that were not handed to it because too much was inside all links (cause `overload`).
    pub overload: u64,
    /// How long the packets were in it that came out since the counters were last asked for.
    pub recent_delay: LatenessSummary,
}

/// Everything that a router has counted.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Counters {
    /// By side: left, right.
    pub received: [Received; 2],
    /// What each rule decided, in the order of the file.
    pub by_rule: Vec<Count>,
    /// What no rule decided, by the side that it came from.
    pub by_default: [Count; 2],
    /// Each link from the left and then from the right, in the order of the file.
    pub lanes: Vec<LaneSnapshot>,
    /// The packets inside all links now.
    pub held: Memory,
}

impl Counters {
    /// One direction of a link; `None` if there is none of that name.
    #[must_use]
    pub fn lane(&self, link: &str, from: Side) -> Option<&LaneSnapshot> {
        self.lanes.iter().find(|lane| lane.link == link && lane.from == from)
    }

    /// Packets that are lost for any reason: by rules, as malformed, by overload, and by what the links are there for.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        let outside: u64 = self.received.iter().map(|received| received.malformed + received.dropped).sum();
        outside + self.lanes.iter().map(|lane| lane.overload + lane.stats.dropped_in_all()).sum::<u64>()
    }
}
