//! Maximises functions of a single variable and of a few variables.

use crate::series::count;

/// Golden section, (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Returns the position of the maximum of `f` on `low..=high`. A grid of `points` intervals finds the peak, and golden sections (Kiefer 1953) refine the
/// position to 10⁻⁹ of the interval.
pub(super) fn maximise(low: f64, high: f64, points: u32, f: impl Fn(f64) -> f64) -> f64 {
    let at = |i: u32| low + (high - low) * f64::from(i) / f64::from(points);
    let best = (0..=points).map(|i| (i, f(at(i)))).fold((0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best }).0;
    // The maximum lies between the neighbours of the best grid point, if the grid is fine enough.
    let (mut left, mut right) = (at(best.saturating_sub(1)), at((best + 1).min(points)));
    let (mut one, mut other) = (right - GOLDEN * (right - left), left + GOLDEN * (right - left));
    let (mut f_one, mut f_other) = (f(one), f(other));
    while right - left > 1e-9 * (high - low) {
        if f_one >= f_other {
            (right, other, f_other) = (other, one, f_one);
            one = right - GOLDEN * (right - left);
            f_one = f(one);
        } else {
            (left, one, f_one) = (one, other, f_other);
            other = left + GOLDEN * (right - left);
            f_other = f(other);
        }
    }
    f64::midpoint(left, right)
}

/// Returns the position near `start` of the maximum of `f`, and the maximum. Uses the simplex of Nelder & Mead (1965, The Computer Journal 7(4)), with a
/// second start from the first result. Returns `None` if `f` is minus infinity at all corners of the first simplex, which lie at `start` and one `step`
/// from `start` along each axis.
pub(super) fn climb<const N: usize>(start: [f64; N], step: [f64; N], f: impl Fn([f64; N]) -> f64) -> Option<([f64; N], f64)> {
    let first = simplex(start, step, &f)?;
    // A simplex can collapse before the maximum. The second start has full dimension again, with smaller steps because the maximum is near.
    simplex(first.0, step.map(|step| step / 8.0), &f)
}

/// Difference of function values that counts as zero, about 10⁻⁸ of the difference between two distinguishable likelihoods.
const SETTLED: f64 = 1e-9;
const MOST_ROUNDS: usize = 400;

/// Runs the simplex from a start, until the values at all corners agree or the rounds end.
fn simplex<const N: usize>(start: [f64; N], step: [f64; N], f: &impl Fn([f64; N]) -> f64) -> Option<([f64; N], f64)> {
    let with_value = |at: [f64; N]| (at, f(at));
    let beside = |axis: usize| std::array::from_fn(|i| if i == axis { start[i] + step[i] } else { start[i] });
    let mut corners: Vec<([f64; N], f64)> = std::iter::once(start).chain((0..N).map(beside)).map(with_value).collect();
    for _ in 0..MOST_ROUNDS {
        corners.sort_by(|one, other| other.1.total_cmp(&one.1));
        let (best, worst) = (corners[0], corners[N]);
        if best.1 - worst.1 <= SETTLED {
            break;
        }
        let middle: [f64; N] = std::array::from_fn(|i| corners[..N].iter().map(|corner| corner.0[i]).sum::<f64>() / count(N));
        // Factors along the line from the worst corner through the middle of the others: 1 mirrors the worst corner, 2 goes twice as far, ½ goes halfway,
        // and −½ goes halfway back.
        let along = |by: f64| with_value(std::array::from_fn(|i| middle[i] + by * (middle[i] - worst.0[i])));
        let mirrored = along(1.0);
        let next = if mirrored.1 > best.1 {
            let farther = along(2.0);
            if farther.1 > mirrored.1 { farther } else { mirrored }
        } else if mirrored.1 > corners[N - 1].1 {
            mirrored
        } else {
            along(if mirrored.1 > worst.1 { 0.5 } else { -0.5 })
        };
        if next.1 > worst.1 {
            corners[N] = next;
        } else {
            // No point on the line is better than the worst corner, so the simplex shrinks towards the best corner.
            for corner in &mut corners[1..] {
                *corner = with_value(std::array::from_fn(|i| f64::midpoint(best.0[i], corner.0[i])));
            }
        }
    }
    corners.into_iter().max_by(|one, other| one.1.total_cmp(&other.1)).filter(|best| best.1 > f64::NEG_INFINITY)
}

/// Returns the standard error of a maximum-likelihood estimate from the curvature, (−d²ln L/dx²)^−½, by central differences with step `h`. Returns `None`
/// for a likelihood without curvature.
pub(super) fn standard_error(at: f64, h: f64, log_likelihood: impl Fn(f64) -> f64) -> Option<f64> {
    let curvature = (log_likelihood(at - h) - 2.0 * log_likelihood(at) + log_likelihood(at + h)) / (h * h);
    (curvature < 0.0).then(|| (-1.0 / curvature).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_found_among_several() {
        let f = |x: f64| (3.0 * x).sin() - 0.05 * (x - 6.0).powi(2);
        let found = maximise(0.0, 10.0, 40, f);
        // 3·cos 3x = 0.1·(x − 6) near x = 6.8, solved by Newton's method.
        let mut x = 6.8_f64;
        for _ in 0..50 {
            x -= (3.0 * (3.0 * x).cos() - 0.1 * (x - 6.0)) / (-9.0 * (3.0 * x).sin() - 0.1);
        }
        assert!((found - x).abs() < 1e-7, "{found} {x}");
        assert!((maximise(0.0, 1.0, 10, |x| x) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn the_top_of_a_narrow_ridge_is_found() {
        // Rosenbrock's valley (1960) turned upside down has its maximum at (1, 1). The function of three variables has a peak next to a wall of minus infinity.
        let (at, value) = climb([-1.2, 1.0], [0.1, 0.1], |[x, y]| -100.0 * (y - x * x).powi(2) - (1.0 - x).powi(2)).unwrap();
        assert!((at[0] - 1.0).abs() < 1e-3 && (at[1] - 1.0).abs() < 2e-3 && value > -1e-6, "{at:?} {value}");
        let walled = |[x, y, z]: [f64; 3]| if z > 2.0 { f64::NEG_INFINITY } else { z - (x - 1.0).powi(2) - (y + z).powi(2) };
        let (at, value) = climb([0.0; 3], [0.3; 3], walled).unwrap();
        assert!((at[0] - 1.0).abs() < 0.01 && (value - 2.0).abs() < 0.01, "{at:?} {value}");
        assert_eq!(climb([0.0], [1.0], |_| f64::NEG_INFINITY), None);
    }

    #[test]
    fn curvature_is_certainty() {
        let se = standard_error(2.0, 1e-3, |x| -(x - 2.0).powi(2) / (2.0 * 0.3 * 0.3)).unwrap();
        assert!((se - 0.3).abs() < 1e-6);
        assert_eq!(standard_error(0.0, 1e-3, |x| x), None);
    }
}
