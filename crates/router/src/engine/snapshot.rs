//! Counters of a router.

use cohaptic_linkfile::router::{Memory, Side};
use cohaptic_realtime::LatenessSummary;
use cohaptic_units::Bytes;
use cohaptic_wan::LinkStats;

/// Number of packets and their bytes. The bytes are bytes of IP, without frame and padding; of a frame without IP and of a malformed packet, all bytes count.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Count {
    /// Number of packets.
    pub packets: u64,
    /// Bytes of IP in the packets.
    pub bytes: u64,
}

impl Count {
    /// Adds one packet.
    pub(crate) const fn add(&mut self, size: Bytes) {
        self.packets += 1;
        self.bytes += size.get();
    }
}

/// Packets from one side, and their fates outside of links.
///
/// For each side: `all = not_ip + malformed + passed + dropped + Σ (offered + overload)` over the links from that side.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Received {
    /// All packets and frames from this side.
    pub all: Count,
    /// Frames without IP, such as ARP, which went to the other side at once.
    pub not_ip: u64,
    /// Malformed packets of IP, which were dropped.
    pub malformed: u64,
    /// Packets passed without a link, by a rule or by the default.
    pub passed: u64,
    /// Packets dropped by a rule or by the default.
    pub dropped: u64,
}

/// Counters of a link: of one direction of a name of the file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LaneSnapshot {
    /// Name of the link.
    pub link: String,
    /// Side from which the packets come.
    pub from: Side,
    /// Counters and delays kept by the link.
    pub stats: LinkStats,
    /// Bytes of IP in the delivered packets.
    pub delivered_bytes: u64,
    /// Packets not offered to the link, because too many packets or bytes were inside all links (cause `overload`).
    pub overload: u64,
    /// Delays of the packets delivered since the previous snapshot.
    pub recent_delay: LatenessSummary,
}

/// All counters of a router.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Counters {
    /// Arrived packets, indexed by side: left, right.
    pub received: [Received; 2],
    /// Packets for which each rule decided, in the order of the file.
    pub by_rule: Vec<Count>,
    /// Packets without a deciding rule, indexed by the side of origin.
    pub by_default: [Count; 2],
    /// Directions of links in the order of the file: each link from the left and then from the right.
    pub lanes: Vec<LaneSnapshot>,
    /// Packets and bytes inside all links now.
    pub held: Memory,
}

impl Counters {
    /// Returns the counters of the link in one direction, or `None` if no link has this name.
    #[must_use]
    pub fn lane(&self, link: &str, from: Side) -> Option<&LaneSnapshot> {
        self.lanes.iter().find(|lane| lane.link == link && lane.from == from)
    }

    /// Returns the number of packets lost for any reason: dropped by rules, malformed, overload, and dropped by links.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        let outside: u64 = self.received.iter().map(|received| received.malformed + received.dropped).sum();
        outside + self.lanes.iter().map(|lane| lane.overload + lane.stats.dropped_in_all()).sum::<u64>()
    }
}
