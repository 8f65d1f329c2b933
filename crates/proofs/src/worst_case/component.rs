//! Strongly connected components of an automaton. The shapes of one component are searched together.

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::{eigen, real, triangle_inverse};

use super::norm::gram;

/// Largest Skeel condition number (‖|R||R⁻¹|‖_F) of a factor, per row of the state. With a larger number, products in the factor's coordinates lose too many
/// digits.
const WORST_CONDITION: f64 = 1e7;

/// One strongly connected component, with nodes of its own numbering from 0.
#[derive(Debug)]
pub(super) struct Component<'a> {
    /// Number of rows of the matrices.
    pub size: usize,
    /// Numbers of the nodes in the pattern, indexed by node of the component.
    pub nodes: Vec<usize>,
    pub edges: Vec<Step<'a>>,
}

/// An edge of a component; `from` and `to` are nodes of the component.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub from: usize,
    pub to: usize,
    pub matrix: &'a Matrix,
}

/// Factors of the shapes of a component, with the rate of the shapes.
#[derive(Clone, Debug)]
pub(super) struct Factors {
    /// Square of the rate.
    pub square: f64,
    /// Upper triangles R with P = RᵀR, indexed by node of the component.
    pub factors: Vec<Matrix>,
}

impl Component<'_> {
    /// Returns the matrices R_to A R_from⁻¹, indexed by edge; `None` if the condition number of a factor is too large.
    pub(super) fn images(&self, factors: &[Matrix]) -> Option<Vec<Matrix>> {
        let inverses: Vec<Matrix> = factors.iter().map(triangle_inverse).collect();
        let usable = factors.iter().zip(&inverses).all(|(factor, inverse)| {
            let absolute = |of: &Matrix| Matrix::from_fn(self.size, self.size, |i, j| of[(i, j)].abs());
            // Written so that NaN fails.
            absolute(factor).times(&absolute(inverse)).frobenius_norm() <= WORST_CONDITION * real(self.size)
        });
        usable.then(|| self.edges.iter().map(|step| factors[step.to].times(&step.matrix.times(&inverses[step.from]))).collect())
    }
}

/// Returns the largest square of a 2-norm of the matrices.
pub(super) fn largest_square(images: &[Matrix]) -> f64 {
    images.iter().flat_map(|image| eigen(&gram(image)).0).fold(0.0, f64::max)
}
