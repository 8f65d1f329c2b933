//! The directed links of a full mesh: the link that most pairs have, and the pairs that have another one.

use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::Arc;

use cohaptic_wan::LinkModel;

/// The directed links of a full mesh. Equal links share one configuration.
///
/// A mesh of N peers has N·(N−1) links, nearly all of them alike. The table stores the configuration that most links have, and each link that has
/// another one: memory grows with the number of peers and with the entries for single links, and not with N². Two tables are equal exactly if the same
/// peers have equal links between them, however they came about.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkTable {
    peers: usize,
    /// The different configurations, in order of first use.
    configs: Vec<Arc<LinkModel>>,
    /// Which configuration most links have; of several the first.
    usual: usize,
    /// The links that have another one.
    exceptions: BTreeMap<(usize, usize), usize>,
}

impl LinkTable {
    /// The links between this number of peers: `usual`, but for the pairs (sender, receiver) in `exceptions`. Pairs of a peer with itself or beyond the last
    /// peer are no links and are left out.
    ///
    /// # Panics
    ///
    /// With fewer than two peers: there is no link then.
    #[must_use]
    pub fn new(peers: usize, usual: Arc<LinkModel>, exceptions: impl IntoIterator<Item = ((usize, usize), Arc<LinkModel>)>) -> Self {
        assert!(peers >= 2, "{peers} peers have no link between them: expected at least two");
        let is_link = |(from, to): (usize, usize)| from != to && from < peers && to < peers;
        let own: BTreeMap<(usize, usize), Arc<LinkModel>> = exceptions.into_iter().filter(|(pair, _)| is_link(*pair)).collect();
        let mut configs = Configs::default();
        let mut exceptions = BTreeMap::new();
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

    /// All links alike.
    ///
    /// # Panics
    ///
    /// With fewer than two peers.
    #[must_use]
    pub fn uniform(peers: usize, link: impl Into<LinkModel>) -> Self {
        Self::new(peers, Arc::new(link.into()), [])
    }

    /// Makes the configuration of most links the usual one, so that equal tables are stored alike. `usual`: `None` if all links are exceptions.
    fn canonical(peers: usize, configs: Vec<Arc<LinkModel>>, usual: Option<usize>, mut exceptions: BTreeMap<(usize, usize), usize>) -> Self {
        exceptions.retain(|_, place| Some(*place) != usual);
        let mut counts = vec![0_u64; configs.len()];
        exceptions.values().for_each(|place| counts[*place] += 1);
        if let Some(usual) = usual {
            counts[usual] = link_count(peers) - exceptions.len() as u64;
        }
        // The first of the largest: `max_by_key` would give the last.
        let most = (0..counts.len()).rev().max_by_key(|place| counts[*place]).unwrap_or(0);
        if usual != Some(most) {
            // At least half of all links are exceptions, so that this walk over all of them takes no longer than reading them did.
            let given = exceptions;
            let place = |pair: (usize, usize)| given.get(&pair).copied().or(usual).filter(|place| *place != most);
            exceptions = pairs(peers).filter_map(|pair| place(pair).map(|place| (pair, place))).collect();
        }
        Self { peers, configs, usual: most, exceptions }
    }

    /// The number of peers N; there are N·(N−1) links.
    #[must_use]
    pub const fn peers(&self) -> usize {
        self.peers
    }

    /// The different configurations, in order of first use: by sender, then by receiver. Each is used.
    #[must_use]
    pub fn configs(&self) -> &[Arc<LinkModel>] {
        &self.configs
    }

    /// The link from one peer to another, by their places in the file. For a peer with itself, or for peers that are not
    /// there, the answer has no meaning.
    #[must_use]
    pub fn between(&self, from: usize, to: usize) -> &LinkModel {
        &self.configs[self.config_between(from, to)]
    }

    /// The same, as a place in [`LinkTable::configs`].
    #[must_use]
    pub fn config_between(&self, from: usize, to: usize) -> usize {
        if self.exceptions.is_empty() {
            return self.usual;
        }
        self.exceptions.get(&(from, to)).copied().unwrap_or(self.usual)
    }

    /// Which of [`LinkTable::configs`] most links have; of several the first.
    #[must_use]
    pub const fn usual(&self) -> usize {
        self.usual
    }

    /// The links that have another configuration than [`LinkTable::usual`], with its place in [`LinkTable::configs`]: by sender, then by receiver.
    pub fn exceptions(&self) -> impl Iterator<Item = ((usize, usize), usize)> + '_ {
        self.exceptions.iter().map(|(pair, place)| (*pair, *place))
    }

    /// The configurations in order of first use, and how many links have each: at least one.
    pub fn used(&self) -> impl Iterator<Item = (&Arc<LinkModel>, u64)> + '_ {
        let mut counts = vec![0; self.configs.len()];
        self.exceptions.values().for_each(|place| counts[*place] += 1);
        counts[self.usual] = link_count(self.peers) - self.exceptions.len() as u64;
        self.configs.iter().zip(counts)
    }

    /// Whether all links have the same configuration.
    #[must_use]
    pub const fn is_uniform(&self) -> bool {
        self.configs.len() == 1
    }
}

/// One link with its new configuration.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkChange {
    /// The place of the sender among the peers or programs.
    pub from: usize,
    /// The place of the receiver.
    pub to: usize,
    /// From now on.
    pub config: Arc<LinkModel>,
}

/// The number of directed links between this number of peers.
pub(super) const fn link_count(peers: usize) -> u64 {
    (peers as u64) * (peers as u64).saturating_sub(1)
}

/// Every directed link, by sender and then by receiver.
pub fn pairs(peers: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..peers).flat_map(move |from| (0..peers).filter(move |&to| to != from).map(move |to| (from, to)))
}

/// The first link that is not among those given, which are in order; `None` if all are. Takes as many steps as there are links given.
pub(super) fn first_left(peers: usize, given: impl Iterator<Item = (usize, usize)>) -> Option<(usize, usize)> {
    let mut given = given;
    pairs(peers).find(|pair| given.next() != Some(*pair))
}

/// Configurations as they are met, equal ones once.
#[derive(Default)]
struct Configs {
    found: Vec<Arc<LinkModel>>,
    /// Those found, by a key that is equal in equal ones and tells most others apart.
    places: BTreeMap<(Duration, u64), Vec<usize>>,
}

impl Configs {
    fn place(&mut self, config: &Arc<LinkModel>) -> usize {
        let loss = config.as_fixed().and_then(|fixed| fixed.loss.mean()).unwrap_or(0.0);
        // Adding zero makes the two zeros, which are equal, the same bits.
        let alike = self.places.entry((config.mean_delay(), (loss + 0.0).to_bits())).or_default();
        let known = alike.iter().find(|place| Arc::ptr_eq(&self.found[**place], config) || self.found[**place] == *config);
        if let Some(place) = known {
            return *place;
        }
        alike.push(self.found.len());
        self.found.push(Arc::clone(config));
        self.found.len() - 1
    }
}
