//! How fast the slowest disturbance changes, as far as the bounds of its radius tell.

use cohaptic_stability::{Analysis, Verdict};

/// A number that lies between two others.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Bounded {
    value: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

/// The bounds of a number that is known are no farther apart than this, relative to it.
const KNOWN: f64 = 0.01;

impl Bounded {
    /// What a function that rises with the radius makes of it.
    fn of(analysis: &Analysis, rising: impl Fn(f64) -> f64) -> Self {
        let (low, high) = analysis.radius.bounds();
        Self { value: rising(analysis.radius.value), low: rising(low), high: rising(high) }
    }

    /// The number, if it is known to a percent.
    pub(super) fn known(&self) -> Option<f64> {
        // Also not for NaN, and not where a bound is infinite.
        (self.high - self.low <= KNOWN * self.value.abs()).then_some(self.value)
    }
}

/// After how long the slowest disturbance is smaller, or larger, by a factor of e \[s\]: the frame over the logarithm of the radius. Below zero where it
/// grows; `None` where it cannot be told which.
pub(super) fn time_constant(analysis: &Analysis) -> Option<Bounded> {
    let frame = analysis.frame.as_secs_f64();
    match analysis.verdict() {
        // Rises with the radius: from 0 for a radius of 0, and from −∞ for one next to 1 up to 0.
        Verdict::Stable | Verdict::Unstable => Some(Bounded::of(analysis, |radius| -frame / radius.ln())),
        Verdict::Marginal | Verdict::Overflow => None,
    }
}

/// By which factor the slowest disturbance changes in a second.
pub(super) fn per_second(analysis: &Analysis) -> Bounded {
    Bounded::of(analysis, |radius| radius.powf(1.0 / analysis.frame.as_secs_f64()))
}

/// The same in words.
pub(super) fn words(analysis: &Analysis) -> String {
    let (radius, a_second) = (analysis.radius.value, per_second(analysis));
    let (low, high) = analysis.radius.bounds();
    let factors = match a_second.known() {
        Some(a_second) => format!("by a factor of {radius:.6} a frame and {a_second:.4e} a second"),
        // A second is many frames, and the factor no number.
        None if a_second.high.is_infinite() && low > 0.0 => format!("by a factor of {radius:.4e} a frame"),
        None if low > 0.0 => format!("by a factor of {low:.6} to {high:.6} a frame and {:.4e} to {:.4e} a second", a_second.low, a_second.high),
        None => format!("by a factor of at most {high:.1e} a frame and {:.4e} a second", a_second.high),
    };
    match (analysis.verdict(), time_constant(analysis)) {
        (Verdict::Stable, Some(constant)) => {
            let constant = match constant.known() {
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

    /// 1600 s over ln(1/5.5e-7) = 14.41 are 111.0 s; of the rounding itself, 6.5e-16, it would be 45.8 s.
    #[test]
    fn a_radius_that_is_rounding_has_a_time_constant_that_is_at_most_that_of_its_bound() {
        let clocks = analysis(6.5e-16, 5.5e-7, Duration::from_secs(1600));
        let constant = time_constant(&clocks).unwrap();
        assert_eq!((constant.known(), constant.low), (None, 0.0));
        assert!((constant.high - 1600.0 / (1.0 / 5.5e-7_f64).ln()).abs() < 1e-6, "{constant:?}");
        let words = words(&clocks);
        assert!(words.contains("time constant at most 111.0") && words.contains("at most 5.5e-7 a frame"), "{words}");
    }

    /// Half an hour of frames of a second with a radius of 0.5 ± 0.1: 1/ln(1/0.4) = 1.091 s to 1/ln(1/0.6) = 1.958 s.
    #[test]
    fn bounds_apart_give_a_range_and_close_ones_a_number() {
        let second = Duration::from_secs(1);
        assert!(words(&analysis(0.5, 0.1, second)).ends_with("time constant 1.091 s to 1.958 s"));
        assert!(words(&analysis(0.5, 1e-9, second)).ends_with("time constant 1.443 s"));
        // 1/ln(3) = 910.239 ms to 1/ln(2) = 1.443 s.
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
