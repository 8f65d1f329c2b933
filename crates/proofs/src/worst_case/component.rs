//! Strongly connected components of an automaton, whose shapes are searched together.

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::{eigen, real, triangle_inverse};

use super::norm::gram;

/// Factors with a Skeel condition number (‖|R||R⁻¹|‖_F) above this are not used: products in their coordinates would lose too many digits.
const WORST_CONDITION: f64 = 1e7;

/// One strongly connected component, with nodes numbered from 0.
#[derive(Debug)]
pub(super) struct Component<'a> {
    /// The number of rows of the matrices.
    pub size: usize,
    /// The nodes' numbers in the pattern.
    pub nodes: Vec<usize>,
    pub edges: Vec<Step<'a>>,
}

/// An edge of a component, by its numbering.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub from: usize,
    pub to: usize,
    pub matrix: &'a Matrix,
}

/// Factors of the shapes of a component, and the square of the rate that they have.
#[derive(Clone, Debug)]
pub(super) struct Factors {
    pub square: f64,
    pub factors: Vec<Matrix>,
}

impl Component<'_> {
    /// The edges in the coordinates of the factors; `None` where these are too far from round to be of use.
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

/// The largest square of a 2-norm.
pub(super) fn largest_square(images: &[Matrix]) -> f64 {
    images.iter().flat_map(|image| eigen(&gram(image)).0).fold(0.0, f64::max)
}
