//! Zeros of a vector-valued function, by the method of Levenberg (1944).

use crate::Matrix;
use crate::factorisation::Lu;

/// Largest number of steps. From near a zero some ten steps suffice.
const MOST_STEPS: usize = 200;

/// Returns a place near `start` at which the residual is small, and the norm of the residual there. The caller decides whether that norm counts as zero.
/// `moved` moves a place by `size` coordinates.
pub(super) fn zero<P>(start: P, size: usize, residual: impl Fn(&P) -> Vec<f64>, moved: impl Fn(&P, &[f64]) -> P) -> (P, f64) {
    let mut place = start;
    let mut left = residual(&place);
    let mut damping = 1e-6;
    for _ in 0..MOST_STEPS {
        // The residual consists of lengths of about a metre. Below this norm only rounding is left.
        if norm(&left) <= 1e-15 * crate::rounding::real(size) {
            break;
        }
        let slope = slope(&place, size, left.len(), &residual, &moved);
        let normal = Matrix::from_fn(size, size, |row, column| {
            let product: f64 = (0..left.len()).map(|entry| slope[(entry, row)] * slope[(entry, column)]).sum();
            product + if row == column { damping } else { 0.0 }
        });
        let right: Vec<f64> = (0..size).map(|row| -left.iter().enumerate().map(|(entry, left)| slope[(entry, row)] * left).sum::<f64>()).collect();
        let step = Lu::of(&normal).solve(&right);
        let next = moved(&place, &step);
        let reached = residual(&next);
        if norm(&reached) < norm(&left) {
            (place, left, damping) = (next, reached, (0.1 * damping).max(1e-14));
        } else if norm(&step) <= f64::EPSILON * crate::rounding::real(size) {
            break;
        } else {
            damping = (10.0 * damping).min(1e6);
        }
    }
    let left = norm(&left);
    (place, left)
}

fn norm(entries: &[f64]) -> f64 {
    entries.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
}

/// Returns the slope of the residual (row: entry of the residual, column: coordinate), by central differences.
fn slope<P>(place: &P, size: usize, rows: usize, residual: &impl Fn(&P) -> Vec<f64>, moved: &impl Fn(&P, &[f64]) -> P) -> Matrix {
    const STEP: f64 = 1e-6;
    let mut slope = Matrix::zeros(rows, size);
    let mut by = vec![0.0; size];
    for column in 0..size {
        let mut at = |step: f64| {
            by[column] = step;
            let found = residual(&moved(place, &by));
            by[column] = 0.0;
            found
        };
        for (row, (up, down)) in at(STEP).iter().zip(at(-STEP)).enumerate() {
            slope[(row, column)] = (up - down) / (2.0 * STEP);
        }
    }
    slope
}
