//! What a run is made of: hosts, links and limits. A test bed and state machines have them alike.

use std::collections::BTreeMap;
use std::panic::Location;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_wan::{LinkModel, NodeId, Path};

use crate::file::LinkFile;
use crate::hit::{Laws, PacketLaw, PathHit, SentPacket, Verdict};
use crate::link::{LinkChange, ToLink};
use crate::names::Names;
use crate::settings::{Limits, Settings};
use crate::watch::LIMIT;
use crate::wire::BYTE_LIMIT;
use crate::words::hits_on;

/// Hosts and the links between them, as the test says them.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) names: Arc<Names>,
    /// What the hosts are called in messages: `host` or `node`.
    noun: &'static str,
    every: LinkModel,
    links: BTreeMap<Path, LinkModel>,
    /// In order of time.
    pub(crate) changes: Vec<LinkChange>,
    pub(crate) seed: Option<u64>,
    pub(crate) settings: Settings,
    /// Where a failure writes what happened.
    pub(crate) artefacts: Option<PathBuf>,
    pub(crate) stall_limit: Duration,
}

/// As Linux gives a socket (`net.core.rmem_default`) \[bytes\].
pub(crate) const RECEIVE_BUFFER: usize = 212_992;

/// A million polls, or packets and timers, at one instant take a tenth of a second.
const PATIENCE: u64 = 1_000_000;

impl Setup {
    /// Hosts of these names, with ideal links between them.
    pub(crate) fn new(noun: &'static str, names: Names) -> Self {
        Self {
            names: Arc::new(names),
            noun,
            every: LinkModel::default(),
            links: BTreeMap::new(),
            changes: Vec::new(),
            seed: None,
            settings: Settings {
                receive_buffer: RECEIVE_BUFFER,
                traces: false,
                digests: true,
                keeps_packets: false,
                patience: PATIENCE,
                byte_limit: BYTE_LIMIT,
                limits: Limits::default(),
                said: Arc::default(),
                laws: Laws::default(),
            },
            artefacts: None,
            stall_limit: LIMIT,
        }
    }

    /// One more host.
    pub(crate) fn add(&mut self, name: &str) {
        Arc::make_mut(&mut self.names).add(name.to_owned());
    }

    /// What every link is that is not named.
    pub(crate) fn set_every(&mut self, link: impl ToLink) {
        self.every = link.to_link();
        Arc::make_mut(&mut self.settings.said).set_every(&link);
    }

    /// What the link from one host to another is.
    ///
    /// # Panics
    ///
    /// If there is no such host, both are the same, or the words are none.
    pub(crate) fn set_link(&mut self, from: &str, to: &str, link: impl ToLink) {
        let path = self.names.path(from, to);
        assert!(path.from != path.to, "{} `{from}` has no link to itself", self.noun);
        self.set_path(path, link);
    }

    /// What the link of a path is.
    pub(crate) fn set_path(&mut self, path: Path, link: impl ToLink) {
        self.links.insert(path, link.to_link());
        Arc::make_mut(&mut self.settings.said).set(path, &link);
    }

    /// All links, what becomes of them, and the seed, as a file says. The hosts of the file are there.
    pub(crate) fn read(&mut self, file: LinkFile) {
        let LinkFile { hosts, every, links, changes, hits, seed } = file;
        let nodes: Vec<NodeId> = hosts.iter().map(|host| self.names.node(host)).collect();
        self.add_hits(&hits);
        self.every = every;
        self.links = links.into_iter().map(|((from, to), link)| (Path { from: nodes[from], to: nodes[to] }, link)).collect();
        self.changes =
            changes.into_iter().map(|change| LinkChange { from: nodes[change.from].index(), to: nodes[change.to].index(), ..change }).collect();
        Arc::make_mut(&mut self.settings.said).set_models(self.every == LinkModel::default(), self.links.keys().copied());
        self.seed = seed.or(self.seed);
    }

    /// The link of each path.
    pub(crate) fn links(&self) -> impl Fn(NodeId, NodeId) -> LinkModel + Send + Sync + use<> {
        let (every, links) = (self.every.clone(), self.links.clone());
        move |from, to| links.get(&Path { from, to }).unwrap_or(&every).clone()
    }

    /// Records what happens, and every packet with what it carries.
    pub(crate) const fn record(&mut self) {
        self.settings.traces = true;
        self.settings.keeps_packets = true;
    }
}

/// Packets that are hit.
impl Setup {
    #[track_caller]
    pub(crate) fn add_function(&mut self, ends: [&str; 2], judge: impl FnMut(&SentPacket<'_>) -> Verdict + Clone + Send + 'static) {
        let path = self.hit_path(ends);
        self.settings.laws.add_function(path, place(), judge);
    }

    #[track_caller]
    pub(crate) fn add_law(&mut self, ends: [&str; 2], law: impl PacketLaw + Clone + Send + 'static) {
        let path = self.hit_path(ends);
        self.settings.laws.add(path, place(), law);
    }

    #[track_caller]
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    pub(crate) fn add_words(&mut self, ends: [&str; 2], words: &str) {
        let path = self.hit_path(ends);
        let hits = hits_on(words).unwrap_or_else(|error| panic!("these are no words of hits: {error}"));
        hits.into_iter().for_each(|hit| self.settings.laws.add_hit(path, hit));
    }

    pub(crate) fn add_hits(&mut self, hits: &[PathHit]) {
        for PathHit { from, to, hit } in hits {
            let path = self.hit_path([from, to]);
            self.settings.laws.add_hit(path, hit.clone());
        }
    }

    fn hit_path(&self, [from, to]: [&str; 2]) -> Path {
        let path = self.names.path(from, to);
        assert!(path.from != path.to, "host `{from}` has no link to itself");
        path
    }
}

/// The name of a law that has none: where it was given.
#[track_caller]
fn place() -> String {
    format!("the law of {}", Location::caller())
}
