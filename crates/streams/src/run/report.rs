//! Views of a running relay of TCP, and the report at the end of the run.

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_realtime::{Lateness, Tolerance, Validity};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::LinkStats;

use crate::engine::{Counts, Engine, LineCounts};

/// Report of a finished run.
#[derive(Clone, Debug)]
pub struct Report {
    /// Length of the run.
    pub elapsed: Duration,
    /// Proxies, in the order of the configuration.
    pub proxies: Vec<ProxyReport>,
    /// Connections open at the end, and then closed.
    pub open: usize,
    /// Bytes held by the relay at the end.
    pub held: Bytes,
    /// Lateness of the first write of each batch of bytes, from the instant at which the bytes had left their line. Writes that waited for their receiver are
    /// left out.
    pub release: Lateness,
    /// Verdict on the lateness, by the tolerance of the run.
    pub validity: Validity,
}

/// Report of a proxy.
#[derive(Clone, PartialEq, Debug)]
pub struct ProxyReport {
    /// Name of the proxy.
    pub name: String,
    /// Listening address.
    pub listen: SocketAddr,
    /// Address of the program.
    pub to: SocketAddr,
    /// Counters of connections.
    pub counts: Counts,
    /// Lines forth and back.
    pub lines: [LineReport; 2],
}

/// Counters of a line.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LineReport {
    /// Counters of bytes.
    pub bytes: LineCounts,
    /// Counters of pieces, with the ends of streams, and their mean delay.
    pub pieces: LinkStats,
}

impl Report {
    pub(super) fn new(engine: &Engine, addresses: &[SocketAddr], now: Instant, release: &Lateness, tolerance: Tolerance) -> Self {
        let proxies = engine.config().proxies.iter().zip(addresses).enumerate();
        let proxy = |(place, (proxy, listen)): (usize, (&crate::Proxy, &SocketAddr))| {
            let [forth, back] = [0, 1].map(|way| line(engine, 2 * place + way));
            Some(ProxyReport { name: proxy.name.clone(), listen: *listen, to: proxy.to, counts: *engine.counts(place)?, lines: [forth?, back?] })
        };
        Self {
            elapsed: now.saturating_duration_since(Instant::ZERO),
            // Every proxy has counters and two lines, so `?` leaves none out.
            proxies: proxies.filter_map(proxy).collect(),
            open: engine.open_connections(),
            held: engine.held(),
            validity: tolerance.judge(release, "writes"),
            release: release.clone(),
        }
    }
}

/// Returns the counters of the line with an index.
fn line(engine: &Engine, line: usize) -> Option<LineReport> {
    let (bytes, pieces) = engine.line(line)?;
    Some(LineReport { bytes, pieces })
}

/// State of a running relay of TCP.
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

    /// Returns the counters of a line: 2n is forth and 2n + 1 is back, of proxy n.
    #[must_use]
    pub fn line(&self, line: usize) -> Option<LineReport> {
        self::line(self.engine, line)
    }

    /// Returns the delays of the latest pieces of a line, at most 128, in no particular order.
    #[must_use]
    pub fn recent_delays(&self, line: usize) -> &[Duration] {
        self.engine.recent_delays(line)
    }

    /// Returns the counters of the connections of a proxy.
    #[must_use]
    pub fn counts(&self, proxy: usize) -> Option<&Counts> {
        self.engine.counts(proxy)
    }

    /// Returns the lateness so far.
    #[must_use]
    pub const fn release(&self) -> &Lateness {
        self.release
    }

    /// Returns the number of open connections.
    #[must_use]
    pub fn open_connections(&self) -> usize {
        self.engine.open_connections()
    }
}
