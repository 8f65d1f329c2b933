//! Own states of the past, against the equation written sample by sample.

use std::time::Duration;

use cohaptic_peer::coordination::{Law, LawParameters, LawStrategy, LawValue, LawValues, Prediction};
use cohaptic_peer::{Context, Coordination, Gains, Held, State, Strategy as _};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::cases;
use crate::laws::{Body, TICK, body, count, gains, pull, rounding};

fn parameters(gains: Gains, lag: LawValue, middle: Option<u64>) -> LawParameters {
    let mut own = LawValues::default();
    own.set(0, lag);
    LawParameters { gains, peers: 2, tick: TICK, oldest: None, middle, own }
}

fn strategy(gains: Gains, ticks: u32) -> LawStrategy<1> {
    LawStrategy::new(Coordination::LocalLag, parameters(gains, LawValue::Duration(TICK * ticks), None))
}

fn force(strategy: &mut LawStrategy<1>, own: Body, others: &[Body]) -> f64 {
    let state = |(x, v): Body| State { position: [x], velocity: [v] };
    let (own, held) = (state(own), Held::new(others.iter().copied().map(state)));
    strategy.command(&Context { now: Instant::ZERO, local_time: Instant::ZERO, own: &own, held: &held, ahead: Prediction::REST }).force[0]
}

properties! {
    #![proptest_config(cases(300))]

    /// The equation is FT(k) = mean of KT·(x(k − L) − xⱼ) + BT·(v(k − L) − vⱼ), with the first state before the first tick.
    #[test]
    fn it_is_the_mean_over_samples_of_a_past_state(
        gains in gains(), own in vec(body(), 1..40), others in vec(body(), 1..12), lag in 0..20_u32,
    ) {
        let mut strategy = strategy(gains, lag);
        for tick in 0..own.len() {
            let past = own[tick.saturating_sub(lag as usize)];
            let mean = others.iter().map(|other| pull(gains, past, *other)).sum::<f64>() / count(&others);
            let force = force(&mut strategy, own[tick], &others);
            prop_assert!((force - mean).abs() <= rounding(gains, past, &others) / count(&others), "{force} is not {mean} at tick {tick}");
        }
    }

    /// At a common velocity v the force is KT·v times the mean difference between the age of the samples and the age of the own state; zero for equal ages.
    #[test]
    fn at_a_common_velocity_it_is_as_the_ages_differ(gains in gains(), v in -1.0..1.0, lag in 0..20_u32, ages in vec(0..20_u32, 1..8), ticks in 20..40_u32) {
        let at = |tick: f64| (1e-3 * tick * v, v);
        let mut strategy = strategy(gains, lag);
        for tick in 0..ticks {
            force(&mut strategy, at(f64::from(tick)), &[at(0.0)]);
        }
        let others: Vec<Body> = ages.iter().map(|age| at(f64::from(ticks) - f64::from(*age))).collect();
        let older = ages.iter().map(|age| f64::from(*age) - f64::from(lag)).sum::<f64>() / count(&others);
        let force = force(&mut strategy, at(f64::from(ticks)), &others);
        prop_assert!((force - gains.stiffness * 1e-3 * v * older).abs() <= 64.0 * f64::EPSILON * (gains.stiffness + gains.damping), "{force}");
    }

    /// The memory contains the states of the latest ticks, the oldest first. A change of gains keeps the memory, and a saved memory can be restored.
    #[test]
    fn the_past_goes_on_under_new_gains(first in gains(), second in gains(), own in vec(body(), 30), other in body(), lag in 1..20_u32) {
        let (mut one, mut other_one) = (strategy(first, lag), strategy(second, lag));
        let (before, after) = own.split_at(25);
        before.iter().for_each(|own| _ = force(&mut one, *own, &[other]));
        let states: Vec<f64> = before[25 - lag as usize..].iter().flat_map(|(x, v)| [*x, *v]).collect();
        prop_assert_eq!(one.memory(), states.as_slice());
        one.set_gains(second);
        other_one.set_memory(&states);
        for own in after {
            prop_assert_eq!(force(&mut one, *own, &[other]).to_bits(), force(&mut other_one, *own, &[other]).to_bits());
        }
    }
}

/// A part of a tick counts as a whole tick, as for samples that arrive between two ticks.
#[test]
fn a_lag_is_rounded_up_to_ticks() {
    let lag = |lag: LawValue, middle: Option<u64>| {
        Law::<f64>::lag(&Coordination::LocalLag.law(&parameters(Gains { stiffness: 1.0, damping: 0.0 }, lag, middle)).unwrap())
    };
    let micros = |micros: u64| LawValue::Duration(Duration::from_micros(micros));
    assert_eq!([0, 1, 1000, 1001, 10_200].map(|span| lag(micros(span), Some(7))), [0, 1, 1, 2, 11]);
    assert_eq!(lag(LawValue::Automatic, Some(7)), 7);
}
