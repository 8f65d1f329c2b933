//! Eigenvectors of chosen eigenvalues, by inverse iteration (Ipsen 1997).

use num_complex::Complex64;

use crate::Matrix;
use crate::factorisation::Lu;
use crate::matrix::ComplexMatrix;
use crate::rounding::real;

/// The number of solves for one vector. The first leads into the space of the eigenvalue; the second corrects for a start that was nearly orthogonal to that
/// space.
const STEPS: usize = 2;

/// Returns an eigenvector of length 1, to rounding, of a matrix for one of its computed eigenvalues. For an eigenvalue that is not simple the result is some
/// vector of its space, a different vector for each `place`. `None` if numbers overflow.
pub fn eigenvector(matrix: &Matrix, value: Complex64, place: usize) -> Option<Vec<Complex64>> {
    let size = matrix.rows();
    let shifted = ComplexMatrix::from_fn(size, size, |row, column| matrix[(row, column)] - if row == column { value } else { Complex64::ZERO });
    // If a pivot is zero, `value` is an eigenvalue to the last digit. A division by a number of the size of a rounding error still leads to its vector.
    let least = Complex64::from(f64::EPSILON * matrix.largest().max(f64::MIN_POSITIVE));
    let factors = Lu::with_least_pivot(&shifted, least);
    let mut vector = start(size, place);
    for _ in 0..STEPS {
        vector = factors.solve(&vector);
        // The vector is divided by its largest entry first, so that the squares of the length do not overflow.
        let largest = vector.iter().map(|entry| entry.l1_norm()).fold(0.0, f64::max);
        vector.iter_mut().for_each(|entry| *entry /= largest);
        let length = vector.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
        vector.iter_mut().for_each(|entry| *entry /= length);
    }
    vector.iter().all(|entry| entry.is_finite()).then_some(vector)
}

/// Returns a start vector without a pattern, a different vector for each `place`: the fractional parts of multiples of the golden ratio, plus one half.
fn start(size: usize, place: usize) -> Vec<Complex64> {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let entry = |row: usize| real((row + 1) * (place + 1)) * GOLDEN;
    (0..size).map(|row| Complex64::from(entry(row) - entry(row).floor() + 0.5)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigenvalues;

    fn residual(matrix: &Matrix, value: Complex64, vector: &[Complex64]) -> f64 {
        let row = |row: usize| matrix.row(row).iter().zip(vector).map(|(entry, x)| entry * x).sum::<Complex64>() - value * vector[row];
        (0..matrix.rows()).map(|place| row(place).norm_sqr()).sum::<f64>().sqrt()
    }

    #[test]
    fn vectors_of_all_eigenvalues_have_small_residuals() {
        for size in [1, 2, 5, 12, 30] {
            let entry = |row: usize, column: usize| libm::sin(f64::from(u32::try_from(7 * row * row + 3 * column + row * column + 1).unwrap()));
            let matrix = Matrix::from_fn(size, size, entry);
            for (place, value) in eigenvalues(&matrix).into_iter().enumerate() {
                let vector = eigenvector(&matrix, value, place).unwrap();
                let left = residual(&matrix, value, &vector);
                // The eigenvalue and the solution are both exact for matrices within n·ε·|A|.
                assert!(left < 1e-14 * real(size) * matrix.frobenius_norm(), "{size}: {left} for {value}");
            }
        }
    }

    #[test]
    fn of_a_double_eigenvalue_each_place_has_a_vector_of_its_own() {
        let matrix = Matrix::from_fn(3, 3, |row, column| if row == column { [2.0, 2.0, 1.0][row] } else { 0.0 });
        let [one, other] = [0, 1].map(|place| eigenvector(&matrix, Complex64::from(2.0), place).unwrap());
        assert!(residual(&matrix, Complex64::from(2.0), &one) < 1e-15 && residual(&matrix, Complex64::from(2.0), &other) < 1e-15);
        let area = (one[0] * other[1] - one[1] * other[0]).norm();
        assert!(area > 0.1, "{one:?} and {other:?} span {area}");
    }
}
