//! Part of a held sample without a force on the receiver.
//!
//! A held sample is a position and a velocity, and only KT·x + BT·v exerts a force. The other combination, w, changes no other state, and only the next sample
//! changes w. So the operator on the second moment is block triangular: a block for the moments without w, and a block for the moments with w. E w² is
//! multiplied by the probability of no arrival. In the long run this probability is a factor q per frame, the spectral radius of the moves of the link's chain
//! without an arrival. By the inequality of Cauchy and Schwarz the moment of w with another w, or with a state with a force, grows no faster than the faster of
//! the two. So the radius of the whole is the largest of the radius without w and of all q. A link of constant delay overwrites the held sample in every frame,
//! so for such a link q = 0.

use super::arrivals::Outcome;
use crate::{Matrix, Radius, spectrum};

/// Returns the probability per frame, in the long run, of no arrival on a link. `states` is the number of states of the link's chain, and `frame`
/// lists the outcomes of each tick of a frame at which a sample may arrive or the state may change.
pub(crate) fn staying(states: usize, frame: &[Vec<Outcome>]) -> Radius {
    let mut stay = Matrix::identity(states);
    let mut roundings = 0;
    for outcomes in frame {
        let mut step = Matrix::zeros(states, states);
        for outcome in outcomes.iter().filter(|outcome| outcome.take.is_none()) {
            step[(outcome.to, outcome.from)] += outcome.probability;
        }
        // A state without outcomes at a tick has a zero column here. Such a state is unreachable at the tick, so nothing is lost from the product.
        stay = step.times(&stay);
        // A product of the steps adds up `states` terms per entry, and an entry of a step adds up at most as many outcomes as the tick has.
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

    /// All samples are lost in the bad state and none in the good state, so that silence lasts exactly as long as the chain stays in the bad state.
    #[test]
    fn a_chain_is_silent_as_long_as_it_stays_bad() {
        let frame =
            [vec![Outcome { take: Some(0), ..none(0, 0, 0.9) }, Outcome { take: Some(0), ..none(0, 1, 0.1) }, none(1, 0, 0.3), none(1, 1, 0.7)]];
        let found = staying(2, &frame);
        assert!((found.value - 0.7).abs() < 1e-14 && found.error < 1e-12, "{found:?}");
    }
}
