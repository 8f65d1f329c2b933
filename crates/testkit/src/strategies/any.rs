//! Strategies of links and networks.

use std::sync::Arc;

use cohaptic_wan::NodeId;
use proptest::strategy::{NewTree, Strategy, ValueTree};
use proptest::test_runner::TestRunner;

use super::bounds::LinkBounds;
use super::draw;
use super::grid::Dice;
use super::link::ImpairedLink;
use super::network::ImpairedNetwork;
use super::shrink::Search;
use super::space::{LinkSpace, NetworkSpace};
use crate::nat::Behaviour;

/// Draws any link: [`links_like`] with [`LinkBounds::any`].
pub fn any_link() -> Links {
    links_like(LinkBounds::any())
}

/// Draws links within [`LinkBounds`], or links like one of the library, such as `"lte-driving"` (feature `files`). Links within bounds shrink to the least
/// impaired link on which the test still fails, and links like one of the library to the link of the library itself: see [`Likeness`].
///
/// # Panics
///
/// If the bounds make no sense, where [`LinkBounds::check`] returns an error instead; or if the library has no such link.
#[track_caller]
pub fn links_like<L: Likeness>(like: L) -> L::Links {
    like.links()
}

/// Description of the links that [`links_like`] draws.
///
/// With the feature `files`, a text names a link of the library. A factor is drawn for each number with a range in the library: `lte-driving delay*1.4` has
/// 1.4 times the delay of `lte-driving`. The range of a number reaches from the 10th to the 90th percentile of the links of this kind, and the logarithm of
/// the number is uniform. A link without a range in the library, such as `starlink`, is drawn unchanged. The drawn link is given to `Testbed::access` of a
/// host. If the name has a direction, or both directions are equal, [`Testbed::links`](crate::Testbed::links) and the like take the link too.
pub trait Likeness {
    /// Strategy of the links.
    type Links: Strategy;

    /// Returns the strategy.
    ///
    /// # Panics
    ///
    /// As [`links_like`].
    #[track_caller]
    fn links(self) -> Self::Links;
}

impl Likeness for LinkBounds {
    type Links = Links;

    #[track_caller]
    fn links(self) -> Links {
        Links { bounds: checked(self) }
    }
}

/// Draws any network of `hosts` hosts: [`networks_like`] with [`LinkBounds::any`].
///
/// # Panics
///
/// With no hosts, or more than 1000.
#[track_caller]
pub fn any_network(hosts: usize) -> Networks {
    networks_like(hosts, LinkBounds::any())
}

/// Draws networks of `hosts` hosts with links within bounds. The networks shrink to the least impaired network on which the test still fails. About a quarter
/// of the links is impaired in a third of all networks, half of the links in another third, and all links in the last third.
///
/// # Panics
///
/// With no hosts, or more than 1000, or if the bounds make no sense; [`LinkBounds::check`] returns an error instead.
#[track_caller]
pub fn networks_like(hosts: usize, bounds: LinkBounds) -> Networks {
    Networks { ideal: ImpairedNetwork::ideal(hosts), bounds: checked(bounds), behind: Vec::new() }
}

#[track_caller]
#[expect(clippy::panic, reason = "documented: bounds stand in a test")]
pub(super) fn checked(bounds: LinkBounds) -> Arc<LinkBounds> {
    if let Err(error) = bounds.check() {
        panic!("the bounds of links are not valid: {error}");
    }
    Arc::new(bounds)
}

/// Strategy of links: see [`links_like`].
#[derive(Clone, Debug)]
#[must_use = "strategies do nothing unless used"]
pub struct Links {
    bounds: Arc<LinkBounds>,
}

/// Strategy of networks: see [`networks_like`].
#[derive(Clone, Debug)]
#[must_use = "strategies do nothing unless used"]
pub struct Networks {
    ideal: ImpairedNetwork,
    bounds: Arc<LinkBounds>,
    /// Hosts that may be behind NATs.
    behind: Vec<NodeId>,
}

impl Networks {
    /// Puts these hosts behind NATs of any kind, each in half of all networks. Hosts are given by their numbers, from 0. Others cannot reach such a host before
    /// it has sent something, and do not know its name, so name the hosts that begin a conversation: clients, not servers. The search for a lesser network
    /// takes the NATs away first, and then tries more open kinds.
    ///
    /// ```
    /// use cohaptic_testkit::proptest::prelude::*;
    /// use cohaptic_testkit::strategies::any_network;
    ///
    /// proptest! {
    ///     fn a_client_is_answered_behind_any_nat(network in any_network(2).behind_nats([0])) {
    ///         prop_assert!(network.nats().all(|(host, _)| host.index() == 0));
    ///     }
    /// }
    /// # a_client_is_answered_behind_any_nat();
    /// ```
    ///
    /// # Panics
    ///
    /// If there is no such host.
    #[track_caller]
    pub fn behind_nats(mut self, hosts: impl IntoIterator<Item = usize>) -> Self {
        self.behind = hosts.into_iter().map(NodeId::new).collect();
        let count = self.ideal.hosts();
        assert!(self.behind.iter().all(|host| host.index() < count), "the network has {count} hosts: expected numbers below {count}");
        self
    }
}

#[cfg(feature = "scenes")]
impl Networks {
    /// Creates a strategy of networks of `hosts` hosts. The bounds must have been checked.
    pub(super) fn within(hosts: usize, bounds: &Arc<LinkBounds>) -> Self {
        Self { ideal: ImpairedNetwork::ideal(hosts), bounds: Arc::clone(bounds), behind: Vec::new() }
    }
}

/// Maximum number of draws of a link. A draw fails if a model with bursts cannot reach the loss within the bounds.
const ATTEMPTS: u32 = 100;

fn link(bounds: &LinkBounds, is_ideal: bool, runner: &mut TestRunner) -> Result<ImpairedLink, proptest::test_runner::Reason> {
    let mut dice = Dice(runner.rng());
    (0..ATTEMPTS).find_map(|_| draw::link(bounds, is_ideal, &mut dice)).ok_or_else(|| format!("found no link within {bounds:?}").into())
}

impl Strategy for Links {
    type Tree = Box<dyn ValueTree<Value = ImpairedLink>>;
    type Value = ImpairedLink;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let link = link(&self.bounds, false, runner)?;
        Ok(Box::new(Search::new(LinkSpace(Arc::clone(&self.bounds)), link)))
    }
}

impl Strategy for Networks {
    type Tree = Box<dyn ValueTree<Value = ImpairedNetwork>>;
    type Value = ImpairedNetwork;

    fn new_tree(&self, runner: &mut TestRunner) -> NewTree<Self> {
        let mut network = self.ideal.clone();
        // The share is drawn once for the network. With a draw per link every network would have about half of its links impaired.
        let impaired = Dice(runner.rng()).pick(1, &[2, 4]);
        let hosts = network.hosts();
        let pairs = (0..hosts).flat_map(|from| (0..hosts).map(move |to| (NodeId::new(from), NodeId::new(to)))).filter(|(from, to)| from != to);
        for (from, to) in pairs {
            let is_ideal = Dice(runner.rng()).below(4) >= impaired;
            network = network.with_link(from, to, link(&self.bounds, is_ideal, runner)?);
        }
        // Drawn after the links, so that the links are those of the same network without NATs.
        for host in &self.behind {
            let mut dice = Dice(runner.rng());
            if dice.one_in(2) {
                let kind = dice.pick(0, &[1, 2, 3, 4]);
                network.set_behaviour(*host, Behaviour::nth(kind));
            }
        }
        Ok(Box::new(Search::new(NetworkSpace(LinkSpace(Arc::clone(&self.bounds))), network)))
    }
}
