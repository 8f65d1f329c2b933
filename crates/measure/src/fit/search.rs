//! The greatest value of a function of one variable.

/// (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Where `f` is greatest on `low..=high`: a grid of `points` finds the peak, golden sections (Kiefer 1953) refine it to 10⁻⁹ of the interval.
pub(super) fn maximise(low: f64, high: f64, points: u32, f: impl Fn(f64) -> f64) -> f64 {
    let at = |i: u32| low + (high - low) * f64::from(i) / f64::from(points);
    let best = (0..=points).map(|i| (i, f(at(i)))).fold((0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best }).0;
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

/// The standard error of an estimate of greatest likelihood from the curvature there: (−d²ln L/dx²)^−½, by central differences of step `h`. `None`
/// where the likelihood is not curved.
pub(super) fn standard_error(at: f64, h: f64, log_likelihood: impl Fn(f64) -> f64) -> Option<f64> {
    let curvature = (log_likelihood(at - h) - 2.0 * log_likelihood(at) + log_likelihood(at + h)) / (h * h);
    (curvature < 0.0).then(|| (-1.0 / curvature).sqrt())
}

/// The place where an increasing `f` crosses zero on `low..=high`; an end if it does not.
pub(super) fn crossing(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    // 60 halvings leave 10⁻¹⁸ of the interval.
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if f(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_found_among_several() {
        let f = |x: f64| (3.0 * x).sin() - 0.05 * (x - 6.0).powi(2);
        let found = maximise(0.0, 10.0, 40, f);
        // 3·cos 3x = 0.1·(x − 6) near x = 6.8: found by Newton.
        let mut x = 6.8_f64;
        for _ in 0..50 {
            x -= (3.0 * (3.0 * x).cos() - 0.1 * (x - 6.0)) / (-9.0 * (3.0 * x).sin() - 0.1);
        }
        assert!((found - x).abs() < 1e-7, "{found} {x}");
        assert!((maximise(0.0, 1.0, 10, |x| x) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn curvature_is_certainty() {
        let se = standard_error(2.0, 1e-3, |x| -(x - 2.0).powi(2) / (2.0 * 0.3 * 0.3)).unwrap();
        assert!((se - 0.3).abs() < 1e-6);
        assert_eq!(standard_error(0.0, 1e-3, |x| x), None);
    }

    #[test]
    fn a_root_is_found_or_an_end() {
        assert!((crossing(0.0, 2.0, |x| x * x - 2.0) - 2.0_f64.sqrt()).abs() < 1e-12);
        assert!((crossing(0.0, 1.0, |_| -1.0) - 1.0).abs() < 1e-12);
    }
}
