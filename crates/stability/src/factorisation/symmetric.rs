//! Factorisations of symmetric matrices: Cholesky's factor, and eigenvectors by Jacobi's rotations.

use crate::Matrix;

/// Returns the upper triangle R with RᵀR = A (Cholesky). Reads only the upper triangle of A. `None` if a pivot is not above zero or not finite.
pub fn cholesky(symmetric: &Matrix) -> Option<Matrix> {
    let size = symmetric.rows();
    let mut factor = Matrix::from_fn(size, size, |i, j| if i <= j { symmetric[(i, j)] } else { 0.0 });
    for pivot in 0..size {
        let square = factor[(pivot, pivot)];
        // The negated condition refuses a pivot that is NaN.
        if !(square > 0.0 && square.is_finite()) {
            return None;
        }
        let root = square.sqrt();
        for entry in &mut factor.row_mut(pivot)[pivot..] {
            *entry /= root;
        }
        // The loop subtracts whole rows. So the innermost loop has no sum with a prescribed order of terms.
        let row = factor.row(pivot)[pivot..].to_vec();
        for below in pivot + 1..size {
            let share = row[below - pivot];
            for (entry, product) in factor.row_mut(below)[below..].iter_mut().zip(&row[below - pivot..]) {
                *entry -= share * product;
            }
        }
    }
    Some(factor)
}

/// Returns the inverse of an upper triangle.
#[must_use]
pub fn triangle_inverse(upper: &Matrix) -> Matrix {
    let size = upper.rows();
    let mut inverse = Matrix::zeros(size, size);
    for row in (0..size).rev() {
        // R·Z = I, row by row from the last: z_row = (e_row − Σ r_row,k z_k) / r_row,row.
        let mut sum = vec![0.0; size];
        sum[row] = 1.0;
        for k in row + 1..size {
            // Row k of the inverse is zero left of the diagonal, so only columns from k on change.
            let share = upper[(row, k)];
            for (entry, below) in sum[k..].iter_mut().zip(&inverse.row(k)[k..]) {
                *entry -= share * below;
            }
        }
        for (entry, value) in inverse.row_mut(row).iter_mut().zip(sum) {
            *entry = value / upper[(row, row)];
        }
    }
    inverse
}

/// Solves RᵀR·x = b.
pub fn solve(upper: &Matrix, right: &[f64]) -> Vec<f64> {
    let size = upper.rows();
    let mut x = right.to_vec();
    // Forward substitution with Rᵀ: each found number is subtracted from the right sides of all later rows.
    for row in 0..size {
        x[row] /= upper[(row, row)];
        let value = x[row];
        for (entry, factor) in x[row + 1..].iter_mut().zip(&upper.row(row)[row + 1..]) {
            *entry -= factor * value;
        }
    }
    // Back substitution with R, from the last row up.
    for row in (0..size).rev() {
        let sum: f64 = upper.row(row)[row + 1..].iter().zip(&x[row + 1..]).map(|(factor, value)| factor * value).sum();
        x[row] = (x[row] - sum) / upper[(row, row)];
    }
    x
}

/// Returns the eigenvalues of a symmetric matrix, in no order, and the eigenvectors of length 1 as rows in the same order, by Jacobi's rotations.
pub fn eigen(symmetric: &Matrix) -> (Vec<f64>, Matrix) {
    const SWEEPS: u32 = 30;
    let size = symmetric.rows();
    let mut a = symmetric.clone();
    let mut vectors = Matrix::identity(size);
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for p in 0..size {
            for q in p + 1..size {
                let off = a[(p, q)];
                // An entry this small compared with its two diagonal entries is rounding.
                if off.abs() <= f64::EPSILON * (a[(p, p)] * a[(q, q)]).abs().sqrt() || off.abs() < f64::MIN_POSITIVE {
                    continue;
                }
                rotated = true;
                // The smaller root of t² + 2θt − 1 = 0 turns by at most 45°, as convergence requires (Golub & Van Loan 2013, Section
                // 8.5.2).
                let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * off);
                let tangent = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
                let sine = tangent * cosine;
                rotate_rows(&mut a, p, q, cosine, sine);
                for row in 0..size {
                    let entries = a.row_mut(row);
                    (entries[p], entries[q]) = (cosine * entries[p] - sine * entries[q], sine * entries[p] + cosine * entries[q]);
                }
                // The rows of `vectors` turn with the rows of A, so they end as the eigenvectors.
                rotate_rows(&mut vectors, p, q, cosine, sine);
            }
        }
        if !rotated {
            break;
        }
    }
    ((0..size).map(|place| a[(place, place)]).collect(), vectors)
}

fn rotate_rows(a: &mut Matrix, p: usize, q: usize, cosine: f64, sine: f64) {
    let upper = a.row(p).to_vec();
    let lower = a.row(q).to_vec();
    for (entry, (x, y)) in a.row_mut(p).iter_mut().zip(upper.iter().zip(&lower)) {
        *entry = cosine * x - sine * y;
    }
    for (entry, (x, y)) in a.row_mut(q).iter_mut().zip(upper.iter().zip(&lower)) {
        *entry = sine * x + cosine * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a matrix without structure.
    fn some(size: usize) -> Matrix {
        Matrix::from_fn(size, size, |i, j| libm::sin(f64::from(u32::try_from(7 * i * i + 3 * j + i * j + 1).unwrap())))
    }

    fn close(a: &Matrix, b: &Matrix, tolerance: f64) {
        assert!(a.entries().iter().zip(b.entries()).all(|(a, b)| (a - b).abs() <= tolerance), "{a:?} {b:?}");
    }

    #[test]
    fn factors_multiply_back() {
        for size in [1, 2, 5, 9] {
            let positive = some(size).transposed().times(&some(size));
            let factor = cholesky(&positive).unwrap();
            close(&factor.transposed().times(&factor), &positive, 1e-13);
            close(&factor.times(&triangle_inverse(&factor)), &Matrix::identity(size), 1e-7);
            let x: Vec<f64> = (0..size).map(|place| libm::cos(f64::from(u32::try_from(place).unwrap()))).collect();
            let solved = solve(&factor, &positive.times_column(&x));
            assert!(positive.times_column(&solved).iter().zip(positive.times_column(&x)).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        assert!(cholesky(&Matrix::identity(2).scaled(-1.0)).is_none());
        assert!(cholesky(&Matrix::identity(2).scaled(f64::NAN)).is_none());
    }

    #[test]
    fn eigenvectors_diagonalise() {
        for size in [1, 2, 6, 12] {
            let base = some(size);
            let symmetric = Matrix::from_fn(size, size, |i, j| base[(i, j)] + base[(j, i)]);
            let (values, vectors) = eigen(&symmetric);
            close(&vectors.times(&vectors.transposed()), &Matrix::identity(size), 1e-13);
            let diagonal = Matrix::from_fn(size, size, |i, j| if i == j { values[i] } else { 0.0 });
            close(&vectors.transposed().times(&diagonal).times(&vectors), &symmetric, 1e-12);
        }
    }
}
