use rand_distr::{Distribution, Exp1, StandardNormal};

use super::*;
use crate::tests::TestRng;

/// Packets every 8 ms, with a delay of 20 ms and an exponential part of mean 3 ms, and some losses. `shift` is added to the delay, as a function of time \[s\].
fn measured(seed: u64, packets: u32, shift: impl Fn(f64) -> f64) -> Measurements {
    let mut rng = TestRng::new(seed);
    let packet = |number: u32| {
        let sent_s = 0.008 * f64::from(number);
        let more: f64 = Exp1.sample(&mut rng);
        let delay_s = (number % 17 != 5).then(|| 0.02 + 0.003 * more + shift(sent_s));
        Measurement { sent_s, delay_s }
    };
    Measurements::new((0..packets).map(packet).collect()).unwrap()
}

/// The least of 80 delays lies 3 ms/80 = 37 µs above the floor on average. A step of 2 ms is therefore clear, although the delays spread over 20 ms.
#[test]
fn a_step_is_found_where_it_is() {
    for (seed, at, by) in [(1, 30.0, 0.002), (2, 10.0, -0.015), (3, 50.0, 0.25), (4, 31.416, -1.0), (5, 20.0, -0.002)] {
        let steps = measured(seed, 8_000, |sent| if sent < at { 0.0 } else { by }).steps();
        assert_eq!(steps.len(), 1, "{at} {steps:?}");
        // The least of 400 delays on each side is known to 3 ms/400. The place is known to the few packets until the next clearly short delay.
        assert!((steps[0].by_s - by).abs() < 1e-4 && (steps[0].at_s - at).abs() < 0.1, "{at} {by} {steps:?}");
        assert!((f64::from(u32::try_from(steps[0].packet).unwrap()) * 0.008 - steps[0].at_s).abs() < 1e-9);
    }
}

#[test]
fn a_step_is_found_beside_a_drift_and_beside_another_step() {
    // A drift of 100 ppm, 6.4 ms in all.
    let steps = measured(6, 8_000, |sent| 1e-4 * sent + if sent < 40.0 { 0.0 } else { 0.05 }).steps();
    assert!(steps.len() == 1 && (steps[0].by_s - 0.05).abs() < 1e-3 && (steps[0].at_s - 40.0).abs() < 0.1, "{steps:?}");
    let twice = measured(7, 8_000, |sent| {
        if sent < 20.0 {
            0.0
        } else if sent < 45.0 {
            -0.01
        } else {
            -0.03
        }
    });
    let steps = twice.steps();
    assert!(steps.len() == 2 && (steps[0].by_s + 0.01).abs() < 1e-4 && (steps[1].by_s + 0.02).abs() < 1e-4, "{steps:?}");
    let part = twice.part(twice.longest_part(&steps));
    let ends = [part.packets()[0].sent_s, part.packets()[part.packets().len() - 1].sent_s];
    assert!((ends[0] - 20.0).abs() < 0.1 && (ends[1] - 45.0).abs() < 0.1, "{ends:?}");
}

#[test]
fn what_is_no_step_is_left_alone() {
    let seeds = || 10..40;
    assert!(seeds().all(|seed| measured(seed, 2_000, |_| 0.0).steps().is_empty()));
    assert!(seeds().all(|seed| measured(seed, 2_000, |sent| 2e-4 * sent).steps().is_empty()), "a drift");
    assert!(seeds().all(|seed| measured(seed, 2_000, |sent| 0.005 * (sent / 3.0).sin()).steps().is_empty()), "a wave");
    // A queue of 100 ms for a fifth of the time.
    assert!(seeds().all(|seed| measured(seed, 2_000, |sent| if (6.0..9.0).contains(&sent) { 0.1 } else { 0.0 }).steps().is_empty()), "a queue");
    // Delays with a memory of 8 ms to 16 s, the whole measurement: at most one measurement in a hundred has a step by chance.
    let remembers = |seed: u64, time: f64| {
        let mut rng = TestRng::new(seed);
        let mut z: f64 = StandardNormal.sample(&mut rng);
        let phi = (-0.008 / time).exp();
        let packet = |number: u32| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            z = phi * z + (1.0 - phi * phi).sqrt() * noise;
            Measurement { sent_s: 0.008 * f64::from(number), delay_s: Some(0.02 + 0.003 * z.exp()) }
        };
        Measurements::new((0..2_000).map(packet).collect()).unwrap().steps()
    };
    for time in [0.008, 0.1, 0.5, 2.0, 16.0] {
        let found = (0..200).filter(|seed| !remembers(*seed, time).is_empty()).count();
        assert!(found <= 2, "{time}: {found}");
    }
    assert!(measured(1, 150, |sent| if sent < 0.6 { 0.0 } else { 1.0 }).steps().is_empty(), "too few");
    let everything = measured(1, 150, |_| 0.0);
    assert_eq!(everything.part(everything.longest_part(&[])), everything);
}

/// A clock with steps of a fifth of a millisecond shows few different delays. A change of 5 µs among delays that spread over a millisecond does not matter.
#[test]
fn a_step_is_not_small_beside_the_spread_of_delays() {
    for (by, count) in [(5e-6, 0), (1e-3, 1)] {
        let packet = |number: u32| {
            let since = if number < 500 { 0.0 } else { by };
            Measurement { sent_s: 0.01 * f64::from(number), delay_s: Some(0.02 + 2e-4 * f64::from(number * 7 % 10) + since) }
        };
        assert_eq!(Measurements::new((0..1_000).map(packet).collect()).unwrap().steps().len(), count, "{by}");
    }
}

/// Equal delays have no spread. A step must then only exceed rounding.
#[test]
fn constant_delays_step_too() {
    let packet = |number: u32| Measurement { sent_s: 0.01 * f64::from(number), delay_s: Some(if number < 500 { 0.02 } else { 0.02 + 1e-6 }) };
    let steps = Measurements::new((0..1_000).map(packet).collect()).unwrap().steps();
    assert!(steps.len() == 1 && steps[0].packet == 500 && (steps[0].by_s - 1e-6).abs() < 1e-12, "{steps:?}");
}
