//! Tests of the laws against closed forms, with a perfect arm and perfect coordination: the object is where the hand wants it, some ticks later.

use std::f64::consts::{LN_2, PI};
use std::time::Duration;

use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::{MovesConfig, Operator, OperatorConfig, OperatorLaw, Seen, View};

fn millis(count: u64) -> Duration {
    Duration::from_millis(count)
}

fn person(law: OperatorLaw, visual_delay: Duration) -> OperatorConfig {
    OperatorConfig { sees: Seen::Own, visual_delay, law }
}

/// Movements of 250 ms without noise, limits and learning.
const PLAIN: MovesConfig = MovesConfig {
    reaction: Duration::from_millis(250),
    duration: Duration::from_millis(250),
    speed: None,
    step: None,
    noise: 0.0,
    learns: 0.0,
    expects: None,
};

fn index(count: u64) -> usize {
    usize::try_from(count).unwrap()
}

/// Returns a uniform number of the generator splitmix64 (Steele, Lea & Flood 2014), which the tests alone use.
fn unit(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut word = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((word ^ (word >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
}

fn normal(state: &mut u64) -> f64 {
    (-2.0 * (1.0 - unit(state)).ln()).sqrt() * (2.0 * PI * unit(state)).cos()
}

/// Number of movements until the object is within the radius of 1 m of a target at a distance \[m\].
fn movements(distance: f64, noise: f64, state: &mut u64) -> u64 {
    // One tick is a whole movement, and the result is seen at once: the numbers of movements do not depend on times.
    let config = person(OperatorLaw::Moves(MovesConfig { reaction: Duration::ZERO, noise, ..PLAIN }), Duration::ZERO);
    let mut operator = Operator::<1>::new(&config, millis(250), Duration::ZERO, [0.0]);
    let (mut count, mut position) = (0, [0.0]);
    while (distance - position[0]).abs() > 1.0 {
        let view = View { position, target: [distance], radius: 1.0 };
        position = operator
            .tick(&view, |number| {
                assert_eq!(number, count);
                count += 1;
                [normal(state)]
            })
            .position;
    }
    count
}

/// Fitts's law: with a noise c of each movement the error is multiplied by c·z, so the number of movements grows as the logarithm of distance over radius. The
/// renewal theorem gives ln 2/(ln(1/c) − E ln|z|) a bit, E ln|z| = −(γ + ln 2)/2; the numbers for small distances come from the integral equation of the
/// number of factors, solved by another program.
#[test]
fn the_number_of_movements_follows_fitts() {
    let mut state = 1;
    // Mean number and its standard error.
    let mut mean = |distance: f64, runs: u32| {
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..runs {
            let count = movements(distance, 0.1, &mut state) as f64;
            sum += count;
            squares += count * count;
        }
        let mean = sum / f64::from(runs);
        (mean, ((squares / f64::from(runs) - mean * mean).max(0.0) / f64::from(runs)).sqrt())
    };
    for (distance, expected) in [(2.0, 1.000_001), (8.0, 1.211_300), (32.0, 1.771_725), (128.0, 2.216_938)] {
        let (found, error) = mean(distance, 400_000);
        // Five standard errors, and a unit of the last digit of the expected number.
        assert!((found - expected).abs() < 5.0 * error + 1e-6, "{distance}: {found} within {error}, expected {expected}");
        assert!(error < 0.002);
    }
    let ((near, error), (far, other)) = (mean(2f64.powi(20), 100_000), mean(2f64.powi(40), 100_000));
    let slope = (far - near) / 20.0;
    let expected = LN_2 / (10f64.ln() + 0.5 * (0.577_215_664_901_532_9 + LN_2));
    assert!((expected - 0.2359).abs() < 5e-5);
    assert!((slope - expected).abs() < 5.0 * (error.hypot(other)) / 20.0, "{slope}, expected {expected}");
}

/// Width and distance of the sixteen targets of Fitts (1954), in any unit, and the time of his people with the light stylus \[s\].
const TAPPING: [(f64, f64, f64); 16] = [
    (2.0, 2.0, 0.180),
    (1.0, 2.0, 0.212),
    (0.5, 2.0, 0.281),
    (0.25, 2.0, 0.392),
    (2.0, 4.0, 0.203),
    (1.0, 4.0, 0.260),
    (0.5, 4.0, 0.372),
    (0.25, 4.0, 0.484),
    (2.0, 8.0, 0.279),
    (1.0, 8.0, 0.357),
    (0.5, 8.0, 0.469),
    (0.25, 8.0, 0.580),
    (2.0, 16.0, 0.388),
    (1.0, 16.0, 0.481),
    (0.5, 16.0, 0.595),
    (0.25, 16.0, 0.731),
];

/// Slope of the least squares line through the times over the index of difficulty log₂(2A/W) [ms a bit]. N movements take N·T + (N − 1)·τ. The people of Fitts
/// had 94.7 ms a bit.
#[test]
fn a_bit_of_difficulty_costs_a_tenth_more_than_with_people() {
    let difficulty = |(width, distance, _): &(f64, f64, f64)| (2.0 * distance / width).log2();
    let mean = TAPPING.iter().map(difficulty).sum::<f64>() / 16.0;
    let slope = |time: &mut dyn FnMut(&(f64, f64, f64)) -> f64| {
        let (mut products, mut squares) = (0.0, 0.0);
        for target in &TAPPING {
            let apart = difficulty(target) - mean;
            products += apart * time(target);
            squares += apart * apart;
        }
        1e3 * products / squares
    };
    assert!((slope(&mut |(_, _, people)| *people) - 94.7).abs() < 0.05);
    let (mut state, runs) = (7, 100_000_u32);
    let found = slope(&mut |(width, distance, _)| {
        let count: u64 = (0..runs).map(|_| movements(2.0 * distance / width, 0.1, &mut state)).sum();
        0.45 * (count as f64 / f64::from(runs)) - 0.2
    });
    // A number of movements has a standard deviation below 1, so a mean time one below 1.5 ms, and the squares of the index sum to 40: below 0.25 ms a bit.
    assert!((found - 103.5).abs() < 0.5, "{found}");
}

/// Steering law (Accot & Zhai 1997): along a lane of the width w, a person aims w/(4c) ahead and needs (T + τ)·4c/w for a length. The mean difference of the
/// times for two lengths is that of a renewal process, without the movements at both ends.
#[test]
fn the_time_along_a_lane_follows_its_length_over_its_width() {
    let (noise, width, tick, runs) = (0.1, 0.02, millis(10), 2_000_u32);
    let ahead = width / (4.0 * noise);
    let mut state = 3;
    // Differences of the ticks at which 0.2 and 1.2 m are passed.
    let mut between = || {
        let config = person(OperatorLaw::Moves(MovesConfig { noise, ..PLAIN }), millis(200));
        let mut operator = Operator::<1>::new(&config, tick, Duration::ZERO, [0.0]);
        let (mut position, mut passed) = ([0.0], [0_u32; 2]);
        while position[0] < 1.2 {
            let view = View { position, target: [position[0] + ahead], radius: 0.0 };
            position = operator.tick(&view, |_| [normal(&mut state)]).position;
            passed = [passed[0] + u32::from(position[0] < 0.2), passed[1] + 1];
        }
        f64::from(passed[1] - passed[0])
    };
    let ticks: Vec<f64> = (0..runs).map(|_| between()).collect();
    let mean = ticks.iter().sum::<f64>() / f64::from(runs);
    let error = (ticks.iter().map(|ticks| (ticks - mean).powi(2)).sum::<f64>()).sqrt() / f64::from(runs);
    let expected = 4.0 * noise * 0.45 * 1.0 / width / 0.01;
    assert!((mean - expected).abs() < 5.0 * error && error < 2.0, "{mean} ± {error}, expected {expected}");
}

/// A hand whose object follows with a delay of some ticks. Returns the wanted positions of some ticks, beginning with the first.
fn follow(operator: &mut Operator<1>, delay: usize, ticks: usize, target: impl Fn(usize) -> f64, radius: f64) -> Vec<f64> {
    let mut wanted: Vec<f64> = Vec::new();
    for tick in 0..ticks {
        // The wanted position of a tick is reached within the tick.
        let position = if tick > delay { wanted[tick - 1 - delay] } else { 0.0 };
        let view = View { position: [position], target: [target(tick)], radius };
        wanted.push(operator.tick(&view, |_| unreachable!("without noise nothing is drawn")).position[0]);
    }
    wanted
}

properties! {
    /// A person who waits for the delay pays the delay with each correction, but not with the first movement: N·T + (N − 1)·(τ + D) (as Ferrell 1965).
    #[test]
    fn each_correction_costs_the_delay(count in 1_u64..6, duration in 2_u64..40, visual in 0_u64..40, delay in 0_u64..60, reaction in 0_u64..50) {
        let config = MovesConfig { reaction: millis(reaction), duration: millis(duration), step: Some(1.0), ..PLAIN };
        let tick = millis(1);
        let mut operator = Operator::<1>::new(&person(OperatorLaw::Moves(config), millis(visual)), tick, millis(delay + 1), [0.0]);
        let distance = count as f64;
        let wanted = follow(&mut operator, index(delay), 2000, |_| distance, 1e-6);
        // A place that was wanted over a tick is seen one tick later, and then as much later as the object lags.
        let expected = reaction + count * duration + (count - 1) * (visual + delay + 1);
        let first = wanted.iter().position(|wanted| (wanted - distance).abs() < 1e-9).unwrap();
        prop_assert_eq!(first as u64, expected);
        prop_assert!(wanted[first..].iter().all(|wanted| (wanted - distance).abs() < 1e-9), "no movement follows");
    }

    /// A peak of the speed above the limit makes the movement last longer: 1.875·|a|/T is the peak of a minimum jerk.
    #[test]
    fn no_movement_is_faster_than_its_limit(distance in 0.01_f64..2.0, speed in 0.05_f64..5.0) {
        let config = MovesConfig { reaction: Duration::ZERO, speed: Some(speed), ..PLAIN };
        let mut operator = Operator::<1>::new(&person(OperatorLaw::Moves(config), Duration::ZERO), millis(1), Duration::ZERO, [0.0]);
        let view = View { position: [0.0], target: [distance], radius: 1e-3 };
        let least = 250.0_f64 * (1.875 * distance / (speed * 0.25)).max(1.0);
        let ticks = (1_u32..).find(|ticks| f64::from(*ticks) >= least).map_or(0, |ticks| index(u64::from(ticks)));
        let wanted: Vec<_> = (0..=ticks).map(|_| operator.tick(&view, |_| [0.0])).collect();
        let peak = wanted.iter().map(|wanted| wanted.velocity[0]).fold(0.0, f64::max);
        prop_assert!(peak <= speed * (1.0 + 1e-12) && (peak >= 0.99 * speed || ticks == 250), "{} of {}", peak, speed);
        prop_assert!((wanted[ticks].position[0] - distance).abs() < 1e-12 && wanted[ticks].velocity[0].abs() < 1e-12);
        prop_assert!(wanted[ticks - 1].position[0] < distance);
    }
}

/// A person who does not wait corrects an error that the next two movements have corrected already: e⁺ = e − e⁻⁻. The errors of movements grow by |x| = 1.1510
/// each, where x³ = x² − 1, if the delay is at least 2T + τ and at most 2·(T + τ).
#[test]
fn who_does_not_wait_overshoots_more_and_more() {
    let (duration, visual) = (20, 30);
    let period = duration + visual;
    let config = MovesConfig { reaction: Duration::ZERO, duration: millis(duration), ..PLAIN };
    for delay in [2 * duration + visual, 2 * period - 1] {
        let mut operator = Operator::<1>::new(&person(OperatorLaw::Moves(config.clone()), millis(visual)), millis(1), Duration::ZERO, [0.0]);
        let movements = 60;
        // The target moves once, after three movements of 1 m, so that no error is zero and no movement is left out.
        let target = |tick: usize| if tick < 110 { 1.0 } else { 1.7 };
        let wanted = follow(&mut operator, index(delay), index(period * (movements + 1)), target, 0.0);
        // Error of the hand before each movement. The first two movements see nothing of the first.
        let errors: Vec<f64> = (0..movements).map(|number| 1.7 - wanted[index(number * period)]).collect();
        for place in 3..errors.len() - 1 {
            assert!(
                (errors[place + 1] - (errors[place] - errors[place - 2])).abs() < 1e-6 * errors[place].abs().max(1.0),
                "{delay}: {place} of {errors:?}"
            );
        }
        // Of x³ − x² + 1 the pair of complex roots has the modulus 1/√r, where −r is the real root. A sequence of that pair alone has products e·e⁺⁺ − e⁺·e⁺
        // that grow by the square of the modulus; the third root has died out.
        let product = |place: usize| errors[place] * errors[place + 2] - errors[place + 1] * errors[place + 1];
        let growth = (product(51) / product(50)).sqrt();
        assert!((growth - 1.1510).abs() < 5e-5, "{delay}: {growth}");
    }
    let root = 0.754_877_666_246_692_8_f64;
    assert!((root.powi(3) + root.powi(2) - 1.0).abs() < 1e-15 && (root.recip().sqrt() - 1.1510).abs() < 5e-5);
}

/// A copy at the edge of the radius is at the target.
#[test]
fn nobody_moves_from_the_edge_of_the_target() {
    let ends = |radius: f64| {
        let config = MovesConfig { reaction: Duration::ZERO, ..PLAIN };
        let mut operator = Operator::<1>::new(&person(OperatorLaw::Moves(config), Duration::ZERO), millis(1), Duration::ZERO, [0.0]);
        (0..=250).map(|_| operator.tick(&View { position: [0.0], target: [0.5], radius }, |_| [0.0]).position[0]).fold(0.0, f64::max)
    };
    assert_eq!((ends(0.5), ends(0.499)), (0.0, 0.5));
}

/// A person of whom nothing comes through waits for the reaction time, plans again, and does not believe in a smaller gain.
#[test]
fn a_person_is_surprised_once_a_movement() {
    let config = MovesConfig { reaction: millis(30), duration: millis(10), learns: 0.2, ..PLAIN };
    let mut operator = Operator::<1>::new(&person(OperatorLaw::Moves(config), millis(20)), millis(1), Duration::ZERO, [0.0]);
    let view = View { position: [0.0], target: [1.0], radius: 0.1 };
    let ends: Vec<f64> = (0..200).map(|_| operator.tick(&view, |_| [0.0]).position[0]).collect();
    // From 30 to 40, a look at 60, a plan at 90; and so on every 60 ticks. Each movement wants the whole way again.
    for (tick, expected) in [(29, 0.0), (40, 1.0), (89, 1.0), (100, 2.0), (149, 2.0), (160, 3.0)] {
        assert!((ends[tick] - expected).abs() < 1e-12, "{tick}: {}", ends[tick]);
    }
}

/// The estimated gain of 1 comes 1/5 nearer to what was seen with each movement, down to 0.1 and up to 1.2, and the next movement is longer by its inverse.
#[test]
fn a_person_learns_the_gain() {
    let config = MovesConfig { reaction: Duration::ZERO, duration: millis(10), learns: 0.2, ..PLAIN };
    let mut operator = Operator::<1>::new(&person(OperatorLaw::Moves(config), Duration::ZERO), millis(1), Duration::ZERO, [0.0]);
    let (mut gain, mut object, mut hand) = (1.0, 0.0, 0.0);
    for movement in 0..4 {
        let expected = hand + (1.0 - object) / gain;
        for _ in 0..=10 {
            let wanted = operator.tick(&View { position: [object], target: [1.0], radius: 1e-6 }, |_| [0.0]).position[0];
            // The object moves by 0.7 of the hand, and shows its way only at the end.
            if (wanted - expected).abs() < 1e-12 {
                object += 0.7 * (expected - hand);
                hand = expected;
                break;
            }
        }
        assert!((hand - expected).abs() < 1e-12, "movement {movement}");
        gain += 0.2 * (0.7 - gain);
    }
}

const SINES: [(f64, f64); 5] = [(0.020, 0.1), (0.015, 0.17), (0.010, 0.29), (0.006, 0.43), (0.004, 0.61)];

fn target(tick: usize) -> f64 {
    SINES.iter().map(|(amplitude, frequency)| amplitude * (2.0 * PI * frequency * tick as f64 * 1e-3).sin()).sum()
}

/// Root mean square of the error over a common period of the sines, 100 s, from the transfer functions of hand and delay at each of their frequencies.
#[test]
fn crossover_has_the_error_of_its_transfer_function() {
    let periods = 100_000;
    for (delay, expected) in [(0, 8.659_958e-3), (100, 8.785_722e-3)] {
        let mut operator = Operator::<1>::new(&person(OperatorLaw::Crossover { frequency: 3.0 }, millis(200)), millis(1), Duration::ZERO, [0.0]);
        let mut wanted = vec![0.0];
        let mut squares = 0.0;
        for tick in 0..2 * periods {
            let position = if tick >= delay { wanted[tick - delay] } else { 0.0 };
            let next = operator.tick(&View { position: [position], target: [target(tick)], radius: 0.0 }, |_| unreachable!());
            assert!((next.position[0] - wanted[tick]).abs() < 1e-15, "the wanted position of a tick follows from the ticks before");
            wanted.push(next.position[0] + 1e-3 * next.velocity[0]);
            // The first period lets the transient die out, by a factor of e^(-100).
            if tick >= periods {
                squares += (target(tick) - wanted[tick]).powi(2);
            }
        }
        let found = (squares / periods as f64).sqrt();
        assert!((found - expected).abs() < 5e-10, "{delay}: {found}");
    }
    let alone = SINES.iter().map(|(amplitude, _)| 0.5 * amplitude * amplitude).sum::<f64>().sqrt();
    assert!((alone - 19.710_403e-3).abs() < 5e-10);
}

/// x(k + 1) = x(k) − hω·x(k − m) is stable below hω = 2·sin(π/(2·(2m + 1))).
#[test]
fn crossover_is_unstable_above_its_bound() {
    let bound = 2e3 * (PI / (2.0 * 401.0)).sin();
    assert!((bound - 7.834_376).abs() < 5e-7);
    for (factor, grows) in [(0.999, false), (1.001, true)] {
        let law = OperatorLaw::Crossover { frequency: factor * bound };
        let mut operator = Operator::<1>::new(&person(law, millis(200)), millis(1), Duration::ZERO, [0.0]);
        let mut wanted = vec![0.0];
        for tick in 0..200_000 {
            let target = if tick < 400 { 1.0 } else { 0.0 };
            let next = operator.tick(&View { position: [wanted[tick]], target: [target], radius: 0.0 }, |_| unreachable!());
            wanted.push(next.position[0] + 1e-3 * next.velocity[0]);
        }
        let envelope = |from: usize| wanted[from..from + 2000].iter().fold(0.0_f64, |largest, wanted| largest.max(wanted.abs()));
        assert_eq!(envelope(190_000) > envelope(100_000), grows, "{factor}");
    }
}

/// A person who tracks is known by the wanted position and by what is seen and not yet used. Delays of no tick and of several.
#[test]
fn a_person_who_remembers_the_same_goes_on_alike() {
    for delay in [0, 1, 5] {
        let config = person(OperatorLaw::Crossover { frequency: 3.0 }, millis(delay));
        let seen = |tick: u32| View { position: [0.01 * f64::from(tick * tick)], target: [0.2 - 0.03 * f64::from(tick)], radius: 0.0 };
        let new = |place: f64| Operator::<1>::new(&config, millis(1), Duration::ZERO, [place]);
        let (mut one, mut other) = (new(0.0), new(7.0));
        (0..8).for_each(|tick| _ = one.tick(&seen(tick), |_| [0.0]));
        let (position, views) = one.tracking().unwrap();
        let views: Vec<View<1>> = views.copied().collect();
        // Newest first: the view of tick 7 has waited least.
        assert_eq!(views, (0..delay).map(|age| seen(7 - u32::try_from(age).unwrap())).collect::<Vec<_>>());
        other.set_tracking(position, views.into_iter());
        for tick in 8..20 {
            assert_eq!(one.tick(&seen(tick), |_| [0.0]), other.tick(&seen(tick), |_| [0.0]), "{delay} ticks, at tick {tick}");
        }
    }
    let mut moving = Operator::<1>::new(&person(OperatorLaw::Moves(PLAIN), millis(1)), millis(1), Duration::ZERO, [0.0]);
    moving.set_tracking([1.0], std::iter::empty());
    assert!(moving.tracking().is_none());
    assert_eq!(moving.tick(&View { position: [0.0], target: [0.0], radius: 1.0 }, |_| [0.0]).position, [0.0]);
}
