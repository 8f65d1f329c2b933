//! Deadlines of nodes. The earliest deadline of all is known at once; a change takes as many steps as the number of nodes has bits.

use cohaptic_units::Instant;

/// Deadlines of N nodes, as a binary tree in an array: every inner entry holds the earlier of its two children. Entry 1 is the root, and the entries of the
/// nodes are at the end.
#[derive(Debug)]
pub(super) struct Deadlines {
    /// Entries of the tree: the earliest deadline below each. The children of entry `i` are the entries `2 * i` and `2 * i + 1`; entry 0 is unused.
    least: Vec<Instant>,
    /// Index of the entry of node 0.
    first: usize,
}

/// Stands for no deadline, because waiting for the last representable instant is waiting for ever.
const NONE: Instant = Instant::MAX;

impl Deadlines {
    pub(super) fn new(nodes: usize) -> Self {
        let first = nodes.next_power_of_two();
        Self { least: vec![NONE; 2 * first], first }
    }

    pub(super) fn set(&mut self, node: usize, deadline: Option<Instant>) {
        let mut place = self.first + node;
        let deadline = deadline.unwrap_or(NONE);
        if self.least[place] == deadline {
            return;
        }
        self.least[place] = deadline;
        while place > 1 {
            let least = self.least[place].min(self.least[place ^ 1]);
            // The other child of the same parent differs in the lowest bit of its index.
            place /= 2;
            // An unchanged entry leaves all entries above unchanged.
            if self.least[place] == least {
                return;
            }
            self.least[place] = least;
        }
    }

    pub(super) fn next(&self) -> Option<Instant> {
        Some(self.least[1]).filter(|deadline| *deadline != NONE)
    }

    /// Returns the first node from `from` on whose deadline is not after `now`.
    pub(super) fn due(&self, from: usize, now: Instant) -> Option<usize> {
        // A packet may arrive at the last instant. Nodes without a deadline must not count as due then.
        let now = now.min(Instant::from_nanos(u64::MAX - 1));
        if from >= self.first || self.least[1] > now {
            return None;
        }
        let mut place = self.first + from;
        // Goes up from a right child and right from a left one, until an entry with a due deadline below is found.
        while self.least[place] > now {
            while place % 2 == 1 {
                place /= 2;
                if place <= 1 {
                    return None;
                }
            }
            place += 1;
        }
        // Goes down to the leftmost node that is due.
        while place < self.first {
            place *= 2;
            // At least one child is due. If the left child is not due, the right child is.
            if self.least[place] > now {
                place += 1;
            }
        }
        Some(place - self.first)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn at_the_last_instant_nobody_is_due_who_has_no_deadline() {
        let mut tree = Deadlines::new(3);
        tree.set(1, Some(Instant::from_nanos(u64::MAX - 1)));
        tree.set(2, Some(Instant::MAX));
        assert_eq!((tree.due(0, Instant::MAX), tree.due(2, Instant::MAX)), (Some(1), None));
        assert_eq!(tree.next(), Some(Instant::from_nanos(u64::MAX - 1)));
    }

    proptest! {
        #[test]
        fn they_are_what_a_list_says(nodes in 1_usize..9, changes in prop::collection::vec((0_usize..9, prop::option::of(0_u64..6)), 0..30)) {
            let mut tree = Deadlines::new(nodes);
            let mut list = vec![None; nodes];
            for (node, deadline) in changes {
                let (node, deadline) = (node % nodes, deadline.map(Instant::from_nanos));
                tree.set(node, deadline);
                list[node] = deadline;
                prop_assert_eq!(tree.next(), list.iter().flatten().min().copied());
                for now in (0..7).map(Instant::from_nanos) {
                    for from in 0..=nodes {
                        let expected = (from..nodes).find(|node| list[*node].is_some_and(|deadline| deadline <= now));
                        prop_assert_eq!(tree.due(from, now), expected);
                    }
                }
            }
        }
    }
}
