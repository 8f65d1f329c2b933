//! The search for the least impaired value that still fails.
//!
//! One search for links, networks and scenes: a [`Space`] says what can be taken away, what can be made plainer and what the numbers are, and [`Search`]
//! asks in a fixed order:
//!
//! 1. *Parts*, level by level (the peers of a scene, the links of a network, the stages of a link): all at once, then halves, halves of halves, and each by itself.
//! 2. *Forms*: each made plainer by itself, in the order in which the space lists them.
//! 3. *Numbers*, one after the other, towards the least impairing value: that value itself first, then by bisection among those of one significant digit,
//!    then of two between the last that passed and the first that failed. Where the number drawn is not round and nothing round fails, digit by digit on.
//!
//! If anything was accepted, it begins again, with numbers now tried one step further only, until nothing changes. What has been tried is not tried again.

mod numbers;
mod space;

use proptest::strategy::ValueTree;

use numbers::Numbers;

pub(super) use space::{Number, Space};

use crate::failure::Searching;

/// A value and the way to a lesser one.
///
/// After [`ValueTree::simplify`] or [`ValueTree::complicate`] gave true, the current value is one to be tried: simplify says that it failed, complicate that it
/// passed. Once nothing is left to try, complicate gives back the last value that failed, to be tried once more, as the trees of proptest do: in a tuple
/// the shrinking of the next component begins from there.
#[derive(Clone, Debug)]
pub(super) struct Search<S: Space> {
    space: S,
    /// The least value that failed.
    best: S::Value,
    /// The candidate that is tried now.
    trial: Option<S::Value>,
    phase: Phase<S>,
    /// What passed.
    passed: Vec<S::Value>,
    /// Whether anything was accepted since the phases began anew.
    progress: bool,
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

    /// Takes the next value to try, skipping those that are known to pass.
    fn advance(&mut self) -> bool {
        while let Some(candidate) = self.propose() {
            if candidate == self.best || self.passed.contains(&candidate) {
                self.answer(false);
                continue;
            }
            self.trial = Some(candidate);
            return true;
        }
        false
    }

    /// The next value in the order of the phases.
    fn propose(&mut self) -> Option<S::Value> {
        loop {
            let (space, best) = (&self.space, &self.best);
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
            Phase::Forms(_) => Phase::Numbers(Numbers::new(space.places(best), self.round > 0)),
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
        // With nothing left to try the current value is the best again.
        self.advance();
        true
    }
}

/// Heaps of parts that may go together, the next to try at the end.
#[derive(Clone, Debug)]
struct Parts<P> {
    heaps: Vec<Vec<P>>,
    tried: Option<Vec<P>>,
}

impl<P> Parts<P> {
    fn new(all: Vec<P>) -> Self {
        Self { heaps: vec![all], tried: None }
    }

    /// The value without the next heap.
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
            self.answer(false);
        }
        None
    }

    /// Halves the heap that cannot go as a whole.
    fn answer(&mut self, went: bool) {
        let Some(mut first) = self.tried.take() else { return };
        if !went && first.len() > 1 {
            let second = first.split_off(first.len() / 2);
            self.heaps.extend([second, first]);
        }
    }
}
