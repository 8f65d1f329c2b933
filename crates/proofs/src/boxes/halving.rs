//! Halving of ranges of keys until every piece is decided or a limit is reached. Verdicts on pieces may be known before the proof begins.

use cohaptic_stability::Watch;
use cohaptic_stability::numerics::real;
use rayon::prelude::*;

use super::error::ProofError;
use super::followed::Followed;
use super::guarantee::Guarantee;

/// Least and greatest value of each key, indexed by key.
pub(super) type Ranges = Vec<[f64; 2]>;

/// Limits of the halving of undecided ranges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halving {
    /// Largest number of halvings.
    pub(super) times: u32,
    /// Length, in the unit of the key, above which ranges are halved, if a floating-point number lies within. `None`: ranges of every length are halved.
    pub(super) tolerance: Option<f64>,
    /// Largest number of halved ranges of one size. If an eigenvalue stays at the unit circle, no range is ever decided.
    pub(super) most: usize,
    /// The key whose ranges are never halved, a delay.
    pub(super) whole: Option<usize>,
}

/// Function that returns the verdict on ranges; `None` if the ranges were not looked at.
pub(super) type Look<'a> = &'a (dyn Fn(&[[f64; 2]]) -> Result<Option<Guarantee>, ProofError> + Sync);

/// The pieces into which ranges were halved.
#[derive(Debug)]
pub(super) struct Halved {
    /// Pieces with their verdicts, in the order in which the halving reached them: pieces with fewer halvings first.
    pub(super) pieces: Vec<(Ranges, Guarantee)>,
    /// Number of ranges looked at, ranges halved afterwards included.
    pub(super) attempts: usize,
    /// `true` if all pieces were looked at. Otherwise the remaining pieces are undecided too.
    pub(super) is_whole: bool,
}

impl Halving {
    /// Returns the same halving with the ranges of one key left whole.
    pub(super) const fn but_for(self, whole: Option<usize>) -> Self {
        Self { whole, ..self }
    }

    /// Halves ranges that have been halved `halved` times before. Ranges of one size are looked at in parallel; the order of the pieces does not depend on the
    /// threads.
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
            // At the last size undecided ranges become pieces instead of being halved.
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

    /// Returns whether undecided ranges may be halved: at least one key is not whole, and every halved key is longer than the tolerance.
    pub(super) fn may_halve(self, ranges: &[[f64; 2]]) -> bool {
        let is_long = |[low, high]: [f64; 2], tolerance| {
            let middle = low.midpoint(high);
            // Between two neighbouring floating-point numbers there is no middle, and halving would go on for ever.
            high - low > tolerance && low < middle && middle < high
        };
        let halved = self.halved_keys(ranges.len());
        !halved.is_empty() && self.tolerance.is_none_or(|tolerance| halved.iter().all(|key| is_long(ranges[*key], tolerance)))
    }

    /// Returns the keys, of the given number of keys, whose ranges are halved.
    pub(super) fn halved_keys(self, keys: usize) -> Vec<usize> {
        (0..keys).filter(|key| self.whole != Some(*key)).collect()
    }

    /// Returns the 2ⁿ parts of ranges with n halved keys. Bit b of the place of a part says whether the part has the upper half of halved key b.
    pub(super) fn halves(self, ranges: &[[f64; 2]]) -> Vec<Ranges> {
        let halved = self.halved_keys(ranges.len());
        let part = |place: usize| {
            let mut part = ranges.to_vec();
            for (bit, key) in halved.iter().enumerate() {
                let middle = part[*key][0].midpoint(part[*key][1]);
                // The upper half keeps the upper end and the lower half the lower end. The opposite end becomes the middle.
                part[*key][usize::from(place >> bit & 1 == 0)] = middle;
            }
            part
        };
        (0..1 << halved.len()).map(part).collect()
    }
}

/// Store of the pieces of a proof that were decided or left undecided, in this process or in another.
pub trait KnownPieces: Sync {
    /// Returns the verdict on the scenes within a range \[low, high\] of each key, in the order of the keys; `None` if the verdict is not known.
    fn known(&self, ranges: &[[f64; 2]]) -> Option<Guarantee>;

    /// Stores the verdict on a piece. Called once the piece was looked at, also with [`Guarantee::Undecided`].
    fn found(&self, ranges: &[[f64; 2]], guarantee: Guarantee);
}

/// A store that knows no piece and keeps none.
pub(super) struct NothingKnown;

impl KnownPieces for NothingKnown {
    fn known(&self, _ranges: &[[f64; 2]]) -> Option<Guarantee> {
        None
    }

    fn found(&self, _ranges: &[[f64; 2]], _guarantee: Guarantee) {}
}

impl Followed<'_> {
    /// Returns the verdict on the ranges: the known verdict, or else the verdict that is computed here and then stored in `pieces`. Counts as one operation of
    /// the watch.
    pub(super) fn look(&self, ranges: &[[f64; 2]], pieces: &dyn KnownPieces, watch: &dyn Watch) -> Result<Guarantee, ProofError> {
        let guarantee = match pieces.known(ranges) {
            Some(known) => known,
            None => {
                // An undecided piece is stored too: a later process then halves the piece without deciding it again.
                let found = self.decide(ranges)?.map_or(Guarantee::Undecided, Guarantee::from);
                pieces.found(ranges, found);
                found
            }
        };
        watch.done(1.0);
        Ok(guarantee)
    }
}
