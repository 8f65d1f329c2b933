//! Boundaries: every value of one key at which a scene turns stable or unstable.
//!
//! Stability regions are not convex and have islands, so the line is looked at in many places first. Then, pass after pass, the intervals between
//! neighbouring samples are gone through: where the verdict changes they are halved down to the tolerance; where it does not, and the radius bends
//! enough to reach 1 and come back in between, they are halved until it certainly does not. What the radius does within an interval is judged
//! by the second differences around it, so an island that is smooth on the scale of the samples, or a tangency, is found however narrow it is; one that
//! shows nothing of itself at the samples around it is not, and the result says how fine it looked.

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

/// How closely a boundary is looked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BoundaryOptions {
    /// How many values are looked at first, both ends among them; at least 2. Default: 400.
    pub samples: usize,
    /// How closely each crossing is found, in the unit of the key; above zero.
    pub tolerance: f64,
    /// The search ends when it has looked at this number of values; see [`Boundary::is_settled`]. Default: 100,000.
    pub most: usize,
}

impl BoundaryOptions {
    /// 400 samples, and 10⁻⁹ of the range.
    #[must_use]
    pub fn of(range: &KeyRange) -> Self {
        Self { samples: 400, tolerance: 1e-9 * (range.high - range.low), most: 100_000 }
    }

    /// The same for mean-square radii, whose bounds are wider: 10⁻⁷ of the range.
    #[must_use]
    pub fn of_mean_square(range: &KeyRange) -> Self {
        Self { tolerance: 1e-7 * (range.high - range.low), ..Self::of(range) }
    }
}

/// A value at which the verdict changes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Crossing {
    /// The value, to half the tolerance.
    pub value: f64,
    /// Below it.
    pub from: Verdict,
    /// Above it.
    pub to: Verdict,
}

/// Neighbouring values at which the radius cannot be told from 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stretch {
    /// The first one that was seen.
    pub low: f64,
    /// The last one that was seen; the same if there is one only: the radius touches 1 and turns back.
    pub high: f64,
}

/// All crossings along a key.
#[derive(Clone, PartialEq, Debug)]
pub struct Boundary {
    /// In ascending order. One between stable and unstable on whose two sides is a marginal stretch no wider than the tolerance counts once.
    pub crossings: Vec<Crossing>,
    /// Where the radius stays, or touches, 1 as closely as can be told; in ascending order. Those that are part of a crossing are left out.
    pub marginal: Vec<Stretch>,
    /// The verdict at the lower end of the range.
    pub first: Verdict,
    /// How many values were looked at.
    pub samples: usize,
    /// The shortest distance between two neighbouring ones.
    pub finest: f64,
    /// The longest distance between two neighbouring ones.
    pub coarsest: f64,
    /// Every value that was looked at and its radius, by the criterion of the family, ascending: given to [`Boundary::find`] again, none of them is computed
    /// again.
    pub known: Vec<(f64, Cell)>,
    settled: bool,
}

/// How a search ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum End {
    /// Every interval was looked at as closely as it needs.
    Settled,
    /// It had looked at as many values as it may.
    Most,
    /// It was stopped.
    Stopped,
}

/// Looks at values, and then at those between them that they call for, pass after pass.
fn go_on<E: Send>(
    first: Vec<f64>,
    range: &KeyRange,
    options: BoundaryOptions,
    look: impl Fn(f64) -> Result<Option<(f64, Cell)>, E> + Sync,
) -> Result<(Samples, End), E> {
    let spacing = (range.high - range.low) / crate::rounding::real(options.samples - 1);
    let (mut seen, mut next) = (Samples::default(), first);
    while !next.is_empty() {
        if seen.len() + next.len() > options.most {
            return Ok((seen, End::Most));
        }
        let found: Vec<Option<(f64, Cell)>> = next.par_iter().map(|value| look(*value)).collect::<Result<_, E>>()?;
        let is_whole = found.iter().all(Option::is_some);
        seen.extend(found.into_iter().flatten());
        if !is_whole {
            return Ok((seen, End::Stopped));
        }
        next = wanted(&seen, options.tolerance, spacing);
    }
    Ok((seen, End::Settled))
}

/// Known radii, by the bits of the value.
fn by_value(known: &[(f64, Cell)]) -> BTreeMap<u64, Cell> {
    known.iter().map(|(value, cell)| (value.to_bits(), *cell)).collect()
}

/// Why there is no boundary.
#[derive(Debug, thiserror::Error)]
pub enum BoundaryError<E> {
    /// The options make no sense.
    #[error("{samples} samples and a tolerance of {tolerance}: expected at least 2 samples, not more than {most}, and a finite tolerance above zero")]
    Options {
        /// How many values are looked at first.
        samples: usize,
        /// The tolerance.
        tolerance: f64,
        /// How many are looked at at most.
        most: usize,
    },
    /// The family has not one open key.
    #[error("{keys} open keys: expected one for a boundary")]
    Keys {
        /// How many.
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

    /// [`Boundary::find`] with a watch, which sees how far values are that take long, and ends the search within them.
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

    /// Finds every crossing of a radius over a range, which may be that of anything. Values are looked at on all threads of the pool it is called in;
    /// what comes out does not depend on how many there are.
    ///
    /// `known` are values looked at before, such as [`Boundary::known`] of a search that was stopped; values that are not needed are left out. `progress`
    /// is told after each value how many have been looked at; `stop` is asked before each: if it answers `true` the search ends as it is.
    ///
    /// # Errors
    ///
    /// [`BoundaryError::Options`], and what `radius` answers.
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

    /// [`Boundary::search`]; of a value that was ended before it was known, `radius` answers `None`.
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

    /// How many of the values are nominal: see [`Cell::is_nominal`].
    #[must_use]
    pub fn nominal(&self) -> usize {
        self.known.iter().filter(|(_, cell)| cell.is_nominal).count()
    }

    /// Whether every interval was looked at as closely as it needs: not if the search was stopped, or had looked at as many values as it may.
    #[must_use]
    pub const fn is_settled(&self) -> bool {
        self.settled
    }

    fn of(seen: &Samples, tolerance: f64, settled: bool) -> Self {
        let known: Vec<(f64, Cell)> = seen.iter().collect();
        let gaps = || known.windows(2).map(|pair| pair[1].0 - pair[0].0);
        let mut marginal: Vec<Stretch> = Vec::new();
        let mut crossings: Vec<Crossing> = Vec::new();
        // The verdict on this side of the line, and where it was seen last; a marginal span waits until its width is known.
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
                (Verdict::Marginal, Some((_, side)), Some((_, other))) if narrow => {
                    if side == other {
                        marginal.push(Stretch { low, high });
                    } else {
                        crossings.push(Crossing { value: 0.5 * (low + high), from: side, to: other });
                    }
                    // What follows is past the crossing already.
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
