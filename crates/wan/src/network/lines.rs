//! The lines of a network.

use alloc::vec::Vec;

use super::config::NetworkConfig;
use super::id::LinkId;
use super::on_demand::OnDemand;
use super::pending::{InNetwork, LineId};
use crate::line::Line;

/// The links and the access lines.
#[derive(Clone, Debug)]
pub(super) struct Lines<P> {
    /// By number, which is by sender, then receiver; where all have links to all the diagonal is there too, and never used. Links on demand lie in the order in
    /// which they were made.
    pub(super) links: Vec<Line<P, InNetwork<P>>>,
    /// `None`: all links are there from the beginning.
    pub(super) on_demand: Option<OnDemand>,
    pub(super) uplinks: Vec<Option<Line<P, InNetwork<P>>>>,
    pub(super) downlinks: Vec<Option<Line<P, InNetwork<P>>>>,
}

impl<P> Lines<P> {
    /// Lines of a network that has no links and no access lines yet.
    pub(super) fn new(config: &NetworkConfig, on_demand: Option<OnDemand>) -> Self {
        let none = || config.nodes.iter().map(|_| None).collect();
        Self { links: Vec::new(), on_demand, uplinks: none(), downlinks: none() }
    }

    /// A link; `None` if it was not made yet, or there is none.
    pub(super) fn find_link(&self, link: LinkId) -> Option<&Line<P, InNetwork<P>>> {
        let place = match &self.on_demand {
            None => link.index(),
            Some(on_demand) => on_demand.place(link)?,
        };
        self.links.get(place)
    }

    /// A link that was made.
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
