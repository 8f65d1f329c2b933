//! A loop with delays, given by the matrices of its characteristic function.

use super::kernel::Kernel;
use crate::Matrix;

/// A loop x(t+1) = now·x(t) + Σ matrix·(kernel applied to x). Its characteristic function is F(z) = det(z − now − Σ kernel(z)·matrix), and the eigenvalues of
/// the loop are the roots of F.
///
/// `Kernel::Delay(j)` stands for x(t−j), and `Kernel::Sum(j)` for x(t−1) + … + x(t−j).
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

/// Why matrices do not make a loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DelayedLoopError {
    /// The matrices are empty, not square, or of different sizes.
    #[error("a matrix of a delayed loop has {rows} rows and {columns} columns, expected {size} of each, at least 1")]
    Shape {
        /// Rows of that matrix.
        rows: usize,
        /// Columns of that matrix.
        columns: usize,
        /// Rows of the matrix `now`.
        size: usize,
    },
    /// A delay has 2³² steps or more.
    #[error("a delay of {steps} steps: expected fewer than 2^32")]
    TooLong {
        /// Steps of the delay.
        steps: usize,
    },
    /// An entry is infinite or NaN.
    #[error("an entry of a matrix of a delayed loop is not finite")]
    NotFinite,
}

impl DelayedLoop {
    /// Returns the loop of these matrices. Terms that are zero are left out.
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
