//! The speed of the slowest disturbance, as far as the bounds of the radius determine the speed.

use cohaptic_stability::{Analysis, Verdict};

/// A number with bounds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Bounded {
    value: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Largest relative distance of the bounds of a known number.
const KNOWN: f64 = 0.01;

impl Bounded {
    /// Applies a function, which must rise with the radius, to the radius and to its bounds.
    fn of(analysis: &Analysis, rising: impl Fn(f64) -> f64) -> Self {
        let (low, high) = analysis.radius.bounds();
        Self { value: rising(analysis.radius.value), low: rising(low), high: rising(high) }
    }

    /// Returns the number if the bounds are at most one percent apart.
    pub(super) fn known(&self) -> Option<f64> {
        // The comparison is false for NaN and for an infinite bound, as it must be.
        (self.high - self.low <= KNOWN * self.value.abs()).then_some(self.value)
    }
}

/// Returns the time in which the slowest disturbance changes by a factor of e \[s\]: the frame over the logarithm of the radius. Negative for a growing
/// disturbance; `None` if the analysis cannot tell whether the disturbance grows.
pub(super) fn time_constant(analysis: &Analysis) -> Option<Bounded> {
    let frame = analysis.frame.as_secs_f64();
    match analysis.verdict() {
        // The time rises with the radius: from 0 at a radius of 0 to ∞ just below 1, and from −∞ just above 1 to 0.
        Verdict::Stable | Verdict::Unstable => Some(Bounded::of(analysis, |radius| -frame / radius.ln())),
        Verdict::Marginal | Verdict::Overflow => None,
    }
}

/// Returns the factor by which the slowest disturbance changes per second.
pub(super) fn per_second(analysis: &Analysis) -> Bounded {
    Bounded::of(analysis, |radius| radius.powf(1.0 / analysis.frame.as_secs_f64()))
}

/// Returns the speed of the slowest disturbance in words.
pub(super) fn words(analysis: &Analysis) -> String {
    let (radius, a_second) = (analysis.radius.value, per_second(analysis));
    let (low, high) = analysis.radius.bounds();
    let factors = match a_second.known() {
        Some(a_second) => format!("by a factor of {radius:.6} per frame and {a_second:.4e} per second"),
        // A second has many frames, and the factor per second can be beyond `f64`.
        None if a_second.high.is_infinite() && low > 0.0 => format!("by a factor of {radius:.4e} per frame"),
        None if low > 0.0 => format!("by a factor of {low:.6} to {high:.6} per frame and {:.4e} to {:.4e} per second", a_second.low, a_second.high),
        None => format!("by a factor of at most {high:.1e} per frame and {:.4e} per second", a_second.high),
    };
    match (analysis.verdict(), time_constant(analysis)) {
        (Verdict::Stable, Some(constant)) => {
            let constant = match constant.known() {
                // A radius of 0 with an error of 0: everything is gone after one frame.
                _ if constant.high <= 0.0 => return "every disturbance is gone within a frame".to_owned(),
                Some(seconds) => time(seconds),
                None if constant.low > 0.0 => format!("{} to {}", time(constant.low), time(constant.high)),
                None => format!("at most {}", time(constant.high)),
            };
            format!("the slowest disturbance changes {factors}: time constant {constant}")
        }
        (Verdict::Unstable, Some(constant)) if constant.low < 0.0 => {
            let constant = match constant.known() {
                Some(seconds) => time(-seconds),
                None if constant.high < 0.0 => format!("{} to {}", time(-constant.high), time(-constant.low)),
                None => format!("at most {}", time(-constant.low)),
            };
            format!("the fastest disturbance grows {factors}: e times as large in {constant}")
        }
        (Verdict::Unstable, _) => "the fastest disturbance grows beyond every number within a frame".to_owned(),
        (Verdict::Overflow, _) => "how fast disturbances change is not known".to_owned(),
        (Verdict::Stable | Verdict::Marginal, _) => format!("the slowest disturbance changes {factors}"),
    }
}

fn time(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.3} ms", seconds * 1e3) } else { format!("{seconds:.3} s") }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_stability::{Method, Radius};

    use super::*;

    fn analysis(value: f64, error: f64, frame: Duration) -> Analysis {
        let radius = Radius { value, error };
        Analysis { radius, rigid_modes: 0, dimension: 1, method: Method::Reduced, frame, modes: Vec::new(), notes: Vec::new() }
    }

    /// 1600 s over ln(1/5.5e-7) = 14.41 are 111.0 s. Computed from the rounding error 6.5e-16 itself, the time would be 45.8 s.
    #[test]
    fn a_radius_that_is_rounding_has_a_time_constant_that_is_at_most_that_of_its_bound() {
        let clocks = analysis(6.5e-16, 5.5e-7, Duration::from_secs(1600));
        let constant = time_constant(&clocks).unwrap();
        assert_eq!((constant.known(), constant.low), (None, 0.0));
        assert!((constant.high - 1600.0 / (1.0 / 5.5e-7_f64).ln()).abs() < 1e-6, "{constant:?}");
        let words = words(&clocks);
        assert!(words.contains("time constant at most 111.0") && words.contains("at most 5.5e-7 per frame"), "{words}");
    }

    /// Frames of one second with a radius of 0.5 ± 0.1: 1/ln(1/0.4) = 1.091 s to 1/ln(1/0.6) = 1.958 s.
    #[test]
    fn bounds_apart_give_a_range_and_close_ones_a_number() {
        let second = Duration::from_secs(1);
        assert!(words(&analysis(0.5, 0.1, second)).ends_with("time constant 1.091 s to 1.958 s"));
        assert!(words(&analysis(0.5, 1e-9, second)).ends_with("time constant 1.443 s"));
        // From 1/ln(3) = 910.239 ms to 1/ln(2) = 1.443 s.
        assert!(words(&analysis(2.5, 0.5, second)).ends_with("e times as large in 910.239 ms to 1.443 s"));
    }

    #[test]
    fn where_nothing_is_known_there_is_no_time_constant() {
        let second = Duration::from_secs(1);
        assert_eq!(time_constant(&analysis(1.0, 0.1, second)), None);
        assert_eq!(time_constant(&analysis(f64::INFINITY, f64::INFINITY, second)), None);
        assert_eq!(words(&analysis(f64::INFINITY, 0.0, second)), "the fastest disturbance grows beyond every number within a frame");
        assert_eq!(words(&analysis(0.0, 0.0, second)), "every disturbance is gone within a frame");
    }
}
