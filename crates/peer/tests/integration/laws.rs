//! Coordination laws against their equations, written again sample by sample.

use std::time::Duration;

use cohaptic_peer::coordination::{LawParameters, LawValues, Prediction, UsedGains};
use cohaptic_peer::{Context, Coordination, Gains, Held, State, Strategy as _};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::cases;

#[expect(clippy::cast_precision_loss, reason = "a handful of peers")]
pub(crate) fn count(others: &[Body]) -> f64 {
    others.len() as f64
}

pub(crate) const TICK: Duration = Duration::from_millis(1);

/// Position and velocity along one axis.
pub(crate) type Body = (f64, f64);

/// Returns FT of a law for a copy `own` and the held samples `others`.
fn force(law: Coordination, gains: Gains, own: Body, others: &[Body]) -> f64 {
    let state = |(x, v): Body| State { position: [x], velocity: [v] };
    let mut strategy = law.strategy::<1>(gains, others.len() + 1, TICK);
    let (own, held) = (state(own), Held::new(others.iter().copied().map(state)));
    strategy.command(&Context { now: Instant::ZERO, local_time: Instant::ZERO, own: &own, held: &held, ahead: Prediction::REST }).force[0]
}

/// Returns the pull of one sample: KT·(x − xⱼ) + BT·(v − vⱼ).
pub(crate) fn pull(gains: Gains, own: Body, other: Body) -> f64 {
    gains.stiffness * (own.0 - other.0) + gains.damping * (own.1 - other.1)
}

/// Returns the greatest difference between two ways of adding n terms: each term is rounded at most three times, and each sum at most n + 4 times, by 2⁻⁵³ of
/// the sizes.
pub(crate) fn rounding(gains: Gains, own: Body, others: &[Body]) -> f64 {
    let size = |other: &Body| gains.stiffness * (own.0.abs() + other.0.abs()) + gains.damping * (own.1.abs() + other.1.abs());
    2.0 * (count(others) + 7.0) * f64::EPSILON / 2.0 * others.iter().map(size).sum::<f64>()
}

pub(crate) fn body() -> impl Strategy<Value = Body> {
    (-0.1..0.1, -1.0..1.0)
}

pub(crate) fn gains() -> impl Strategy<Value = Gains> {
    (0.0..5000.0, 0.0..50.0).prop_map(|(stiffness, damping)| Gains { stiffness, damping })
}

properties! {
    #![proptest_config(cases(500))]

    /// Rakhsha & Constantinescu 2015, eq. (2): the sum of the pulls of all other copies.
    #[test]
    fn proportional_derivative_is_the_sum_over_the_others(gains in gains(), own in body(), others in vec(body(), 1..12)) {
        let sum: f64 = others.iter().map(|other| pull(gains, own, *other)).sum();
        let force = force(Coordination::ProportionalDerivative, gains, own, &others);
        prop_assert!((force - sum).abs() <= rounding(gains, own, &others), "{force} is not {sum}");
    }

    /// Rakhsha & Constantinescu 2015, eq. (4): the mean of the pulls of all other copies.
    #[test]
    fn average_position_is_the_mean_over_the_others(gains in gains(), own in body(), others in vec(body(), 1..12)) {
        let mean = others.iter().map(|other| pull(gains, own, *other)).sum::<f64>() / count(&others);
        let force = force(Coordination::AveragePosition, gains, own, &others);
        prop_assert!((force - mean).abs() <= rounding(gains, own, &others) / count(&others), "{force} is not {mean}");
    }

    /// A law with changed gains acts as a law made with these gains.
    #[test]
    fn new_gains_make_the_law_anew(first in gains(), second in gains(), own in body(), other in body()) {
        for law in laws() {
            let mut strategy = law.strategy::<1>(first, 3, TICK);
            strategy.set_gains(second);
            let state = |(x, v): Body| State { position: [x], velocity: [v] };
            let (own, held) = (state(own), Held::new([state(other), state(other)]));
            let context = Context { now: Instant::ZERO, local_time: Instant::ZERO, own: &own, held: &held, ahead: Prediction::REST };
            prop_assert_eq!(strategy.command(&context), law.strategy::<1>(second, 3, TICK).command(&context));
        }
    }
}

fn parameters(gains: Gains) -> LawParameters {
    LawParameters { gains, peers: 2, tick: TICK, oldest: None, middle: None, own: LawValues::default() }
}

/// Returns the strategies of the registry that are laws.
fn laws() -> impl Iterator<Item = Coordination> {
    let gains = Gains { stiffness: 3.0, damping: 5.0 };
    Coordination::ALL.iter().copied().filter(move |coordination| coordination.law(&parameters(gains)).is_some())
}

/// Order and number of coefficients are independent of their values, so parallel lanes can assign coefficients lane by lane.
#[test]
fn a_law_maps_its_coefficients_in_one_order() {
    let gains = Gains { stiffness: 3.0, damping: 5.0 };
    for coordination in laws() {
        let Some(law) = coordination.law(&parameters(gains)) else { unreachable!("a law is one whatever its parameters are") };
        let mut seen = Vec::new();
        let copy = law.map(|coefficient| {
            seen.push(*coefficient);
            *coefficient
        });
        let used = match coordination.gains() {
            UsedGains::Both => [3.0, 5.0],
            UsedGains::Stiffness => [3.0, 0.0],
            UsedGains::Neither => unreachable!("laws have gains"),
        };
        assert_eq!((copy, &seen[..2]), (law, used.as_slice()), "{}", coordination.name());
    }
}
