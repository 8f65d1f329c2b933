//! Search for the least impaired value on which a test still fails.
//!
//! The search is the same for links, networks and scenes. A [`Space`] lists the parts that can be removed, the forms that can become plainer, and the numbers
//! of a value. [`Search`] tries changes in a fixed order:
//!
//! 1. *Parts*, level by level (the peers of a scene, the links of a network, the stages of a link): all at once, then halves, halves of halves, and single
//!    parts.
//! 2. *Forms*: each form becomes plainer by itself, in the order in which the space lists the forms.
//! 3. *Numbers*, one after the other, towards the least impairing value, which is tried first. Bisection follows among numbers of one significant digit,
//!    then among numbers of two digits between the last number that passed and the first number that failed. If the number drawn is not round and no round
//!    number fails, the digits increase further.
//!
//! If anything was accepted, the search begins again, and each number is then tried only a step further, until nothing changes. A value that was tried is not
//! tried again.

mod numbers;
mod space;

use proptest::strategy::ValueTree;

use numbers::Numbers;

pub(super) use space::{Number, Space};

use crate::failure::Searching;

/// Value of a strategy, with the search for a lesser value.
///
/// After [`ValueTree::simplify`] or [`ValueTree::complicate`] has returned true, the test must be run with the current value. `simplify` reports that the test
/// has failed, `complicate` that it has passed. If nothing is left to try, `complicate` restores the last value that failed, and the test is run with it once
/// more, as with the trees of proptest: in a tuple the shrinking of the next component begins there.
#[derive(Clone, Debug)]
pub(super) struct Search<S: Space> {
    space: S,
    /// Least value so far with which the test has failed.
    best: S::Value,
    /// Candidate with which the test is run now.
    trial: Option<S::Value>,
    phase: Phase<S>,
    /// Candidates with which the test has passed.
    passed: Vec<S::Value>,
    /// `true` if anything was accepted since the first phase last began.
    progress: bool,
    /// Number of times that the phases have begun anew.
    round: u32,
    _searching: Searching,
}

#[derive(Clone, Debug)]
enum Phase<S: Space> {
    Parts { level: usize, parts: Parts<S::Part> },
    Forms(std::vec::IntoIter<S::Form>),
    Numbers(Numbers<S::Place>),
    Done,
}

impl<S: Space> Search<S> {
    pub(super) fn new(space: S, value: S::Value) -> Self {
        let parts = Parts::new(space.parts(&value, 0));
        Self {
            space,
            best: value,
            trial: None,
            phase: Phase::Parts { level: 0, parts },
            passed: Vec::new(),
            progress: false,
            round: 0,
            _searching: Searching::begin(),
        }
    }

    /// Proceeds to the next candidate, and skips candidates that have been tried. Returns whether a candidate is left.
    fn advance(&mut self) -> bool {
        while let Some(candidate) = self.propose() {
            if candidate == self.best || self.passed.contains(&candidate) {
                // A test depends on the input alone: a candidate that has passed would pass again, and is skipped.
                self.answer(false);
                continue;
            }
            self.trial = Some(candidate);
            return true;
        }
        false
    }

    /// Returns the next candidate, in the order of the phases.
    fn propose(&mut self) -> Option<S::Value> {
        loop {
            let (space, best) = (&self.space, &self.best);
            // Every candidate is a change of the best value so far, so accepted changes add up.
            let found = match &mut self.phase {
                Phase::Parts { parts, .. } => parts.propose(|parts| space.without(best, parts)),
                Phase::Forms(forms) => forms.by_ref().find_map(|form| space.plainer(best, &form)),
                Phase::Numbers(numbers) => numbers.propose(space, best),
                Phase::Done => return None,
            };
            if found.is_some() {
                return found;
            }
            self.next_phase();
        }
    }

    fn next_phase(&mut self) {
        let (space, best) = (&self.space, &self.best);
        let parts = |level| Phase::Parts { level, parts: Parts::new(space.parts(best, level)) };
        self.phase = match &self.phase {
            Phase::Parts { level, .. } if level + 1 < S::LEVELS => parts(level + 1),
            Phase::Parts { .. } => Phase::Forms(space.forms(best).into_iter()),
            // After the first round most numbers cannot shrink further, so one try per number is enough to see whether a number still can.
            Phase::Forms(_) => Phase::Numbers(Numbers::new(space.places(best), self.round > 0)),
            // A smaller number may let a part go that had to stay before, so the phases begin again after every round with progress.
            Phase::Numbers(_) if self.progress => {
                self.progress = false;
                self.round += 1;
                parts(0)
            }
            Phase::Numbers(_) | Phase::Done => Phase::Done,
        };
    }

    fn answer(&mut self, fails: bool) {
        match &mut self.phase {
            Phase::Parts { parts, .. } => parts.answer(fails),
            Phase::Numbers(numbers) => numbers.answer(fails),
            Phase::Forms(_) | Phase::Done => {}
        }
    }
}

impl<S: Space> ValueTree for Search<S> {
    type Value = S::Value;

    fn current(&self) -> S::Value {
        self.trial.as_ref().unwrap_or(&self.best).clone()
    }

    fn simplify(&mut self) -> bool {
        // `simplify` is the only report of proptest that the property has failed with the current value.
        Searching::failed();
        if let Some(failed) = self.trial.take() {
            self.best = failed;
            self.progress = true;
            self.answer(true);
        }
        self.advance()
    }

    fn complicate(&mut self) -> bool {
        let Some(passed) = self.trial.take() else { return false };
        self.passed.push(passed);
        self.answer(false);
        // If nothing is left to try, there is no candidate, and the current value is the best one again.
        self.advance();
        true
    }
}

/// Heaps of parts that may be removed together. The heap to try next is the last.
#[derive(Clone, Debug)]
struct Parts<P> {
    heaps: Vec<Vec<P>>,
    tried: Option<Vec<P>>,
}

impl<P> Parts<P> {
    fn new(all: Vec<P>) -> Self {
        Self { heaps: vec![all], tried: None }
    }

    /// Returns the value without the parts of the next heap.
    fn propose<V>(&mut self, without: impl Fn(&[P]) -> Option<V>) -> Option<V> {
        while let Some(heap) = self.heaps.pop() {
            if heap.is_empty() {
                continue;
            }
            let candidate = without(&heap);
            self.tried = Some(heap);
            if candidate.is_some() {
                return candidate;
            }
            // The space has no value without this heap, for instance because the value would be outside of the bounds. Halves of the heap may still go.
            self.answer(false);
        }
        None
    }

    /// Takes the answer to the last candidate. A heap that could not be removed as a whole is halved.
    fn answer(&mut self, went: bool) {
        let Some(mut first) = self.tried.take() else { return };
        if !went && first.len() > 1 {
            let second = first.split_off(first.len() / 2);
            // The first half comes last, because the last heap is tried next.
            self.heaps.extend([second, first]);
        }
    }
}
