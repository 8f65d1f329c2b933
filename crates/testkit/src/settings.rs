//! Settings of a run.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_wan::{NodeId, Path};

use crate::access::AccessLines;
use crate::again::Said;
use crate::hit::Laws;
use crate::middlebox::{Interfaces, Middlebox};

/// Settings of a run.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// Size of the receive buffer of a UDP socket \[bytes\].
    pub(crate) receive_buffer: usize,
    /// Addresses chosen by the test, in short form, by host and version of IP (true for 6).
    pub(crate) addresses: BTreeMap<(NodeId, bool), u32>,
    /// `true` if the address of IPv6 comes first when a name is looked up.
    pub(crate) six_first: bool,
    /// `true` if events are recorded.
    pub(crate) traces: bool,
    /// `true` if recorded events contain digests of the packets' bytes.
    pub(crate) digests: bool,
    /// `true` if packets are recorded, with their bytes.
    pub(crate) keeps_packets: bool,
    /// Maximum number of polls of tasks, or of handled packets and timers, at one instant.
    pub(crate) patience: u64,
    /// Maximum number of bytes that the run may hold.
    pub(crate) byte_limit: u64,
    /// Limits beyond which a run fails.
    pub(crate) limits: Limits,
    /// Description of the network as the test gave it.
    pub(crate) said: Arc<Said>,
    /// Laws that hit packets.
    pub(crate) laws: Laws,
    /// Access lines of hosts with access lines.
    pub(crate) access: BTreeMap<NodeId, AccessLines>,
    /// NATs and firewalls. Each stands after all that are behind it.
    pub(crate) middleboxes: Vec<Middlebox>,
    /// Hosts with several interfaces.
    pub(crate) interfaces: Vec<Interfaces>,
    /// Parts of the system that the test bed stands in for.
    #[cfg(feature = "facade")]
    pub(crate) standard: Standard,
    /// Link for packets of the sender to itself; `None` if such packets arrive at once. The receiver of the link is a host without programs.
    pub(crate) loopback: Option<Path>,
}

impl Settings {
    /// Returns the number of nodes that are no hosts: NATs, firewalls and interfaces.
    pub(crate) fn devices(&self) -> usize {
        self.middleboxes.len() + self.interfaces.iter().map(|interfaces| interfaces.nodes.len()).sum::<usize>()
    }
}

/// Parts of the system that a test bed stands in for, beside sockets and names.
#[cfg(feature = "facade")]
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub(crate) struct Standard {
    /// `true` if clocks are virtual.
    pub(crate) clocks: bool,
    /// `true` if random numbers come from the seed.
    pub(crate) random: bool,
}

/// Limits of a run, beyond which the run fails.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Limits {
    /// Limit of the virtual time of the run.
    pub(crate) time: Duration,
    /// Limit of the polls of tasks.
    pub(crate) steps: u64,
}

/// Default time limit, longer than tests mean to run. A program that asks five times a second has asked 18,000 times by then.
const TIME: Duration = Duration::from_secs(3600);

/// Default limit of polls, which take some seconds by the wall clock.
const STEPS: u64 = 20_000_000;

impl Default for Limits {
    fn default() -> Self {
        Self { time: TIME, steps: STEPS }
    }
}

/// Limit that a run has reached.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Reached {
    Time(Duration),
    Steps(u64),
}

impl Limits {
    /// Returns the last instant of a run.
    pub(crate) fn until(self) -> Instant {
        Instant::ZERO.saturating_add(self.time)
    }

    /// Returns the limit that a run has reached after `steps` polls.
    pub(crate) const fn reached(self, steps: u64) -> Reached {
        if steps > self.steps { Reached::Steps(self.steps) } else { Reached::Time(self.time) }
    }
}
