//! Large matrices: `faer`, on one thread, so that the result does not depend on how many there are.

use std::fmt;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, EvdParams, evd_real, evd_scratch, hessenberg};
use faer::{Mat, Par, Spec};
use num_complex::Complex64;

use super::francis;
use crate::Matrix;

/// Buffers for matrices of one size.
pub(super) struct Large {
    matrix: Mat<f64>,
    real: Mat<f64>,
    imaginary: Mat<f64>,
    buffer: MemBuffer,
}

impl fmt::Debug for Large {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Large").field("size", &self.size()).finish_non_exhaustive()
    }
}

impl Large {
    pub(super) fn new(size: usize) -> Self {
        let (none, parameters) = (ComputeEigenvectors::No, Spec::<EvdParams, f64>::default());
        let buffer = MemBuffer::new(evd_scratch::<f64>(size, none, none, Par::Seq, parameters));
        Self { matrix: Mat::zeros(size, size), real: Mat::zeros(size, 1), imaginary: Mat::zeros(size, 1), buffer }
    }

    pub(super) fn size(&self) -> usize {
        self.matrix.nrows()
    }

    /// The eigenvalues in `faer`'s order. False if the iteration did not converge.
    pub(super) fn eigenvalues(&mut self, matrix: &Matrix, mut take: impl FnMut(Complex64)) -> bool {
        let size = self.size();
        for column in 0..size {
            for row in 0..size {
                self.matrix[(row, column)] = matrix[(row, column)];
            }
        }
        let outcome = evd_real(
            self.matrix.as_ref(),
            self.real.as_mut().col_mut(0).as_diagonal_mut(),
            self.imaginary.as_mut().col_mut(0).as_diagonal_mut(),
            None,
            None,
            Par::Seq,
            MemStack::new(&mut self.buffer),
            Spec::default(),
        );
        for place in 0..size {
            take(Complex64::new(self.real[(place, 0)], self.imaginary[(place, 0)]));
        }
        outcome.is_ok()
    }
}

/// The quasi-triangular factor of the real Schur form; `None` if the iteration did not converge.
///
/// `faer` keeps its own to itself, so that it is asked for the Hessenberg form only.
pub(super) fn quasi_triangular(matrix: &Matrix) -> Option<Matrix> {
    let size = matrix.rows();
    let mut form = matrix.clone();
    if size > 2 {
        let mut h = Mat::from_fn(size, size, |row, column| matrix[(row, column)]);
        let block = 16.min(size - 1);
        let mut reflectors = Mat::<f64>::zeros(block, size - 1);
        let mut buffer = MemBuffer::new(hessenberg::hessenberg_in_place_scratch::<f64>(size, block, Par::Seq, Spec::default()));
        hessenberg::hessenberg_in_place(h.as_mut(), reflectors.as_mut(), Par::Seq, MemStack::new(&mut buffer), Spec::default());
        // Below the first subdiagonal it keeps the reflectors.
        form = Matrix::from_fn(size, size, |row, column| if row > column + 1 { 0.0 } else { h[(row, column)] });
    }
    francis::iterate::<true, _>(&mut form).then_some(form)
}
