//! Quadratic certificates, and their check, which does not depend on the search.
//!
//! Let P_v > 0 be shapes, one per node, with AₑᵀP_to Aₑ <= ρ²·P_from for every edge that lies on a cycle. Then V(x) = xᵀP_v x grows by at most ρ² in every
//! step, and no allowed product grows faster than ρ per step (Philippe, Essick, Dullerud & Jungers 2016).
//!
//! Every entry of M = ρ²P_from − AᵀP_to A is within γ₍₂ₙ₊₄₎·(ρ²|P_from| + |A|ᵀ|P_to||A|) of the exact one, and M > 0 is checked with that error
//! ([`is_positive`]).

use cohaptic_stability::numerics::{UNDERFLOW, UNIT, gamma, is_positive, outward, real};
use cohaptic_stability::{Matrix, Watch};
use thiserror::Error;

use super::automaton::Automaton;
use super::lyapunov;
use super::norm::mirror;

/// A proof that no allowed product grows faster than a rate. A value of this type was always checked.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Certificate {
    rate: f64,
    shapes: Vec<Matrix>,
}

/// Reasons why shapes and a rate are not a certificate.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
pub(crate) enum CertificateError {
    /// The rate is negative, infinite or not a number.
    #[error("a rate is a finite number and not negative, not {rate}")]
    Rate {
        /// The rate given.
        rate: f64,
    },
    /// The number of shapes differs from the number of nodes.
    #[error("there are {shapes} shapes for {nodes} nodes")]
    Count {
        /// Number of shapes given.
        shapes: usize,
        /// Number of nodes of the pattern.
        nodes: usize,
    },
    /// A shape does not have the size of the matrices or is not symmetric to the bit.
    #[error("the shape of node {node} is not a symmetric matrix of the size of the state")]
    NotSymmetric {
        /// Number of the node, from 0.
        node: usize,
    },
    /// A shape could not be shown to be positive definite.
    #[error("the shape of node {node} cannot be shown to be positive definite")]
    NotPositive {
        /// Number of the node, from 0.
        node: usize,
    },
    /// The matrix of an edge could not be shown to grow by at most the rate.
    #[error("edge {edge} cannot be shown to grow by at most {rate}")]
    TooFast {
        /// Number of the edge of the pattern, from 0.
        edge: usize,
        /// The rate given.
        rate: f64,
    },
}

impl Certificate {
    /// Checks shapes, one per node, against a rate.
    ///
    /// The check refuses a true certificate whose margin is smaller than the rounding errors, about n²·10⁻¹⁶ relative to the terms that cancel.
    ///
    /// # Errors
    ///
    /// [`CertificateError`] for the first condition that could not be shown.
    pub(crate) fn new(automaton: &Automaton, rate: f64, shapes: Vec<Matrix>) -> Result<Self, CertificateError> {
        if !(rate >= 0.0 && rate.is_finite()) {
            return Err(CertificateError::Rate { rate });
        }
        let (pattern, size) = (automaton.pattern(), automaton.size());
        if shapes.len() != pattern.nodes() {
            return Err(CertificateError::Count { shapes: shapes.len(), nodes: pattern.nodes() });
        }
        for (node, shape) in shapes.iter().enumerate() {
            let symmetric = (shape.rows(), shape.columns()) == (size, size) && *shape == shape.transposed();
            if !symmetric {
                return Err(CertificateError::NotSymmetric { node });
            }
            if !is_positive(shape, &Matrix::zeros(size, size)) {
                return Err(CertificateError::NotPositive { node });
            }
        }
        // Matrices are scaled to entries near 1, so that no square underflows; the scale is a power of two and exact.
        let exponent = automaton.exponent();
        let (scaled, scaled_rate) = (automaton.scaled(exponent), libm::ldexp(rate, exponent));
        for (edge, step) in pattern.edges().iter().enumerate() {
            let matrix = &scaled.matrices()[step.symbol];
            if pattern.recurs(step) && !contracts(matrix, &shapes[step.from], &shapes[step.to], scaled_rate) {
                return Err(CertificateError::TooFast { edge, rate });
            }
        }
        Ok(Self { rate, shapes })
    }

    #[cfg(test)]
    /// Searches shapes with a small rate and checks them.
    ///
    /// The search stops when a stage improves the rate by less than the relative `accuracy`. The rate need not be the smallest rate of a quadratic certificate,
    /// and that smallest rate is up to √n times the joint spectral radius (Ando & Shih 1998).
    ///
    /// # Errors
    ///
    /// [`CertificateError`] if no shapes can be checked, because numbers overflow.
    pub(crate) fn find(automaton: &Automaton, accuracy: f64) -> Result<Self, CertificateError> {
        Self::find_watched(automaton, accuracy, &cohaptic_stability::Unwatched).expect("without a watch nothing ends it")
    }

    /// Searches shapes with a small rate and checks them; `None` if the watch ends the search. The error is that of the last shapes tried.
    pub(super) fn find_watched(automaton: &Automaton, accuracy: f64, watch: &dyn Watch) -> Option<Result<Self, CertificateError>> {
        // The search works on entries near 1. The scale is a power of two, so it changes no digit of the shapes.
        let exponent = automaton.exponent();
        let scaled = automaton.scaled(exponent);
        let unscaled = |rate: f64| libm::ldexp(rate, -exponent);
        let found = lyapunov::search(&scaled, accuracy, watch)?;
        // The check needs a rate slightly above the computed rate; how much more depends on how far the shapes are from round.
        let mut excess = 4.0 * UNIT;
        while excess < 1.0 {
            if watch.stops() {
                return None;
            }
            if let Ok(certificate) = Self::new(automaton, unscaled(found.rate * (1.0 + excess) + UNDERFLOW), found.shapes.clone()) {
                return Some(Ok(certificate));
            }
            excess *= 4.0;
        }
        // The identity as every shape proves any upper bound of the 2-norms, such as the Frobenius norm.
        let frobenius = scaled.recurrent().map(|edge| scaled.matrices()[edge.symbol].frobenius_norm()).fold(0.0, f64::max);
        let rate = unscaled(frobenius * (1.0 + 1e-6) + 1e-100);
        Some(Self::new(automaton, rate, vec![Matrix::identity(automaton.size()); automaton.pattern().nodes()]))
    }

    /// Returns the rate ρ, an upper bound of the joint spectral radius.
    #[must_use]
    pub(crate) const fn rate(&self) -> f64 {
        self.rate
    }

    /// Returns the shapes P, indexed by node of the pattern.
    #[must_use]
    pub(crate) fn shapes(&self) -> &[Matrix] {
        &self.shapes
    }
}

/// Returns whether ρ²P_from − AᵀP_to A > 0 can be shown, or A is zero, which contracts at any rate.
fn contracts(matrix: &Matrix, from: &Matrix, to: &Matrix, rate: f64) -> bool {
    if matrix.largest() == 0.0 {
        return true;
    }
    let size = matrix.rows();
    // A lower bound of ρ²: the two roundings are taken off.
    let square = rate * rate * (1.0 - 4.0 * UNIT);
    let image = matrix.transposed().times(&to.times(matrix));
    let absolute = |of: &Matrix| Matrix::from_fn(size, size, |i, j| of[(i, j)].abs());
    let image_size = absolute(matrix).transposed().times(&absolute(to).times(&absolute(matrix)));
    let mut difference = Matrix::from_fn(size, size, |i, j| square * from[(i, j)] - image[(i, j)]);
    mirror(&mut difference);
    // γ counts the operations of one entry: the two sums of n products, the product with ρ², and the difference. The sizes of the terms were computed with the
    // same roundings, hence the second factor.
    let share = gamma(2 * size + 4) * (1.0 + gamma(2 * size + 4));
    let underflow = 4.0 * real(size) * (1.0 + real(size) * matrix.largest()) * (1.0 + to.largest()) * UNDERFLOW;
    let error = Matrix::from_fn(size, size, |i, j| outward(share * (square * from[(i, j)].abs() + image_size[(i, j)])) + underflow);
    is_positive(&difference, &error)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn single(matrix: Matrix) -> Automaton {
        Automaton::free(vec![matrix]).unwrap()
    }

    /// In one dimension the smallest rate is |a| for every shape, and the check is sharp to a few roundings.
    #[test]
    fn a_rate_too_small_by_one_part_in_a_million_million_is_refused() {
        let automaton = single(Matrix::identity(1).scaled(0.9));
        for shape in [1.0, 3e-200, 7e200, 0.3] {
            let shapes = vec![Matrix::identity(1).scaled(shape)];
            assert!(Certificate::new(&automaton, 0.9 * (1.0 + 1e-12), shapes.clone()).is_ok());
            assert_eq!(
                Certificate::new(&automaton, 0.9 * (1.0 - 1e-12), shapes),
                Err(CertificateError::TooFast { edge: 0, rate: 0.9 * (1.0 - 1e-12) })
            );
        }
        // A scaled permutation of three axes: the check accepts the identity, and refuses any other shape and a rate that is too small by 1e-12.
        let turn = single(Matrix::from_fn(3, 3, |i, j| if (i + 1) % 3 == j { 0.5 } else { 0.0 }));
        assert!(Certificate::new(&turn, 0.5 * (1.0 + 1e-12), vec![Matrix::identity(3)]).is_ok());
        assert!(Certificate::new(&turn, 0.5 * (1.0 - 1e-12), vec![Matrix::identity(3)]).is_err());
        let mut wrong = Matrix::identity(3);
        wrong[(0, 0)] = 1.0 + 1e-11;
        assert!(Certificate::new(&turn, 0.5 * (1.0 + 1e-12), vec![wrong]).is_err());
    }

    #[test]
    fn wrong_shapes_are_refused() {
        let automaton = single(Matrix::identity(2).scaled(0.5));
        let with = |entries: [f64; 4]| Certificate::new(&automaton, 1.0, vec![Matrix::from_fn(2, 2, |i, j| entries[2 * i + j])]);
        assert!(with([1.0, 0.0, 0.0, 1.0]).is_ok());
        assert_eq!(with([1.0, 1e-12, 0.0, 1.0]), Err(CertificateError::NotSymmetric { node: 0 }));
        for entries in [[1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 2.0, 1.0], [-1.0, 0.0, 0.0, -1.0], [1.0, 0.0, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0, 1.0]] {
            assert_eq!(with(entries), Err(CertificateError::NotPositive { node: 0 }), "{entries:?}");
        }
        assert!(matches!(with([f64::NAN; 4]), Err(CertificateError::NotSymmetric { .. })));
        assert_eq!(Certificate::new(&automaton, 1.0, vec![]), Err(CertificateError::Count { shapes: 0, nodes: 1 }));
        assert_eq!(Certificate::new(&automaton, 1.0, vec![Matrix::identity(3)]), Err(CertificateError::NotSymmetric { node: 0 }));
        assert!(matches!(Certificate::new(&automaton, f64::NAN, vec![Matrix::identity(2)]), Err(CertificateError::Rate { .. })));
    }
}
