//! Which numbers of a joining have been let in: a window of the last 128, as in RFC 4303, section 3.4.3.

/// How far behind the highest number one that is late is still let in, once.
pub const WINDOW: u32 = 128;

/// The numbers seen in one joining.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    highest: u64,
    /// Bit i: `highest` − i has been seen. Bit 0 is always set.
    seen: u128,
}

impl Window {
    /// After the first number of a joining, which may be any.
    pub(super) const fn beginning_with(number: u64) -> Self {
        Self { highest: number, seen: 1 }
    }

    /// Whether that number may pass; from now on it is seen.
    pub(super) const fn accept(&mut self, number: u64) -> bool {
        if number > self.highest {
            let ahead = number - self.highest;
            self.seen = if ahead < WINDOW as u64 { self.seen << ahead | 1 } else { 1 };
            self.highest = number;
            return true;
        }
        let behind = self.highest - number;
        if behind >= WINDOW as u64 || self.seen >> behind & 1 == 1 {
            return false;
        }
        self.seen |= 1 << behind;
        true
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_late_number_passes_once_and_one_128_behind_never() {
        let mut window = Window::beginning_with(0);
        assert!(window.accept(128));
        assert!(!window.accept(0), "0 is out of the window");
        assert!(window.accept(1));
        assert!(!window.accept(1));
        assert!(!window.accept(128));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// Against a set of all numbers ever seen, with jumps over and within the window.
        #[test]
        fn it_lets_in_what_a_set_would_and_nothing_older_than_the_window(steps in prop::collection::vec((-200_i64..200, any::<bool>()), 1..300)) {
            let mut seen = BTreeSet::from([1000_u64]);
            let mut window = Window::beginning_with(1000);
            for (step, far) in steps {
                let highest = *seen.last().unwrap();
                let number = highest.saturating_add_signed(if far { step } else { step % 5 });
                let expected = number + 128 > highest && !seen.contains(&number);
                prop_assert_eq!(window.accept(number), expected);
                if expected {
                    seen.insert(number);
                }
            }
        }
    }
}
