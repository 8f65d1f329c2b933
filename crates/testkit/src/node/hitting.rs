//! Laws between nodes, which hit packets.

use super::Nodes;
use crate::hit::{Hits, PacketLaw, SentPacket, Verdict};

impl Nodes {
    /// Asks a function for the fate of every packet offered to the link from a node to another node: see [`hit`](crate::hit). Every run begins with a clone of
    /// the function.
    ///
    /// # Panics
    ///
    /// If there is no such node yet, or both nodes are the same.
    #[track_caller]
    pub fn on_packet(mut self, from: &str, to: &str, judge: impl FnMut(&SentPacket<'_>) -> Verdict + Clone + Send + 'static) -> Self {
        self.setup.add_function([from, to], judge);
        self
    }

    /// Asks a law for the fate of every packet offered to the link from a node to another node: see [`PacketLaw`].
    ///
    /// # Panics
    ///
    /// As [`Nodes::on_packet`].
    #[track_caller]
    pub fn law(mut self, from: &str, to: &str, law: impl PacketLaw + Clone + Send + 'static) -> Self {
        self.setup.add_law([from, to], law);
        self
    }

    /// Hits packets from a node to another node, as [words](crate::hit) say.
    ///
    /// # Panics
    ///
    /// As [`Nodes::on_packet`]; if the words make no sense. The message names the place.
    #[track_caller]
    pub fn hit(mut self, from: &str, to: &str, words: &str) -> Self {
        self.setup.add_words([from, to], words);
        self
    }

    /// Hits packets as a value says. A strategy has drawn the value, or a printed test contains it.
    ///
    /// # Panics
    ///
    /// If `hits` names a node that does not exist.
    #[track_caller]
    pub fn hits(mut self, hits: &Hits) -> Self {
        self.setup.add_hits(&hits.all);
        self
    }
}
