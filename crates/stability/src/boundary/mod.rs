//! Boundaries: the values of one key at which a scene turns stable or unstable.
//!
//! Stability regions are not convex and have islands, so the radius is first computed at many values. Then, pass after pass, intervals between neighbouring
//! values are halved. An interval with different verdicts at its ends is halved down to the tolerance. An interval with equal verdicts at its ends is halved as
//! long as the radius may bend enough to reach 1 and come back in between. The bend of the radius within an interval is estimated from the second differences
//! around the interval. So an island smooth on the scale of the samples, or a tangency, is found at any width. An island without a trace in the samples around
//! the island is not found; the result tells the distances between neighbouring values.

pub(crate) mod blocks;
mod intervals;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::map::{Scratches, nodes};
use crate::watch::Asks;
use crate::{AnalysisError, Cell, Family, FamilyError, KeyRange, Verdict, Watch};
use intervals::{Samples, wanted};

/// Options of a search for a boundary.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BoundaryOptions {
    /// Number of values of the first pass, both ends of the range among them; at least 2. Default: 400.
    pub samples: usize,
    /// Largest width of the interval around a crossing, in the unit of the key; above zero.
    pub tolerance: f64,
    /// Largest number of computed values of a search; see [`Boundary::is_settled`]. Default: 100,000.
    pub most: usize,
}

impl BoundaryOptions {
    /// Returns the default options: 400 samples, and a tolerance of 10⁻⁹ of the range.
    #[must_use]
    pub fn of(range: &KeyRange) -> Self {
        Self { samples: 400, tolerance: 1e-9 * (range.high - range.low), most: 100_000 }
    }

    /// Returns the default options for mean-square radii with their wider bounds: 400 samples, and a tolerance of 10⁻⁷ of the range.
    #[must_use]
    pub fn of_mean_square(range: &KeyRange) -> Self {
        Self { tolerance: 1e-7 * (range.high - range.low), ..Self::of(range) }
    }
}

/// A value of the key at which the verdict changes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Crossing {
    /// Value of the key, to within half the tolerance.
    pub value: f64,
    /// Verdict below the value.
    pub from: Verdict,
    /// Verdict above the value.
    pub to: Verdict,
}

/// A stretch of neighbouring values with a radius too near to 1 for a verdict.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stretch {
    /// Lowest computed value of the stretch.
    pub low: f64,
    /// Highest computed value of the stretch; equal to `low` if the stretch has a single value. There the radius touches 1 and turns back.
    pub high: f64,
}

/// All crossings along a key, and the values of the search.
#[derive(Clone, PartialEq, Debug)]
pub struct Boundary {
    /// Crossings in ascending order. A marginal stretch no wider than the tolerance between different verdicts counts as one crossing.
    pub crossings: Vec<Crossing>,
    /// Stretches where the radius is 1 as closely as can be told, in ascending order. Stretches within a crossing are left out.
    pub marginal: Vec<Stretch>,
    /// Verdict at the lower end of the range.
    pub first: Verdict,
    /// Number of computed values.
    pub samples: usize,
    /// Shortest distance between two neighbouring values; infinite if there are fewer than two.
    pub finest: f64,
    /// Longest distance between two neighbouring values.
    pub coarsest: f64,
    /// Every computed value and its radius by the criterion of the family, ascending by value. A later [`Boundary::find`] with these values computes none
    /// of these values again.
    pub known: Vec<(f64, Cell)>,
    settled: bool,
}

/// The reason why a search ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum End {
    /// Every interval is divided as finely as needed.
    Settled,
    /// The search would need more values than allowed.
    Most,
    /// The search was stopped.
    Stopped,
}

/// Computes the cells of the values `first`, and then, pass after pass, of the middles of halved intervals. `look` returns `None` if the search is to stop.
fn go_on<E: Send>(
    first: Vec<f64>,
    range: &KeyRange,
    options: BoundaryOptions,
    look: impl Fn(f64) -> Result<Option<(f64, Cell)>, E> + Sync,
) -> Result<(Samples, End), E> {
    let spacing = (range.high - range.low) / crate::rounding::real(options.samples - 1);
    let (mut seen, mut next) = (Samples::default(), first);
    while !next.is_empty() {
        // The limit is checked before a pass, so a pass is computed whole or not at all.
        if seen.len() + next.len() > options.most {
            return Ok((seen, End::Most));
        }
        let found: Vec<Option<(f64, Cell)>> = next.par_iter().map(|value| look(*value)).collect::<Result<_, E>>()?;
        // Cells computed before a stop are kept, and a later search can begin with these cells.
        let is_whole = found.iter().all(Option::is_some);
        seen.extend(found.into_iter().flatten());
        if !is_whole {
            return Ok((seen, End::Stopped));
        }
        next = wanted(&seen, options.tolerance, spacing);
    }
    Ok((seen, End::Settled))
}

/// Returns the known cells, indexed by the bits of their values.
fn by_value(known: &[(f64, Cell)]) -> BTreeMap<u64, Cell> {
    known.iter().map(|(value, cell)| (value.to_bits(), *cell)).collect()
}

/// Why there is no boundary.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BoundaryError<E> {
    /// The options make no sense.
    #[error("{samples} samples and a tolerance of {tolerance}: expected at least 2 samples, not more than {most}, and a finite tolerance above zero")]
    Options {
        /// Number of values of the first pass.
        samples: usize,
        /// The tolerance.
        tolerance: f64,
        /// Largest number of values of the search.
        most: usize,
    },
    /// The family has not one open key.
    #[error("{keys} open keys: expected one for a boundary")]
    Keys {
        /// Number of open keys.
        keys: usize,
    },
    /// A radius cannot be computed.
    #[error(transparent)]
    Radius(E),
}

impl Boundary {
    /// Finds every crossing along the open key of a family: [`Boundary::search`] with its bounded radii.
    ///
    /// # Errors
    ///
    /// As [`Boundary::search`], and if the family has not one open key.
    pub fn find(
        family: &Family,
        options: BoundaryOptions,
        known: &[(f64, Cell)],
        progress: impl Fn(usize) + Sync,
        stop: impl Fn() -> bool + Sync,
    ) -> Result<Self, BoundaryError<FamilyError>> {
        Self::find_watched(family, options, known, progress, &Asks(stop))
    }

    /// Runs [`Boundary::find`] with a watch. The watch sees the progress of slow values and can stop the search within a value.
    ///
    /// # Errors
    ///
    /// As [`Boundary::find`].
    pub fn find_watched(
        family: &Family,
        options: BoundaryOptions,
        known: &[(f64, Cell)],
        progress: impl Fn(usize) + Sync,
        watch: &dyn Watch,
    ) -> Result<Self, BoundaryError<FamilyError>> {
        let [range] = family.keys() else {
            return Err(BoundaryError::Keys { keys: family.keys().len() });
        };
        let pool = Scratches::default();
        let radius = |value: f64| match pool.with(|scratch| family.bounded_radius_watched(&[value], scratch, watch)) {
            Err(FamilyError::Analysis(AnalysisError::Stopped)) => Ok(None),
            found => found.map(Some),
        };
        Self::searched(range, options, known, radius, progress, || watch.stops())
    }

    /// Finds every crossing of any function `radius` over a range. Values are computed on all threads of the calling pool; the result does not depend on the
    /// number of threads.
    ///
    /// `known` are values computed before, such as [`Boundary::known`] of a stopped search; unneeded values are left out of the result. `progress` is called
    /// after each value with the number of values so far. `stop` is called before each value; if it returns `true` the search ends with the values so far.
    ///
    /// # Errors
    ///
    /// [`BoundaryError::Options`] for options out of range, and [`BoundaryError::Radius`] with an error of `radius`.
    pub fn search<E: Send>(
        range: &KeyRange,
        options: BoundaryOptions,
        known: &[(f64, Cell)],
        radius: impl Fn(f64) -> Result<Cell, E> + Sync,
        progress: impl Fn(usize) + Sync,
        stop: impl Fn() -> bool + Sync,
    ) -> Result<Self, BoundaryError<E>> {
        Self::searched(range, options, known, |value| radius(value).map(Some), progress, stop)
    }

    /// Runs [`Boundary::search`] with a `radius`; a result `None` of `radius` means a stopped computation.
    fn searched<E: Send>(
        range: &KeyRange,
        options: BoundaryOptions,
        known: &[(f64, Cell)],
        radius: impl Fn(f64) -> Result<Option<Cell>, E> + Sync,
        progress: impl Fn(usize) + Sync,
        stop: impl Fn() -> bool + Sync,
    ) -> Result<Self, BoundaryError<E>> {
        let BoundaryOptions { samples, tolerance, most } = options;
        if samples < 2 || samples > most || !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(BoundaryError::Options { samples, tolerance, most });
        }
        let known = by_value(known);
        let looked_at = AtomicUsize::new(0);
        let look = |value: f64| -> Result<Option<(f64, Cell)>, E> {
            if stop() {
                return Ok(None);
            }
            let found = match known.get(&value.to_bits()) {
                Some(cell) => Some(*cell),
                None => radius(value)?,
            };
            let Some(found) = found else { return Ok(None) };
            progress(looked_at.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(Some((value, found)))
        };
        let (seen, end) = go_on(nodes(range, samples), range, options, look).map_err(BoundaryError::Radius)?;
        Ok(Self::of(&seen, tolerance, end == End::Settled))
    }

    /// Returns the number of values with nominal cells: see [`Cell::is_nominal`].
    #[must_use]
    pub fn nominal(&self) -> usize {
        self.known.iter().filter(|(_, cell)| cell.is_nominal).count()
    }

    /// Returns whether every interval is divided as finely as needed. False if the search was stopped, or would have needed more than the largest number of
    /// values.
    #[must_use]
    pub const fn is_settled(&self) -> bool {
        self.settled
    }

    fn of(seen: &Samples, tolerance: f64, settled: bool) -> Self {
        let known: Vec<(f64, Cell)> = seen.iter().collect();
        let gaps = || known.windows(2).map(|pair| pair[1].0 - pair[0].0);
        let mut marginal: Vec<Stretch> = Vec::new();
        let mut crossings: Vec<Crossing> = Vec::new();
        // `before` is the verdict below the present run of equal verdicts, and the last value with that verdict. A run is taken as a whole, because a marginal
        // run is a crossing only if it is narrow.
        let first = known.first().map_or(Verdict::Marginal, |(_, cell)| cell.radius.verdict());
        let mut place = 0;
        let mut before: Option<(f64, Verdict)> = None;
        while place < known.len() {
            let (low, verdict) = (known[place].0, known[place].1.radius.verdict());
            let run = known[place..].iter().take_while(|(_, cell)| cell.radius.verdict() == verdict).count();
            let high = known[place + run - 1].0;
            place += run;
            let after = known.get(place).map(|(value, cell)| (*value, cell.radius.verdict()));
            let narrow = high - low <= tolerance;
            match (verdict, before, after) {
                // A narrow marginal run between two different verdicts is a crossing, between equal verdicts a tangency.
                (Verdict::Marginal, Some((_, side)), Some((_, other))) if narrow => {
                    if side == other {
                        marginal.push(Stretch { low, high });
                    } else {
                        crossings.push(Crossing { value: 0.5 * (low + high), from: side, to: other });
                    }
                    // The next run lies above this crossing, so `before` takes the verdict of the next run already.
                    before = Some((high, other));
                }
                _ => {
                    if verdict == Verdict::Marginal {
                        marginal.push(Stretch { low, high });
                    }
                    if let Some((last, side)) = before
                        && side != verdict
                    {
                        crossings.push(Crossing { value: 0.5 * (last + low), from: side, to: verdict });
                    }
                    before = Some((high, verdict));
                }
            }
        }
        Self {
            crossings,
            marginal,
            first,
            samples: known.len(),
            finest: gaps().fold(f64::INFINITY, f64::min),
            coarsest: gaps().fold(0.0, f64::max),
            settled,
            known,
        }
    }
}
