//! Nodes that run: their time, the questions that they are asked, and the way of a packet.

use std::any::{Any, type_name};
use std::collections::VecDeque;
use std::fmt;
use std::panic::Location;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::{LinkStats, NodeId};

use super::deadlines::Deadlines;
use super::{Node, Packet};
use crate::again::Again;
use crate::artefacts::Artefacts;
use crate::failure;
use crate::names::Names;
use crate::record::Record;
use crate::seed::Seed;
use crate::setup::Setup;
use crate::watch::{Kind, Watched};
use crate::wire::Wire;

/// Nodes that run.
///
/// Between the steps the test looks at the nodes, changes them, and breaks the links between them. At one instant packets arrive first, in the order of the
/// [network](cohaptic_wan::Network); then the timers go off that are due, in the order of the nodes; then packets arrive that are sent at this instant over links without
/// delay. If the test fails while the run is there, the seed is told, and what [`Nodes::artefacts`](super::Nodes::artefacts) asked for is written.
pub struct NodeRun {
    pub(super) names: Arc<Names>,
    /// `None`: crashed, or being asked.
    pub(super) nodes: Vec<Option<Box<dyn Node>>>,
    pub(super) up: Vec<bool>,
    pub(super) wire: Wire<Ports>,
    pub(super) deadlines: Deadlines,
    pub(super) counts: Vec<NodeCounts>,
    /// What has arrived and is not handed over yet.
    pub(super) arrived: VecDeque<(NodeId, Packet)>,
    /// Nodes that the test has touched.
    touched: Vec<NodeId>,
    /// What was done since time last passed.
    pub(super) done: u64,
    pub(super) patience: u64,
    time_limit: Duration,
    again: Again,
    artefacts: Artefacts,
    pub(super) watched: Arc<Watched>,
}

/// What a node does that keeps time from passing.
#[derive(Clone, Copy, Debug)]
pub(super) enum Does {
    Sends,
    Receives,
    Wakes,
}

/// The ports of a packet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ports {
    pub(super) from: u16,
    pub(super) to: u16,
    /// Whether it is of version 6 of IP.
    pub(super) is_six: bool,
}

/// What a node has sent and got.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub struct NodeCounts {
    /// Packets that it sent, wherever they went.
    pub sent: u64,
    /// Packets that it was handed.
    pub arrived: u64,
    /// Timers that went off.
    pub timeouts: u64,
    /// Packets that it sent to an address that no node has.
    pub unroutable: u64,
    /// Packets that were lost because it was down when they arrived.
    pub while_down: u64,
    /// Packets of it that were lost because the way was cut when they were sent, or would have arrived.
    pub cut: u64,
}

impl NodeRun {
    pub(super) fn new(mut setup: Setup, nodes: Vec<Box<dyn Node>>, seed: Seed) -> Self {
        let artefacts = Artefacts::new(setup.artefacts.take(), &seed);
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
            touched: (0..count).map(NodeId::new).collect(),
            done: 0,
            patience: settings.patience,
            time_limit: settings.limits.time,
            again: Again { names: Arc::clone(&names), said: settings.said, laws: settings.laws, seed, others: Vec::new(), place: Location::caller() },
            artefacts,
            watched,
            names,
        };
        run.ask_touched();
        run
    }

    /// The time since the run began.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.wire.now()
    }

    /// The names of the nodes, in the order in which they were added.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// A node.
    ///
    /// # Panics
    ///
    /// If there is none of that name, it is down, or of another type.
    #[must_use]
    pub fn node<T: Node>(&self, name: &str) -> &T {
        let id = self.id(name);
        let node: &dyn Any = self.nodes[id.index()].as_deref().unwrap_or_else(|| is_down(name));
        node.downcast_ref().unwrap_or_else(|| is_another::<T>(name))
    }

    /// A node, to be changed. What it wants to send then is sent now, and its timer is asked for anew.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::node`].
    #[must_use]
    pub fn node_mut<T: Node>(&mut self, name: &str) -> &mut T {
        let id = self.id(name);
        self.touched.push(id);
        let node: &mut dyn Any = self.nodes[id.index()].as_deref_mut().unwrap_or_else(|| is_down(name));
        node.downcast_mut().unwrap_or_else(|| is_another::<T>(name))
    }

    /// What a node has sent and got.
    ///
    /// # Panics
    ///
    /// If there is none of that name.
    #[must_use]
    pub fn counts(&self, name: &str) -> NodeCounts {
        self.counts[self.id(name).index()]
    }

    /// What the link from one node to another has done so far.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub fn link_stats(&self, from: &str, to: &str) -> LinkStats {
        self.wire.link_stats(self.names.path(from, to)).unwrap_or_else(|| panic!("node `{from}` has no link to itself"))
    }

    /// When something happens next; `None` if nothing will.
    ///
    /// # Panics
    ///
    /// If a node that the test has touched never ends to send.
    pub fn next_event(&mut self) -> Option<Instant> {
        self.ask_touched();
        self.next()
    }

    /// Lets happen what happens next, all that is due at that instant; says whether there was anything.
    ///
    /// # Panics
    ///
    /// If a node does, or time stands still: a node sends, or wants to be woken, again and again.
    pub fn step(&mut self) -> bool {
        self.ask_touched();
        let next = self.next();
        if let Some(next) = next {
            self.pass(next);
        }
        next.is_some()
    }

    /// Lets time pass until then, with all that happens, that instant included.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::step`]; if the instant has passed.
    pub fn run_until(&mut self, until: Instant) {
        assert!(until >= self.now(), "{} s has passed: it is {} s", Seconds(until), Seconds(self.now()));
        self.ask_touched();
        while let Some(next) = self.next().filter(|next| *next <= until) {
            self.pass(next);
        }
        self.wire.set_now(until);
    }

    /// Lets time pass until nothing will happen any more: no packet is on its way, and no node wants to be woken. Gives that instant.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::step`]; if there is no end before the [time limit](super::Nodes::time_limit).
    #[expect(clippy::panic, reason = "a test that waits for ever; says the way out")]
    pub fn run_until_idle(&mut self) -> Instant {
        while self.step() {
            if self.is_late() {
                panic!(
                    "at {} s something happens still; nodes that always wake again run with `run_until` or `run_while`.{}",
                    Seconds(self.now()),
                    self.network()
                );
            }
        }
        self.now()
    }

    /// Lets time pass as long as that is so; it is asked after every instant at which something happened. Gives the instant at which it is so no more.
    ///
    /// # Panics
    ///
    /// As [`NodeRun::step`]; if it is so still when nothing will happen any more, or at the [time limit](super::Nodes::time_limit).
    #[expect(clippy::panic, reason = "a test that waits for what never comes; says the way out")]
    pub fn run_while(&mut self, mut is_so: impl FnMut(&Self) -> bool) -> Instant {
        while is_so(self) {
            if !self.step() {
                panic!(
                    "nothing will ever happen after {} s, and what was to end has not ended: no packet is on its way, and no node wants to be woken. A lost \
                     packet needs a timer",
                    Seconds(self.now())
                );
            }
            if self.is_late() {
                panic!("at {} s what was to end has not ended; `Nodes::time_limit` lets it go on for longer.{}", Seconds(self.now()), self.network());
            }
        }
        self.now()
    }

    /// What has happened so far. Packets that are on their way are followed to their end, in the fates alone.
    ///
    /// # Panics
    ///
    /// If it is not [recorded](super::Nodes::recorded).
    #[must_use]
    pub fn record(&self) -> Record {
        assert!(self.wire.recording().traces, "nothing was recorded; `Nodes::recorded` asks for it");
        Record::new(self.again.seed.clone(), self.wire.recorded())
    }

    /// Returns the network in words, for messages.
    fn network(&self) -> String {
        let lines = self.again.said.lines(&self.names);
        if lines.is_empty() { String::new() } else { format!(" The network:\n  {}", lines.join("\n  ")) }
    }

    fn is_late(&self) -> bool {
        self.now().saturating_duration_since(Instant::ZERO) > self.time_limit
    }

    /// Asks the nodes that the test has touched.
    pub(super) fn ask_touched(&mut self) {
        if self.touched.is_empty() {
            return;
        }
        for node in std::mem::take(&mut self.touched) {
            self.ask(node, Does::Sends);
        }
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
    panic!("node `{name}` is down; `NodeRun::restart` brings one back in its place")
}

#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(super) fn is_another<T>(name: &str) -> ! {
    panic!("node `{name}` is no `{}`", type_name::<T>())
}

impl Drop for NodeRun {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let mut recorded = self.wire.recorded();
            let drawn = std::mem::take(&mut recorded.drawn);
            // A test without chance, or with the seed of its place, fails again as it stands.
            let differs = failure::is_searching() || !self.again.seed.is_of_place && self.again.has_chance();
            let network = if differs { self.again.network(&drawn) } else { Vec::new() };
            let text = if network.is_empty() {
                String::new()
            } else {
                format!("nodes with this network meet the same again:\n    {}\n", network.join("\n    "))
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
