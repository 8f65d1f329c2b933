//! The verdicts on the cells of a map.

use rayon::prelude::*;

use super::Map;
use crate::{Criterion, Family, FamilyError, FamilyScratch, Radius, Verdict};

/// The distance from 1 below which a spectral radius is computed again, with a bound: far more than the error of any radius of a scene that can be run.
const NEAR: f64 = 1e-3;
/// The distance from 1 below which a mean-square radius is computed again, which takes a thousand times as long. It is a hundred times the largest error
/// that was measured of radii without a bound (`crates/stability/src/mean_square/tests.rs`).
const NEAR_OF_SQUARES: f64 = 1e-7;

impl Map {
    /// Returns the verdict on every cell, indexed as the radii, on all threads of the pool that calls this function. The radii of a map have no bounds of their
    /// errors, which is enough far from 1. Radii near 1 are computed again, with a bound. `family` must be the family of the map.
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
