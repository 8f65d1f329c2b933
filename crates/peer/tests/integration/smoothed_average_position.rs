//! A force with a first-order lag, against the closed form.

use std::time::Duration;

use cohaptic_peer::coordination::{LawParameters, LawStrategy, LawValue, LawValues, Prediction};
use cohaptic_peer::{Context, Coordination, Gains, Held, State, Strategy as _};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::prelude::*;

use crate::cases;
use crate::laws::{Body, TICK, body, gains, pull};

fn strategy(gains: Gains, lag: Duration) -> LawStrategy<1> {
    let mut own = LawValues::default();
    own.set(0, LawValue::Duration(lag));
    LawStrategy::new(Coordination::SmoothedAveragePosition, LawParameters { gains, peers: 2, tick: TICK, oldest: None, middle: None, own })
}

fn forces(strategy: &mut LawStrategy<1>, own: Body, other: Body, ticks: usize) -> Vec<f64> {
    let state = |(x, v): Body| State { position: [x], velocity: [v] };
    let (own, held) = (state(own), Held::new([state(other)]));
    let context = Context { now: Instant::ZERO, local_time: Instant::ZERO, own: &own, held: &held, ahead: Prediction::REST };
    (0..ticks).map(|_| strategy.command(&context).force[0]).collect()
}

properties! {
    #![proptest_config(cases(500))]

    /// Under a constant pull F the force is F·(1 − e^(−k·Tc/lag)) at the k-th tick. Each tick rounds by some units in the last place of F. The accumulated
    /// error is at most 1/(1 − a) times as large, and 1 − a is at least 1/500 here.
    #[test]
    fn a_constant_pull_is_approached_exponentially(gains in gains(), own in body(), other in body(), lag in 0.2..500.0_f64) {
        let lag = Duration::from_secs_f64(lag * 1e-3);
        let pull = pull(gains, own, other);
        let size = gains.stiffness * (own.0.abs() + other.0.abs()) + gains.damping * (own.1.abs() + other.1.abs());
        for (k, force) in (1..).zip(forces(&mut strategy(gains, lag), own, other, 200)) {
            let expected = -pull * (-f64::from(k) * TICK.as_secs_f64() / lag.as_secs_f64()).exp_m1();
            prop_assert!((force - expected).abs() <= 4000.0 * f64::EPSILON * size, "{k}: {force} is not {expected}");
        }
    }

    /// Without a lag the law equals the average-position law.
    #[test]
    fn without_a_lag_it_is_the_average_position_law(gains in gains(), own in body(), other in body()) {
        let average = &mut Coordination::AveragePosition.strategy::<1>(gains, 2, TICK);
        let smoothed = &mut strategy(gains, Duration::ZERO);
        prop_assert_eq!(forces(smoothed, own, other, 3), forces(average, own, other, 3));
    }
}

/// A change of gains keeps the memory, and a saved memory can be restored.
#[test]
fn the_force_that_is_remembered_goes_on_under_new_gains() {
    let lag = Duration::from_millis(10);
    let mut first = strategy(Gains { stiffness: 100.0, damping: 0.0 }, lag);
    let before = forces(&mut first, (0.1, 0.0), (0.0, 0.0), 5)[4];
    assert_eq!(first.memory(), [before]);
    first.set_gains(Gains { stiffness: 0.0, damping: 0.0 });
    let after = forces(&mut first, (0.1, 0.0), (0.0, 0.0), 1)[0];
    assert!((after / before - (-0.1_f64).exp()).abs() < 1e-15);
    let mut other = strategy(Gains { stiffness: 0.0, damping: 0.0 }, lag);
    other.set_memory(&[before]);
    assert_eq!(forces(&mut other, (0.1, 0.0), (0.0, 0.0), 1), [after]);
}
