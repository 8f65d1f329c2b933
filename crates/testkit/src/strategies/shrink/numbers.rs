//! Shrinking of numbers to the least impairing value, by bisection among round numbers.

use super::space::{Number, Space};
use crate::strategies::grid::{is_round, next_towards, round_between};

/// Numbers of a value. The numbers shrink in sequence.
#[derive(Clone, Debug)]
pub(super) struct Numbers<P> {
    places: std::vec::IntoIter<P>,
    /// `true` if a number stays unchanged when the test passes with the next round number.
    only_nearest: bool,
    /// Number that shrinks now.
    now: Option<(P, Bisection)>,
}

impl<P: Clone> Numbers<P> {
    pub(super) fn new(places: Vec<P>, only_nearest: bool) -> Self {
        Self { places: places.into_iter(), only_nearest, now: None }
    }

    pub(super) fn propose<S: Space<Place = P>>(&mut self, space: &S, best: &S::Value) -> Option<S::Value> {
        loop {
            while let Some((place, bisection)) = &mut self.now {
                let Some(number) = bisection.propose() else { break };
                let candidate = space.with_number(best, place, number);
                if candidate.is_some() {
                    return candidate;
                }
                // A number that the space refuses counts as passed: the bisection then looks for a number nearer to the failing one.
                bisection.answer(false);
            }
            let place = self.places.next()?;
            self.now = space.number(best, &place).map(|number| (place, Bisection::new(number, self.only_nearest)));
        }
    }

    pub(super) fn answer(&mut self, fails: bool) {
        if let Some((_, bisection)) = &mut self.now {
            bisection.answer(fails);
        }
    }
}

/// Search for the least impairing value of a number.
#[derive(Clone, Debug)]
struct Bisection {
    step: u64,
    /// Number nearest to the goal with which the test failed.
    fails: u64,
    /// Number nearest to `fails`, on the side of the goal, with which the test passed. The goal before the first such number.
    passes: u64,
    /// Number of significant digits of the numbers in `between`.
    digits: u32,
    /// Round numbers between `passes` and `fails`, beginning on the side of the goal.
    between: Vec<u64>,
    next: Next,
    asked: u64,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Next {
    Goal,
    Nearest,
    Middle,
    Nothing,
}

impl Bisection {
    fn new(number: Number, only_nearest: bool) -> Self {
        let Number { value, goal, step } = number;
        let mut new = Self { step, fails: value, passes: goal, digits: 1, between: Vec::new(), next: Next::Goal, asked: goal };
        if value == goal {
            new.next = Next::Nothing;
        } else if only_nearest {
            new.next = Next::Nearest;
        }
        new
    }

    fn fill(&mut self) {
        let (low, high) = (self.fails.min(self.passes), self.fails.max(self.passes));
        self.between = round_between(low, high, self.digits, self.step);
        if self.passes > self.fails {
            self.between.reverse();
        }
    }

    fn propose(&mut self) -> Option<u64> {
        self.asked = match self.next {
            Next::Nothing => return None,
            Next::Goal => self.passes,
            Next::Nearest => {
                self.digits = 2;
                // The neighbour has as many digits as the number itself, so that a number with many digits moves by its last digit.
                while !is_round(self.fails, self.digits, self.step) && self.digits < 20 {
                    self.digits += 1;
                }
                next_towards(self.passes, self.fails, self.digits, self.step)
            }
            Next::Middle => loop {
                if !self.between.is_empty() {
                    break self.between[(self.between.len() - 1) / 2];
                }
                // Two digits are enough, unless the number drawn has more digits and no rounder number fails.
                if self.digits >= 20 || (self.digits >= 2 && is_round(self.fails, self.digits, self.step)) {
                    self.next = Next::Nothing;
                    return None;
                }
                self.digits += 1;
                self.fill();
            },
        };
        Some(self.asked)
    }

    fn answer(&mut self, fails: bool) {
        match (self.next, fails) {
            (Next::Goal, true) | (Next::Nearest, false) | (Next::Nothing, _) => self.next = Next::Nothing,
            (Next::Goal, false) => {
                self.next = Next::Middle;
                self.fill();
            }
            // A neighbour fails as well, so the search begins anew with the goal.
            (Next::Nearest, true) => {
                self.fails = self.asked;
                self.next = if self.asked == self.passes { Next::Nothing } else { Next::Goal };
                self.digits = 1;
            }
            (Next::Middle, _) => {
                let middle = (self.between.len() - 1) / 2;
                if fails {
                    self.fails = self.asked;
                    self.between.truncate(middle);
                } else {
                    self.passes = self.asked;
                    self.between.drain(..=middle);
                }
            }
        }
    }
}
