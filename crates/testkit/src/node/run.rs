//! Running nodes: their time, their links, and the record of the run.

use std::any::{Any, type_name};
use std::collections::VecDeque;
use std::fmt;
use std::panic::Location;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::{LinkStats, NodeId, Path, flow_number};

use super::deadlines::Deadlines;
use super::{Node, Packet};
use crate::access::AccessStats;
use crate::again::Again;
use crate::artefacts::Artefacts;
use crate::failure;
use crate::names::Names;
use crate::record::Record;
use crate::seed::Seed;
use crate::setup::Setup;
use crate::watch::{Kind, Watched};
use crate::wire::{Form, HasFlow, Wire};

/// Running nodes.
///
/// Between the steps of time the test looks at the nodes, changes the nodes, and breaks links between nodes. At one instant packets arrive first, in the
/// order of the [network](cohaptic_wan::Network). Then the timers that are due go off, in the order of the nodes. Then packets arrive that are sent at this
/// instant over links without delay. If the test fails while the run exists, the seed is printed, and the record is written where
/// [`Nodes::artefacts`](super::Nodes::artefacts) says.
pub struct NodeRun {
    pub(super) names: Arc<Names>,
    /// Nodes by index. `None` while a node is down, or while a method of the node runs.
    pub(super) nodes: Vec<Option<Box<dyn Node>>>,
    pub(super) up: Vec<bool>,
    pub(super) wire: Wire<Ports>,
    pub(super) deadlines: Deadlines,
    pub(super) counts: Vec<NodeCounts>,
    /// Packets that have arrived and are not handed over yet, with the receiver.
    pub(super) arrived: VecDeque<(NodeId, Packet)>,
    /// Nodes changed by the test. Their packets and deadlines must be polled again.
    touched: Vec<NodeId>,
    /// Number of events since time last passed.
    pub(super) done: u64,
    pub(super) patience: u64,
    time_limit: Duration,
    again: Again,
    artefacts: Artefacts,
    pub(super) watched: Arc<Watched>,
}

/// Activity of a node that keeps time from passing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Does {
    Sends,
    Receives,
    Wakes,
}

/// Ports of a packet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ports {
    pub(super) from: u16,
    pub(super) to: u16,
    /// `true` if the packet is of IPv6.
    pub(super) is_six: bool,
}

impl HasFlow for Ports {
    fn flow(&self, Path { from, to }: Path) -> u32 {
        // Two hosts and two ports of 16 bits each fill the 64 bits of `ends`.
        let ends = [from.0, to.0, self.from, self.to].into_iter().fold(0, |ends, part| ends << 16 | u64::from(part));
        flow_number(&[ends, self.is_six.into()])
    }

    /// Packets of nodes are captured as contents.
    fn form(&self) -> Form {
        Form::Content
    }
}

/// Number of packets and timers of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub struct NodeCounts {
    /// Packets that the node has sent, to any address.
    pub sent: u64,
    /// Packets that the node was handed.
    pub arrived: u64,
    /// Timers that went off.
    pub timeouts: u64,
    /// Packets from the node to an address of no node.
    pub unroutable: u64,
    /// Packets that were lost because the node was down when they arrived.
    pub while_down: u64,
    /// Packets sent by the node that were lost because the path was cut when they were sent or would have arrived.
    pub cut: u64,
}

impl NodeRun {
    pub(super) fn new(mut setup: Setup, nodes: Vec<Box<dyn Node>>, seed: Seed) -> Self {
        let artefacts = Artefacts::new(setup.artefacts.take(), &seed);
        // The folder may come from the environment, without a word in the test.
        if artefacts.is_wanted() {
            setup.record();
        }
        let link = setup.links();
        let Setup { names, settings, changes, stall_limit, .. } = setup;
        let count = names.len();
        let watched = Watched::begin(Kind::Nodes, &names, stall_limit, &seed, &artefacts);
        let mut run = Self {
            nodes: nodes.into_iter().map(Some).collect(),
            wire: Wire::new(&names, seed.value, &settings, changes, link),
            up: vec![true; count],
            deadlines: Deadlines::new(count),
            counts: vec![NodeCounts::default(); count],
            arrived: VecDeque::new(),
            // Every node counts as touched, so that `ask_touched` below asks each node for its first packets and deadline.
            touched: (0..count).map(NodeId::new).collect(),
            done: 0,
            patience: settings.patience,
            time_limit: settings.limits.time,
            again: Again {
                hosts: names.len(),
                names: Arc::clone(&names),
                said: settings.said,
                laws: settings.laws,
                seed,
                others: Vec::new(),
                place: Location::caller(),
            },
            artefacts,
            watched,
            names,
        };
        run.ask_touched();
        run
    }

    /// Returns the time since the run began.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.wire.now()
    }

    /// Returns the node named `name`.
    ///
    /// # Panics
    ///
    /// If no node has the name, the node is down, or the node is of another type.
    #[must_use]
    pub fn node<T: Node>(&self, name: &str) -> &T {
        let id = self.id(name);
        let node: &dyn Any = self.nodes[id.index()].as_deref().unwrap_or_else(|| is_down(name));
        node.downcast_ref().unwrap_or_else(|| is_another::<T>(name))
    }

    /// Returns the node named `name`, for changes. Before time passes, the node is asked for packets and its deadline.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::node`].
    #[must_use]
    pub fn node_mut<T: Node>(&mut self, name: &str) -> &mut T {
        let id = self.id(name);
        // Noted before the node is lent, because the run does not learn when the test has finished its changes.
        self.touched.push(id);
        let node: &mut dyn Any = self.nodes[id.index()].as_deref_mut().unwrap_or_else(|| is_down(name));
        node.downcast_mut().unwrap_or_else(|| is_another::<T>(name))
    }

    /// Returns the counts of a node.
    ///
    /// # Panics
    ///
    /// If no node has the name.
    #[must_use]
    pub fn counts(&self, name: &str) -> NodeCounts {
        self.counts[self.id(name).index()]
    }

    /// Returns the statistics of the link from a node to another node so far.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub fn link_stats(&self, from: &str, to: &str) -> LinkStats {
        self.wire.link_stats(self.names.path(from, to)).unwrap_or_else(|| panic!("node `{from}` has no link to itself; name two nodes"))
    }

    /// Returns the statistics of the access lines (`Nodes::access`) of a node so far, or `None` if the node has none.
    ///
    /// # Panics
    ///
    /// If no node has the name.
    #[must_use]
    pub fn access_stats(&self, name: &str) -> Option<AccessStats> {
        self.wire.access_stats(self.id(name))
    }

    /// Returns the instant of the next event, or `None` if nothing will happen.
    ///
    /// # Panics
    ///
    /// If a node that the test has touched never stops sending.
    pub fn next_event(&mut self) -> Option<Instant> {
        self.ask_touched();
        self.next()
    }

    /// Lets time pass to the next event, and lets all events of that instant happen. Returns whether there was any.
    ///
    /// # Panics
    ///
    /// If a node panics, or time stands still because a node sends, or wants to be woken, again and again.
    pub fn step(&mut self) -> bool {
        self.ask_touched();
        let next = self.next();
        if let Some(next) = next {
            self.pass(next);
        }
        next.is_some()
    }

    /// Lets time pass until `until`, with all events up to and including that instant.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::step`]; if `until` has passed.
    pub fn run_until(&mut self, until: Instant) {
        assert!(
            until >= self.now(),
            "the run cannot go on until {} s: the run is already at {} s; give a later instant",
            Seconds(until),
            Seconds(self.now())
        );
        self.ask_touched();
        while let Some(next) = self.next().filter(|next| *next <= until) {
            self.pass(next);
        }
        // The last event may lie before `until`, so the time is still to be moved.
        self.wire.set_now(until);
    }

    /// Lets time pass until nothing will happen any more: no packet is under way, and no node wants to be woken. Returns that instant.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::step`]; if events go on beyond the [time limit](super::Nodes::time_limit).
    #[expect(clippy::panic, reason = "a test that waits for ever; says the way out")]
    pub fn run_until_idle(&mut self) -> Instant {
        while self.step() {
            if self.is_late() {
                panic!(
                    "the nodes are not idle at {} s, beyond the time limit; run nodes that always wake again with `run_until` or `run_while`.{}",
                    Seconds(self.now()),
                    self.network()
                );
            }
        }
        self.now()
    }

    /// Lets time pass while `is_so` returns true, and returns the first instant at which `is_so` returns false. `is_so` is called after every instant with an
    /// event.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::step`]; if `is_so` is still true when nothing will happen any more, or at the [time limit](super::Nodes::time_limit).
    #[expect(clippy::panic, reason = "a test that waits for what never comes; says the way out")]
    pub fn run_while(&mut self, mut is_so: impl FnMut(&Self) -> bool) -> Instant {
        // Asked before the first step: a condition that is false already lets no time pass.
        while is_so(self) {
            if !self.step() {
                panic!(
                    "nothing will ever happen after {} s, and the condition of `run_while` still holds: no packet is under way, and no node wants to be \
                     woken. A node needs a timer for each packet that may be lost",
                    Seconds(self.now())
                );
            }
            if self.is_late() {
                panic!(
                    "the condition of `run_while` still holds at {} s, beyond the time limit; `Nodes::time_limit` sets another limit.{}",
                    Seconds(self.now()),
                    self.network()
                );
            }
        }
        self.now()
    }

    /// Returns the record so far. Packets under way are followed to their end, for the fates only.
    ///
    /// # Panics
    ///
    /// If the run is not [recorded](super::Nodes::recorded).
    #[must_use]
    pub fn record(&self) -> Record {
        assert!(self.wire.recording().traces, "the run was not recorded; call `Nodes::recorded` before `start`");
        Record::new(self.again.seed.clone(), self.wire.recorded())
    }

    /// Returns a description of the network, for messages.
    fn network(&self) -> String {
        let lines = self.again.said.lines(&self.names);
        if lines.is_empty() { String::new() } else { format!(" The network:\n  {}", lines.join("\n  ")) }
    }

    fn is_late(&self) -> bool {
        self.now().saturating_duration_since(Instant::ZERO) > self.time_limit
    }

    /// Polls packets and deadlines of the nodes that the test has changed.
    pub(super) fn ask_touched(&mut self) {
        if self.touched.is_empty() {
            return;
        }
        for node in std::mem::take(&mut self.touched) {
            self.ask(node, Does::Sends);
        }
        // Packets over links without delay arrive before the test goes on.
        self.hand_over();
    }

    pub(super) fn touch(&mut self, node: NodeId) {
        self.touched.push(node);
    }

    pub(super) fn id(&self, name: &str) -> NodeId {
        self.names.node(name)
    }

    fn next(&self) -> Option<Instant> {
        [self.wire.next(), self.deadlines.next()].into_iter().flatten().min()
    }
}

#[expect(clippy::panic, reason = "a misuse, and the way out")]
fn is_down<T>(name: &str) -> T {
    panic!("node `{name}` is down; `NodeRun::restart` puts a node in its place")
}

#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(super) fn is_another<T>(name: &str) -> ! {
    panic!("node `{name}` is not a `{}`; name the type of the node that was added", type_name::<T>())
}

impl Drop for NodeRun {
    fn drop(&mut self) {
        // A run that is dropped without a panic has nothing to report.
        if std::thread::panicking() {
            let mut recorded = self.wire.recorded();
            let drawn = std::mem::take(&mut recorded.drawn);
            // A test without chance, or with the seed of its place, fails again as it stands.
            let differs = failure::is_searching() || !self.again.seed.is_of_place && self.again.has_chance();
            let network = if differs { self.again.network(&drawn) } else { Vec::new() };
            let text = if network.is_empty() {
                String::new()
            } else {
                format!("the nodes meet the same fates again with this network:\n    {}\n", network.join("\n    "))
            };
            let (artefacts, record) = (self.artefacts.clone(), Record::new(self.again.seed.clone(), recorded));
            failure::report(Box::new(move || artefacts.report(None, text, record)));
        }
    }
}

impl fmt::Debug for NodeRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NodeRun").field("names", &self.names).field("now", &self.now()).finish_non_exhaustive()
    }
}
