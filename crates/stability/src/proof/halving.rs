//! Ranges of keys that are halved until they are decided.

use rayon::prelude::*;

use super::{Guarantee, ProofError};
use crate::Watch;
use crate::worst_case::rounding::real;

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
    /// Halves ranges that have been halved `halved` times before.
    pub(super) fn of(self, whole: Ranges, halved: u32, look: Look<'_>, watch: &dyn Watch) -> Result<Halved, ProofError> {
        let mut waiting = vec![whole];
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
                    Some(Guarantee::Undecided) if !is_last && self.may_halve(&ranges) => next.extend(halves(&ranges)),
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
        self.tolerance.is_none_or(|tolerance| ranges.iter().all(|range| is_long(*range, tolerance)))
    }
}

/// The parts of ranges of which each is halved: those of the first key follow each other.
pub(super) fn halves(ranges: &[[f64; 2]]) -> Vec<Ranges> {
    let half = |range: [f64; 2], is_high: bool| {
        let middle = range[0].midpoint(range[1]);
        if is_high { [middle, range[1]] } else { [range[0], middle] }
    };
    let part = |place: usize| ranges.iter().enumerate().map(|(key, range)| half(*range, place >> key & 1 == 1)).collect();
    (0..1 << ranges.len()).map(part).collect()
}
