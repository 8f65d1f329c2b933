//! A loop with delays, in the form of its characteristic function.

use super::kernel::Kernel;
use crate::Matrix;

/// x(t+1) = now·x(t) + Σ matrix·(what a kernel makes of x at t and before): the characteristic function is
/// F(z) = det(z − now − Σ kernel(z)·matrix), and an eigenvalue of the loop is a root of it.
///
/// `Kernel::Delay(j)` in it stands for x(t−j), and `Kernel::Sum(j)` for x(t−1) + … + x(t−j).
#[derive(Clone, PartialEq, Debug)]
pub struct DelayedLoop {
    pub(super) now: Matrix,
    pub(super) now_norm: f64,
    pub(super) terms: Vec<Term>,
}

#[derive(Clone, PartialEq, Debug)]
pub(super) struct Term {
    pub(super) kernel: Kernel,
    pub(super) matrix: Matrix,
    pub(super) norm: f64,
}

/// Why matrices make no loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DelayedLoopError {
    /// Not all matrices are square and of one size.
    #[error("a matrix of a delayed loop has {rows} rows and {columns} columns, expected {size} of each, at least 1")]
    Shape {
        /// Rows of that matrix.
        rows: usize,
        /// Columns of that matrix.
        columns: usize,
        /// The rows of the first matrix.
        size: usize,
    },
    /// A delay has more steps than are counted.
    #[error("a delay of {steps} steps: expected fewer than 2^32")]
    TooLong {
        /// The steps.
        steps: usize,
    },
    /// An entry is infinite or NaN.
    #[error("an entry of a matrix of a delayed loop is not finite")]
    NotFinite,
}

impl DelayedLoop {
    /// The loop. Terms that are zero are left out.
    ///
    /// # Errors
    ///
    /// If the matrices are empty, not square, not all of one size, or not finite.
    pub fn new(now: Matrix, terms: Vec<(Kernel, Matrix)>) -> Result<Self, DelayedLoopError> {
        let size = now.rows();
        for matrix in terms.iter().map(|(_, matrix)| matrix).chain([&now]) {
            let (rows, columns) = (matrix.rows(), matrix.columns());
            if rows != size || columns != size || size == 0 {
                return Err(DelayedLoopError::Shape { rows, columns, size });
            }
            if !matrix.is_finite() {
                return Err(DelayedLoopError::NotFinite);
            }
        }
        let terms = terms.into_iter().filter(|(kernel, matrix)| matrix.largest() > 0.0 && *kernel != Kernel::Sum(0));
        let terms = terms.map(|(kernel, matrix)| Term { kernel, norm: matrix.frobenius_norm(), matrix }).collect();
        Ok(Self { now_norm: now.frobenius_norm(), now, terms })
    }
}
