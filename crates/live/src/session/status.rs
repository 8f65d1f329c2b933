//! A session as it stands, and as it ended.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use cohaptic_harness::Summary;
use cohaptic_harness::live::{PeerState, SeatStats};
use cohaptic_harness::measures::MeasuredValue;
use cohaptic_realtime::udp::EndpointCounts;
use cohaptic_realtime::{LatenessSummary, Prepared, Validity};
use cohaptic_wan::LinkStats;

use crate::AdmissionStats;

/// A session at one moment, for onlookers.
#[derive(Clone, Debug)]
pub struct Status {
    /// Since it began, in logical time.
    pub elapsed: Duration,
    /// How late ticks were so far.
    pub ticks: LatenessSummary,
    /// How late datagrams to other programs were so far.
    pub releases: LatenessSummary,
    /// Whether it counts so far.
    pub validity: Validity,
    /// Each peer, in the order of the scene.
    pub peers: Vec<PeerStatus>,
    /// Each directed link, by sender, then receiver.
    pub links: Vec<LinkStatus>,
    /// The counts of the admission; `None` in a scene without peers in other programs.
    pub admission: Option<AdmissionStats>,
    /// The measures of the scene so far; empty if it asks for none.
    pub measures: Vec<MeasuredValue>,
}

/// A peer at one moment.
#[derive(Clone, Copy, Debug)]
pub struct PeerStatus {
    /// Whether it is there, and where.
    pub state: PeerState,
    /// FC, which its hand feels \[N\]; zero beyond the axes of the scene, and for a peer in another program.
    pub force: [f64; 3],
    /// What came in from it; `None` for one that is simulated here.
    pub seat: Option<SeatStats>,
}

/// A link at one moment.
#[derive(Clone, Debug)]
pub struct LinkStatus {
    /// The sender's place in the scene.
    pub from: usize,
    /// The receiver's place in the scene.
    pub to: usize,
    /// Its counters.
    pub stats: LinkStats,
    /// Bytes that it has delivered.
    pub delivered_bytes: u64,
    /// The delays of the latest packets that it delivered, in no order.
    pub recent: Vec<Duration>,
}

/// What a session came to.
#[derive(Debug)]
pub struct Report {
    /// What the scene came to, in logical time.
    pub summary: Summary,
    /// The measures of the scene; empty if it asks for none.
    pub measures: Vec<MeasuredValue>,
    /// How late ticks were.
    pub ticks: LatenessSummary,
    /// How many ticks were later than the tolerance.
    pub late_ticks: u64,
    /// How late datagrams to other programs were sent.
    pub releases: LatenessSummary,
    /// Whether the session counts.
    pub validity: Validity,
    /// By how much the clock on the wall was ahead of logical time when the last thing happened.
    pub behind: Duration,
    /// What came in at each peer that is remote; `None` for one that is simulated here.
    pub seats: Vec<Option<SeatStats>>,
    /// The counts of the admission, and of the socket before it.
    pub admission: Option<(AdmissionStats, SocketCounts)>,
    /// What the system granted and refused.
    pub prepared: Prepared,
    /// The files of the record.
    pub files: Vec<PathBuf>,
}

/// What the socket of a session did.
#[derive(Clone, Copy, Debug)]
pub struct SocketCounts {
    /// Where it listened.
    pub address: SocketAddr,
    /// What it took and sent.
    pub counts: EndpointCounts,
    /// What the kernel dropped because nobody read in time; `None` if the system does not tell.
    pub kernel_drops: Option<u64>,
}
