//! Figures of the order of arrivals (RFC 4737).

use serde::Serialize;

use crate::batches::share_interval;
use crate::series::count_u64;

/// Figures of the order of arrivals. Extra copies are ignored.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct OrderFigures {
    /// Share of received packets with a number below `NextExp`, the largest number arrived before plus one (RFC 4737, section 3.3). `None` if no packet
    /// arrived.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reordered: Option<f64>,
    /// Wilson's interval of the share at confidence 0.95. From 300 packets on, batch means take into account that reordered packets come in groups.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reordered_interval_95: Option<[f64; 2]>,
    /// Mean extent of reordered packets \[arrivals\]: i − j for arrival i, with j the first arrival of a packet sent later (RFC 4737, section 4.2.2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reordering_extent_mean: Option<f64>,
    /// Largest extent \[arrivals\]: a buffer of that many packets restores the order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reordering_extent_max: Option<u64>,
}

/// Collects arrivals.
#[derive(Clone, Debug, Default)]
pub(super) struct OrderOfArrival {
    received: u64,
    /// Largest number arrived so far plus one.
    next_expected: u64,
    reordered: u64,
    /// `true` if each arrival was reordered, indexed by arrival.
    was_reordered: Vec<bool>,
    extent_sum: u64,
    extent_max: u64,
    /// Arrivals (index of the arrival, number of the packet) with a number above all numbers before. An entry is left out if index and number both follow
    /// the entry before by steps of one: no later packet can have a number in between. Both components increase.
    records: Vec<(u64, u64)>,
}

impl OrderOfArrival {
    /// Adds the arrival of the first copy of a packet.
    pub(super) fn arrives(&mut self, sequence: u64) {
        let place = self.received;
        self.received += 1;
        self.was_reordered.push(sequence < self.next_expected);
        if sequence >= self.next_expected {
            let follows = sequence == self.next_expected && self.records.last().is_some_and(|(at, number)| place - at == sequence - number);
            if !follows {
                self.records.push((place, sequence));
            }
            self.next_expected = sequence.saturating_add(1);
            return;
        }
        // The first entry with a larger number is the first arrival of any packet sent later.
        let first_later = self.records.partition_point(|&(_, number)| number < sequence);
        let extent = self.records.get(first_later).map_or(0, |(at, _)| place - at);
        self.reordered += 1;
        self.extent_sum += extent;
        self.extent_max = self.extent_max.max(extent);
    }

    pub(super) fn figures(&self) -> OrderFigures {
        let indicator: Vec<f64> = self.was_reordered.iter().map(|reordered| f64::from(u8::from(*reordered))).collect();
        OrderFigures {
            reordered: (self.received > 0).then(|| count_u64(self.reordered) / count_u64(self.received)),
            reordered_interval_95: share_interval(&indicator),
            reordering_extent_mean: (self.reordered > 0).then(|| count_u64(self.extent_sum) / count_u64(self.reordered)),
            reordering_extent_max: (self.reordered > 0).then_some(self.extent_max),
        }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    fn figures(arrivals: &[u64]) -> OrderFigures {
        let mut order = OrderOfArrival::default();
        arrivals.iter().for_each(|&sequence| order.arrives(sequence));
        order.figures()
    }

    /// Extents by the definition of the RFC: i − j with the least j < i such that s\[j\] > s\[i\].
    fn extents(arrivals: &[u64]) -> Vec<u64> {
        let extent = |i: usize| arrivals[..i].iter().position(|&earlier| earlier > arrivals[i]).map(|j| (i - j) as u64);
        (0..arrivals.len()).filter_map(extent).collect()
    }

    #[test]
    fn the_examples_of_the_rfc() {
        // RFC 4737, sections 4.2.3 and 7: packet 4 arrives after 5 and 6, with extent 2 (numbers here from 0).
        let late_by_two = figures(&[0, 1, 2, 4, 5, 3, 6, 7, 8, 9]);
        assert_eq!((late_by_two.reordered, late_by_two.reordering_extent_max), (Some(0.1), Some(2)));
        // Section 7.2: packets 7, 8, 9, 10 arrive before 4, 5, 6, which gives three reordered packets with extents 4, 5, 6.
        let early = figures(&[0, 1, 2, 3, 7, 8, 9, 10, 4, 5, 6, 11]);
        assert_eq!((early.reordered, early.reordering_extent_mean, early.reordering_extent_max), (Some(0.25), Some(5.0), Some(6)));
        // Lost packets alone cause no reordering.
        assert_eq!(figures(&[0, 2, 5, 6]).reordered, Some(0.0));
        assert_eq!(figures(&[]).reordered, None);
    }

    properties! {
        #[test]
        fn extents_are_those_of_the_definition(numbers in prop::collection::btree_set(0..200_u64, 0..60), swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..40)) {
            let mut arrivals: Vec<u64> = numbers.into_iter().collect();
            for (one, other) in swaps {
                if !arrivals.is_empty() {
                    let (one, other) = (one.index(arrivals.len()), other.index(arrivals.len()));
                    arrivals.swap(one, other);
                }
            }
            let expected = extents(&arrivals);
            let found = figures(&arrivals);
            prop_assert_eq!(found.reordering_extent_max, expected.iter().copied().max());
            prop_assert_eq!(found.reordered, (!arrivals.is_empty()).then(|| expected.len() as f64 / arrivals.len() as f64));
            let mean = (!expected.is_empty()).then(|| expected.iter().sum::<u64>() as f64 / expected.len() as f64);
            prop_assert_eq!(found.reordering_extent_mean, mean);
        }
    }
}
