use crate::{Matrix, Radius};
pub(crate) fn radius(matrix: &Matrix) -> f64 {
    let m = faer::Mat::<f64>::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix[(i, j)]);
    m.eigenvalues().unwrap().iter().map(|l| (l.re * l.re + l.im * l.im).sqrt()).fold(0.0, f64::max)
}
pub(crate) fn bounded_radius(matrix: &Matrix, error: f64) -> Radius {
    Radius { value: radius(matrix), error }
}
