//! Parts common to runs of test beds and of state machines: hosts, links and limits.

use std::collections::BTreeMap;
use std::panic::Location;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_wan::{LinkModel, NodeId, Path};

use crate::file::LinkFile;
use crate::hit::{Laws, PacketLaw, PathHit, SentPacket, Verdict};
use crate::link::{LinkChange, ToLink};
use crate::middlebox::{Interfaces, Middlebox, Topology, check_size};
use crate::names::Names;
use crate::nat::Behaviour;
use crate::settings::{Limits, Settings};
use crate::watch::LIMIT;
use crate::wire::BYTE_LIMIT;
use crate::words::hits_on;

/// Hosts and links in the form given by the test.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    pub(crate) names: Arc<Names>,
    /// Word for a host in messages: `host` or `node`.
    noun: &'static str,
    /// Link of every path that is not in `links`.
    every: LinkModel,
    links: BTreeMap<Path, LinkModel>,
    /// Changes of links, sorted by time.
    pub(crate) changes: Vec<LinkChange>,
    pub(crate) seed: Option<u64>,
    pub(crate) settings: Settings,
    /// Folder for the record of a failing run.
    pub(crate) artefacts: Option<PathBuf>,
    pub(crate) stall_limit: Duration,
}

/// Default size of a receive buffer in Linux (`net.core.rmem_default`) \[bytes\].
pub(crate) const RECEIVE_BUFFER: usize = 212_992;

/// Default patience. A million polls, or packets and timers, take a fraction of a second.
const PATIENCE: u64 = 1_000_000;

impl Setup {
    /// Creates a setup with hosts of these names, and ideal links between them.
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
                addresses: BTreeMap::new(),
                six_first: false,
                #[cfg(feature = "facade")]
                standard: crate::settings::Standard::default(),
                traces: false,
                digests: true,
                keeps_packets: false,
                patience: PATIENCE,
                byte_limit: BYTE_LIMIT,
                limits: Limits::default(),
                said: Arc::default(),
                laws: Laws::default(),
                access: BTreeMap::new(),
                middleboxes: Vec::new(),
                interfaces: Vec::new(),
                loopback: None,
            },
            artefacts: None,
            stall_limit: LIMIT,
        }
    }

    /// Adds a host.
    pub(crate) fn add(&mut self, name: &str) {
        Arc::make_mut(&mut self.names).add(name.to_owned());
    }

    /// Returns the number of hosts. NATs, firewalls and interfaces have the last names, and do not count.
    pub(crate) fn hosts(&self) -> usize {
        self.names.len() - self.settings.devices()
    }

    /// Gives a host interfaces of these names, each a node with links of its own.
    ///
    /// # Panics
    ///
    /// If there is no such host, the host has interfaces already or is behind a NAT, or another host has one of the names.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    pub(crate) fn add_interfaces(&mut self, host: &str, interfaces: &[&str]) {
        let node = self.names.node(host);
        assert!(!interfaces.is_empty(), "host `{host}` gets no interfaces: give at least one name");
        if let Err(fault) = self.check_single(node) {
            panic!("host `{host}` cannot get interfaces: {fault}");
        }
        let first = self.names.len();
        interfaces.iter().for_each(|interface| self.add(interface));
        let interfaces = Interfaces { host: node, nodes: (first..self.names.len()).map(NodeId::new).collect() };
        Arc::make_mut(&mut self.settings.said).add_device(interfaces.line(&self.names), interfaces.call(&self.names));
        self.settings.interfaces.push(interfaces);
    }

    /// Checks that a node is a host with links of its own.
    fn check_single(&self, node: NodeId) -> Result<(), String> {
        let Settings { middleboxes, interfaces, .. } = &self.settings;
        if interfaces.iter().any(|other| other.host == node || other.nodes.contains(&node)) {
            return Err("it has interfaces, or is one".to_owned());
        }
        let other = middleboxes.iter().find(|middlebox| middlebox.node == node || middlebox.inside.contains(&node));
        other.map_or(Ok(()), |other| Err(format!("it is `{}` or behind it; put its interfaces there", self.names[other.node.index()])))
    }

    /// Adds a NAT, or a firewall if `translates` is false, with the hosts named `inside` behind.
    ///
    /// # Panics
    ///
    /// If there are no such hosts, if one of them is behind another NAT or firewall, or if another host has the name.
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    pub(crate) fn add_middlebox(&mut self, name: &str, behaviour: Behaviour, translates: bool, inside: &[&str]) {
        let inside: Vec<NodeId> = inside.iter().map(|host| self.names.node(host)).collect();
        if let Err(fault) = check_size(self.settings.middleboxes.iter().filter(|middlebox| middlebox.translates).count(), translates, inside.len()) {
            panic!("`{name}` cannot be added: {fault}");
        }
        for (place, node) in inside.iter().enumerate() {
            let host = &self.names[node.index()];
            assert!(!inside[..place].contains(node), "host `{host}` is named twice behind `{name}`: name it once");
            if self.settings.interfaces.iter().any(|interfaces| interfaces.host == *node) {
                panic!("host `{host}` has interfaces, and cannot be behind `{name}` itself: name its interfaces");
            }
            if let Some(other) = self.settings.middleboxes.iter().find(|middlebox| middlebox.inside.contains(node)) {
                panic!("host `{host}` is behind `{}` already, and cannot be behind `{name}` as well", self.names[other.node.index()]);
            }
        }
        self.add(name);
        let middlebox = Middlebox { node: NodeId::new(self.names.len() - 1), behaviour, translates, inside };
        Arc::make_mut(&mut self.settings.said).add_device(middlebox.line(&self.names), middlebox.call(&self.names));
        self.settings.middleboxes.push(middlebox);
    }

    /// Checks that each link, law and access line can carry packets: hosts behind a NAT have links to the NAT and to each other alone.
    ///
    /// # Panics
    ///
    /// If a link is named that does not exist.
    pub(crate) fn check_links(&self) {
        if self.settings.devices() == 0 {
            return;
        }
        let has_interfaces = |node: NodeId| self.settings.interfaces.iter().any(|interfaces| interfaces.host == node);
        let topology = Topology::new(self.names.len(), &self.settings.middleboxes);
        let changed = self.changes.iter().map(|change| Path { from: NodeId::new(change.from), to: NodeId::new(change.to) });
        for path in self.links.keys().copied().chain(changed).chain(self.settings.laws.iter().map(|law| law.path)) {
            let is_link = topology.is_link(path.from, path.to) && ![path.from, path.to].into_iter().any(has_interfaces);
            assert!(is_link, "{}", no_link(&self.names, path));
        }
        for Interfaces { host, .. } in &self.settings.interfaces {
            let name = &self.names[host.index()];
            assert!(
                !self.settings.access.contains_key(host),
                "host `{name}` cannot have access lines, because it has no links: give them to its interfaces"
            );
        }
        for Middlebox { node, .. } in &self.settings.middleboxes {
            assert!(
                !self.settings.access.contains_key(node),
                "`{}` cannot have access lines, because packets from inside would pass its downlink: give its links to and from the hosts outside words",
                self.names[node.index()]
            );
        }
    }

    /// Sets the link of every path that is not set by itself.
    pub(crate) fn set_every(&mut self, link: impl ToLink) {
        self.every = link.to_link();
        Arc::make_mut(&mut self.settings.said).set_every(&link);
    }

    /// Sets the link from a host to another host.
    ///
    /// # Panics
    ///
    /// If there is no such host, both hosts are the same, or the words describe no link.
    pub(crate) fn set_link(&mut self, from: &str, to: &str, link: impl ToLink) {
        let path = self.names.path(from, to);
        assert!(path.from != path.to, "{noun} `{from}` has no link to itself; name two {noun}s", noun = self.noun);
        self.set_path(path, link);
    }

    /// Sets the link of a path.
    pub(crate) fn set_path(&mut self, path: Path, link: impl ToLink) {
        self.links.insert(path, link.to_link());
        Arc::make_mut(&mut self.settings.said).set(path, &link);
    }

    /// Sets the access lines of a host.
    ///
    /// # Panics
    ///
    /// If there is no such host, or `link` is no name of the library with both directions.
    #[cfg(feature = "files")]
    #[expect(clippy::panic, reason = "a test that says nonsense is to fail, with the place")]
    pub(crate) fn set_access(&mut self, host: &str, link: &str) {
        let node = self.names.node(host);
        let named = crate::library::LibraryLink::expect(link);
        // A host has one name, whatever the letters of the test: the name decides about the random numbers of its lines.
        let lines = named.and_then(|named| Ok((named.both_ways(&self.names[node.index()])?, named.to_string())));
        let (lines, words) = lines.unwrap_or_else(|error| panic!("`{link}` cannot be the access line of host `{host}`: {error}"));
        self.settings.access.insert(node, lines);
        Arc::make_mut(&mut self.settings.said).set_access(node, Some(words));
    }

    /// Sets all links, their changes, the access lines, the hits and the seed as a file says. The setup must have the hosts of the file.
    pub(crate) fn read(&mut self, file: LinkFile) {
        let LinkFile { hosts, devices, every, links, changes, access, hits, seed } = file;
        // Packets of state machines have no addresses that a NAT could translate.
        assert!(
            self.noun == "host" || devices.is_empty(),
            "the file has NATs, firewalls or interfaces, which are of sockets alone: expected links only"
        );
        // The setup may have the hosts of the file in another order, so the indices of the file are translated.
        let nodes: Vec<NodeId> = hosts.iter().map(|host| self.names.node(host)).collect();
        self.add_hits(&hits);
        self.every = every;
        self.links = links.into_iter().map(|((from, to), link)| (Path { from: nodes[from], to: nodes[to] }, link)).collect();
        self.changes =
            changes.into_iter().map(|change| LinkChange { from: nodes[change.from].index(), to: nodes[change.to].index(), ..change }).collect();
        self.settings.access = access.into_iter().map(|(host, lines)| (nodes[host], lines)).collect();
        let said = Arc::make_mut(&mut self.settings.said);
        said.set_models(self.every == LinkModel::default(), self.links.keys().copied());
        self.settings.access.keys().for_each(|host| said.set_access(*host, None));
        // A seed in the file replaces a seed set before. A later call of `seed` replaces both.
        self.seed = seed.or(self.seed);
    }

    /// Returns a function from a path to its link.
    pub(crate) fn links(&self) -> impl Fn(NodeId, NodeId) -> LinkModel + Send + Sync + use<> {
        let (every, links) = (self.every.clone(), self.links.clone());
        move |from, to| links.get(&Path { from, to }).unwrap_or(&every).clone()
    }

    /// Records every event, and every packet with its content.
    pub(crate) const fn record(&mut self) {
        self.settings.traces = true;
        self.settings.keeps_packets = true;
    }
}

/// Laws that hit packets.
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
        let hits = hits_on(words).unwrap_or_else(|error| panic!("these words do not describe hits: {error}"));
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
        assert!(path.from != path.to, "host `{from}` has no link to itself; name two hosts");
        path
    }
}

/// Returns the message that there is no link between two hosts because of a NAT or an interface.
pub(crate) fn no_link(names: &Names, Path { from, to }: Path) -> String {
    let [from, to] = [from, to].map(|node| &names[node.index()]);
    format!("`{from}` has no link to `{to}`, because a NAT, a firewall or an interface is between them: name the links on the way")
}

/// Returns the name of a law without words: the place where the test gave the law.
#[track_caller]
fn place() -> String {
    format!("the law of {}", Location::caller())
}
