//! The lines of a network.

use alloc::vec::Vec;

use super::pending::{InNetwork, LineId};
use crate::line::Line;

/// The links and the access lines.
#[derive(Clone, Debug)]
pub(super) struct Lines<P> {
    /// By sender, then receiver; where all have links to all the diagonal is there too, and never used.
    pub(super) links: Vec<Line<P, InNetwork<P>>>,
    pub(super) uplinks: Vec<Option<Line<P, InNetwork<P>>>>,
    pub(super) downlinks: Vec<Option<Line<P, InNetwork<P>>>>,
}

impl<P> Lines<P> {
    #[inline(always)]
    pub(super) fn get_mut(&mut self, line: LineId) -> &mut Line<P, InNetwork<P>> {
        let access = match line {
            LineId::Link(link) => return &mut self.links[link.index()],
            LineId::Uplink(node) => &mut self.uplinks[node.index()],
            LineId::Downlink(node) => &mut self.downlinks[node.index()],
        };
        access.as_mut().expect("a packet is in an access line only where there is one")
    }
}
