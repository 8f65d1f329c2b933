//! Sets of lost packets, by link and number.

use std::collections::BTreeSet;

use cohaptic_wan::{Loss, Pattern};

/// Lost packet of a link.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct LostPacket {
    /// Index of the sender among the nodes.
    pub from: usize,
    /// Index of the receiver among the nodes.
    pub to: usize,
    /// Number of the packet on its link, from 0.
    pub number: u64,
}

impl LostPacket {
    /// Returns whether both packets belong to one link.
    #[must_use]
    pub const fn is_beside(&self, other: &Self) -> bool {
        self.from == other.from && self.to == other.to
    }
}

/// Packets that links lose, ordered by sender, receiver and number.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct LostPackets(BTreeSet<LostPacket>);

impl LostPackets {
    /// Returns the number of packets.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether no packet is lost.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether a packet is lost.
    #[must_use]
    pub fn contains(&self, packet: &LostPacket) -> bool {
        self.0.contains(packet)
    }

    /// Returns each packet, by sender, receiver and number.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = LostPacket> + Clone + '_ {
        self.0.iter().copied()
    }

    /// Returns each link with lost packets as (sender, receiver), with the numbers of the packets in ascending order.
    #[must_use]
    pub fn by_link(&self) -> Vec<((usize, usize), Vec<u64>)> {
        let mut links: Vec<((usize, usize), Vec<u64>)> = Vec::new();
        for LostPacket { from, to, number } in self.iter() {
            match links.last_mut() {
                Some((link, numbers)) if *link == (from, to) => numbers.push(number),
                _ => links.push(((from, to), vec![number])),
            }
        }
        links
    }

    /// Returns the loss of these packets on the link from one node to another.
    #[must_use]
    pub(crate) fn on_link(&self, from: usize, to: usize) -> Loss {
        let ends = |number| LostPacket { from, to, number };
        // The number 2⁶⁴ − 1 has no successor, and so no span. No run sends as many packets.
        let spans: Vec<_> = self.0.range(ends(0)..ends(u64::MAX)).map(|packet| packet.number..packet.number + 1).collect();
        if spans.is_empty() { Loss::None } else { Pattern::of_packets(spans, None).map_or(Loss::None, Loss::Pattern) }
    }
}

impl FromIterator<LostPacket> for LostPackets {
    fn from_iter<I: IntoIterator<Item = LostPacket>>(packets: I) -> Self {
        Self(packets.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_link_has_its_own_packets() {
        let lost: LostPackets =
            [(1, 0, 4), (0, 1, 6), (0, 1, 2), (0, 1, u64::MAX)].map(|(from, to, number)| LostPacket { from, to, number }).into_iter().collect();
        assert_eq!(lost.by_link(), [((0, 1), vec![2, 6, u64::MAX]), ((1, 0), vec![4])]);
        assert_eq!(lost.on_link(0, 1), Loss::Pattern(Pattern::of_packets(vec![2..3, 6..7], None).unwrap()));
        assert_eq!(lost.on_link(0, 2), Loss::None);
    }
}
