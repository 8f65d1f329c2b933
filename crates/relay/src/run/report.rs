//! Views of a running relay, and the report at the end of the run.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_realtime::udp::EndpointCounts;
use cohaptic_realtime::{Lateness, Prepared, Validity};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkStats, NodeId};

use crate::engine::{Engine, IntakeCounts, LinkCounts};

/// Report of a finished run.
#[derive(Debug)]
pub struct Report {
    /// Length of the run.
    pub elapsed: Duration,
    /// Requests of the thread, granted or refused by the system.
    pub prepared: Prepared,
    /// Directed links, ordered by sender and then by receiver.
    pub links: Vec<LinkReport>,
    /// Ports, in the order of the programs. For a proxy: the listening port, then a single entry for the ports of all clients.
    pub ports: Vec<PortReport>,
    /// Counters of arrived datagrams.
    pub intake: IntakeCounts,
    /// Release error: time from the due departure of a datagram to the call of the kernel, for each datagram handed to the kernel. Includes the share in
    /// `clamped`.
    pub release: Lateness,
    /// Time from arrival to offer, of late datagrams only.
    pub clamped: Lateness,
    /// Number and payload bytes of the datagrams in flight at the end.
    pub held: (u64, Bytes),
    /// Clients sent away because no socket could be opened.
    pub without_socket: u64,
    /// Requested changes of links that do not exist.
    pub refused_changes: u64,
    /// Verdict on the release error, by the tolerance of the run.
    pub validity: Validity,
}

/// Counters of one directed link.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkReport {
    /// Name of the sender.
    pub from: String,
    /// Name of the receiver.
    pub to: String,
    /// Counters and delays kept by the link: offered, delivered, dropped by cause.
    pub stats: LinkStats,
    /// Counters kept by the relay.
    pub counts: LinkCounts,
}

/// Counters of one port.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PortReport {
    /// Name of the program; `listen` and `clients` for a proxy.
    pub name: String,
    /// Local address; `None` for the ports of clients.
    pub address: Option<SocketAddr>,
    /// Datagrams received, sent and lost at the socket.
    pub counts: EndpointCounts,
    /// Size of the receive buffer in the kernel, in the kernel's own count \[bytes\]; the smallest size among the ports of clients.
    pub receive_buffer: usize,
    /// Datagrams dropped by the kernel because the receive buffer was full; `None` if the system does not tell.
    pub kernel_drops: Option<u64>,
}

/// State of a running relay.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    pub(super) now: Instant,
    pub(super) engine: &'a Engine,
    pub(super) release: &'a Lateness,
}

impl View<'_> {
    /// Returns the time of the relay's clock at this look.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Returns the counters of each directed link, ordered by sender and then by receiver. A mesh of N programs has N·(N−1) links, and the list is made anew on
    /// each call.
    #[must_use]
    pub fn links(&self) -> Vec<LinkReport> {
        links(self.engine)
    }

    /// Returns the delays of the latest datagrams delivered by a link, at most 128, in no particular order.
    #[must_use]
    pub fn recent_delays(&self, from: NodeId, to: NodeId) -> &[Duration] {
        self.engine.recent_delays(from, to)
    }

    /// Returns the counters of arrived datagrams.
    #[must_use]
    pub const fn intake(&self) -> &IntakeCounts {
        self.engine.counts()
    }

    /// Returns the release error so far.
    #[must_use]
    pub const fn release(&self) -> &Lateness {
        self.release
    }

    /// Returns the number and the payload bytes of the datagrams in flight.
    #[must_use]
    pub fn held(&self) -> (u64, Bytes) {
        self.engine.held()
    }

    /// Returns the number of clients; zero for a mesh.
    #[must_use]
    pub fn clients(&self) -> usize {
        self.engine.clients()
    }
}

/// Returns the counters of every link of the network, ordered by sender and then by receiver.
pub(super) fn links(engine: &Engine) -> Vec<LinkReport> {
    let nodes = || (0..).map(NodeId).zip(engine.names());
    let pairs = nodes().flat_map(|from| nodes().map(move |to| (from, to))).filter(|((from, _), (to, _))| from != to);
    // Every pair has a link, so `?` leaves no pair out.
    let report = |((from, from_name), (to, to_name)): ((NodeId, &String), (NodeId, &String))| {
        let (stats, counts) = engine.link_stats(from, to)?;
        Some(LinkReport { from: from_name.clone(), to: to_name.clone(), stats, counts })
    };
    pairs.filter_map(report).collect()
}
