//! Every packet in both representations against its formula, and verdicts against simulations.
#![allow(clippy::float_cmp, reason = "no error at all is exactly zero")]

use cohaptic_harness::Model;
use cohaptic_harness::check::{Stability, stability};
use cohaptic_units::Instant;

use super::traffic::{Arrival, NODES};
use super::*;
use crate::Unwatched;

const QUICK: Options = Options { quick: true };
const MILLISECOND: Duration = Duration::from_millis(1);

fn traffics() -> [Traffic; 3] {
    CLOCKS.map(|clocks| Traffic::new(clocks.tick * 8, clocks.offset, 50))
}

fn in_steps(traffic: &Traffic, step: Duration, rounding: Rounding) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    steps::carry(traffic, step, rounding, |arrival| arrivals.push(arrival));
    arrivals
}

#[test]
fn sendings_are_in_order_of_time() {
    for traffic in traffics() {
        let sendings: Vec<Instant> = traffic.sendings().map(|(at, _)| at).collect();
        assert!(sendings.is_sorted() && sendings.len() == 50 * NODES);
    }
}

#[test]
fn events_have_no_error_at_all() {
    for traffic in traffics() {
        let mut errors = Errors::default();
        events::carry(&traffic, |arrival| errors.add(&traffic, arrival)).unwrap();
        assert_eq!((errors.seen(), errors.of_mean(), errors.worst()), (50 * 12, 0.0, 0.0));
    }
}

/// With rounding up, a sample waits less than a step for its sending, and its delay grows by less than a step. With rounding to the nearest step, the delay
/// changes by at most half a step.
#[test]
fn steps_err_by_less_than_two_steps() {
    for traffic in traffics() {
        for step in STEPS.map(Duration::from_nanos) {
            let arrivals = in_steps(&traffic, step, Rounding::Up);
            assert_eq!(arrivals.len(), 50 * 12);
            for Arrival { from, to, delay } in arrivals {
                let right = traffic.delays[from][to];
                assert!((right..right + 2 * step).contains(&delay));
            }
            for Arrival { from, to, delay } in in_steps(&traffic, step, Rounding::Nearest) {
                assert!(delay.abs_diff(traffic.delays[from][to]) < step * 3 / 2);
            }
        }
    }
}

/// In lockstep, samples are taken at steps, so the mean error is the mean rounding of the twelve delays.
#[test]
fn the_mean_error_in_lockstep_is_that_of_the_delays() {
    let traffic = &traffics()[0];
    let mut errors = Errors::default();
    for arrival in in_steps(traffic, MILLISECOND, Rounding::Up) {
        errors.add(traffic, arrival);
    }
    let mut nanos = 0;
    for (from, row) in traffic.delays.iter().enumerate() {
        for (_, delay) in row.iter().enumerate().filter(|(to, _)| *to != from) {
            nanos += 1_000_000 - delay.as_nanos() % 1_000_000;
        }
    }
    let expected = u32::try_from(nanos).map(f64::from).unwrap() / 12.0 / 1e9;
    assert!((errors.of_mean() - expected).abs() < 1e-15, "{} {expected}", errors.of_mean());
}

#[test]
fn steps_of_a_nanosecond_have_no_error_either() {
    let traffic = Traffic::new(Duration::from_micros(500), Duration::from_nanos(37), 3);
    for Arrival { from, to, delay } in in_steps(&traffic, Duration::from_nanos(1), Rounding::Nearest) {
        assert_eq!(delay, traffic.delays[from][to]);
    }
}

#[test]
fn rounding_is_up_or_to_the_nearest() {
    let micros = Duration::from_micros;
    for (span, up, nearest) in [(0, 0, 0), (1, 1, 0), (499, 1, 0), (500, 1, 1), (1000, 1, 1), (1001, 2, 1), (1500, 2, 2)] {
        assert_eq!(Rounding::Up.span(micros(span), MILLISECOND), micros(1000 * up));
        assert_eq!(Rounding::Nearest.span(micros(span), MILLISECOND), micros(1000 * nearest));
    }
}

fn rounding_of(work: &Work, rounding: Rounding) -> f64 {
    work.wrong(Way::Steps(MILLISECOND, rounding), &Unwatched).unwrap().0
}

/// A delay acts as d = ⌈delay/tick⌉ ticks, so rounding up to ticks changes no verdict, while rounding to the nearest tick does.
#[test]
fn rounding_up_to_the_tick_changes_no_verdict_in_lockstep_and_all_else_does() {
    let work = CLOCKS.map(|clocks| Work::new(clocks, QUICK, &Unwatched).unwrap());
    assert_eq!(rounding_of(&work[0], Rounding::Up), 0.0);
    assert!(rounding_of(&work[1], Rounding::Up) > 0.0 || rounding_of(&work[1], Rounding::Nearest) > 0.0);
    assert!(rounding_of(&work[2], Rounding::Up) > 0.0 && rounding_of(&work[2], Rounding::Nearest) > 0.0);
    for work in &work {
        assert!(work.scenes.iter().any(|(.., stable)| *stable) && work.scenes.iter().any(|(.., stable)| !*stable));
        assert_eq!(work.wrong(Way::Events, &Unwatched).unwrap().0, 0.0);
    }
}

/// Where steps change the verdict, a simulation of the scene as written agrees with the analysis, and a simulation of the scene in steps agrees with its own
/// verdict, unless 20 s are too short for a decision.
#[test]
fn simulations_say_the_same_on_both_sides() {
    let mut told = 0;
    for clocks in CLOCKS {
        for (times, stiffness, right) in Work::new(clocks, QUICK, &Unwatched).unwrap().scenes {
            let stepped = times.in_steps(MILLISECOND, Rounding::Up);
            if stepped.verdict(stiffness, Method::Reduced).unwrap() == Some(right) {
                continue;
            }
            for (times, stable) in [(times, right), (stepped, !right)] {
                let simulated = stability(&times.scene(stiffness).unwrap(), Model::Least, || true);
                let against = if stable { matches!(simulated, Stability::Unstable) } else { matches!(simulated, Stability::Stable) };
                assert!(!against, "{times:?} {stiffness}: {simulated:?}");
                told += u32::from(!matches!(simulated, Stability::Undecided { .. }));
            }
        }
    }
    assert!(told >= 4, "{told} simulations told");
}

#[test]
fn every_row_has_a_cost_and_an_error() {
    for row in rows(QUICK, &Unwatched).unwrap() {
        assert!(row.cost.is_some_and(|cost| cost.is_finite() && cost > 0.0), "{row:?}");
        assert!(row.error.is_some_and(|error| error.is_finite() && error >= 0.0), "{row:?}");
    }
}
