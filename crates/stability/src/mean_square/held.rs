//! What a receiver holds and does not feel.
//!
//! A held sample is a position and a velocity, and only KT·x + BT·v acts. The other combination, w, changes nothing and is changed by nothing but the
//! next sample, so the whole second moment is block triangular: what acts, and the moments that have w in them. E w² is multiplied by the probability that
//! nothing arrives, in the long run by q per frame, the spectral radius of the moves of the link's chain on which nothing is taken in. By the inequality of
//! Cauchy and Schwarz the moments of two such combinations, and of one and what acts, grow no faster than the faster of the two. So the radius of the whole is
//! the larger of the radius of what acts and of all q. What a link of certain delay brings is overwritten in every frame: q = 0.

use super::arrivals::Outcome;
use crate::{Matrix, Radius, spectrum};

/// The probability, per frame in the long run, that nothing arrives on a link whose chain has this number of states, given what may happen in a frame.
pub(crate) fn staying(states: usize, frame: &[Vec<Outcome>]) -> Radius {
    let mut stay = Matrix::identity(states);
    let mut roundings = 0;
    for outcomes in frame {
        let mut step = Matrix::zeros(states, states);
        for outcome in outcomes.iter().filter(|outcome| outcome.take.is_none()) {
            step[(outcome.to, outcome.from)] += outcome.probability;
        }
        // A place that no outcome leads from cannot be reached.
        stay = step.times(&stay);
        roundings += states + outcomes.len() + 1;
    }
    let rounding = f64::EPSILON * crate::rounding::real(roundings);
    match states {
        1 => Radius { value: stay[(0, 0)], error: rounding * stay[(0, 0)] },
        _ => spectrum::bounded_radius(&stay, rounding),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn none(from: usize, to: usize, probability: f64) -> Outcome {
        Outcome { from, to, take: None, probability }
    }

    #[test]
    fn two_chances_to_arrive_are_both_missed_with_the_product() {
        let frame = [vec![none(0, 0, 0.5), Outcome { take: Some(0), ..none(0, 0, 0.5) }], vec![none(0, 0, 0.25)]];
        assert!((staying(1, &frame).value - 0.125).abs() < 1e-16);
        assert!((staying(1, &[]).value - 1.0).abs() < 1e-16);
    }

    /// In the bad state everything is lost, in the good one nothing: to hear nothing for ever is to stay in the bad one.
    #[test]
    fn a_chain_is_silent_as_long_as_it_stays_bad() {
        let frame =
            [vec![Outcome { take: Some(0), ..none(0, 0, 0.9) }, Outcome { take: Some(0), ..none(0, 1, 0.1) }, none(1, 0, 0.3), none(1, 1, 0.7)]];
        let found = staying(2, &frame);
        assert!((found.value - 0.7).abs() < 1e-14 && found.error < 1e-12, "{found:?}");
    }
}
