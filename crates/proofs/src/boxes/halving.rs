//! Ranges of keys that are halved until they are decided.

use cohaptic_stability::Watch;
use cohaptic_stability::numerics::real;
use rayon::prelude::*;

use super::error::ProofError;
use super::guarantee::Guarantee;

/// From which value of each key to which.
pub(super) type Ranges = Vec<[f64; 2]>;

/// How far ranges are halved that are not decided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halving {
    /// At most so often.
    pub(super) times: u32,
    /// Only those that are longer, and have a number within; `None` for all.
    pub(super) tolerance: Option<f64>,
    /// More than these are not halved at once: where an eigenvalue stays at the unit circle, none is ever decided.
    pub(super) most: usize,
    /// The key whose ranges are never halved.
    pub(super) whole: Option<usize>,
}

/// The verdict on ranges; `None` if they were not looked at.
pub(super) type Look<'a> = &'a (dyn Fn(&[[f64; 2]]) -> Result<Option<Guarantee>, ProofError> + Sync);

/// All that ranges were halved into.
#[derive(Debug)]
pub(super) struct Halved {
    /// Larger ones first, then by the last key and then by those before it.
    pub(super) pieces: Vec<(Ranges, Guarantee)>,
    /// How many were looked at.
    pub(super) attempts: usize,
    /// Whether every one was looked at; otherwise some are undecided that were not.
    pub(super) is_whole: bool,
}

impl Halving {
    /// The halving that leaves the ranges of a key whole.
    pub(super) const fn but_for(self, whole: Option<usize>) -> Self {
        Self { whole, ..self }
    }

    /// Halves ranges that have been halved `halved` times before.
    pub(super) fn of(self, mut waiting: Vec<Ranges>, halved: u32, look: Look<'_>, watch: &dyn Watch) -> Result<Halved, ProofError> {
        let mut all = Halved { pieces: Vec::new(), attempts: 0, is_whole: true };
        for halved in halved.. {
            if waiting.is_empty() {
                break;
            }
            watch.expects(real(waiting.len()));
            let found = waiting.par_iter().map(|ranges| if watch.stops() { Ok(None) } else { look(ranges) });
            let found = found.collect::<Result<Vec<_>, _>>()?;
            all.attempts += found.len();
            all.is_whole = all.is_whole && !watch.stops() && found.iter().all(Option::is_some);
            let is_last = watch.stops() || halved >= self.times || found.len() > self.most;
            let mut next = Vec::new();
            for (ranges, found) in waiting.into_iter().zip(found) {
                match found {
                    Some(Guarantee::Undecided) if !is_last && self.may_halve(&ranges) => next.extend(self.halves(&ranges)),
                    found => all.pieces.push((ranges, found.unwrap_or(Guarantee::Undecided))),
                }
            }
            waiting = next;
        }
        Ok(all)
    }

    /// Whether these ranges are halved if they are not decided.
    pub(super) fn may_halve(self, ranges: &[[f64; 2]]) -> bool {
        let is_long = |[low, high]: [f64; 2], tolerance| {
            let middle = low.midpoint(high);
            high - low > tolerance && low < middle && middle < high
        };
        let halved = self.halved_keys(ranges.len());
        !halved.is_empty() && self.tolerance.is_none_or(|tolerance| halved.iter().all(|key| is_long(ranges[*key], tolerance)))
    }

    /// Which of that number of keys are halved.
    pub(super) fn halved_keys(self, keys: usize) -> Vec<usize> {
        (0..keys).filter(|key| self.whole != Some(*key)).collect()
    }

    /// The parts of ranges: those of the first key that is halved follow each other.
    pub(super) fn halves(self, ranges: &[[f64; 2]]) -> Vec<Ranges> {
        let halved = self.halved_keys(ranges.len());
        let part = |place: usize| {
            let mut part = ranges.to_vec();
            for (bit, key) in halved.iter().enumerate() {
                let middle = part[*key][0].midpoint(part[*key][1]);
                part[*key][usize::from(place >> bit & 1 == 0)] = middle;
            }
            part
        };
        (0..1 << halved.len()).map(part).collect()
    }
}
