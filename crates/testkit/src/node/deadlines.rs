//! When which node wants to be woken: the least of all is known at once, and a change costs as many steps as N has bits.

use cohaptic_units::Instant;

/// The deadlines of N nodes, as a tree in which every inner place holds the least of the two below it. Place 1 is the root, the nodes' own places are the last.
#[derive(Debug)]
pub(super) struct Deadlines {
    least: Vec<Instant>,
    first: usize,
}

/// Stands for no deadline: to wait for the last instant there is, is to wait for ever.
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
            place /= 2;
            if self.least[place] == least {
                return;
            }
            self.least[place] = least;
        }
    }

    pub(super) fn next(&self) -> Option<Instant> {
        Some(self.least[1]).filter(|deadline| *deadline != NONE)
    }

    /// The first node from `from` on whose deadline is not after `now`.
    pub(super) fn due(&self, from: usize, now: Instant) -> Option<usize> {
        // A packet may arrive at the last instant, where those without a deadline are not due.
        let now = now.min(Instant::from_nanos(u64::MAX - 1));
        if from >= self.first || self.least[1] > now {
            return None;
        }
        let mut place = self.first + from;
        // Upwards and to the right, until something below is due.
        while self.least[place] > now {
            while place % 2 == 1 {
                place /= 2;
                if place <= 1 {
                    return None;
                }
            }
            place += 1;
        }
        while place < self.first {
            place *= 2;
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
