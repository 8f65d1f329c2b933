//! Links of a network by their paths. A link on demand is made where it is first found missing.

use super::id::{LinkId, NodeId, Path};
use super::{Network, NetworkError};

impl<P: Clone> Network<P> {
    #[inline]
    pub(super) fn path(&self, from: NodeId, to: NodeId) -> Result<Path, NetworkError> {
        self.existing_link(Path { from, to }).map(|_| Path { from, to })
    }

    /// Returns the number of the link of a path, if the link exists.
    #[inline]
    pub(super) fn existing_link(&self, Path { from, to }: Path) -> Result<LinkId, NetworkError> {
        let exists = from.0 < self.nodes && to.0 < self.nodes && from != to;
        if exists && let Some(link) = self.places.link(Path { from, to }) { Ok(link) } else { Err(NetworkError::NoLink { from, to }) }
    }

    /// Returns the number of the link of a path. `path` must have checked the path.
    #[inline]
    pub(super) fn link(&self, path: Path) -> LinkId {
        self.places.link(path).expect("packets travel on links that there are")
    }

    /// Returns the number of the link of a path and the link's place in `lines.links`. Makes the link first if links are made on demand.
    #[inline(always)]
    pub(super) fn link_and_place(&mut self, path: Path) -> (LinkId, usize) {
        let link = self.link(path);
        (link, self.place(path, link))
    }

    /// Returns the place in `lines.links` of the link with the number `link`, which is the link of `path`. Makes the link first if links are made on demand.
    #[inline(always)]
    pub(super) fn place(&mut self, path: Path, link: LinkId) -> usize {
        let place = match &self.lines.on_demand {
            None => Some(link.index()),
            Some(on_demand) => on_demand.place(link),
        };
        place.unwrap_or_else(|| self.make(path, link))
    }

    /// Makes a link on demand, and returns its place in `lines.links`. The instant of making changes no answer: an unused link is in its initial state, its
    /// model begins at [`Instant::ZERO`], and its random numbers are addressed by its name.
    #[cold]
    #[inline(never)]
    fn make(&mut self, path: Path, link: LinkId) -> usize {
        let name = self.link_name(path);
        let place = self.lines.links.len();
        let on_demand = self.lines.on_demand.as_mut().expect("links are missing only where they are made on demand");
        let model = on_demand.model(path);
        on_demand.made(link, place);
        self.is_random |= model.is_random();
        // The link may bring inner events.
        self.settle(self.now);
        let line = self.line(&name, model);
        self.lines.links.push(line);
        // The list of path counters has one entry per link, in the order of the links.
        if self.has_uplinks {
            self.paths.push(0);
        }
        place
    }
}
