//! What the radii of a map say. A map has them without bounds of their errors, which is enough far from 1; near it they are computed again, with one.

use cohaptic_stability::{Family, FamilyError, FamilyScratch, Map, Radius, Verdict};

/// A radius this close to 1 is computed again: far more than any radius of a scene that can be run is off.
const NEAR: f64 = 1e-3;

/// The verdict on every cell.
pub(super) fn verdicts(family: &Family, map: &Map) -> Result<Vec<Vec<Verdict>>, FamilyError> {
    let mut scratch = FamilyScratch::default();
    let mut verdict = |x: f64, y: f64, value: f64| {
        let is_near = (value - 1.0).abs() < NEAR;
        let radius = if is_near { family.bounded_radius(&[x, y], &mut scratch)? } else { Radius { value, error: 0.0 } };
        Ok(radius.verdict())
    };
    let rows = map.y.iter().zip(&map.radius);
    rows.map(|(y, row)| map.x.iter().zip(row).map(|(x, value)| verdict(*x, *y, *value)).collect()).collect()
}
