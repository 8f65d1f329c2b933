//! Table of the directed links of a full mesh: the configuration of most links, and the links with another configuration.

use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::Arc;

use cohaptic_wan::LinkModel;

/// Directed links of a full mesh. Equal links share one configuration.
///
/// A mesh of N peers has N·(N−1) links, nearly all of them alike. The table stores the configuration of most links, and each link with another
/// configuration. Memory grows with the number of entries for single links, and not with N². Two tables are equal exactly if all pairs of peers have equal
/// links, whatever the order of configurations and exceptions in the calls that made the tables.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkTable {
    /// Number of peers N, at least 2.
    peers: usize,
    /// Distinct configurations, in order of first use. Each configuration is used by a link.
    configs: Vec<Arc<LinkModel>>,
    /// Index in `configs` of the most frequent configuration. Of several equally frequent configurations, the first.
    usual: usize,
    /// Indices in `configs` of the links with another configuration, by sender and receiver.
    exceptions: BTreeMap<(usize, usize), usize>,
}

impl LinkTable {
    /// Returns the table of the links between `peers` peers. Every link is `usual`, except the pairs (sender, receiver) in `exceptions`. Pairs of a peer with
    /// itself, and pairs with a peer beyond the last one, are no links and are left out.
    ///
    /// # Panics
    ///
    /// If `peers` is below two, because such a mesh has no link.
    #[must_use]
    pub fn new(peers: usize, usual: Arc<LinkModel>, exceptions: impl IntoIterator<Item = ((usize, usize), Arc<LinkModel>)>) -> Self {
        assert!(peers >= 2, "{peers} peers have no link between them: expected at least two");
        let is_link = |(from, to): (usize, usize)| from != to && from < peers && to < peers;
        let own: BTreeMap<(usize, usize), Arc<LinkModel>> = exceptions.into_iter().filter(|(pair, _)| is_link(*pair)).collect();
        let mut configs = Configs::default();
        let mut exceptions = BTreeMap::new();
        // Configurations are in the order of first use, so the usual configuration is placed just before the first exception after the first usual link.
        let first_usual = first_left(peers, own.keys().copied());
        let mut usual_place = None;
        for (pair, config) in &own {
            if first_usual.is_some_and(|first| first < *pair) {
                usual_place.get_or_insert_with(|| configs.place(&usual));
            }
            exceptions.insert(*pair, configs.place(config));
        }
        if first_usual.is_some() {
            usual_place.get_or_insert_with(|| configs.place(&usual));
        }
        Self::canonical(peers, configs.found, usual_place, exceptions)
    }

    /// Returns a table in which all links are equal.
    ///
    /// # Panics
    ///
    /// If `peers` is below two.
    #[must_use]
    pub fn uniform(peers: usize, link: impl Into<LinkModel>) -> Self {
        Self::new(peers, Arc::new(link.into()), [])
    }

    /// Makes the most frequent configuration the usual configuration, so that equal tables are stored alike. `usual` is an index in `configs`, or `None` if all
    /// links are exceptions.
    fn canonical(peers: usize, configs: Vec<Arc<LinkModel>>, usual: Option<usize>, mut exceptions: BTreeMap<(usize, usize), usize>) -> Self {
        exceptions.retain(|_, place| Some(*place) != usual);
        let mut counts = vec![0_u64; configs.len()];
        exceptions.values().for_each(|place| counts[*place] += 1);
        if let Some(usual) = usual {
            // All links without an exception have the usual configuration.
            counts[usual] = link_count(peers) - exceptions.len() as u64;
        }
        // In reverse order, because `max_by_key` returns the last maximum, and the first configuration must win a tie.
        let most = (0..counts.len()).rev().max_by_key(|place| counts[*place]).unwrap_or(0);
        if usual != Some(most) {
            // The exceptions outnumber the usual links here or are as many, so this walk over all links costs no more than reading the exceptions did.
            let given = exceptions;
            let place = |pair: (usize, usize)| given.get(&pair).copied().or(usual).filter(|place| *place != most);
            exceptions = pairs(peers).filter_map(|pair| place(pair).map(|place| (pair, place))).collect();
        }
        Self { peers, configs, usual: most, exceptions }
    }

    /// Returns the number of peers N. The mesh has N·(N−1) links.
    #[must_use]
    pub const fn peers(&self) -> usize {
        self.peers
    }

    /// Returns the distinct configurations in order of first use, by sender and then by receiver. Each configuration is used by a link.
    #[must_use]
    pub fn configs(&self) -> &[Arc<LinkModel>] {
        &self.configs
    }

    /// Returns the link from one peer to another, by their indices in the file. For a peer with itself, or an index beyond the last peer, the answer has no
    /// meaning.
    #[must_use]
    pub fn between(&self, from: usize, to: usize) -> &LinkModel {
        &self.configs[self.config_between(from, to)]
    }

    /// Returns the link from one peer to another as an index in [`LinkTable::configs`].
    #[must_use]
    pub fn config_between(&self, from: usize, to: usize) -> usize {
        // Most meshes have no exceptions, and need no look-up then.
        if self.exceptions.is_empty() {
            return self.usual;
        }
        self.exceptions.get(&(from, to)).copied().unwrap_or(self.usual)
    }

    /// Returns the index in [`LinkTable::configs`] of the most frequent configuration. Of several equally frequent configurations, the first.
    #[must_use]
    pub const fn usual(&self) -> usize {
        self.usual
    }

    /// Returns the links with another configuration than [`LinkTable::usual`], by sender and then by receiver, each with its index in [`LinkTable::configs`].
    pub fn exceptions(&self) -> impl Iterator<Item = ((usize, usize), usize)> + '_ {
        self.exceptions.iter().map(|(pair, place)| (*pair, *place))
    }

    /// Returns the configurations in order of first use, each with the number of its links, at least 1.
    pub fn used(&self) -> impl Iterator<Item = (&Arc<LinkModel>, u64)> + '_ {
        let mut counts = vec![0; self.configs.len()];
        self.exceptions.values().for_each(|place| counts[*place] += 1);
        counts[self.usual] = link_count(self.peers) - self.exceptions.len() as u64;
        self.configs.iter().zip(counts)
    }

    /// Returns whether all links have the same configuration.
    #[must_use]
    pub const fn is_uniform(&self) -> bool {
        self.configs.len() == 1
    }
}

/// Change of a link to a new configuration.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkChange {
    /// Index of the sender among the peers or programs.
    pub from: usize,
    /// Index of the receiver among the peers or programs.
    pub to: usize,
    /// New configuration of the link.
    pub config: Arc<LinkModel>,
}

/// Returns the number of directed links between `peers` peers.
pub(super) const fn link_count(peers: usize) -> u64 {
    (peers as u64) * (peers as u64).saturating_sub(1)
}

/// Returns every directed link as (sender, receiver), by sender and then by receiver.
pub fn pairs(peers: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..peers).flat_map(move |from| (0..peers).filter(move |&to| to != from).map(move |to| (from, to)))
}

/// Returns the first link that is missing in `given`, or `None` if `given` has all links. `given` must be ordered by sender and then by receiver. Takes at most
/// a step more than `given` has links.
pub(super) fn first_left(peers: usize, given: impl Iterator<Item = (usize, usize)>) -> Option<(usize, usize)> {
    let mut given = given;
    pairs(peers).find(|pair| given.next() != Some(*pair))
}

/// Distinct configurations, in order of first use.
#[derive(Default)]
struct Configs {
    /// Configurations found so far.
    found: Vec<Arc<LinkModel>>,
    /// Indices in `found`, by mean delay and the bits of the mean loss. Equal configurations have equal keys, and different configurations rarely do.
    places: BTreeMap<(Duration, u64), Vec<usize>>,
}

impl Configs {
    /// Returns the index of a configuration in `found`. A new configuration is added.
    fn place(&mut self, config: &Arc<LinkModel>) -> usize {
        let loss = config.as_fixed().and_then(|fixed| fixed.loss.mean()).unwrap_or(0.0);
        // The zeros 0 and -0 are equal and differ in their bits. Adding zero makes both the ordinary zero.
        let alike = self.places.entry((config.mean_delay(), (loss + 0.0).to_bits())).or_default();
        // Pointers are compared first, because most calls pass the same few configurations.
        let known = alike.iter().find(|place| Arc::ptr_eq(&self.found[**place], config) || self.found[**place] == *config);
        if let Some(place) = known {
            return *place;
        }
        alike.push(self.found.len());
        self.found.push(Arc::clone(config));
        self.found.len() - 1
    }
}
