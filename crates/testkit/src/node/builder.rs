//! What a run of nodes is made of.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use super::{Node, NodeRun};
use crate::file::LinkFile;
use crate::link::ToLink;
use crate::names::Names;
use crate::record::Record;
use crate::seed::{Place, Seed};
use crate::setup::Setup;

/// State machines, and the links between them.
#[must_use = "nodes do nothing until they are started"]
pub struct Nodes {
    pub(super) setup: Setup,
    pub(super) nodes: Vec<Box<dyn Node>>,
}

impl Default for Nodes {
    fn default() -> Self {
        Self::new()
    }
}

impl Nodes {
    /// No nodes yet, with ideal links between those that come.
    pub fn new() -> Self {
        Self { setup: Setup::new("node", Names::default()), nodes: Vec::new() }
    }

    /// One more node. The n-th, from 0, has the addresses of [`address()`](super::address()).
    ///
    /// # Panics
    ///
    /// If the name is empty or there already, or has one of the characters that an address is written with (`:`, `[`, `]`, white space).
    pub fn add(mut self, name: &str, node: impl Node) -> Self {
        self.setup.add(name);
        self.nodes.push(Box::new(node));
        self
    }

    /// What every link is that is not named by [`Nodes::link`], before or after: a model, or words of `tc-netem`.
    ///
    /// # Panics
    ///
    /// If the words are none.
    pub fn links(mut self, link: impl ToLink) -> Self {
        self.setup.set_every(link);
        self
    }

    /// What the link from one node to another is, of those that have been added; the way back is a link of its own.
    ///
    /// # Panics
    ///
    /// If there is no such node, both are the same, or the words are none.
    pub fn link(mut self, from: &str, to: &str, link: impl ToLink) -> Self {
        self.setup.set_link(from, to, link);
        self
    }

    /// What the links in both directions between two nodes are. Each has random numbers of its own.
    ///
    /// # Panics
    ///
    /// As [`Nodes::link`].
    pub fn link_both(self, one: &str, other: &str, link: impl ToLink) -> Self {
        self.link(one, other, &link).link(other, one, &link)
    }

    /// All links, what becomes of them, and the seed, as a file says: see [`LinkFile`]. Its hosts are nodes that have been added.
    ///
    /// # Panics
    ///
    /// If the file cannot be read or makes no sense, with the path, the place and the line; if one of its hosts is no node.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    #[track_caller]
    pub fn links_from_file(mut self, path: impl AsRef<std::path::Path>) -> Self {
        match LinkFile::read(path) {
            Ok(file) => self.setup.read(file),
            Err(error) => panic!("{error}"),
        }
        self
    }

    /// The seed of all chance in the links, unless the environment says another one ([`SEED_VARIABLE`](crate::SEED_VARIABLE)). Without it, the seed is made of
    /// the file, the line and the column of the call of [`Nodes::start`], or as that of a [test bed](crate::Testbed::seed) in [`Nodes::run_twice`]. Nodes of the same names on the same links with the same seed meet what the hosts of a [`Testbed`](crate::Testbed) meet.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.setup.seed = Some(seed);
        self
    }

    /// How many packets may be sent, and packets and timers handled, at one instant before the run is given up, because time does not pass; a million if it is
    /// not said.
    pub const fn patience(mut self, events: u64) -> Self {
        self.setup.settings.patience = events;
        self
    }

    /// How many bytes the run may hold that were sent and neither read nor lost; a gibibyte if it is not said. A run that comes to hold more fails, and names the
    /// node that sent last: see [`Testbed::byte_limit`](crate::Testbed::byte_limit).
    pub const fn byte_limit(mut self, bytes: u64) -> Self {
        self.setup.settings.byte_limit = bytes;
        self
    }

    /// For how long by the wall clock a node may run without returning: see [`Testbed::stall_limit`](crate::Testbed::stall_limit).
    pub const fn stall_limit(mut self, limit: Duration) -> Self {
        self.setup.stall_limit = limit;
        self
    }

    /// Until when a run that waits for something may go on before it is given up; an hour of its own time if it is not said.
    pub const fn time_limit(mut self, limit: Duration) -> Self {
        self.setup.settings.limits.time = limit;
        self
    }

    /// Records what happens, for [`NodeRun::record`]: every event, and every packet with what it carries.
    pub const fn recorded(mut self) -> Self {
        self.setup.record();
        self
    }

    /// If the test fails while the run is there, what happened is written into this folder: see [`Record::write`].
    pub fn artefacts(mut self, folder: impl Into<PathBuf>) -> Self {
        self.setup.artefacts = Some(folder.into());
        self.recorded()
    }

    /// Begins: asks every node what it wants to send at the beginning, in their order.
    ///
    /// # Panics
    ///
    /// If there is no node; if what the environment says of the seed is no number; if a node never ends to send.
    #[must_use]
    #[track_caller]
    pub fn start(self) -> NodeRun {
        self.start_at(&Place::here())
    }

    fn start_at(self, place: &Place) -> NodeRun {
        assert!(!self.setup.names.is_empty(), "a run without nodes; `add` one before `start`");
        let seed = Seed::choose(self.setup.seed, place);
        NodeRun::new(self.setup, self.nodes, seed)
    }

    /// Runs nodes twice, and gives what came out first, if all that happened was the same to the nanosecond: every packet, with what it carried. `build` makes the
    /// nodes, anew each time.
    ///
    /// # Panics
    ///
    /// If the two runs differ, with the first difference and its time.
    #[expect(clippy::panic, reason = "what it was asked to find out")]
    #[track_caller]
    pub fn run_twice<T>(build: impl Fn() -> Self, program: impl Fn(&mut NodeRun) -> T) -> T {
        let place = Place::of(&program);
        let run = || -> (T, Record) {
            let mut run = build().recorded().start_at(&place);
            (program(&mut run), run.record())
        };
        let ((outcome, first), (_, second)) = (run(), run());
        if let Some(difference) = first.trace().first_difference(second.trace()) {
            panic!(
                "the nodes do not do the same twice: {difference}Look for hash maps, threads, the time of day and random numbers without a seed.\n{}",
                first.seed().advice()
            );
        }
        outcome
    }
}

impl fmt::Debug for Nodes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Nodes").field("names", &self.setup.names).field("seed", &self.setup.seed).finish_non_exhaustive()
    }
}
