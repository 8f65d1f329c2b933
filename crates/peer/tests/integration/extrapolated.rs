//! Extrapolated samples, against the equation written sample by sample.

use std::time::Duration;

use cohaptic_peer::coordination::{LawParameters, LawStrategy, LawValue, LawValues, Prediction};
use cohaptic_peer::{Context, Coordination, Gains, Held, State, Strategy as _};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::cases;
use crate::laws::{Body, TICK, body, count, gains, pull, rounding};

fn strategy(gains: Gains, horizon: Duration) -> LawStrategy<1> {
    let mut own = LawValues::default();
    own.set(0, LawValue::Duration(horizon));
    LawStrategy::new(Coordination::Extrapolated, LawParameters { gains, peers: 2, tick: TICK, oldest: None, middle: None, own })
}

/// Returns FT at the local time 1 s for samples with these ages \[ms\].
fn force(gains: Gains, horizon: Duration, own: Body, others: &[(Body, u64)]) -> f64 {
    let state = |(x, v): Body| State { position: [x], velocity: [v] };
    let mut strategy = strategy(gains, horizon);
    let mut held = Held::new(others.iter().map(|_| State::REST));
    assert_eq!(strategy.horizon(), (!horizon.is_zero()).then_some(horizon.as_secs_f64()));
    if let Some(horizon) = strategy.horizon() {
        held.keep_ages(horizon);
    }
    for (place, (body, age)) in others.iter().enumerate() {
        held.accept(place, 0, Instant::from_nanos((1000 - age) * 1_000_000), state(*body));
    }
    held.refresh();
    let (own, local_time) = (state(own), Instant::from_nanos(1_000_000_000));
    held.move_on(local_time);
    strategy.command(&Context { now: Instant::ZERO, local_time, own: &own, held: &held, ahead: Prediction::REST }).force[0]
}

properties! {
    #![proptest_config(cases(500))]

    /// The equation is FT = mean of KT·(x − xⱼ − min(age, horizon)·vⱼ) + BT·(v − vⱼ).
    #[test]
    fn it_is_the_mean_over_extrapolated_samples(
        gains in gains(), own in body(), others in vec((body(), 0..300_u64), 1..12), horizon in 0..200_u64,
    ) {
        let moved: Vec<Body> = others.iter().map(|((x, v), age)| (x + (*age).min(horizon) as f64 * 1e-3 * v, *v)).collect();
        let mean = moved.iter().map(|other| pull(gains, own, *other)).sum::<f64>() / count(&moved);
        let force = force(gains, Duration::from_millis(horizon), own, &others);
        // Ages and leads are rounded too, so there are twice as many roundings.
        prop_assert!((force - mean).abs() <= 2.0 * rounding(gains, own, &moved) / count(&moved) + 1e-13, "{force} is not {mean}");
    }

    /// Copies that move at one velocity exert no force on each other, at any age of the samples below the horizon.
    #[test]
    fn nobody_is_held_back_at_a_common_velocity(gains in gains(), x in -0.1..0.1, v in -1.0..1.0, ages in vec(0..200_u64, 1..12)) {
        let others: Vec<(Body, u64)> = ages.iter().map(|age| ((x - *age as f64 * 1e-3 * v, v), *age)).collect();
        let force = force(gains, Duration::from_millis(200), (x, v), &others);
        prop_assert!(force.abs() <= 40.0 * f64::EPSILON * (gains.stiffness + gains.damping), "{force}");
    }

    /// The extrapolation of a copy under an acceleration of at most a errs by at most ½·a·age². A constant acceleration reaches this error exactly.
    #[test]
    fn the_error_of_a_sample_is_that_of_its_acceleration(x in -0.1..0.1, v in -1.0..1.0, a in -20.0..20.0_f64, age in 0..200_u64) {
        let t = age as f64 * 1e-3;
        let now = (x + v * t + 0.5 * a * t * t, v + a * t);
        let force = force(Gains { stiffness: 1.0, damping: 0.0 }, Duration::from_millis(200), now, &[((x, v), age)]);
        prop_assert!((force - 0.5 * a * t * t).abs() < 1e-14, "{force}");
    }

    /// Without a horizon the law equals the average-position law.
    #[test]
    fn without_a_horizon_it_is_the_average_position_law(gains in gains(), own in body(), others in vec((body(), 0..300_u64), 1..12)) {
        let state = |(x, v): Body| State { position: [x], velocity: [v] };
        let (copy, held) = (state(own), Held::new(others.iter().map(|(body, _)| state(*body))));
        let context = Context { now: Instant::ZERO, local_time: Instant::ZERO, own: &copy, held: &held, ahead: Prediction::REST };
        let average = Coordination::AveragePosition.strategy::<1>(gains, 2, TICK).command(&context).force[0];
        prop_assert_eq!(force(gains, Duration::ZERO, own, &others), average);
    }
}
