//! What a relay says of itself, while it runs and at its end.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_realtime::udp::EndpointCounts;
use cohaptic_realtime::{Lateness, Prepared, Validity};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkStats, NodeId};

use crate::engine::{Engine, IntakeCounts, LinkCounts};

/// What a relay did, at its end.
#[derive(Debug)]
pub struct Report {
    /// How long it ran.
    pub elapsed: Duration,
    /// What the system granted the thread.
    pub prepared: Prepared,
    /// Each directed link, by sender and then by receiver.
    pub links: Vec<LinkReport>,
    /// Each port; of a proxy, the one that listens, and those of all clients together.
    pub ports: Vec<PortReport>,
    /// What came in.
    pub intake: IntakeCounts,
    /// How late each datagram was handed to the kernel: the release error. It includes the share in `clamped`.
    pub release: Lateness,
    /// By how much datagrams were offered later than they came, of those that were.
    pub clamped: Lateness,
    /// Still on their way at the end.
    pub held: (u64, Bytes),
    /// Clients that were sent away because no socket could be had.
    pub without_socket: u64,
    /// Changes of links that are not there.
    pub refused_changes: u64,
    /// Whether what left was as late as tolerated.
    pub validity: Validity,
}

/// What one directed link did.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkReport {
    /// The name of its sender.
    pub from: String,
    /// The name of its receiver.
    pub to: String,
    /// What the link counts: offered, delivered, dropped by cause, delay.
    pub stats: LinkStats,
    /// What the relay counts besides.
    pub counts: LinkCounts,
}

/// What one port did.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PortReport {
    /// The name of its program; `listen` and `clients` for a proxy.
    pub name: String,
    /// Where it is; `None` for the ports of clients.
    pub address: Option<SocketAddr>,
    /// What it received and sent, and what it did not.
    pub counts: EndpointCounts,
    /// How many bytes may wait in the kernel to be read, as the kernel counts them.
    pub receive_buffer: usize,
    /// Datagrams that the kernel dropped because that was full; `None` if the system does not tell.
    pub kernel_drops: Option<u64>,
}

/// How things stand, while a relay runs.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub(super) now: Instant,
    pub(super) engine: &'a Engine,
    pub(super) release: &'a Lateness,
}

impl View<'_> {
    /// The logical time.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Each directed link, by sender and then by receiver. A mesh of N programs has N·(N−1): look at them as often as that allows.
    #[must_use]
    pub fn links(&self) -> Vec<LinkReport> {
        links(self.engine)
    }

    /// The delays of the latest datagrams that came out of a link, in no order: of 128 at most.
    #[must_use]
    pub fn recent_delays(&self, from: NodeId, to: NodeId) -> &[Duration] {
        self.engine.recent_delays(from, to)
    }

    /// What came in.
    #[must_use]
    pub const fn intake(&self) -> &IntakeCounts {
        self.engine.counts()
    }

    /// The release error so far.
    #[must_use]
    pub const fn release(&self) -> &Lateness {
        self.release
    }

    /// How many datagrams are on their way, and how many bytes.
    #[must_use]
    pub fn held(&self) -> (u64, Bytes) {
        self.engine.held()
    }

    /// How many clients there are; for a mesh, none.
    #[must_use]
    pub fn clients(&self) -> usize {
        self.engine.clients()
    }

    /// Where a program is, if that is known; `None` for a proxy.
    #[must_use]
    pub fn program_address(&self, program: NodeId) -> Option<SocketAddr> {
        self.engine.program_address(program)
    }
}

/// What every link did.
pub(super) fn links(engine: &Engine) -> Vec<LinkReport> {
    let nodes = || (0..).map(NodeId).zip(engine.names());
    let pairs = nodes().flat_map(|from| nodes().map(move |to| (from, to))).filter(|((from, _), (to, _))| from != to);
    let report = |((from, from_name), (to, to_name)): ((NodeId, &String), (NodeId, &String))| {
        let (stats, counts) = engine.link_stats(from, to)?;
        Some(LinkReport { from: from_name.clone(), to: to_name.clone(), stats, counts })
    };
    pairs.filter_map(report).collect()
}
