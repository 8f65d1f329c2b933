//! Builder of a run of nodes.

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
    /// Creates a builder without nodes. Links between added nodes are ideal.
    pub fn new() -> Self {
        Self { setup: Setup::new("node", Names::default()), nodes: Vec::new() }
    }

    /// Adds a node. Node number n, from 0, has the addresses of [`address()`](super::address()).
    ///
    /// # Panics
    ///
    /// If the name is empty or taken, or contains a character with which an address is written (`:`, `[`, `]`, white space).
    pub fn add(mut self, name: &str, node: impl Node) -> Self {
        self.setup.add(name);
        self.nodes.push(Box::new(node));
        self
    }

    /// Sets all links that no call of [`Nodes::link`] names, whether before or after this call. A link is a model, or words of `tc-netem`.
    ///
    /// # Panics
    ///
    /// If the words describe no link.
    pub fn links(mut self, link: impl ToLink) -> Self {
        self.setup.set_every(link);
        self
    }

    /// Sets the link from a node to another node. Both nodes must have been added. The link back is separate.
    ///
    /// # Panics
    ///
    /// If there is no such node, if both nodes are the same, or if the words describe no link.
    pub fn link(mut self, from: &str, to: &str, link: impl ToLink) -> Self {
        self.setup.set_link(from, to, link);
        self
    }

    /// Sets the links in both directions between two nodes. Each link draws random numbers of its own.
    ///
    /// # Panics
    ///
    /// As [`Nodes::link`].
    pub fn link_both(self, one: &str, other: &str, link: impl ToLink) -> Self {
        self.link(one, other, &link).link(other, one, &link)
    }

    /// Gives a node the access lines of a link of the library (feature `files`): see [`Testbed::access`](crate::Testbed::access). The node must have been
    /// added.
    ///
    /// # Panics
    ///
    /// As [`Testbed::access`](crate::Testbed::access).
    #[cfg(feature = "files")]
    pub fn access(mut self, node: &str, link: impl AsRef<str>) -> Self {
        self.setup.set_access(node, link.as_ref());
        self
    }

    /// Sets all links, their changes, the access lines and the seed as a file says: see [`LinkFile`]. The hosts of the file are nodes that have been added.
    ///
    /// # Panics
    ///
    /// If the file cannot be read or makes no sense, or if one of its hosts is no node. The message names the path, the place and the line.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    #[track_caller]
    pub fn links_from_file(mut self, path: impl AsRef<std::path::Path>) -> Self {
        match LinkFile::read(path) {
            Ok(file) => self.setup.read(file),
            Err(error) => panic!("{error}"),
        }
        self
    }

    /// Sets the seed of all chance in the links. The environment variable [`SEED_VARIABLE`](crate::SEED_VARIABLE) takes precedence. Without either, the seed is
    /// derived from the file, the line and the column of the call of [`Nodes::start`], or as for a [test bed](crate::Testbed::seed) in [`Nodes::run_twice`].
    /// With the same seed, nodes on the same links see the same delays and losses as the hosts of a [`Testbed`](crate::Testbed) with the same names.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.setup.seed = Some(seed);
        self
    }

    /// Sets how many packets may be sent, and packets and timers handled, at one instant. Beyond this number the run fails, because time does not pass. The
    /// default is a million.
    pub const fn patience(mut self, events: u64) -> Self {
        self.setup.settings.patience = events;
        self
    }

    /// Sets how many bytes the run may hold that were sent and neither read nor lost. The default is a gibibyte. A run that holds more fails, and the message
    /// names the node that sent last: see [`Testbed::byte_limit`](crate::Testbed::byte_limit).
    pub const fn byte_limit(mut self, bytes: u64) -> Self {
        self.setup.settings.byte_limit = bytes;
        self
    }

    /// Sets how long a node may run without returning, by the wall clock: see [`Testbed::stall_limit`](crate::Testbed::stall_limit).
    pub const fn stall_limit(mut self, limit: Duration) -> Self {
        self.setup.stall_limit = limit;
        self
    }

    /// Sets the time limit of a run that waits for an end, in virtual time. The default is an hour.
    pub const fn time_limit(mut self, limit: Duration) -> Self {
        self.setup.settings.limits.time = limit;
        self
    }

    /// Records every event, and every packet with its content, for [`NodeRun::record`].
    pub const fn recorded(mut self) -> Self {
        self.setup.record();
        self
    }

    /// Sets the folder into which the record is written if the test fails while the run exists: see [`Record::write`].
    pub fn artefacts(mut self, folder: impl Into<PathBuf>) -> Self {
        self.setup.artefacts = Some(folder.into());
        self.recorded()
    }

    /// Starts the run: asks every node for its first packets and its deadline, in the order of the nodes.
    ///
    /// # Panics
    ///
    /// If there is no node; if the environment variable of the seed is no number; if a node never stops sending.
    #[must_use]
    #[track_caller]
    pub fn start(self) -> NodeRun {
        self.start_at(&Place::here())
    }

    fn start_at(self, place: &Place) -> NodeRun {
        assert!(!self.setup.names.is_empty(), "the run has no nodes: `add` at least one node before `start`");
        let seed = Seed::choose(self.setup.seed, place);
        NodeRun::new(self.setup, self.nodes, seed)
    }

    /// Runs nodes twice, compares every event of the two runs to the nanosecond, with the content of every packet, and returns the first output. `build` makes
    /// the nodes anew for each run.
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
                "two runs of the nodes are not the same: {difference}Look for hash maps, threads, the time of day and random numbers without a seed.\n{}",
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
