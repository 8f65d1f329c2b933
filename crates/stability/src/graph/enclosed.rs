//! Intervals around the eigenvalues of an averaging matrix, rounding included, for proofs.

use cohaptic_scene::Scene;

use super::{Eigenvalue, Graph, GraphError, symmetric};
use crate::Matrix;
use crate::factorisation::eigen;
use crate::rounding::real;

/// The eigenvalues of an averaging matrix, without the single eigenvalue 1 of each connected part of the graph.
#[derive(Clone, PartialEq, Debug)]
pub struct EnclosedSpectrum {
    /// Disjoint intervals in rising order, each with at least one eigenvalue.
    pub others: Vec<[f64; 2]>,
    /// Number or total weight of the heard peers of each peer; `None` unless exactly the same for all peers.
    pub degree: Option<f64>,
}

impl Graph {
    /// Returns enclosures of the eigenvalues of the averaging matrix for the peers of a scene.
    ///
    /// # Errors
    ///
    /// [`GraphError`] if the graph does not fit the scene's number of peers.
    pub fn enclosed_spectrum(&self, scene: &Scene) -> Result<EnclosedSpectrum, GraphError> {
        let (spectrum, degree) = self.spectrum(scene)?;
        let is_pair = scene.peers.len() == 2;
        let error = match self {
            Self::Weighted(weights) => {
                let ones = spectrum.iter().map(|(eigenvalue, copies)| if *eigenvalue == Eigenvalue::One { *copies } else { 0 }).sum();
                let degree = degree.filter(|_| has_equal_sums(weights));
                return Ok(EnclosedSpectrum { others: merged(of_weights(weights, ones)), degree });
            }
            // The other eigenvalues of a star are 0 and −1, exact numbers.
            Self::Star => 0.0,
            Self::Ring { .. } if is_pair => 0.0,
            // −1/(N − 1) is rounded once.
            Self::Complete => f64::EPSILON,
            // An angle below 2π is off by four roundings, a cosine by at most its angle's error and one rounding, and a mean of cosines by a rounding per term
            // and a final rounding.
            Self::Ring { neighbours } => (32.0 + real(*neighbours)) * f64::EPSILON,
        };
        let other = |(eigenvalue, _): &(Eigenvalue, usize)| if let Eigenvalue::Other(value) = eigenvalue { Some(*value) } else { None };
        let others = spectrum.iter().filter_map(other).map(|value| within_unit(value, error)).collect();
        Ok(EnclosedSpectrum { others: merged(others), degree })
    }
}

/// Returns the interval of half width `error` around a value, cut to [−1, 1]. All eigenvalues of averaging matrices with mutual weights lie there.
fn within_unit(value: f64, error: f64) -> [f64; 2] {
    [(value - error).max(-1.0), (value + error).min(1.0)]
}

/// Returns the union of intervals as disjoint intervals in rising order.
fn merged(mut intervals: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    intervals.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let mut apart: Vec<[f64; 2]> = Vec::new();
    for [low, high] in intervals {
        match apart.last_mut() {
            Some(last) if low <= last[1] => last[1] = last[1].max(high),
            _ => apart.push([low, high]),
        }
    }
    apart
}

/// Returns an interval for each eigenvalue of D⁻¹W except the largest `ones` eigenvalues, known to be 1. The matrix A = D^−½·W·D^−½ has the same eigenvalues,
/// is symmetric and has norm 1. If the computation fails, the single interval [−1, 1] stands for all eigenvalues.
///
/// Let U and the diagonal Λ be the computed eigenvectors and eigenvalues of A, let ε = ‖UᵀU − 1‖ < 1, and let U = Q·H with Q orthogonal. Then ‖U − Q‖ = ‖H − 1‖
/// ≤ ε, since each singular value σ of U has |σ − 1| ≤ |σ² − 1|. So ‖QᵀAQ − Λ‖ = ‖AQ − QΛ‖ ≤ ‖AU − UΛ‖ + ε·(1 + ‖Λ‖), and each eigenvalue of A differs by at
/// most this bound from the eigenvalue of Λ at the same place in rising order (Weyl 1912).
fn of_weights(weights: &Matrix, ones: usize) -> Vec<[f64; 2]> {
    let size = weights.rows();
    let unknown = || vec![[-1.0, 1.0]; usize::from(size > ones)];
    let Some((a, _)) = symmetric(weights) else { return unknown() };
    let (values, rows) = eigen(&a);
    let u = rows.transposed();
    let (reached, unit) = (a.times(&u), rows.times(&u));
    let residual = frobenius(&Matrix::from_fn(size, size, |row, column| reached[(row, column)] - u[(row, column)] * values[column]));
    let skew = frobenius(&Matrix::from_fn(size, size, |row, column| unit[(row, column)] - if row == column { 1.0 } else { 0.0 }));
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    // Written so that NaN fails.
    if !(skew < 0.1 && largest < 1.1 && residual < 1.0) {
        return unknown();
    }
    // Each entry of A has a relative error of at most (n + 4)·u, from the sums D and five operations. The matrix A has no negative entries and norm 1, so its
    // error in norm has the same bound. The entries of A·U − U·Λ and of UᵀU are sums of n terms; their errors in the Frobenius norm are at most
    // 4·(n + 2)·√n·u·(1 + ε) and n²·u·(1 + ε)². The sum of these errors is less than half of `rounding`; the other half covers the sums of squares.
    let rounding = 8.0 * (real(size) + 8.0).powi(2) * f64::EPSILON;
    let error = residual + skew * (1.0 + largest) + rounding;
    let mut sorted = values;
    sorted.sort_by(f64::total_cmp);
    sorted.truncate(size - ones);
    sorted.into_iter().map(|value| within_unit(value, error)).collect()
}

/// Returns approximate eigenvectors of D⁻¹W for a connected graph as columns x with xᵀDx = 1, without the eigenvector of the eigenvalue 1. Returns `None` if
/// the eigenvectors are not finite numbers.
pub fn eigenvectors(weights: &Matrix) -> Option<Matrix> {
    let (a, degrees) = symmetric(weights)?;
    let (values, rows) = eigen(&a);
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|one, other| values[*one].total_cmp(&values[*other]));
    // The last eigenvalue in rising order is 1.
    order.pop();
    let vectors = Matrix::from_fn(degrees.len(), order.len(), |row, column| rows[(order[column], row)] / degrees[row].sqrt());
    vectors.is_finite().then_some(vectors)
}

fn frobenius(matrix: &Matrix) -> f64 {
    matrix.entries().iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

/// Tells whether all rows have exactly the same sum, compared without rounding.
fn has_equal_sums(weights: &Matrix) -> bool {
    (1..weights.rows()).all(|row| is_zero(weights.row(0).iter().copied().chain(weights.row(row).iter().map(|weight| -weight))))
}

/// Tells whether the exact sum of numbers is zero. The sum is kept in disjoint parts (Shewchuk 1997, Grow-Expansion), so the sum is zero only if
/// all parts are zero.
fn is_zero(numbers: impl Iterator<Item = f64>) -> bool {
    let mut parts: Vec<f64> = Vec::new();
    for number in numbers {
        let mut rest = number;
        for part in &mut parts {
            let (one, other) = (rest, *part);
            rest = one + other;
            let grown = rest - one;
            *part = (one - (rest - grown)) + (other - grown);
        }
        parts.push(rest);
    }
    // Written so that NaN fails.
    parts.iter().all(|part| part.abs() <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a symmetric matrix with zero diagonal, whose other entries are `weight` of the smaller and the larger index.
    fn weights(peers: usize, weight: impl Fn(usize, usize) -> f64) -> Matrix {
        Matrix::from_fn(peers, peers, |one, other| if one == other { 0.0 } else { weight(one.min(other), one.max(other)) })
    }

    /// Spectra in closed form, some with repeated eigenvalues. Each eigenvalue is enclosed by an interval not much wider than rounding, and no further
    /// interval is found.
    #[test]
    fn eigenvalues_in_closed_form_are_enclosed() {
        let cos = |k: usize, of: usize| libm::cos(std::f64::consts::PI * real(k) / real(of));
        let is = |truth: bool| f64::from(u8::from(truth));
        let root = (0.0625_f64 + 1.0 / 6.0).sqrt();
        let cases: Vec<(&str, Matrix, Vec<f64>)> = vec![
            ("complete", weights(6, |_, _| 0.3), vec![-0.2]),
            ("star of uneven weights", weights(7, |one, other| is(one == 0) * 0.7 * real(other)), vec![-1.0, 0.0]),
            ("path", weights(9, |one, other| is(other == one + 1)), (1..=8).map(|k| cos(k, 8)).collect()),
            ("ring", weights(8, |one, other| is(other == one + 1 || other == one + 7) * 2.5), (1..=4).map(|k| cos(k, 4)).collect()),
            ("hypercube", weights(16, |one, other| is((one ^ other).is_power_of_two()) / 3.0), (1..=4).map(|k| 1.0 - real(k) / 2.0).collect()),
            ("complete bipartite", weights(7, |one, other| is(one < 3 && other >= 3) * 1e-3), vec![-1.0, 0.0]),
            // The two equal peers have λ = −1/2. The other eigenvalues are the zeros of 6·λ³ − 3·λ² − 4·λ + 1 = (λ − 1)·(6·λ² + 3·λ − 1).
            ("triangle with a tail", weights(4, |one, other| is(other < 3 || one == 2)), vec![-0.5, -0.25 + root, -0.25 - root]),
        ];
        for (name, weights, mut expected) in cases {
            expected.sort_by(f64::total_cmp);
            let found = merged(of_weights(&weights, 1));
            assert_eq!(found.len(), expected.len(), "{name}: {found:?}");
            for (interval, value) in found.iter().zip(&expected) {
                assert!(interval[0] <= *value && *value <= interval[1] && interval[1] - interval[0] < 1e-11, "{name}: {value} in {interval:?}");
            }
        }
    }

    /// Very small and very large weights in three unconnected parts of a graph: the three eigenvalues besides 1 are −1. Row sums that overflow leave [−1, 1].
    #[test]
    fn weights_out_of_the_ordinary_leave_bounds_that_hold() {
        let pairs = weights(6, |one, other| if one / 2 == other / 2 { [1e-300, 1.0, 1e300][one / 2] } else { 0.0 });
        assert!(of_weights(&pairs, 3).iter().all(|interval| interval[0] <= -1.0 && interval[1] < -1.0 + 1e-11));
        let beyond = weights(3, |_, _| 1.7e308);
        assert_eq!(of_weights(&beyond, 1), [[-1.0, 1.0]], "degrees beyond all numbers");
    }

    #[test]
    fn sums_are_compared_without_rounding() {
        let rows = |rows: [[f64; 3]; 2]| Matrix::from_fn(2, 3, |row, column| rows[row][column]);
        assert!(has_equal_sums(&rows([[0.1, 0.2, 0.3], [0.3, 0.1, 0.2]])));
        assert!(!has_equal_sums(&rows([[0.1, 0.2, 0.0], [0.3, 0.0, 0.0]])), "0.1 + 0.2 is not 0.3, nor what its sum is rounded to");
        assert!(!has_equal_sums(&rows([[1.0, 1e-20, 0.0], [1.0, 0.0, 0.0]])));
        assert!(has_equal_sums(&rows([[1e20, 1.0, 0.0], [1.0, 1e20, 0.0]])));
    }
}
