//! Snapshots of a running session, and the report of a session that has ended.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use cohaptic_harness::Summary;
use cohaptic_harness::live::{GateStats, PeerState, SeatStats};
use cohaptic_harness::measures::MeasuredValue;
use cohaptic_harness::record::RecordedPicture;
use cohaptic_harness::task::TaskResult;
use cohaptic_realtime::udp::EndpointCounts;
use cohaptic_realtime::{LatenessSummary, Prepared, Validity};
use cohaptic_wan::LinkStats;

use crate::{AdmissionStats, Label, OtherScene};

/// Snapshot of a running session, for display.
#[derive(Clone, Debug)]
pub struct Status {
    /// Logical time since the beginning of the session.
    pub elapsed: Duration,
    /// Lateness of the ticks so far.
    pub ticks: LatenessSummary,
    /// Lateness so far of datagrams to other programs.
    pub releases: LatenessSummary,
    /// Verdict on the session so far: whether ticks and releases were in time.
    pub validity: Validity,
    /// Peers in the order of the scene.
    pub peers: Vec<PeerStatus>,
    /// Directed links, ordered by sender, then by receiver.
    pub links: Vec<LinkStatus>,
    /// Counts of the admission. `None` in a scene without peers in other programs.
    pub admission: Option<AdmissionStats>,
    /// Latest peer that asked with another scene. `None` if no peer did.
    pub other_scene: Option<OtherScene>,
    /// Measures of the scene so far. Empty if the scene asks for no measures.
    pub measures: Vec<MeasuredValue>,
}

/// Snapshot of one peer.
#[derive(Clone, Copy, Debug)]
pub struct PeerStatus {
    /// Presence, position and velocity of the peer.
    pub state: PeerState,
    /// Coupling force FC, which the hand of the peer feels \[N\]. Zero on axes that the scene does not have, and for a peer in another program.
    pub force: [f64; 3],
    /// Counts of the samples and readings received from the peer. `None` for a simulated peer.
    pub seat: Option<SeatStats>,
    /// Connection to the program of the peer. `None` if no program ever joined, and for a peer in this program.
    pub connection: Option<Connection>,
}

/// Connection between the session and a peer in another program.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Connection {
    /// Address of the program.
    pub address: SocketAddr,
    /// Label of the device, as the program told.
    pub label: Label,
    /// Samples that never came: numbers missing between the first and the highest number of each joining.
    pub lost: u64,
    /// Samples that the program has sent, as far as their numbers tell.
    pub sent: u64,
}

/// Snapshot of one directed link.
#[derive(Clone, Debug)]
pub struct LinkStatus {
    /// Sender, as index of a peer in the scene.
    pub from: usize,
    /// Receiver, as index of a peer in the scene.
    pub to: usize,
    /// Counters of the link.
    pub stats: LinkStats,
    /// Bytes delivered by the link.
    pub delivered_bytes: u64,
    /// Delays of the packets delivered last, in no particular order.
    pub recent: Vec<Duration>,
}

/// Report of a session that has ended.
#[derive(Debug)]
pub struct Report {
    /// Result of the scene, in logical time.
    pub summary: Summary,
    /// Measures of the scene. Empty if the scene asks for no measures.
    pub measures: Vec<MeasuredValue>,
    /// Result of the task; `None` for a scene without a task.
    pub task: Option<TaskResult>,
    /// Lateness of the ticks.
    pub ticks: LatenessSummary,
    /// Number of ticks that were later than the tolerance.
    pub late_ticks: u64,
    /// Lateness of datagrams to other programs.
    pub releases: LatenessSummary,
    /// Verdict on the session: whether ticks and releases were in time.
    pub validity: Validity,
    /// Time by which the wall clock was ahead of logical time at the end of the run.
    pub behind: Duration,
    /// Counts of the samples and readings received, indexed by peer. `None` for a simulated peer.
    pub seats: Vec<Option<SeatStats>>,
    /// Forces that the gate of a device changed or made zero, indexed by peer. `None` for a peer without a device or pointer.
    pub gates: Vec<Option<GateStats>>,
    /// Counts of the admission and of its socket. `None` in a scene without peers in other programs.
    pub admission: Option<(AdmissionStats, SocketCounts)>,
    /// Latest peer that asked with another scene. `None` if no peer did.
    pub other_scene: Option<OtherScene>,
    /// Connections to the programs of peers, indexed by peer. `None` as in [`PeerStatus::connection`].
    pub connections: Vec<Option<Connection>>,
    /// Wishes that the system granted and refused.
    pub prepared: Prepared,
    /// Paths of the files of the record. Empty if nothing was recorded.
    pub files: Vec<PathBuf>,
    /// Pictures of the record with the names of their files. Empty if nothing was recorded, or with [`Recorded::Inputs`](super::Recorded::Inputs).
    pub pictures: Vec<RecordedPicture>,
}

/// Counts of the socket of a session.
#[derive(Clone, Copy, Debug)]
pub struct SocketCounts {
    /// Local address of the socket.
    pub address: SocketAddr,
    /// Counts of received and sent datagrams.
    pub counts: EndpointCounts,
    /// Datagrams that the kernel dropped because the receive buffer was full. `None` if the system does not tell.
    pub kernel_drops: Option<u64>,
}
