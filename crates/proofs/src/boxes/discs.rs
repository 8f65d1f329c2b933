//! Discs that contain the eigenvalues of all matrices of a box. The discs lie around the eigenvalues of the mean and move with the numbers of the box.
//!
//! In coordinates V with a nearly diagonal mean, A(z, s) = W·(z·I − M(s))·V with W near V⁻¹ is nearly diagonal for every s of the box. Let dᵢ > 0. If
//! on a circle |z| = ρ
//!
//! ```text
//! |z·(WV)ᵢᵢ − (WMV)ᵢᵢ|·dᵢ > Σ_{j≠i} |z·(WV)ᵢⱼ − (WMV)ᵢⱼ|·dⱼ          for all i and s,                              (1)
//! ```
//!
//! A is diagonally dominant, so no M(s) has an eigenvalue on the circle (Gershgorin 1931; V and W need no property at all). A stays dominant while the
//! entries off the diagonal shrink to zero, so the number of eigenvalues inside the circle equals the number of diagonal entries inside. With ρ = 1 and
//! all diagonal entries inside, every M(s) is **stable**; (1) then holds for larger |z| too. With ρ ≥ 1 and a diagonal entry outside for all s, every M(s) is
//! **unstable**. Every M(s) is also **unstable** if (1) holds on a circle around a diagonal entry, if the circle moves with the entry, stays outside of the
//! unit circle and holds no other diagonal entry.
//!
//! cᵢ(s) = (WMV)ᵢᵢ is linear in s but for a radius, so the distance of cᵢ from the circle is known to first order. Entries off the diagonal are of first
//! order and count by products of two entries, because of the choice of dᵢ: the comparison matrix of (1) times d is a vector of ones.

use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Node, Timetable};
use cohaptic_stability::numerics::{ComplexMatrix, gamma, outward, real};
use num_complex::Complex64;

use super::basis::{Basis, solved};
use super::certificate::PartCertificate;
use super::corners::{self, Common, Point};
use super::guarantee::Proven;
use super::span::{StepSpan, absolute};
use super::steps::Plans;

/// Verdict on all matrices of a box, and the numbers for a check of the verdict.
pub(super) struct Decision {
    pub(super) proven: Proven,
    pub(super) witness: Witness,
}

/// Numbers that satisfy inequality (1), with W the inverse of V.
#[derive(Clone, Debug)]
pub(super) struct Witness {
    /// Coordinates V in which the matrices are nearly diagonal.
    pub(super) coordinates: ComplexMatrix,
    /// Weights d in inequality (1), one per coordinate.
    pub(super) weights: Vec<f64>,
    pub(super) circle: FreeCircle,
}

/// Circle without an eigenvalue of any matrix of a box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum FreeCircle {
    /// Circle around zero with the given radius.
    AroundZero(f64),
    /// Circle around the diagonal entry of the given place, with the given radius. The circle moves with the entry.
    AroundEntry(usize, f64),
}

/// Returns the verdict on all matrices of a box, or `None` if no verdict is shown.
pub(super) fn decide(span: &StepSpan) -> Option<Decision> {
    let near = NearlyDiagonal::of(span)?;
    #[cfg(test)]
    let near = super::mutation::of_discs(near);
    let reaches: Vec<(f64, f64)> =
        (0..near.size()).map(|place| near.reach(near.mean[(place, place)], |slope| slope[(place, place)], near.wide[(place, place)])).collect();
    // A diagonal entry that may lie outside of the unit circle rules out a proof of stability, so instability is tried then.
    let (proven, circle, weights) = if reaches.iter().all(|(_, high)| *high < 1.0) {
        (Proven::Stable, FreeCircle::AroundZero(1.0), near.free_of(1.0, &reaches)?)
    } else {
        // A circle around zero is tried first. A circle around one entry also works if further entries have the same modulus.
        let by_circle = circle(&reaches).and_then(|circle| Some((FreeCircle::AroundZero(circle), near.free_of(circle, &reaches)?)));
        let (circle, weights) = by_circle.or_else(|| near.one_outside(&reaches))?;
        (Proven::Unstable, circle, weights)
    };
    Some(Decision { proven, witness: Witness { coordinates: near.coordinates, weights, circle } })
}

/// Returns the certificate of the differences between the members of a class at a single point of the numbers, or `None` if these are not proven stable.
/// `members` are places in the scene, `weight` is the weight with which a difference hears itself, and velocities are multiplied by `time` \[s\].
pub(crate) fn stable_difference(members: &[usize], node: &Node, weight: f64, timetable: &Timetable, time: f64) -> Option<PartCertificate> {
    let nodes = vec![node.clone()];
    // One point is a box without width: no number varies.
    let points = [Point { nodes: nodes.clone(), weights: Matrix::from_fn(1, 1, |_, _| weight) }];
    let common = Common { timetable, plans: &Plans::default(), tied: true, time };
    let decision = decide(&corners::steps(&points, &[nodes], common).ok()?.product())?;
    let part = PartCertificate::new(vec![members.to_vec()], true, corners::states(&points, common).ok()?, time, &decision.witness);
    (decision.proven == Proven::Stable).then_some(part)
}

/// W·M·V over a box, nearly diagonal, and W·V, nearly the unit matrix.
pub(super) struct NearlyDiagonal {
    /// Coordinates V.
    coordinates: ComplexMatrix,
    mean: ComplexMatrix,
    pub(super) slopes: Vec<ComplexMatrix>,
    /// Bound of the distance of each entry of W·M·V from its mean and slopes.
    pub(super) wide: Matrix,
    /// Bound of the distance of each entry of W·V from the unit matrix.
    off_unit: Matrix,
}

impl NearlyDiagonal {
    fn of(span: &StepSpan) -> Option<Self> {
        let Basis { right: v, left: w } = Basis::of(&span.mean)?;
        let size = span.mean.rows();
        let sizes = |of: &ComplexMatrix| Matrix::from_fn(size, size, |i, j| modulus(of[(i, j)]));
        let (v_size, w_size) = (sizes(&v), sizes(&w));
        let through =
            |matrix: &Matrix| -> ComplexMatrix { w.times(&ComplexMatrix::from_fn(size, size, |i, j| Complex64::from(matrix[(i, j)]))).times(&v) };
        let (mean, unit) = (through(&span.mean), w.times(&v));
        let slopes: Vec<ComplexMatrix> = span.slopes.iter().map(through).collect();
        // The mean and each slope pass through two complex products, and W·V is a further product: eight roundings per term, and the roundings of the sums.
        let rounding = gamma(8 * size + 32) * real(2 + span.slopes.len());
        // Errors and sizes pass through W and V by absolute values, since their signs are unknown.
        let (radius, whole) = (w_size.times(&span.radius).times(&v_size), w_size.times(&span.largest()).times(&v_size));
        let unit_sizes = w_size.times(&v_size);
        let one = |i: usize, j: usize| Complex64::new(if i == j { 1.0 } else { 0.0 }, 0.0);
        Some(Self {
            mean,
            slopes,
            wide: Matrix::from_fn(size, size, |i, j| outward(outward(radius[(i, j)] + rounding * whole[(i, j)]))),
            off_unit: Matrix::from_fn(size, size, |i, j| outward(modulus(unit[(i, j)] - one(i, j)) + rounding * unit_sizes[(i, j)])),
            coordinates: v,
        })
    }

    fn size(&self) -> usize {
        self.mean.rows()
    }

    /// Returns the least and the greatest modulus of a number over the box: `centre` in the middle, moved by the slopes, and off by at most `wide`.
    fn reach(&self, centre: Complex64, slope: impl Fn(&ComplexMatrix) -> Complex64, wide: f64) -> (f64, f64) {
        let size = modulus(centre);
        let direction = if size > 0.0 { Complex64::new(centre.re / size, -centre.im / size) } else { Complex64::new(1.0, 0.0) };
        // Only the parts of slopes along the direction of `centre` change the modulus to first order.
        let (mut along, mut across) = (0.0, 0.0);
        for matrix in &self.slopes {
            let turned = slope(matrix) * direction;
            along += turned.re.abs();
            across += turned.im.abs();
        }
        let wide = wide + 16.0 * f64::EPSILON * (size + along + across);
        (size - along - wide, libm::hypot(size + along, across) + wide)
    }

    /// Returns a bound of the modulus of an entry of z·W·V − W·M·V off the diagonal, for |z| at most `largest`.
    fn beside(&self, i: usize, j: usize, largest: f64) -> f64 {
        let moving: f64 = self.slopes.iter().map(|slope| modulus(slope[(i, j)])).sum();
        outward(outward(modulus(self.mean[(i, j)]) + moving + self.wide[(i, j)] + self.off_unit[(i, j)] * largest))
    }

    /// Returns a d with (1) on the circle around zero with radius `circle`. `reaches`: the least and the greatest modulus of each diagonal entry.
    fn free_of(&self, circle: f64, reaches: &[(f64, f64)]) -> Option<Vec<f64>> {
        let entry = |i: usize, j: usize| {
            let (low, high) = reaches[i];
            // If an entry may lie on the circle, `apart` is not above zero, and `dominated` refuses the matrix.
            let apart = if high < circle { circle - high } else { low - circle };
            if i == j { apart - outward(self.off_unit[(i, i)] * circle) } else { -self.beside(i, j, circle) }
        };
        dominated(&Matrix::from_fn(self.size(), self.size(), entry))
    }

    /// Returns a circle around one diagonal entry, and a d with (1) on the circle. The circle moves with the entry, stays outside of the unit circle
    /// and holds no other diagonal entry.
    fn one_outside(&self, reaches: &[(f64, f64)]) -> Option<(FreeCircle, Vec<f64>)> {
        // Of two conjugate entries the upper entry is enough, since the matrices are real.
        let mut outside: Vec<usize> = (0..self.size()).filter(|place| reaches[*place].0 > 1.0 && self.mean[(*place, *place)].im >= 0.0).collect();
        outside.sort_by(|one, other| reaches[*other].0.total_cmp(&reaches[*one].0));
        outside.into_iter().take(MOST_TRIED).find_map(|centre| {
            // The distance of two entries moves with the difference of their slopes: a common motion does not bring the entries together.
            let between = |place: usize| {
                let difference = self.mean[(place, place)] - self.mean[(centre, centre)];
                let wide = self.wide[(place, place)] + self.wide[(centre, centre)];
                self.reach(difference, |slope| slope[(place, place)] - slope[(centre, centre)], wide).0
            };
            let apart: Vec<f64> = (0..self.size()).map(|place| if place == centre { f64::INFINITY } else { between(place) }).collect();
            let nearest = apart.iter().copied().fold(f64::INFINITY, f64::min);
            // Half the distance to the nearest entry separates the two, and the circle must also stay outside of the unit circle.
            let radius = (reaches[centre].0 - 1.0).min(0.5 * nearest);
            let largest = reaches[centre].1 + radius;
            let entry = |i: usize, j: usize| {
                let apart = if i == centre { radius - self.wide[(i, i)] } else { apart[i] - radius };
                if i == j { apart - outward(self.off_unit[(i, i)] * largest) } else { -self.beside(i, j, largest) }
            };
            let weights = if radius > 0.0 { dominated(&Matrix::from_fn(self.size(), self.size(), entry)) } else { None };
            Some((FreeCircle::AroundEntry(centre, radius), weights?))
        })
    }
}

/// Largest number of tried diagonal entries outside of the unit circle.
const MOST_TRIED: usize = 3;

fn modulus(value: Complex64) -> f64 {
    libm::hypot(value.re, value.im) * (1.0 + 4.0 * f64::EPSILON)
}

/// Returns the radius of the circle around zero with the widest gap between diagonal entries, at least 1 and with a diagonal entry outside; `None` if there is
/// no gap.
fn circle(reaches: &[(f64, f64)]) -> Option<f64> {
    let mut free = None;
    for (low, _) in reaches.iter().filter(|(low, _)| *low > 1.0) {
        // The gap below an entry ends at the largest entry inside. Entries inside the unit circle do not matter, so the gap begins at 1 at least.
        let inner = reaches.iter().filter(|(other, _)| other < low).map(|(_, high)| *high).fold(1.0, f64::max);
        let gap = low - inner;
        if gap > 0.0 && free.is_none_or(|(widest, _)| gap > widest) {
            free = Some((gap, inner.midpoint(*low)));
        }
    }
    free.map(|(_, circle)| circle)
}

/// Returns a d > 0 with C·d > 0, rounding included, for a matrix C without positive entries off the diagonal. `None` if no such d exists or no d was
/// found.
fn dominated(comparison: &Matrix) -> Option<Vec<f64>> {
    let size = comparison.rows();
    if !comparison.is_finite() || (0..size).any(|place| comparison[(place, place)] <= 0.0) {
        return None;
    }
    // C⁻¹ of an M-matrix has no negative entries, so d = C⁻¹·1 is positive then and C·d = 1 leaves the same room in each row.
    let d = solved(comparison, &Matrix::from_fn(size, 1, |_, _| 1.0))?;
    let column: Vec<f64> = (0..size).map(|place| d[(place, 0)]).collect();
    let sizes = absolute(comparison).times_column(&column);
    // Comparisons are written so that NaN fails.
    let holds = column.iter().all(|entry| *entry > 0.0)
        && comparison.times_column(&column).iter().zip(&sizes).all(|(sum, size_of)| *sum > outward(gamma(size + 2) * size_of));
    holds.then_some(column)
}
