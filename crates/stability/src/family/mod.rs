//! Families of scenes that differ in one or two numbers, as a stability map or a line across a map needs.
//!
//! Reading the text of a scene can cost more than analysing the scene. The scene is therefore read only a few times, with different values of its open
//! keys. A key that does nothing but set certain numbers of the scene is *learned*: further values of the key are written straight to those numbers. A key
//! that is not learned, such as a delay, makes the scene be read again for each new value.

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

pub use error::FamilyError;
pub use prepared::Cell;
pub use range::{KeyRange, KeyRangeError};

use crate::scene_radius::RadiusScratch;
use crate::{Criterion, Radius, Unwatched, Watch, left_out};
use leaves::Probe;
use prepared::Prepared;

/// Largest total number of peers in the scenes that a family keeps, of those read for values of a key that is not learned.
const MOST_KEPT: usize = 50_000;

/// A scene with one or two keys left open, which gives a radius for any values of the keys.
#[derive(Debug)]
pub struct Family {
    text: String,
    file: PathBuf,
    overrides: Vec<String>,
    keys: Vec<KeyRange>,
    learned: Vec<bool>,
    criterion: Criterion,
    /// Names of the random parts of the links that were found at either end of the ranges or inside.
    left_out: Vec<&'static str>,
    /// Scenes that were read, indexed by the bits of the values of the keys that are not learned.
    prepared: Mutex<BTreeMap<Vec<u64>, Arc<Prepared>>>,
    /// Identity of this family. A scratch holds a clone, so that the address cannot be used again by a later family.
    identity: Arc<()>,
}

/// Scratch memory for computing radii, with the scene used last. Each thread needs a scratch of its own. A scratch may be used with any family, and the
/// radii do not depend on its earlier use.
#[derive(Debug, Default)]
pub struct FamilyScratch {
    last: Option<Last>,
}

#[derive(Debug)]
struct Last {
    /// Bits of the values of the keys that are not learned.
    fixed: Vec<u64>,
    prepared: Arc<Prepared>,
    scene: Scene,
    radii: Vec<RadiusScratch>,
    family: Arc<()>,
}

impl Family {
    /// Creates the family of a scene whose `keys` are left open. `text`, `file` and `overrides` are the arguments of [`Scene::parse`]; the values of the keys
    /// are applied after the overrides.
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
        // A link that is random at one end of a range may be certain at the other, with a loss or jitter of zero, so that three scenes are asked. The
        // scene inside may be refused, for example if the key takes whole numbers only; the ends must not be.
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
            // Each key alone only sets numbers, but both keys together change more of the scene than these numbers.
            family.learned.fill(false);
        }
        Ok(family)
    }

    /// Returns the open keys with their ranges, in the order given to [`Family::new`].
    #[must_use]
    pub fn keys(&self) -> &[KeyRange] {
        &self.keys
    }

    /// Tells for each key whether the key is learned: its values are written into a scene that has been read before.
    #[must_use]
    pub fn learned(&self) -> &[bool] {
        &self.learned
    }

    /// Reads the scene with the given values of its keys, one value per key.
    ///
    /// # Errors
    ///
    /// [`FamilyError`] if the number of values differs from the number of keys, if a value is out of its range, or if the scene is refused with the values.
    pub fn scene(&self, values: &[f64]) -> Result<Scene, FamilyError> {
        self.check(values)?;
        let mut overrides = self.overrides.clone();
        overrides.extend(self.keys.iter().zip(values).map(|(range, value)| range.text(*value)));
        Ok(Scene::parse(&self.text, &self.file, &overrides)?)
    }

    /// Returns the scene as it is written for a radius with the given values. Of equal peers only the first has the values of the learned keys.
    ///
    /// # Errors
    ///
    /// As for [`Family::scene`], and if the scene cannot be analysed.
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

    /// Returns the criterion of the family's radii: the mean square if a link of the family is random, the spectral radius otherwise.
    #[must_use]
    pub const fn criterion(&self) -> Criterion {
        self.criterion
    }

    /// Returns the random parts of the links anywhere in the family, in words: what its nominal radii leave out. Empty if nothing is left to chance.
    #[must_use]
    pub fn left_out(&self) -> &[&'static str] {
        &self.left_out
    }

    /// Returns the radius for the given values of the keys, by the family's criterion and without a bound of its error. Below 1 the scene is stable.
    ///
    /// # Errors
    ///
    /// As [`Family::scene`], and if the scene cannot be analysed.
    pub fn radius(&self, values: &[f64], scratch: &mut FamilyScratch) -> Result<Cell<f64>, FamilyError> {
        self.radius_watched(values, scratch, &Unwatched)
    }

    /// Like [`Family::radius`], with a watch that can stop the computation while a second moment is followed.
    ///
    /// # Errors
    ///
    /// As [`Family::radius`], and [`AnalysisError::Stopped`](crate::AnalysisError::Stopped) if the watch ends it.
    pub(crate) fn radius_watched(&self, values: &[f64], scratch: &mut FamilyScratch, watch: &dyn Watch) -> Result<Cell<f64>, FamilyError> {
        self.evaluate::<false>(values, scratch, watch).map(|cell| Cell { radius: cell.radius.value, is_nominal: cell.is_nominal })
    }

    /// Returns the radius for the given values of the keys, by the family's criterion, with a bound of its error.
    ///
    /// # Errors
    ///
    /// As [`Family::radius`].
    pub fn bounded_radius(&self, values: &[f64], scratch: &mut FamilyScratch) -> Result<Cell<Radius>, FamilyError> {
        self.bounded_radius_watched(values, scratch, &Unwatched)
    }

    /// Like [`Family::bounded_radius`], with a watch that can stop the computation while a second moment is followed.
    ///
    /// # Errors
    ///
    /// As [`Family::radius`], and [`AnalysisError::Stopped`](crate::AnalysisError::Stopped) if the watch ends it.
    pub(crate) fn bounded_radius_watched(&self, values: &[f64], scratch: &mut FamilyScratch, watch: &dyn Watch) -> Result<Cell<Radius>, FamilyError> {
        self.evaluate::<true>(values, scratch, watch)
    }

    fn evaluate<const BOUND: bool>(&self, values: &[f64], scratch: &mut FamilyScratch, watch: &dyn Watch) -> Result<Cell<Radius>, FamilyError> {
        self.check(values)?;
        // Neighbouring points of a map share the values of the keys that are not learned, so the scene used last often serves again.
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
        // `new` admits at most two keys, so two places are enough.
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
            // A scene without learned keys holds for these values only.
            scratch.last = None;
        }
        Ok(cell)
    }

    /// Checks that there is one value per key and that each value is in its key's range.
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

    /// Tells whether a key does nothing but set numbers of the scene. `others` holds one value per key; the entry of `key` itself is not used.
    fn is_learned(&self, key: usize, others: &[f64]) -> bool {
        let range = &self.keys[key];
        let probe = |value: f64| {
            let mut values = others.to_vec();
            values[key] = value;
            self.scene(&values).map(|scene| Probe { values: vec![value], scene })
        };
        let probes: Result<Vec<Probe>, FamilyError> = [range.odd(key), range.low, range.high].into_iter().map(probe).collect();
        // A value inside the range may be refused although both ends are valid: a number of ticks must be whole. Such a key counts as not learned.
        probes.is_ok_and(|mut probes| leaves::learn(&mut probes).is_some())
    }

    /// Returns the bits of the values of the keys that are not learned, in the order of the keys.
    fn fixed_bits(&self, values: &[f64]) -> impl Iterator<Item = u64> {
        values.iter().zip(&self.learned).filter(|(_, learned)| !**learned).map(|(value, _)| value.to_bits())
    }

    /// Returns the prepared scene for the given values of the keys that are not learned: a kept scene, or one read now.
    fn prepared(&self, values: &[f64]) -> Result<Arc<Prepared>, FamilyError> {
        let fixed: Vec<u64> = self.fixed_bits(values).collect();
        let known = |prepared: &BTreeMap<Vec<u64>, Arc<Prepared>>| prepared.get(&fixed).cloned();
        if let Some(prepared) = known(&self.prepared.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Ok(prepared);
        }
        let prepared = match self.read(values)? {
            Some(prepared) => Arc::new(prepared),
            // With these values the learned keys change more than their numbers, so the scene is read with all values and nothing is varied in it.
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

    /// Reads the scene with all of the given values. No key of the prepared scene can be varied afterwards.
    fn as_it_is(&self, values: &[f64]) -> Result<Prepared, FamilyError> {
        let probe = Probe { values: Vec::new(), scene: self.scene(values)? };
        // `learn` fails only if two probes differ, and there is a single probe here; the error is never returned.
        Prepared::new(vec![probe])?.ok_or(FamilyError::Keys { keys: 0 })
    }

    /// Reads the scene with several values of the learned keys: all at a value inside their ranges, each key alone at either end, and all keys together at
    /// either end. Returns `None` if the keys do more than set numbers.
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

    /// Turns the scene reader's error about a value that the family itself inserted into [`FamilyError::NoNumber`]. Other errors are returned unchanged.
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
