//! Networks of links in the words of `tc-netem`.

use core::fmt;
use core::str::FromStr;
use std::collections::{BTreeMap, BTreeSet};

use cohaptic_wan::{LinkModel, NetworkConfig, NodeId};

use super::link::{ImpairedLink, LinkError};
use crate::nat::{Behaviour, parse_words};

/// Maximum number of hosts of a network.
const MOST: usize = 1_000;

/// Hosts, with a link from each host to each other host. Most links may be ideal.
///
/// The text form is a line with the number of hosts, followed by a line per host behind a NAT (`nat a: strict`) and a line per impaired link. The names of the
/// hosts are `a` to `z`, then `aa`, `ab`, and so on, in the order of their [`NodeId`]. `Debug` prints Rust code that makes the same value. The value can be
/// parsed from the same lines; empty lines and blanks around lines are ignored, and `;` also ends a line.
///
/// ```
/// use cohaptic_testkit::strategies::{ImpairedLink, ImpairedNetwork};
/// use cohaptic_wan::{Network, NodeId};
///
/// let network = ImpairedNetwork::ideal(3).with_link(NodeId(0), NodeId(2), ImpairedLink::words("delay 24ms"));
/// assert_eq!(network.to_string(), "3 hosts\na -> c: delay 24ms");
/// assert_eq!(ImpairedNetwork::words("3 hosts; a -> c: delay 24ms"), network);
///
/// let wan: Network<&str> = Network::new(network.config(7), |from, to| network.model(from, to));
/// # let _ = wan;
/// ```
#[derive(Clone, PartialEq)]
pub struct ImpairedNetwork {
    hosts: usize,
    /// Links by sender and receiver. A missing entry is an ideal link.
    links: BTreeMap<(NodeId, NodeId), ImpairedLink>,
    /// Behaviour of the NATs of hosts behind NATs.
    nats: BTreeMap<NodeId, Behaviour>,
    ideal: ImpairedLink,
}

/// Error of a text that describes no network.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub enum NetworkTextError {
    /// The first line is not a number of hosts.
    Hosts {
        /// The line.
        found: String,
    },
    /// A line is not a link.
    Line {
        /// The line.
        found: String,
    },
    /// A line names a host that does not exist, or a link from a host to itself.
    NoLink {
        /// The line.
        found: String,
        /// Name of the first host.
        first: String,
        /// Name of the last host.
        last: String,
    },
    /// A line does not put a host behind a NAT.
    Nat {
        /// The line.
        found: String,
        /// Fault of the line.
        reason: String,
    },
    /// Two lines describe the same link.
    Repeated {
        /// The sender.
        from: String,
        /// The receiver.
        to: String,
    },
    /// The words of a link are refused.
    Link {
        /// The sender.
        from: String,
        /// The receiver.
        to: String,
        /// Error of the words.
        reason: LinkError,
    },
}

impl fmt::Display for NetworkTextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hosts { found } => write!(f, "\"{found}\" is not a number of hosts: expected a first line such as \"3 hosts\", with 1 to {MOST}"),
            Self::Line { found } => write!(f, "\"{found}\" is not a link: expected a line such as \"a -> b: delay 24ms\""),
            Self::NoLink { found, first, last } => write!(f, "\"{found}\" is not a link between two of the hosts {first} to {last}"),
            Self::Nat { found, reason } => write!(f, "\"{found}\" puts no host behind a NAT: {reason}"),
            Self::Repeated { from, to } => write!(f, "the link {from} -> {to} is given twice: expected one line for each link"),
            Self::Link { from, to, reason } => write!(f, "{from} -> {to}:\n{reason}"),
        }
    }
}

impl std::error::Error for NetworkTextError {}

impl ImpairedNetwork {
    /// Creates a network whose links are all ideal.
    ///
    /// # Panics
    ///
    /// With no hosts, or more than 1000.
    #[must_use]
    #[track_caller]
    pub fn ideal(hosts: usize) -> Self {
        assert!((1..=MOST).contains(&hosts), "a network cannot have {hosts} hosts: expected 1 to {MOST} hosts");
        Self { hosts, links: BTreeMap::new(), nats: BTreeMap::new(), ideal: ImpairedLink::ideal() }
    }

    /// Parses the text that `Debug` prints.
    ///
    /// # Panics
    ///
    /// If the text is refused; `text.parse::<ImpairedNetwork>()` returns an error instead.
    #[must_use]
    #[track_caller]
    #[expect(clippy::panic, reason = "documented: for text that stands in a test")]
    pub fn words(text: &str) -> Self {
        text.parse().unwrap_or_else(|error| panic!("these words do not describe a network: {error}"))
    }

    /// Returns the network with the given link replaced.
    ///
    /// # Panics
    ///
    /// If there is no link between these hosts.
    #[must_use]
    #[track_caller]
    pub fn with_link(mut self, from: NodeId, to: NodeId, link: ImpairedLink) -> Self {
        assert!(
            self.is_link(from, to),
            "there is no link from node {} to node {}: expected two different nodes, numbered below {}",
            from.0,
            to.0,
            self.hosts
        );
        self.put(from, to, link);
        self
    }

    /// Returns the network with a host behind a NAT of its own. The words are those of [`Testbed::nat`](crate::Testbed::nat). The links of the host then are
    /// the links of its NAT, and the link between host and NAT is ideal.
    ///
    /// # Panics
    ///
    /// If there is no such host, or the words are wrong.
    #[must_use]
    #[track_caller]
    #[expect(clippy::panic, reason = "documented: for words that stand in a test")]
    pub fn with_nat(mut self, host: NodeId, words: &str) -> Self {
        assert!(host.index() < self.hosts, "there is no node {}: expected a number below {}", host.0, self.hosts);
        let behaviour = parse_words(words, Behaviour::default(), true).unwrap_or_else(|error| panic!("these words do not describe a NAT: {error}"));
        self.nats.insert(host, behaviour);
        self
    }

    /// Returns the hosts behind NATs, with the words of their NATs, sorted by host.
    pub fn nats(&self) -> impl Iterator<Item = (NodeId, String)> {
        self.nats.iter().map(|(host, behaviour)| (*host, behaviour.to_string()))
    }

    /// Returns the behaviour of the NAT of a host.
    pub(super) fn behaviour(&self, host: NodeId) -> Option<&Behaviour> {
        self.nats.get(&host)
    }

    /// Sets the behaviour of the NAT of a host; `None` takes the NAT away.
    pub(super) fn set_behaviour(&mut self, host: NodeId, behaviour: Option<Behaviour>) {
        match behaviour {
            Some(behaviour) => drop(self.nats.insert(host, behaviour)),
            None => drop(self.nats.remove(&host)),
        }
    }

    /// Returns the number of hosts.
    #[must_use]
    pub const fn hosts(&self) -> usize {
        self.hosts
    }

    /// Returns the name of a host in the text form.
    #[must_use]
    pub fn name(node: NodeId) -> String {
        // Names count in base 26 without a digit for zero: after `z` comes `aa`.
        let mut rest = u64::from(node.0) + 1;
        let mut letters = Vec::new();
        while let Some(place) = rest.checked_sub(1) {
            letters.push(u8::try_from(place % 26).map_or('?', |letter| char::from(b'a' + letter)));
            rest = place / 26;
        }
        letters.into_iter().rev().collect()
    }

    /// Returns the names of the hosts and the seed, as [`cohaptic_wan::Network::new`] needs beside the links.
    #[must_use]
    pub fn config(&self, seed: u64) -> NetworkConfig {
        NetworkConfig { seed, nodes: self.nodes().map(Self::name).collect(), ..NetworkConfig::default() }
    }

    /// Returns the link from a host to another host, or `None` without such a link.
    #[must_use]
    pub fn link(&self, from: NodeId, to: NodeId) -> Option<&ImpairedLink> {
        self.is_link(from, to).then(|| self.links.get(&(from, to)).unwrap_or(&self.ideal))
    }

    /// Returns the model of a link. The model is ideal if there is no such link.
    #[must_use]
    pub fn model(&self, from: NodeId, to: NodeId) -> LinkModel {
        self.link(from, to).map(ImpairedLink::model).unwrap_or_default()
    }

    /// Returns all links, sorted by sender, then receiver.
    pub fn links(&self) -> impl Iterator<Item = (NodeId, NodeId, &ImpairedLink)> {
        self.nodes().flat_map(move |from| self.nodes().filter_map(move |to| Some((from, to, self.link(from, to)?))))
    }

    /// Returns the links that are not ideal.
    pub fn impaired(&self) -> impl Iterator<Item = (NodeId, NodeId, &ImpairedLink)> {
        self.links.iter().filter(|(_, link)| !link.is_ideal()).map(|((from, to), link)| (*from, *to, link))
    }

    /// Returns the number of impairments of all links together.
    #[must_use]
    pub fn stages(&self) -> usize {
        self.links.values().map(|link| link.stages().len()).sum()
    }

    /// Returns the network without a host. The hosts after it get smaller indices. The only host of a network stays.
    #[cfg(feature = "scenes")]
    pub(super) fn without_host(&self, gone: usize) -> Self {
        let moved = |node: NodeId| {
            let place = node.index();
            (place != gone).then_some(NodeId(node.0 - u16::from(place > gone)))
        };
        let mut less = Self::ideal((self.hosts - 1).max(1));
        let links = self.links.iter().filter_map(|((from, to), link)| Some((moved(*from)?, moved(*to)?, link.clone())));
        links.for_each(|(from, to, link)| less.put(from, to, link));
        less.nats = self.nats.iter().filter_map(|(host, behaviour)| Some((moved(*host)?, behaviour.clone()))).collect();
        less
    }

    fn nodes(&self) -> impl Iterator<Item = NodeId> + use<> {
        (0..self.hosts).map(NodeId::new)
    }

    fn is_link(&self, from: NodeId, to: NodeId) -> bool {
        let is_host = |node: NodeId| node.index() < self.hosts;
        is_host(from) && is_host(to) && from != to
    }

    /// Stores a link. An ideal link is not stored.
    fn put(&mut self, from: NodeId, to: NodeId, link: ImpairedLink) {
        // Equal networks must have equal maps, because `PartialEq` compares the maps.
        if link == self.ideal {
            self.links.remove(&(from, to));
        } else {
            self.links.insert((from, to), link);
        }
    }

    /// Returns the host named `name`.
    fn named(&self, name: &str) -> Option<NodeId> {
        self.nodes().find(|node| Self::name(*node) == name)
    }
}

impl fmt::Display for ImpairedNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} hosts", self.hosts)?;
        for (host, behaviour) in &self.nats {
            write!(f, "\nnat {}: {behaviour}", Self::name(*host))?;
        }
        // Stored links include links without impairments, such as a link with a seed only.
        for ((from, to), link) in &self.links {
            write!(f, "\n{} -> {}: {link}", Self::name(*from), Self::name(*to))?;
        }
        Ok(())
    }
}

impl fmt::Debug for ImpairedNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ImpairedNetwork::words(\"")?;
        for line in self.to_string().lines() {
            write!(f, "\n    {line}")?;
        }
        write!(f, "\n\")")
    }
}

impl FromStr for ImpairedNetwork {
    type Err = NetworkTextError;

    fn from_str(text: &str) -> Result<Self, NetworkTextError> {
        let mut lines = text.split(['\n', ';']).map(str::trim).filter(|line| !line.is_empty());
        let first = lines.next().unwrap_or_default();
        let count = first.strip_suffix("hosts").or_else(|| first.strip_suffix("host")).and_then(|count| count.trim().parse().ok());
        let hosts: usize = count.filter(|count| (1..=MOST).contains(count)).ok_or_else(|| NetworkTextError::Hosts { found: first.to_owned() })?;
        let mut network = Self::ideal(hosts);
        // The network stores no ideal links, so a repeated line of an ideal link would not be noticed there.
        let mut said = BTreeSet::new();
        for line in lines {
            if let Some((host, words)) = line.strip_prefix("nat ").filter(|_| !line.contains("->")).and_then(|rest| rest.split_once(':')) {
                let wrong = |reason: String| NetworkTextError::Nat { found: line.to_owned(), reason };
                let host = network.named(host.trim()).ok_or_else(|| wrong("there is no such host".to_owned()))?;
                let behaviour = parse_words(words.trim(), Behaviour::default(), true).map_err(|error| wrong(error.message().to_owned()))?;
                if network.nats.insert(host, behaviour).is_some() {
                    return Err(wrong("the host has a NAT already".to_owned()));
                }
                continue;
            }
            let halves = line.split_once("->").and_then(|(from, rest)| rest.split_once(':').map(|(to, words)| (from.trim(), to.trim(), words)));
            let Some((from, to, words)) = halves else { return Err(NetworkTextError::Line { found: line.to_owned() }) };
            let pair = network.named(from).zip(network.named(to)).filter(|(from, to)| from != to);
            let Some((sender, receiver)) = pair else {
                let last = network.nodes().last().map(Self::name).unwrap_or_default();
                return Err(NetworkTextError::NoLink { found: line.to_owned(), first: Self::name(NodeId(0)), last });
            };
            let (from, to) = (from.to_owned(), to.to_owned());
            if !said.insert((sender, receiver)) {
                return Err(NetworkTextError::Repeated { from, to });
            }
            let link = words.trim().parse().map_err(|reason| NetworkTextError::Link { from, to, reason })?;
            network.put(sender, receiver, link);
        }
        Ok(network)
    }
}
