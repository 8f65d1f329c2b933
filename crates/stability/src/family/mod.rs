//! Scenes that differ in one or two numbers: a map, or a line across it.
//!
//! Reading a scene takes far longer than analysing it. So the scene is read a few times, with different values of its open keys; where it is seen that
//! a key does nothing but set certain numbers, the key is *learned*, and from then on only those numbers are written. A key that is not learned, such
//! as a delay, is read anew for each value.

mod cell;
mod error;
mod leaves;
mod prepared;
mod range;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use cohaptic_scene::Scene;

pub use cell::Cell;
pub use error::FamilyError;
pub use range::{KeyRange, KeyRangeError};

use crate::scene_radius::RadiusScratch;
use crate::{Criterion, Radius, Unwatched, Watch, left_out};
use leaves::Probe;
use prepared::Prepared;

/// The most peers kept in scenes that have been read for values of a key that is not learned.
const MOST_KEPT: usize = 50_000;

/// A scene with one or two keys left open.
#[derive(Debug)]
pub struct Family {
    text: String,
    file: PathBuf,
    overrides: Vec<String>,
    keys: Vec<KeyRange>,
    learned: Vec<bool>,
    criterion: Criterion,
    /// Random parts of the links anywhere in the family, in words.
    left_out: Vec<&'static str>,
    /// Scenes by the values of the keys that are not learned.
    prepared: Mutex<BTreeMap<Vec<u64>, Arc<Prepared>>>,
    /// Tells this family from others, also from those that are gone.
    identity: Arc<()>,
}

/// Room for computing radii, and what was computed last. One for each thread; it may be used with any family, and what comes out does not depend on
/// what it was used for before.
#[derive(Debug, Default)]
pub struct FamilyScratch {
    last: Option<Last>,
}

#[derive(Debug)]
struct Last {
    /// The values of the keys that are not learned.
    fixed: Vec<u64>,
    prepared: Arc<Prepared>,
    scene: Scene,
    radii: Vec<RadiusScratch>,
    family: Arc<()>,
}

impl Family {
    /// Leaves keys of a scene open. `text`, `file` and `overrides` are those of [`Scene::parse`]; the keys are put in after the overrides.
    ///
    /// # Errors
    ///
    /// [`FamilyError`] if there are not one or two different keys, if the scene is refused with the keys at either end, if a key takes no number, or if
    /// the scene cannot be analysed.
    pub fn new(text: &str, file: &Path, overrides: &[String], keys: Vec<KeyRange>) -> Result<Self, FamilyError> {
        if !(1..=2).contains(&keys.len()) {
            return Err(FamilyError::Keys { keys: keys.len() });
        }
        if let [one, other] = keys.as_slice()
            && one.key == other.key
        {
            return Err(FamilyError::Twice { key: one.key.clone() });
        }
        let learned = vec![false; keys.len()];
        let (text, file, overrides) = (text.to_owned(), file.to_path_buf(), overrides.to_vec());
        let criterion = Criterion::SpectralRadius;
        let mut family =
            Self { text, file, overrides, keys, learned, criterion, left_out: Vec::new(), prepared: Mutex::default(), identity: Arc::new(()) };
        let low: Vec<f64> = family.keys.iter().map(|range| range.low).collect();
        let high: Vec<f64> = family.keys.iter().map(|range| range.high).collect();
        let at_low = family.scene(&low).map_err(|error| family.no_number(error))?;
        let at_high = family.scene(&high).map_err(|error| family.no_number(error))?;
        crate::scene_radius::scene_radii(&[&at_low])?;
        // The chance at one end may be none at the other: no loss, no jitter. In between a key may take no value at all.
        let inside: Vec<f64> = family.keys.iter().enumerate().map(|(key, range)| range.odd(key)).collect();
        let inside = family.scene(&inside).ok();
        for name in [Some(&at_low), Some(&at_high), inside.as_ref()].into_iter().flatten().flat_map(left_out) {
            if !family.left_out.contains(&name) {
                family.left_out.push(name);
            }
        }
        family.criterion = if family.left_out.is_empty() { Criterion::SpectralRadius } else { Criterion::MeanSquare };
        drop((at_low, at_high));
        for key in 0..family.keys.len() {
            family.learned[key] = family.is_learned(key, &low);
        }
        if family.learned.iter().any(|learned| *learned) && family.read(&low)?.is_none() {
            // Each key on its own sets numbers, and together they do more than that.
            family.learned.fill(false);
        }
        Ok(family)
    }

    /// The open keys.
    #[must_use]
    pub fn keys(&self) -> &[KeyRange] {
        &self.keys
    }

    /// For each key, whether its values are written into a scene that has been read before.
    #[must_use]
    pub fn learned(&self) -> &[bool] {
        &self.learned
    }

    /// The scene with those values of its keys.
    ///
    /// # Errors
    ///
    /// [`FamilyError`] if there are not as many values as keys, or the scene is refused with them.
    pub fn scene(&self, values: &[f64]) -> Result<Scene, FamilyError> {
        self.check(values)?;
        let mut overrides = self.overrides.clone();
        overrides.extend(self.keys.iter().zip(values).map(|(range, value)| range.text(*value)));
        Ok(Scene::parse(&self.text, &self.file, &overrides)?)
    }

    /// The scene with those values of its keys: of equal peers the first alone has those that are learned.
    ///
    /// # Errors
    ///
    /// As for [`Family::scene`].
    pub fn written(&self, values: &[f64]) -> Result<Scene, FamilyError> {
        let prepared = self.prepared(values)?;
        if !prepared.is_varied() {
            return self.scene(values);
        }
        let mut scene = prepared.scene.clone();
        let learned: Vec<f64> = values.iter().zip(&self.learned).filter(|(_, learned)| **learned).map(|(value, _)| *value).collect();
        prepared.write(&learned, &mut scene);
        Ok(scene)
    }

    /// Which radii the family has.
    #[must_use]
    pub const fn criterion(&self) -> Criterion {
        self.criterion
    }

    /// Returns the random parts of the links anywhere in the family, in words: what its nominal radii leave out. Empty if nothing is left to chance.
    #[must_use]
    pub fn left_out(&self) -> &[&'static str] {
        &self.left_out
    }

    /// The radius with those values of the keys, by the family's criterion and without a bound of its error: below 1 the scene is stable.
    ///
    /// # Errors
    ///
    /// As [`Family::scene`], and if the scene cannot be analysed.
    pub fn radius(&self, values: &[f64], scratch: &mut FamilyScratch) -> Result<Cell<f64>, FamilyError> {
        self.radius_watched(values, scratch, &Unwatched)
    }

    /// [`Family::radius`], watched where a second moment is followed.
    ///
    /// # Errors
    ///
    /// As [`Family::radius`], and [`AnalysisError::Stopped`](crate::AnalysisError::Stopped) if the watch ends it.
    pub fn radius_watched(&self, values: &[f64], scratch: &mut FamilyScratch, watch: &dyn Watch) -> Result<Cell<f64>, FamilyError> {
        self.evaluate::<false>(values, scratch, watch).map(|cell| Cell { radius: cell.radius.value, is_nominal: cell.is_nominal })
    }

    /// The radius with those values of the keys, by the family's criterion.
    ///
    /// # Errors
    ///
    /// As [`Family::radius`].
    pub fn bounded_radius(&self, values: &[f64], scratch: &mut FamilyScratch) -> Result<Cell<Radius>, FamilyError> {
        self.bounded_radius_watched(values, scratch, &Unwatched)
    }

    /// [`Family::bounded_radius`], watched where a second moment is followed.
    ///
    /// # Errors
    ///
    /// As [`Family::radius_watched`].
    pub fn bounded_radius_watched(&self, values: &[f64], scratch: &mut FamilyScratch, watch: &dyn Watch) -> Result<Cell<Radius>, FamilyError> {
        self.evaluate::<true>(values, scratch, watch)
    }

    fn evaluate<const BOUND: bool>(&self, values: &[f64], scratch: &mut FamilyScratch, watch: &dyn Watch) -> Result<Cell<Radius>, FamilyError> {
        self.check(values)?;
        let is_last = scratch
            .last
            .as_ref()
            .is_some_and(|last| Arc::ptr_eq(&last.family, &self.identity) && self.fixed_bits(values).eq(last.fixed.iter().copied()));
        if !is_last {
            let prepared = self.prepared(values)?;
            let (scene, radii) = prepared.scratch();
            scratch.last = Some(Last { fixed: self.fixed_bits(values).collect(), prepared, scene, radii, family: self.identity.clone() });
        }
        let Some(Last { prepared, scene, radii, .. }) = &mut scratch.last else {
            return Ok(Cell::certain(Radius { value: f64::NAN, error: f64::INFINITY }));
        };
        // Two keys at most.
        let (mut learned, mut count) = ([0.0; 2], 0);
        for (value, _) in values.iter().zip(&self.learned).filter(|(_, learned)| **learned) {
            learned[count] = *value;
            count += 1;
        }
        let learned = &learned[..count];
        prepared.write(learned, scene);
        let cell = match self.criterion {
            Criterion::SpectralRadius => Cell::certain(prepared.radius::<BOUND>(scene, radii)),
            Criterion::MeanSquare => prepared.mean_square::<BOUND>(learned, scene, radii, watch)?,
        };
        if !prepared.is_varied() {
            // It stands for these values only.
            scratch.last = None;
        }
        Ok(cell)
    }

    /// One value for each key, each in its range.
    fn check(&self, values: &[f64]) -> Result<(), FamilyError> {
        if values.len() != self.keys.len() {
            return Err(FamilyError::Values { given: values.len(), keys: self.keys.len() });
        }
        let outside = self.keys.iter().zip(values).find(|(range, value)| !(range.low..=range.high).contains(value));
        match outside {
            Some((range, value)) => Err(FamilyError::Outside { key: range.key.clone(), value: *value, low: range.low, high: range.high }),
            None => Ok(()),
        }
    }

    /// Whether a key does nothing but set numbers, the others being as given.
    fn is_learned(&self, key: usize, others: &[f64]) -> bool {
        let range = &self.keys[key];
        let probe = |value: f64| {
            let mut values = others.to_vec();
            values[key] = value;
            self.scene(&values).map(|scene| Probe { values: vec![value], scene })
        };
        let probes: Result<Vec<Probe>, FamilyError> = [range.odd(key), range.low, range.high].into_iter().map(probe).collect();
        // A value in between may be refused where the ends are not: a number of ticks is a whole one.
        probes.is_ok_and(|mut probes| leaves::learn(&mut probes).is_some())
    }

    /// The values of the keys that are not learned.
    fn fixed_bits(&self, values: &[f64]) -> impl Iterator<Item = u64> {
        values.iter().zip(&self.learned).filter(|(_, learned)| !**learned).map(|(value, _)| value.to_bits())
    }

    /// The scene with those values of the keys that are not learned: one read before, or a new one.
    fn prepared(&self, values: &[f64]) -> Result<Arc<Prepared>, FamilyError> {
        let fixed: Vec<u64> = self.fixed_bits(values).collect();
        let known = |prepared: &BTreeMap<Vec<u64>, Arc<Prepared>>| prepared.get(&fixed).cloned();
        if let Some(prepared) = known(&self.prepared.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(prepared);
        }
        let prepared = match self.read(values)? {
            Some(prepared) => Arc::new(prepared),
            // For these values the learned keys do something else than for others: the scene as it is.
            None => Arc::new(self.as_it_is(values)?),
        };
        if prepared.is_varied() {
            let mut kept = self.prepared.lock().unwrap_or_else(PoisonError::into_inner);
            if (kept.len() + 1) * prepared.scene.peers.len() <= MOST_KEPT || kept.is_empty() {
                kept.insert(fixed, prepared.clone());
            }
        }
        Ok(prepared)
    }

    /// The scene with all of those values, none of them to be varied.
    fn as_it_is(&self, values: &[f64]) -> Result<Prepared, FamilyError> {
        let probe = Probe { values: Vec::new(), scene: self.scene(values)? };
        // A single scene has nothing to differ from.
        Prepared::new(vec![probe])?.ok_or(FamilyError::Keys { keys: 0 })
    }

    /// Reads the scene with several values of the learned keys: each on its own at a value inside and at both ends, and all together at either end.
    fn read(&self, values: &[f64]) -> Result<Option<Prepared>, FamilyError> {
        let learned: Vec<usize> = (0..self.keys.len()).filter(|key| self.learned[*key]).collect();
        let mut base = values.to_vec();
        for key in &learned {
            base[*key] = self.keys[*key].odd(*key);
        }
        let mut points = vec![base.clone()];
        for end in [|range: &KeyRange| range.low, |range: &KeyRange| range.high] {
            for key in &learned {
                let mut point = base.clone();
                point[*key] = end(&self.keys[*key]);
                points.push(point);
            }
            if learned.len() > 1 {
                points.push(self.keys.iter().map(end).collect());
            }
        }
        let probe = |point: Vec<f64>| {
            let values = learned.iter().map(|key| point[*key]).collect();
            self.scene(&point).map(|scene| Probe { values, scene })
        };
        let probes = points.into_iter().map(probe).collect::<Result<Vec<_>, _>>()?;
        Ok(Prepared::new(probes)?)
    }

    /// A fault in a value that the family itself has put in, because it is a number: that the key takes none.
    fn no_number(&self, error: FamilyError) -> FamilyError {
        let FamilyError::Scene(error) = error else { return error };
        let fault = error.diagnostic().filter(|fault| fault.override_text().is_some());
        let key = fault.and_then(|fault| self.keys.iter().find(|range| fault.override_text().is_some_and(|text| text.starts_with(&range.key))));
        match (fault, key) {
            (Some(fault), Some(range)) if fault.message().starts_with("found the integer") || fault.message().starts_with("found the number") => {
                FamilyError::NoNumber { key: range.key.clone(), message: fault.message().to_owned() }
            }
            _ => FamilyError::Scene(error),
        }
    }
}
