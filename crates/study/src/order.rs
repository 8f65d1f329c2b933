//! Orders of conditions: given, shuffled, and the rows of a Williams design.

use cohaptic_wan::random::{Purpose, Stream};

use crate::model::{Order, Study};

impl Study {
    /// Returns the row of a slot, from 0: a row of the Williams design, which repeats after its last row, or the slot itself.
    #[must_use]
    pub fn row_of(&self, slot: usize) -> usize {
        if self.order == Order::Williams { slot % self.order_rows() } else { slot }
    }

    /// Returns the number of rows of the Williams design of the conditions.
    #[must_use]
    pub(crate) fn order_rows(&self) -> usize {
        williams(self.conditions.len()).len()
    }

    /// Returns the order of the conditions of a slot, as indices of conditions. A study has a slot for each group that it needs; the slot of an abandoned group
    /// is given again.
    #[must_use]
    pub fn order_of(&self, slot: usize) -> Vec<usize> {
        let count = self.conditions.len();
        match self.order {
            Order::Given => (0..count).collect(),
            Order::Shuffled => shuffled(self.seed, slot, count),
            Order::Williams => williams(count).swap_remove(self.row_of(slot)),
        }
    }
}

/// Returns the rows of a Williams design (Williams 1949) as indices of treatments: `count` rows for an even number of treatments, twice as many for an odd
/// number. Over all rows, each treatment has each place equally often and follows each other treatment equally often.
#[must_use]
pub(crate) fn williams(count: usize) -> Vec<Vec<usize>> {
    // The first row is 0, 1, n−1, 2, n−2, …: the differences of neighbours are all different modulo n. Each row adds one to the row before.
    let first = |place: usize| match place {
        0 => 0,
        odd if odd % 2 == 1 => odd.div_ceil(2),
        even => count - even / 2,
    };
    let row = |shift: usize| (0..count).map(|place| (first(place) + shift) % count).collect::<Vec<usize>>();
    let mut rows: Vec<Vec<usize>> = (0..count).map(row).collect();
    if count % 2 == 1 {
        // With an odd number, a pair of neighbours is balanced only together with its mirror image.
        rows.extend((0..count).map(|shift| row(shift).into_iter().rev().collect::<Vec<usize>>()));
    }
    rows
}

/// Returns the indices 0 … `count` − 1 in the order of a slot, by exchanges of Fisher & Yates with draws of their own for each slot.
fn shuffled(seed: u64, slot: usize, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    // The slot is the address of the draws, so the group that takes the slot of an abandoned session gets the same order.
    let mut words = Stream::new(seed, b"study order").packet(slot as u64).draws(Purpose::Study);
    for last in (1..count).rev() {
        // The upper half of a product with the number of choices. Its bias is below 2⁻⁵⁰ for a thousand conditions.
        let chosen = (u128::from(words.next_word()) * (last as u128 + 1)) >> 64;
        order.swap(last, usize::try_from(chosen).unwrap_or(last));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(rows: &[Vec<usize>]) -> Vec<String> {
        rows.iter().map(|row| row.iter().map(|treatment| (treatment + 1).to_string()).collect()).collect()
    }

    /// Source: Williams (1949, Australian Journal of Scientific Research A 2), the square for four treatments, by rows.
    #[test]
    fn the_square_of_four_is_that_of_williams() {
        assert_eq!(written(&williams(4)), ["1243", "2314", "3421", "4132"]);
        assert_eq!(written(&williams(1)), ["1", "1"]);
        assert_eq!(written(&williams(2)), ["12", "21"]);
        assert_eq!(written(&williams(3)), ["123", "231", "312", "321", "132", "213"]);
    }

    #[test]
    fn every_treatment_has_every_place_and_every_predecessor_equally_often() {
        for count in 1..=13 {
            let rows = williams(count);
            let times = rows.len() / count;
            for treatment in 0..count {
                for place in 0..count {
                    assert_eq!(rows.iter().filter(|row| row[place] == treatment).count(), times, "{count}");
                }
                for other in (0..count).filter(|other| *other != treatment) {
                    let follows = rows.iter().flat_map(|row| row.windows(2)).filter(|pair| **pair == [treatment, other]).count();
                    assert_eq!(follows, times, "{count}: {treatment} before {other}");
                }
            }
        }
    }

    #[test]
    fn every_slot_has_its_own_shuffled_order_and_keeps_it() {
        let orders: Vec<Vec<usize>> = (0..40).map(|slot| shuffled(7, slot, 5)).collect();
        assert_eq!(orders, (0..40).map(|slot| shuffled(7, slot, 5)).collect::<Vec<_>>());
        for order in &orders {
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4]);
        }
        let different: std::collections::BTreeSet<&Vec<usize>> = orders.iter().collect();
        assert!(different.len() > 25, "{}", different.len());
        assert_ne!(orders, (0..40).map(|slot| shuffled(8, slot, 5)).collect::<Vec<_>>());
    }
}
