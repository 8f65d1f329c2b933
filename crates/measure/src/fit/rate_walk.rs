//! Walk of a rate: five states in a row, whose rate changes from second to second as that of a measured line.
//!
//! The rates of whole seconds are cut at their quintiles. A state has the mean of a fifth as its rate, and the walk goes from a state to one of its neighbours
//! with equal chances. Sojourns are exponential, with the mean s inside and 2s at both ends, so that the walk spends a fifth of the time in each state. With
//! cₖ = Σᵢ (rᵢ − r̄)·cos(πk(i − ½)/5) and λₖ = (1 − cos(πk/5))/s, the autocorrelation of the rate after a time t is Σ cₖ²·e^(−λₖt)/Σ cₖ²: the cosines are the
//! eigenvectors of the walk. s is chosen so that walk and measurement have the same autocorrelation after 5 s. The autocorrelations after 1 and 10 s are free,
//! and judge the walk.

use core::f64::consts::PI;
use std::fmt::Write as _;
use std::time::Duration;

use cohaptic_units::print::Span;
use serde::Serialize;

use crate::series::{autocorrelation, count, mean};

/// Number of states.
const STATES: usize = 5;
/// Fewest measured seconds: 12 in each fifth, and 50 pairs that are 10 s apart.
const FEWEST: usize = 60;
/// Largest difference between the autocorrelations of walk and measurement. Of the six recorded mobile lines for which this rule was made, five differ by
/// 0.103 at most, and one by 0.433.
const MOST_APART: f64 = 0.15;
/// Time after which the autocorrelations are equal \[s\].
const MATCHED_S: usize = 5;
/// Times after which the autocorrelations judge the walk \[s\].
const JUDGED_S: [usize; 2] = [1, 10];

/// Walk of a rate, estimated from the rates of whole seconds.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RateWalk {
    /// Measured seconds.
    pub seconds: usize,
    /// Rates of the states, from the least to the greatest \[bit/s\].
    pub rates_bps: [f64; STATES],
    /// Mean sojourn in an inner state \[s\], and half of the mean sojourn at both ends. `None` if no walk has the measured autocorrelation after 5 s.
    pub sojourn_s: Option<f64>,
    /// Measured autocorrelations of the rate after 1, 5 and 10 s. Empty if the rate never changes.
    pub measured: Vec<f64>,
    /// Autocorrelations of the walk after 1, 5 and 10 s. Empty without a sojourn.
    pub walk: Vec<f64>,
    /// Why the walk is refused, as sentences without a full stop; empty if it is not.
    pub refused: Vec<String>,
}

/// Why no walk can be estimated.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("found {found} whole seconds with a rate, expected at least {FEWEST} for a walk of the rate")]
pub struct RateWalkError {
    found: usize,
}

impl RateWalk {
    /// Estimates a walk from the rates of whole seconds \[bit/s\], one after the other; `None` for a second without a measurement.
    ///
    /// # Errors
    ///
    /// [`RateWalkError`] for fewer than 60 measured seconds.
    pub fn of(rates_bps: &[Option<f64>]) -> Result<Self, RateWalkError> {
        let mut sorted: Vec<f64> = rates_bps.iter().copied().flatten().collect();
        let seconds = sorted.len();
        if seconds < FEWEST {
            return Err(RateWalkError { found: seconds });
        }
        sorted.sort_by(f64::total_cmp);
        let fifth = |state: usize| mean(&sorted[state * seconds / STATES..(state + 1) * seconds / STATES]).unwrap_or(0.0);
        let states = std::array::from_fn(fifth);
        let lags = autocorrelation(rates_bps, JUDGED_S[1]);
        // A constant rate has no autocorrelation, and gaps can leave no pair at a lag.
        let measured: Vec<f64> = [JUDGED_S[0], MATCHED_S, JUDGED_S[1]].iter().filter_map(|lag| lags.get(lag - 1).copied()).collect();
        let mut refused = Vec::new();
        if states[0] < 1.0 {
            refused.push("a fifth of the seconds has a mean rate below 1 bit/s, at which no packet would ever leave".to_owned());
        }
        let sojourn_s = match measured[..] {
            [_, matched, _] if matched > 0.0 && matched < 1.0 => Some(sojourn_s(&states, matched)),
            [_, matched, _] => {
                refused.push(format!("the autocorrelation of the rate after {MATCHED_S} s is {matched:.3}, and that of a walk is between 0 and 1"));
                None
            }
            _ => {
                refused.push("the rate never changes, or too few seconds are 10 s apart".to_owned());
                None
            }
        };
        let walk: Vec<f64> = sojourn_s.map_or_else(Vec::new, |sojourn_s| {
            [JUDGED_S[0], MATCHED_S, JUDGED_S[1]].iter().map(|after| of_walk(&states, sojourn_s, count(*after))).collect()
        });
        if let ([first, _, last], [first_of_walk, _, last_of_walk]) = (&measured[..], &walk[..]) {
            refused.extend(too_far([*first, *last], [*first_of_walk, *last_of_walk]));
        }
        Ok(Self { seconds, rates_bps: states, sojourn_s, measured, walk, refused })
    }

    /// Returns the text of the link for a scene: the `[link]` table and the modulator. `None` for a refused walk.
    #[must_use]
    pub fn to_scene_toml(&self) -> Option<String> {
        let inner = self.sojourn_s.filter(|_| self.refused.is_empty()).and_then(|seconds| Duration::try_from_secs_f64(seconds).ok())?;
        let names: Vec<String> = (1..=STATES).map(|state| format!("r{state}")).collect();
        let rates: Vec<String> = names.iter().zip(self.rates_bps).map(|(name, rate)| format!("{name} = {{ rate = \"{rate:.0}bit\" }}")).collect();
        let mut text =
            format!("[link]\nmodulated = {{ by = \"rate-walk\", {} }}\n\n[[modulators]]\nname = \"rate-walk\"\nstates = [\n", rates.join(", "));
        for (state, name) in names.iter().enumerate() {
            let (sojourn, next) = match state {
                0 => (2 * inner, format!("\"{}\"", names[1])),
                last if last == STATES - 1 => (2 * inner, format!("\"{}\"", names[last - 1])),
                inside => (inner, format!("{{ {} = 1, {} = 1 }}", names[inside - 1], names[inside + 1])),
            };
            // Writing to a `String` cannot fail.
            let _ = writeln!(text, "    {{ name = \"{name}\", sojourn = \"{}\", next = {next} }},", Span(sojourn));
        }
        text.push_str("]\n");
        Some(text)
    }
}

/// Returns why a walk is refused by its autocorrelations after 1 and 10 s, which were not fitted.
fn too_far(measured: [f64; 2], walk: [f64; 2]) -> impl Iterator<Item = String> {
    let judged = JUDGED_S.into_iter().zip(measured.into_iter().zip(walk));
    judged
        .filter(|(_, (measured, walk))| (measured - walk).abs() > MOST_APART)
        .map(|(after, (measured, walk))| format!("the autocorrelation of the rate after {after} s is {measured:.3}, and {walk:.3} by the walk"))
}

/// Returns the autocorrelation of the rate of a walk after a time \[s\].
fn of_walk(rates: &[f64; STATES], sojourn_s: f64, after_s: f64) -> f64 {
    let middle = rates.iter().sum::<f64>() / count(STATES);
    // The share of each mode in the variance, and the mode's decay. The mode k = 0 is constant and has no share.
    let modes = (1..STATES).map(|k| {
        let angle = PI * count(k) / count(STATES);
        let share = rates.iter().enumerate().map(|(i, rate)| (rate - middle) * libm::cos(angle * (count(i) + 0.5))).sum::<f64>().powi(2);
        (share, libm::exp(-(1.0 - libm::cos(angle)) * after_s / sojourn_s))
    });
    let (whole, left) = modes.fold((0.0, 0.0), |(whole, left), (share, decay)| (whole + share, left + share * decay));
    left / whole
}

/// Returns the sojourn with which the walk has the autocorrelation `matched`, between 0 and 1, after [`MATCHED_S`] \[s\], to a millisecond.
fn sojourn_s(rates: &[f64; STATES], matched: f64) -> f64 {
    // The autocorrelation grows with the sojourn, from 0 to 1, so halving the interval finds it. The ends are beyond all that seconds can show.
    let (mut low, mut high) = (1e-3_f64, 1e6_f64);
    for _ in 0..80 {
        let middle = (low * high).sqrt();
        if of_walk(rates, middle, count(MATCHED_S)) < matched { low = middle } else { high = middle }
    }
    ((low * 1e3).round() * 1e-3).max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::TestRng;

    /// Figures of a recorded line.
    type Line = ([f64; STATES], f64, [f64; 2], [f64; 2]);

    /// Rates of the states \[Mbit/s\], the sojourn \[s\], and the autocorrelations after 1 and 10 s of the recording and of the walk, of recorded mobile lines
    /// (mahimahi's `ATT-LTE-driving` and `TMobile-UMTS-driving`, down and up, and low-band 5G on foot, down and up), as another program computed them.
    const LINES: [Line; 6] = [
        ([1.212, 3.185, 5.412, 7.072, 9.034], 2.758, [0.924, 0.598], [0.930, 0.495]),
        ([0.101, 0.743, 1.044, 1.112, 1.177], 2.011, [0.840, 0.400], [0.858, 0.309]),
        ([0.192, 0.959, 1.880, 2.635, 4.449], 1.629, [0.897, 0.276], [0.867, 0.292]),
        ([0.256, 0.696, 1.053, 1.301, 1.420], 1.996, [0.854, 0.444], [0.897, 0.366]),
        ([30.80, 78.61, 103.0, 125.7, 172.3], 2.880, [0.861, 0.575], [0.920, 0.489]),
        ([32.54, 56.42, 67.71, 78.62, 97.99], 1.104, [0.380, 0.368], [0.813, 0.168]),
    ];

    #[test]
    fn walks_have_the_autocorrelations_of_the_closed_form() {
        for (rates, sojourn, _, expected) in LINES {
            for (after, expected) in [1.0, 10.0].into_iter().zip(expected) {
                // The figures have three digits, of rates and sojourns with four.
                assert!((of_walk(&rates, sojourn, after) - expected).abs() < 1e-3, "{rates:?} {after}");
            }
            let matched = of_walk(&rates, sojourn, 5.0);
            assert!((sojourn_s(&rates, matched) - sojourn).abs() < 1e-9, "{rates:?}");
        }
        assert!((of_walk(&[1.0, 2.0, 3.0, 4.0, 5.0], 1.0, 0.0) - 1.0).abs() < 1e-12);
    }

    /// Of the recorded lines five have a walk, and one has none: low-band 5G up.
    #[test]
    fn a_recorded_line_is_refused_where_its_rates_are_no_walk() {
        let refused = LINES.map(|(rates, sojourn, measured, _)| too_far(measured, [1.0, 10.0].map(|after| of_walk(&rates, sojourn, after))).count());
        assert_eq!(refused, [0, 0, 0, 0, 0, 2]);
    }

    /// Seconds of a walk: the mean rate of each second, from sojourns as the walk has them.
    fn recorded(rates: &[f64; 5], sojourn_s: f64, seconds: usize) -> Vec<Option<f64>> {
        let mut rng = TestRng::new(11);
        let (mut state, mut left_s) = (2_usize, 0.0);
        let mut one = || {
            let (mut bits, mut to_do_s) = (0.0, 1.0_f64);
            while to_do_s > 0.0 {
                if left_s <= 0.0 {
                    state = match state {
                        0 => 1,
                        4 => 3,
                        inside => inside + 1 - 2 * usize::from(rng.unit() < 0.5),
                    };
                    left_s = -(1.0 - rng.unit()).ln() * sojourn_s * if state == 0 || state == 4 { 2.0 } else { 1.0 };
                }
                let spent_s = to_do_s.min(left_s);
                bits += rates[state] * spent_s;
                (to_do_s, left_s) = (to_do_s - spent_s, left_s - spent_s);
            }
            Some(bits)
        };
        (0..seconds).map(|_| one()).collect()
    }

    /// A walk that was measured for a day comes back. Seconds that hold a change have a rate between two states, so the fifths lie a little closer.
    #[test]
    fn a_measured_walk_comes_back() {
        let rates = LINES[0].0.map(|rate| rate * 1e6);
        let found = RateWalk::of(&recorded(&rates, 4.0, 86_400)).unwrap();
        assert_eq!((found.seconds, &found.refused), (86_400, &Vec::new()));
        for (found, expected) in found.rates_bps.into_iter().zip(rates) {
            assert!((found / expected - 1.0).abs() < 0.12, "{found} {expected}");
        }
        // The mean over a second raises the autocorrelation, and with it the sojourn.
        let sojourn = found.sojourn_s.unwrap();
        assert!((4.0..4.4).contains(&sojourn), "{sojourn}");
        for (walk, measured) in found.walk.iter().zip(&found.measured) {
            assert!((walk - measured).abs() < 0.03, "{found:?}");
        }
    }

    /// Half of the variance has no memory, and half a long one: 0.38 after 1 s as after 10 s, which no walk has.
    #[test]
    fn a_rate_with_two_memories_is_refused() {
        let mut rng = TestRng::new(5);
        let slow = recorded(&[30.0, 50.0, 65.0, 80.0, 95.0], 60.0, 3_000);
        let mixed: Vec<_> = slow.into_iter().map(|rate| rate.map(|rate| rate * 1e6 + 1e8 * rng.unit())).collect();
        let found = RateWalk::of(&mixed).unwrap();
        assert!(found.refused.iter().any(|reason| reason.starts_with("the autocorrelation of the rate after 1 s is 0.")), "{found:?}");
        assert!(found.refused.iter().any(|reason| reason.starts_with("the autocorrelation of the rate after 10 s is 0.")), "{found:?}");
        assert_eq!(found.to_scene_toml(), None);
    }

    #[test]
    fn a_rate_that_no_walk_has_is_refused() {
        let refused = |rates: &[Option<f64>]| RateWalk::of(rates).unwrap().refused.join("; ");
        assert_eq!(refused(&[Some(5e6); 60]), "the rate never changes, or too few seconds are 10 s apart");
        let in_turns: Vec<_> = (0..100).map(|second| Some(if second % 2 == 0 { 1e6 } else { 2e6 })).collect();
        assert_eq!(refused(&in_turns), "the autocorrelation of the rate after 5 s is -1.000, and that of a walk is between 0 and 1");
        let with_silence: Vec<_> = (0..1_000).map(|second| Some(if second % 100 < 25 { 0.0 } else { 1e6 })).collect();
        assert!(refused(&with_silence).starts_with("a fifth of the seconds has a mean rate below 1 bit/s"));
        let short: Vec<_> = (0..90).map(|second| (second % 3 > 0).then_some(f64::from(second))).collect();
        assert!(RateWalk::of(&short).is_ok());
        assert_eq!(
            RateWalk::of(&short[..88]).unwrap_err().to_string(),
            "found 58 whole seconds with a rate, expected at least 60 for a walk of the rate"
        );
    }

    #[test]
    fn a_walk_is_a_modulator() {
        let walk = RateWalk {
            seconds: 786,
            rates_bps: LINES[0].0.map(|rate| rate * 1e6),
            sojourn_s: Some(2.758),
            measured: vec![0.924, 0.701, 0.598],
            walk: vec![0.930, 0.701, 0.495],
            refused: Vec::new(),
        };
        let text = walk.to_scene_toml().unwrap();
        assert!(text.starts_with("[link]\nmodulated = { by = \"rate-walk\", r1 = { rate = \"1212000bit\" }, r2 = "), "{text}");
        for line in [
            "{ name = \"r1\", sojourn = \"5.516s\", next = \"r2\" },",
            "{ name = \"r2\", sojourn = \"2.758s\", next = { r1 = 1, r3 = 1 } },",
            "{ name = \"r5\", sojourn = \"5.516s\", next = \"r4\" },",
        ] {
            assert!(text.contains(line), "{text}");
        }
        assert!(text.parse::<toml::Table>().is_ok());
    }
}
