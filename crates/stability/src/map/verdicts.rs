//! The verdicts on the cells of a map.

use rayon::prelude::*;

use super::Map;
use crate::{Criterion, Family, FamilyError, FamilyScratch, Radius, Verdict};

/// The distance from 1 below which a spectral radius is computed again, with a bound: far more than the error of any radius of a scene that can be run.
const NEAR: f64 = 1e-3;
/// A mean-square radius this close to 1 is computed again, which takes a thousand times as long: a hundred times as far as those were seen off that are
/// computed without a bound (`crates/stability/src/mean_square/tests.rs`).
const NEAR_OF_SQUARES: f64 = 1e-7;

impl Map {
    /// The verdict on every cell, row after row, on all threads of the pool it is called in. A map has radii without bounds of their errors, which is enough far
    /// from 1; near it they are computed again, with one. `family`: that of the map.
    ///
    /// # Errors
    ///
    /// [`FamilyError`] if a radius cannot be computed again.
    pub fn verdicts(&self, family: &Family) -> Result<Vec<Vec<Verdict>>, FamilyError> {
        let near = if family.criterion() == Criterion::MeanSquare { NEAR_OF_SQUARES } else { NEAR };
        let verdict = |x: f64, y: f64, value: f64, scratch: &mut FamilyScratch| {
            let is_near = (value - 1.0).abs() < near;
            let radius = if is_near { family.bounded_radius(&[x, y], scratch)?.radius } else { Radius { value, error: 0.0 } };
            Ok(radius.verdict())
        };
        let rows = self.y.par_iter().zip(&self.radius);
        rows.map_init(FamilyScratch::default, |scratch, (y, row)| self.x.iter().zip(row).map(|(x, value)| verdict(*x, *y, *value, scratch)).collect())
            .collect()
    }
}
