//! Links made at their first use: their models, and their places in the list of links.

use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;

use super::id::{LinkId, NodeId, Path};
use crate::line::model::LinkModel;

type ModelOf = dyn Fn(NodeId, NodeId) -> LinkModel + Send + Sync;

/// Models of links made at their first use, and places of the links made so far.
#[derive(Clone)]
pub(super) struct OnDemand {
    model: Arc<ModelOf>,
    places: Places,
}

impl OnDemand {
    pub(super) fn new(model: impl Fn(NodeId, NodeId) -> LinkModel + Send + Sync + 'static) -> Self {
        Self { model: Arc::new(model), places: Places::new() }
    }

    /// Returns the model of a link that is to be made.
    pub(super) fn model(&self, path: Path) -> LinkModel {
        if path.from == path.to { LinkModel::default() } else { (self.model)(path.from, path.to) }
    }

    /// Returns the place of a link, or `None` if the link was not made yet.
    #[inline(always)]
    pub(super) fn place(&self, link: LinkId) -> Option<usize> {
        self.places.find(link.0)
    }

    /// Notes the making of a link with the index `place` in the list of links.
    pub(super) fn made(&mut self, link: LinkId, place: usize) {
        self.places.insert(link.0, LinkId::new(place).0);
    }
}

impl fmt::Debug for OnDemand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OnDemand").field("made", &self.places.len).finish_non_exhaustive()
    }
}

/// Places of links in the list of links, indexed by link number, in an open-addressed hash table. The order of the slots is never visible, so the hash function
/// changes no answer.
#[derive(Clone, Debug)]
struct Places {
    /// Pairs of link number and place, or [`FREE`]. The number of slots is a power of two, and at most half of the slots are taken.
    slots: Vec<(u32, u32)>,
    len: usize,
}

/// A slot without a link. No link has this number, because link numbers have 29 bits.
const FREE: (u32, u32) = (u32::MAX, 0);

impl Places {
    fn new() -> Self {
        Self { slots: alloc::vec![FREE; 16], len: 0 }
    }

    /// Returns the index of the slot at which the search for `number` begins.
    #[inline(always)]
    fn slot(&self, number: u32) -> usize {
        // Fibonacci hashing: link numbers at a fixed distance, for example of a ring of hosts, are spread evenly by the upper bits of the product.
        (u64::from(number).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32) as usize & (self.slots.len() - 1)
    }

    #[inline(always)]
    fn find(&self, number: u32) -> Option<usize> {
        let mut slot = self.slot(number);
        // At least half of the slots are free, so the search ends.
        loop {
            let (found, place) = self.slots[slot];
            if found == number {
                return Some(place as usize);
            }
            if found == FREE.0 {
                return None;
            }
            slot = (slot + 1) & (self.slots.len() - 1);
        }
    }

    fn insert(&mut self, number: u32, place: u32) {
        if 2 * self.len >= self.slots.len() {
            let doubled = alloc::vec![FREE; 2 * self.slots.len()];
            for (number, place) in core::mem::replace(&mut self.slots, doubled) {
                // Doubling at half load: at most half of the slots are taken after this insertion.
                if number != FREE.0 {
                    // Each number's slot depends on the length of the table, so all pairs are inserted again.
                    self.put(number, place);
                }
            }
        }
        self.put(number, place);
        self.len += 1;
    }

    fn put(&mut self, number: u32, place: u32) {
        let mut slot = self.slot(number);
        while self.slots[slot].0 != FREE.0 {
            slot = (slot + 1) & (self.slots.len() - 1);
        }
        self.slots[slot] = (number, place);
    }
}

#[cfg(test)]
mod tests {
    use alloc::collections::BTreeMap;

    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;
    use crate::network::{Network, NetworkConfig};

    /// A ring of 10⁴ nodes, each of which sends to the next, makes as many links as senders instead of 10⁸.
    #[test]
    fn a_network_holds_the_links_that_carry_packets() {
        let nodes: Vec<_> = (0..10_000).map(|node| alloc::format!("node-{node}")).collect();
        let mut network: Network<()> = Network::on_demand(NetworkConfig { seed: 1, nodes, general: false }, |_, _| LinkModel::default());
        assert_eq!((network.lines.links.len(), network.sent(NodeId(3), NodeId(4))), (0, Some(0)));
        for from in 0..10_000 {
            network
                .handle_packet(cohaptic_units::Instant::ZERO, NodeId(from), NodeId((from + 1) % 10_000), cohaptic_units::Bytes::new(1), ())
                .unwrap();
        }
        assert_eq!((network.lines.links.len(), network.sent(NodeId(3), NodeId(4))), (10_000, Some(1)));
        let places = &network.lines.on_demand.as_ref().unwrap().places;
        assert_eq!((places.len, places.slots.len()), (10_000, 32_768));
    }

    properties! {
        /// Numbers of an arithmetic progression, as a ring of hosts or a star uses, mixed with random numbers.
        #[test]
        fn places_are_those_of_a_map(first in 0_u32..1000, step in 1_u32..30_000, count in 0_u32..300, others in prop::collection::vec(0_u32..1 << 29, 0..100)) {
            let (mut places, mut map) = (Places::new(), BTreeMap::new());
            for number in (0..count).map(|turn| first + turn * step).chain(others) {
                let place = map.len() as u32;
                prop_assert_eq!(places.find(number), map.get(&number).map(|place: &u32| *place as usize));
                if map.insert(number, place).is_none() {
                    places.insert(number, place);
                } else {
                    map.insert(number, places.find(number).unwrap() as u32);
                }
            }
            prop_assert!(map.iter().all(|(number, place)| places.find(*number) == Some(*place as usize)));
            prop_assert!(places.len == map.len() && places.slots.len() <= (4 * map.len()).max(16));
        }
    }
}
