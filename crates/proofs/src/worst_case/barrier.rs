//! Shapes by Newton's method on a logarithmic barrier.
//!
//! The smallest λ = ρ² for which λP_from − AᵀP_to A > 0 on every edge is a generalised eigenvalue problem; the method of centres solves it (Boyd & El Ghaoui
//! 1993). For a λ above the one of the present shapes, the centre is the minimum of
//!
//! ```text
//! φ(P) = Σ_v c_v·tr P_v − Σ_e ln det S_e          S_e = λP_from − XᵀP_to X
//! ```
//!
//! The linear term replaces a constraint on the size of the shapes, on which no rate depends. The λ of the centre is smaller than the λ of the stage, and the
//! next stage's λ lies most of the way towards the centre's. Every stage takes coordinates in which the present shapes are identities, so that the result does
//! not depend on the units of the state. The weight c_v is the number of edges from v: with this weight the identities would be the centre if λ were large.
//!
//! With D a change of the shapes, dS = λD_from − XᵀD_to X, W = S⁻¹, V = XW and Z = XWXᵀ, the second derivative of −ln det S is tr(W dS W dS) =
//! λ²tr(D_from W D_from W) − 2λtr(D_from VᵀD_to V) + tr(D_to Z D_to Z).

use cohaptic_stability::numerics::{cholesky, real, triangle_inverse};
use cohaptic_stability::{Matrix, Watch};

use super::component::{Component, Factors, largest_square};
use super::norm::mirror;
use crate::newton::{Barrier, Shortest, Steps, centre, log_determinant, upper};

/// Share of the distance between λ and the centre's λ that the next stage keeps.
const KEPT: f64 = 0.15;
/// Largest number of centres. Each centre takes a few Newton steps.
const STAGES: u32 = 60;
const STEPS: Steps = Steps { most: 30, centred: 0.3, shortest: Shortest::Damped };
/// Square of a rate, for matrices with entries near 1, that counts as zero.
const NOTHING: f64 = 1e-14;

/// Improves the shapes `start` until a stage lowers the square of the rate by less than the relative `accuracy`. Returns `start` if no stage succeeds; `None`
/// if the watch ends the search.
pub(super) fn improve(component: &Component<'_>, start: Factors, accuracy: f64, watch: &dyn Watch) -> Option<Factors> {
    let mut best = start;
    let Some(mut images) = component.images(&best.factors) else { return Some(best) };
    // The barrier is finite only at a λ above the λ of the present shapes.
    let mut square = 1.3 * best.square;
    for _ in 0..STAGES {
        if !(best.square > NOTHING && best.square.is_finite()) {
            break;
        }
        let round = vec![Matrix::identity(component.size); component.nodes.len()];
        let reached = centre(&Rate::new(component, &images, square), round, STEPS, watch).filter(|reached| !reached.is_stuck);
        let Some(centre) = reached else { break };
        let changes: Option<Vec<Matrix>> = centre.point.iter().map(cholesky).collect();
        let Some(changes) = changes else { break };
        // All factors are divided by one number, on which no rate depends, so that their sizes do not overflow over many stages.
        let factors: Vec<Matrix> = changes.iter().zip(&best.factors).map(|(change, factor)| change.times(factor)).collect();
        let largest = factors.iter().map(Matrix::largest).fold(0.0, f64::max);
        let factors: Vec<Matrix> = factors.iter().map(|factor| factor.scaled(1.0 / largest)).collect();
        let Some(next) = component.images(&factors) else { break };
        let reached = largest_square(&next);
        if reached >= square || reached.is_nan() {
            break;
        }
        let gap = square - reached;
        images = next;
        best = Factors { square: reached, factors };
        square = reached + KEPT * gap;
        // λ is the square of the rate.
        if gap < accuracy.max(1e-9) * reached {
            break;
        }
    }
    if watch.stops() { None } else { Some(best) }
}

/// The barrier φ at one λ.
struct Rate<'a> {
    component: &'a Component<'a>,
    /// Matrices X, indexed by edge of the component.
    images: &'a [Matrix],
    /// λ, the square of a rate.
    square: f64,
    /// Weights c_v, indexed by node of the component.
    weights: Vec<f64>,
    /// Places (i, j), i <= j, of a symmetric matrix, each with the weight that makes the basis orthonormal for the inner product tr(A·B).
    places: Vec<(usize, usize, f64)>,
}

impl<'a> Rate<'a> {
    fn new(component: &'a Component<'a>, images: &'a [Matrix], square: f64) -> Self {
        let weight = |node| real(component.edges.iter().filter(|step| step.from == node).count());
        let place = |i, j| (i, j, if i == j { 1.0 } else { std::f64::consts::SQRT_2 });
        Self {
            component,
            images,
            square,
            weights: (0..component.nodes.len()).map(weight).collect(),
            places: upper(component.size).map(|(i, j)| place(i, j)).collect(),
        }
    }

    /// Returns the triangle of the factorised S of an edge, or `None` if S is not positive definite.
    fn slack(&self, shapes: &[Matrix], edge: usize) -> Option<Matrix> {
        let (step, image) = (&self.component.edges[edge], &self.images[edge]);
        let reached = image.transposed().times(&shapes[step.to].times(image));
        let from = &shapes[step.from];
        cholesky(&Matrix::from_fn(from.rows(), from.columns(), |i, j| self.square * from[(i, j)] - reached[(i, j)]))
    }

    /// Adds `factor`·tr(B_kl MᵀB_ij M) to the entry of row ij and column kl of the block that begins at `row` and `column`. For the unit matrices E_ij the
    /// trace is M_il·M_jk, and the symmetric B_ij take the mean over both orders of k and l.
    fn add(&self, hessian: &mut Matrix, row: usize, column: usize, m: &Matrix, factor: f64) {
        for (place, (i, j, weight)) in self.places.iter().enumerate() {
            let share = 0.5 * factor * weight;
            let (upper, lower) = (m.row(*i), m.row(*j));
            let entries = &mut hessian.row_mut(row + place)[column..column + self.places.len()];
            for (entry, (k, l, other)) in entries.iter_mut().zip(&self.places) {
                *entry += share * other * (upper[*k] * lower[*l] + upper[*l] * lower[*k]);
            }
        }
    }
}

impl Barrier for Rate<'_> {
    /// Shapes, indexed by node of the component.
    type Point = Vec<Matrix>;

    fn value(&self, shapes: &Self::Point) -> Option<f64> {
        let trace = |of: &Matrix| (0..of.rows()).map(|place| of[(place, place)]).sum::<f64>();
        let size: f64 = shapes.iter().zip(&self.weights).map(|(shape, weight)| weight * trace(shape)).sum();
        (0..self.images.len()).try_fold(size, |sum, edge| {
            let factor = self.slack(shapes, edge)?;
            Some(sum - log_determinant(&factor))
        })
    }

    fn derivatives(&self, shapes: &Self::Point) -> Option<(Vec<f64>, Matrix)> {
        let count = self.places.len();
        let mut gradient = vec![0.0; count * shapes.len()];
        for (part, weight) in gradient.chunks_mut(count).zip(&self.weights) {
            for ((i, j, _), entry) in self.places.iter().zip(part) {
                *entry = if i == j { *weight } else { 0.0 };
            }
        }
        let mut hessian = Matrix::zeros(gradient.len(), gradient.len());
        for (edge, (step, image)) in self.component.edges.iter().zip(self.images).enumerate() {
            let inverse = triangle_inverse(&self.slack(shapes, edge)?);
            let w = inverse.times(&inverse.transposed());
            let v = image.times(&w);
            let z = v.times(&image.transposed());
            let (from, to) = (step.from * count, step.to * count);
            for (place, (i, j, weight)) in self.places.iter().enumerate() {
                gradient[from + place] -= self.square * weight * w[(*i, *j)];
                gradient[to + place] += weight * z[(*i, *j)];
            }
            self.add(&mut hessian, from, from, &w, self.square * self.square);
            self.add(&mut hessian, to, to, &z, 1.0);
            // The mixed term has its rows at D_to and its columns at D_from, and a mirror image. Only blocks on or above the diagonal are read; of an edge from
            // a node to itself both halves fall on the diagonal block.
            if to <= from {
                self.add(&mut hessian, to, from, &v, -self.square);
            }
            if from <= to {
                self.add(&mut hessian, from, to, &v.transposed(), -self.square);
            }
        }
        Some((gradient, hessian))
    }

    fn moved(&self, shapes: &Self::Point, direction: &[f64], length: f64) -> Self::Point {
        let mut moved = shapes.clone();
        for (shape, part) in moved.iter_mut().zip(direction.chunks(self.places.len())) {
            for ((i, j, weight), entry) in self.places.iter().zip(part) {
                // B_ij has the entry 1 on the diagonal, or 1/√2 in two places off the diagonal: 1/weight in both cases.
                shape[(*i, *j)] += length * entry / weight;
            }
            mirror(shape);
        }
        moved
    }
}
