//! Counters of links, for each link and in total.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_scene::Topology;
use cohaptic_wan::LinkStats;

/// Results of one link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LinkSummary {
    /// Index of the sender in the scene.
    pub from: usize,
    /// Index of the receiver in the scene.
    pub to: usize,
    /// Counters of the link.
    pub stats: LinkStats,
}

/// Counters of the N·(N−1) links between N peers, or of the links of a topology, by sender, then receiver.
///
/// If all links of a sender have equal counters, the counters are stored once. Equality and [`fmt::Debug`] follow the list of all links, not the storage.
#[derive(Clone)]
pub struct LinkSummaries {
    peers: usize,
    /// Counters by sender, and then by receiver if each link has its own entry.
    stats: Vec<LinkStats>,
    /// Number of links of a sender with a common entry: 1, or N − 1.
    together: usize,
    /// Existing links; `None` if every peer has a link to every other peer.
    topology: Option<Arc<Topology>>,
}

/// Quantiles over links, each the value of some link: of n values, the quantile p is the ⌈p·n⌉-th, counted from the least.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LinkQuantiles {
    /// Least value.
    pub min: f64,
    /// Quantile of 1 %.
    pub p01: f64,
    /// Median.
    pub p50: f64,
    /// Quantile of 99 %.
    pub p99: f64,
    /// Greatest value.
    pub max: f64,
}

impl LinkSummaries {
    /// Stores the counters of each link, by sender, then receiver.
    ///
    /// # Panics
    ///
    /// If the number of entries is not N·(N−1).
    #[must_use]
    pub(crate) fn each(peers: usize, stats: Vec<LinkStats>) -> Self {
        assert_eq!(stats.len(), peers * peers.saturating_sub(1), "every pair of {peers} peers has a link in either direction");
        Self { peers, stats, together: 1, topology: None }
    }

    /// Stores the counters of each link of a topology, by sender, then receiver.
    ///
    /// # Panics
    ///
    /// If the number of entries is not the number of links of the topology.
    #[must_use]
    pub(crate) fn on(topology: Arc<Topology>, stats: Vec<LinkStats>) -> Self {
        assert_eq!(stats.len(), topology.links(), "each link of a topology has counters");
        Self { peers: topology.peers(), stats, together: 1, topology: Some(topology) }
    }

    /// Stores the common counters of the links of each sender, by sender.
    #[must_use]
    pub(crate) fn by_sender(stats: Vec<LinkStats>) -> Self {
        let peers = stats.len();
        Self { peers, stats, together: peers.saturating_sub(1).max(1), topology: None }
    }

    /// Returns the number of links.
    #[must_use]
    pub fn len(&self) -> u64 {
        let all = || self.peers as u64 * (self.peers as u64).saturating_sub(1);
        self.topology.as_ref().map_or_else(all, |topology| topology.links() as u64)
    }

    /// Returns whether there are no links.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the counters of the link from one peer to another; `None` without such a link.
    #[must_use]
    pub fn between(&self, from: usize, to: usize) -> Option<&LinkStats> {
        if let Some(topology) = &self.topology {
            return self.stats.get(topology.place(from, to)? + topology.places(from).start);
        }
        // Row `from` has no entry for `from` itself, so receivers after it move down by one. With common entries the quotient is the sender.
        let is_link = from != to && from < self.peers && to < self.peers;
        if is_link { self.stats.get((from * (self.peers - 1) + to - usize::from(to > from)) / self.together) } else { None }
    }

    /// Returns the receivers and counters of the links from a peer, by receiver. Faster than [`LinkSummaries::between`] for each.
    pub(crate) fn sent_by(&self, from: usize) -> impl Iterator<Item = (usize, &LinkStats)> {
        let (neighbours, stats) = match &self.topology {
            Some(topology) => (Some(topology.neighbours(from)), &self.stats[topology.places(from)]),
            None => {
                // With common entries a sender has a single entry, otherwise one entry per receiver.
                let entries = self.peers.saturating_sub(1) / self.together;
                (None, &self.stats[from * entries..(from + 1) * entries])
            }
        };
        let links = neighbours.map_or_else(|| self.peers.saturating_sub(1), <[u32]>::len);
        let receiver = move |place: usize| neighbours.map_or_else(|| place + usize::from(place >= from), |neighbours| neighbours[place] as usize);
        // A common entry is repeated for each receiver.
        (0..links).map(receiver).zip(stats.iter().cycle())
    }

    /// Returns an iterator over all links.
    #[must_use]
    pub const fn iter(&self) -> EachLink<'_> {
        EachLink { links: self, from: 0, place: 0 }
    }

    /// Returns the stored counters, each with the number of links with these counters. Covers all links, in as few steps as entries are stored.
    pub fn counted(&self) -> impl Iterator<Item = (&LinkStats, u64)> + Clone {
        self.stats.iter().map(|stats| (stats, self.together as u64))
    }

    /// Returns the sum of the counters of all links.
    #[must_use]
    pub fn total(&self) -> LinkStats {
        let mut total = LinkStats::default();
        self.counted().for_each(|(stats, links)| total.add(stats, links));
        total
    }

    /// Returns quantiles of the delivered packets, copies included, as a fraction of the offered packets, over the links with offered packets. A packet in
    /// flight at the end is not delivered. Returns `None` if no link was offered a packet.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "packet counts below 2^53")]
    pub fn delivered_fraction(&self) -> Option<LinkQuantiles> {
        let fraction = |stats: &LinkStats| (stats.offered() > 0).then(|| stats.delivered() as f64 / stats.offered() as f64);
        self.quantiles(fraction)
    }

    /// Returns quantiles of [`LinkStats::mean_delay`] \[s\], over the links with delivered packets. Returns `None` if no link delivered a packet.
    #[must_use]
    pub fn mean_delay(&self) -> Option<LinkQuantiles> {
        self.quantiles(|stats| stats.mean_delay().as_ref().map(Duration::as_secs_f64))
    }

    fn quantiles(&self, value: impl Fn(&LinkStats) -> Option<f64>) -> Option<LinkQuantiles> {
        // Each entry stands for the same number of links, so the quantiles of entries are the quantiles of links.
        let mut values: Vec<f64> = self.stats.iter().filter_map(value).collect();
        let last = values.len().checked_sub(1)?;
        values.sort_unstable_by(f64::total_cmp);
        // Ranks count from 1, indices from 0.
        let percent = |percent: usize| values[(values.len() * percent).div_ceil(100).saturating_sub(1)];
        Some(LinkQuantiles { min: values[0], p01: percent(1), p50: percent(50), p99: percent(99), max: values[last] })
    }
}

impl PartialEq for LinkSummaries {
    fn eq(&self, other: &Self) -> bool {
        // With the same storage the entries can be compared without expanding them to links.
        let is_kept_alike = self.together == other.together;
        self.peers == other.peers && self.topology == other.topology && if is_kept_alike { self.stats == other.stats } else { self.iter().eq(other) }
    }
}

impl Eq for LinkSummaries {}

impl fmt::Debug for LinkSummaries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self).finish()
    }
}

impl<'a> IntoIterator for &'a LinkSummaries {
    type Item = LinkSummary;
    type IntoIter = EachLink<'a>;

    fn into_iter(self) -> EachLink<'a> {
        self.iter()
    }
}

/// Iterator over the links of [`LinkSummaries`].
#[derive(Clone, Debug)]
pub struct EachLink<'a> {
    links: &'a LinkSummaries,
    /// Index of the present sender.
    from: usize,
    /// Number of links of the present sender that were returned so far.
    place: usize,
}

impl Iterator for EachLink<'_> {
    type Item = LinkSummary;

    fn next(&mut self) -> Option<LinkSummary> {
        loop {
            let from = self.from;
            // After the last link of a sender, or for a sender without links, the next sender follows.
            let to = match &self.links.topology {
                _ if from >= self.links.peers => return None,
                Some(topology) => topology.neighbours(from).get(self.place).map(|to| *to as usize),
                None => (self.place + 1 < self.links.peers).then(|| self.place + usize::from(self.place >= from)),
            };
            self.place += 1;
            match to {
                Some(to) => return self.links.between(from, to).map(|stats| LinkSummary { from, to, stats: *stats }),
                None => (self.from, self.place) = (from + 1, 0),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stats(offered: u64, delivered: u64) -> LinkStats {
        LinkStats::counted(offered, delivered, 7 * u128::from(delivered), [])
    }

    #[test]
    fn it_makes_no_difference_how_links_are_kept() {
        for peers in [2, 3, 9] {
            let senders: Vec<LinkStats> = (0..peers).map(|from| stats(10 + from, from)).collect();
            let each = senders.iter().flat_map(|stats| (1..peers).map(|_| *stats)).collect();
            let one = LinkSummaries::by_sender(senders);
            let other = LinkSummaries::each(one.peers, each);
            let list: Vec<LinkSummary> = one.iter().collect();
            assert_eq!((&one, format!("{one:#?}"), one.total()), (&other, format!("{list:#?}"), other.total()));
            assert_eq!((one.len(), list.len() as u64), (other.len(), peers * (peers - 1)));
            for links in [&one, &other] {
                let from = |from: usize| links.sent_by(from).map(move |(to, stats)| LinkSummary { from, to, stats: *stats });
                assert_eq!((0..links.peers).flat_map(from).collect::<Vec<_>>(), list);
            }
            assert_eq!((one.delivered_fraction(), one.mean_delay()), (other.delivered_fraction(), other.mean_delay()));
            assert!(list.iter().all(|link| link.from != link.to && one.between(link.from, link.to) == Some(&link.stats)));
            let places: Vec<(usize, usize)> = list.iter().map(|link| (link.from, link.to)).collect();
            assert!(places.is_sorted() && (one.between(0, 0), one.between(0, one.peers)) == (None, None));
            let mut differs = other.clone();
            let last = differs.stats.len() - 1;
            differs.stats[last] = stats(1, 1);
            assert_ne!(one, differs);
        }
    }

    #[test]
    fn totals_and_quantiles_are_those_of_the_list() {
        // Three peers, six links: one link was offered nothing, one link delivered nothing.
        let links =
            LinkSummaries::each(3, [(0, 0), (4, 0), (4, 1), (4, 2), (4, 3), (4, 8)].map(|(offered, delivered)| stats(offered, delivered)).to_vec());
        assert_eq!(links.total(), stats(20, 14));
        assert_eq!(links.delivered_fraction(), Some(LinkQuantiles { min: 0.0, p01: 0.0, p50: 0.5, p99: 2.0, max: 2.0 }));
        assert_eq!(links.mean_delay(), Some(LinkQuantiles { min: 7e-9, p01: 7e-9, p50: 7e-9, p99: 7e-9, max: 7e-9 }));
        let idle = LinkSummaries::by_sender(vec![stats(0, 0); 4]);
        assert_eq!((idle.delivered_fraction(), idle.mean_delay()), (None, None));
        // Of 342 links the fourth is the quantile of 1 %.
        let many: Vec<LinkStats> = (1..=19 * 18).map(|delivered| stats(1, delivered)).collect();
        let quantiles = LinkSummaries::each(19, many).delivered_fraction();
        assert_eq!(quantiles, Some(LinkQuantiles { min: 1.0, p01: 4.0, p50: 171.0, p99: 339.0, max: 342.0 }));
    }

    #[test]
    fn links_of_a_topology_are_listed_and_no_others() {
        let star = Arc::new(Topology::star(4, 1).unwrap());
        let links = LinkSummaries::on(Arc::clone(&star), (0..6).map(|number| stats(number, number)).collect());
        let pairs: Vec<(usize, usize)> = links.iter().map(|link| (link.from, link.to)).collect();
        assert_eq!((pairs, links.len()), (star.pairs().collect(), 6));
        assert_eq!((links.between(1, 2), links.between(3, 1), links.between(0, 2)), (Some(&stats(2, 2)), Some(&stats(5, 5)), None));
        assert_eq!(links.total(), stats(15, 15));
        let numbers = |from: usize| links.sent_by(from).map(|(to, stats)| (to, stats.offered())).collect::<Vec<_>>();
        assert_eq!((numbers(0), numbers(1), numbers(3)), (vec![(1, 0)], vec![(0, 1), (2, 2), (3, 3)], vec![(1, 5)]));
    }

    /// Totals of 10¹⁰ links fit into 64 bits.
    #[test]
    fn links_of_a_hundred_thousand_peers_are_counted_in_64_bits() {
        let links = LinkSummaries::by_sender(vec![stats(125, 122); 100_000]);
        assert_eq!(links.len(), 9_999_900_000);
        assert_eq!((links.total().offered(), links.total().delivered()), (125 * 9_999_900_000, 122 * 9_999_900_000));
        assert_eq!(links.between(99_999, 99_998), Some(&stats(125, 122)));
    }
}
