//! Access lines of hosts. A root module of its own, because names of links and settings of runs both need it.

use cohaptic_wan::{LinkModel, LinkStats};

/// Lines between a host and all its links.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct AccessLines {
    /// Line before the links: all packets from the host pass the line.
    pub(crate) uplink: Option<LinkModel>,
    /// Line after the links: all packets to the host pass the line.
    pub(crate) downlink: Option<LinkModel>,
}

/// Statistics of the access lines of a host: see `Testbed::access` (feature `files`). A missing line has counted nothing.
#[derive(Clone, PartialEq, Debug, Default)]
#[non_exhaustive]
pub struct AccessStats {
    /// Statistics of the line before the links.
    pub uplink: LinkStats,
    /// Statistics of the line after the links.
    pub downlink: LinkStats,
}
