//! The lines of a network, and the search for a line.

use alloc::vec::Vec;

use super::config::NetworkConfig;
use super::id::LinkId;
use super::on_demand::OnDemand;
use super::pending::{InNetwork, LineId};
use crate::line::Line;

/// Links and access lines of a network.
#[derive(Clone, Debug)]
pub(super) struct Lines<P> {
    /// Links, indexed by [`LinkId`]: in the order of senders, then of receivers. With links between all nodes, the diagonal is included and never used.
    /// Links on demand are in the order of their making instead, and `on_demand` gives their indices.
    pub(super) links: Vec<Line<P, InNetwork<P>>>,
    /// Models and places of links on demand; `None` if all links are made with the network.
    pub(super) on_demand: Option<OnDemand>,
    /// Uplink of each node, indexed by node.
    pub(super) uplinks: Vec<Option<Line<P, InNetwork<P>>>>,
    /// Downlink of each node, indexed by node.
    pub(super) downlinks: Vec<Option<Line<P, InNetwork<P>>>>,
}

impl<P> Lines<P> {
    /// Makes the lines of a network without links and access lines.
    pub(super) fn new(config: &NetworkConfig, on_demand: Option<OnDemand>) -> Self {
        let none = || config.nodes.iter().map(|_| None).collect();
        Self { links: Vec::new(), on_demand, uplinks: none(), downlinks: none() }
    }

    /// Returns the index of a link in `links`, or `None` if the link was not made yet or does not exist.
    pub(super) fn place(&self, link: LinkId) -> Option<usize> {
        // Without links on demand, number and index of a link are equal.
        let place = match &self.on_demand {
            None => link.index(),
            Some(on_demand) => on_demand.place(link)?,
        };
        (place < self.links.len()).then_some(place)
    }

    /// Returns a link, or `None` if the link was not made yet or does not exist.
    pub(super) fn find_link(&self, link: LinkId) -> Option<&Line<P, InNetwork<P>>> {
        self.place(link).map(|place| &self.links[place])
    }

    /// Returns an existing link. Panics if the link does not exist.
    #[inline(always)]
    pub(super) fn link_mut(&mut self, link: LinkId) -> &mut Line<P, InNetwork<P>> {
        let place = match &self.on_demand {
            None => link.index(),
            Some(on_demand) => on_demand.place(link).expect("a packet is on a link that was made"),
        };
        &mut self.links[place]
    }

    #[inline(always)]
    pub(super) fn get_mut(&mut self, line: LineId) -> &mut Line<P, InNetwork<P>> {
        let access = match line {
            LineId::Link(link) => return self.link_mut(link),
            LineId::Uplink(node) => &mut self.uplinks[node.index()],
            LineId::Downlink(node) => &mut self.downlinks[node.index()],
        };
        access.as_mut().expect("a packet is in an access line only where there is one")
    }
}
