//! What a run of nodes is made of.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_wan::{LinkModel, NodeId, Path};

use super::{Node, NodeRun};
use crate::bed::{Names, add_all};
use crate::file::{LinkChange, LinkFile};
use crate::hit::Laws;
use crate::link::ToLink;
use crate::record::Record;
use crate::runtime::limits::Limits;
use crate::seed::{Place, Seed};
use crate::watch::LIMIT;
use crate::wire::{BYTE_LIMIT, Settings};

/// State machines, and the links between them.
#[must_use = "nodes do nothing until they are started"]
pub struct Nodes {
    pub(super) names: Names,
    pub(super) nodes: Vec<Box<dyn Node>>,
    every: LinkModel,
    links: BTreeMap<Path, LinkModel>,
    /// In order of time.
    pub(super) changes: Vec<LinkChange>,
    seed: Option<u64>,
    pub(super) settings: Settings,
    pub(super) time_limit: Duration,
    pub(super) artefacts: Option<PathBuf>,
    pub(super) stall_limit: Duration,
}

/// A million packets and timers at one instant take about a tenth of a second.
const PATIENCE: u64 = 1_000_000;

/// Longer than any test means to run, and with a timer each millisecond over in a second.
const TIME_LIMIT: Duration = Duration::from_secs(3600);

impl Default for Nodes {
    fn default() -> Self {
        Self::new()
    }
}

impl Nodes {
    /// No nodes yet, with ideal links between those that come.
    pub fn new() -> Self {
        Self {
            names: Names::default(),
            nodes: Vec::new(),
            every: LinkModel::default(),
            links: BTreeMap::new(),
            changes: Vec::new(),
            seed: None,
            settings: Settings {
                receive_buffer: 0,
                traces: false,
                keeps_packets: false,
                patience: PATIENCE,
                byte_limit: BYTE_LIMIT,
                limits: Limits::default(),
                said: Arc::default(),
                digests: true,
                laws: Laws::default(),
            },
            time_limit: TIME_LIMIT,
            artefacts: None,
            stall_limit: LIMIT,
        }
    }

    /// One more node. The n-th, from 0, has the addresses of [`address()`](super::address()).
    ///
    /// # Panics
    ///
    /// If the name is empty or there already, or has one of the characters that an address is written with (`:`, `[`, `]`, white space).
    pub fn add(mut self, name: &str, node: impl Node) -> Self {
        self.names.add(name.to_owned());
        self.nodes.push(Box::new(node));
        self
    }

    /// What every link is that is not named by [`Nodes::link`], before or after: a model, or words of `tc-netem`.
    ///
    /// # Panics
    ///
    /// If the words are none.
    pub fn links(mut self, link: impl ToLink) -> Self {
        self.every = link.to_link();
        Arc::make_mut(&mut self.settings.said).set_every(&link);
        self
    }

    /// What the link from one node to another is, of those that have been added; the way back is a link of its own.
    ///
    /// # Panics
    ///
    /// If there is no such node, both are the same, or the words are none.
    pub fn link(mut self, from: &str, to: &str, link: impl ToLink) -> Self {
        let path = self.names.path(from, to);
        assert!(path.from != path.to, "node `{from}` has no link to itself");
        self.links.insert(path, link.to_link());
        Arc::make_mut(&mut self.settings.said).set(path, &link);
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
        let LinkFile { hosts, every, links, changes, hits, seed } = match LinkFile::read(path) {
            Ok(file) => file,
            Err(error) => panic!("{error}"),
        };
        add_all(&mut self.settings.laws, &self.names, &hits);
        let nodes: Vec<NodeId> = hosts.iter().map(|host| self.names.node(host)).collect();
        let links = links.into_iter().map(|((from, to), link)| (Path { from: nodes[from], to: nodes[to] }, link)).collect();
        let changes =
            changes.into_iter().map(|change| LinkChange { from: nodes[change.from].index(), to: nodes[change.to].index(), ..change }).collect();
        let links: BTreeMap<Path, LinkModel> = links;
        Arc::make_mut(&mut self.settings.said).set_models(every == LinkModel::default(), links.keys().copied());
        Self { every, links, changes, seed: seed.or(self.seed), ..self }
    }

    /// The seed of all chance in the links, unless the environment says another one ([`SEED_VARIABLE`](crate::SEED_VARIABLE)). Without it, the seed is made of
    /// the file, the line and the column of the call of [`Nodes::start`], or as that of a [test bed](crate::Testbed::seed) in [`Nodes::run_twice`]. Nodes of the same names on the same links with the same seed meet what the hosts of a [`Testbed`](crate::Testbed) meet.
    pub const fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// How many packets may be sent, and packets and timers handled, at one instant before the run is given up, because time does not pass; a million if it is
    /// not said.
    pub const fn patience(mut self, events: u64) -> Self {
        self.settings.patience = events;
        self
    }

    /// How many bytes the run may hold that were sent and neither read nor lost; a gibibyte if it is not said. A run that comes to hold more fails, and names the
    /// node that sent last: see [`Testbed::byte_limit`](crate::Testbed::byte_limit).
    pub const fn byte_limit(mut self, bytes: u64) -> Self {
        self.settings.byte_limit = bytes;
        self
    }

    /// For how long by the wall clock a node may run without returning: see [`Testbed::stall_limit`](crate::Testbed::stall_limit).
    pub const fn stall_limit(mut self, limit: Duration) -> Self {
        self.stall_limit = limit;
        self
    }

    /// Until when a run that waits for something may go on before it is given up; an hour of its own time if it is not said.
    pub const fn time_limit(mut self, limit: Duration) -> Self {
        self.time_limit = limit;
        self
    }

    /// Records what happens, for [`NodeRun::record`]: every event, and every packet with what it carries.
    pub const fn recorded(mut self) -> Self {
        self.settings.traces = true;
        self.settings.keeps_packets = true;
        self
    }

    /// If the test fails while the run is there, what happened is written into this folder: see [`Record::write`].
    pub fn artefacts(mut self, folder: impl Into<PathBuf>) -> Self {
        self.artefacts = Some(folder.into());
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
        assert!(!self.names.is_empty(), "a run without nodes; `add` one before `start`");
        let seed = Seed::choose(self.seed, place);
        let (every, links) = (self.every.clone(), self.links.clone());
        NodeRun::new(self, seed, move |from, to| links.get(&Path { from, to }).unwrap_or(&every).clone())
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
        f.debug_struct("Nodes").field("names", &self.names).field("seed", &self.seed).finish_non_exhaustive()
    }
}
