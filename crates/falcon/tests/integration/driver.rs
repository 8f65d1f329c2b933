//! Homing, lights, buttons, position, velocity, and a spring.

use core::f64::consts::TAU;
use core::time::Duration;

use cohaptic_falcon::driver::{DriverConfig, Phase};
use cohaptic_falcon::protocol::{Buttons, Leds};
use cohaptic_falcon::safety::Limits;
use cohaptic_falcon::simulator::{SimulatorConfig, StillHand, Waypoints};

use crate::common::{Bench, MILLISECOND, distance, in_device, running, seconds};

#[test]
fn a_hand_homes_the_device_and_switches_forces_on() {
    let mut bench = Bench::new(running(), Waypoints::homing(Duration::from_millis(500)), DriverConfig::DEFAULT);
    let mut phases = vec![];
    let mut lights = vec![];
    let simulator = bench.simulator.clone();
    bench
        .run(seconds(5.0), |_, status| {
            if phases.last() != Some(&status.phase) {
                phases.push(status.phase);
            }
            let leds = simulator.with(|device| device.leds());
            if lights.last() != Some(&leds) {
                lights.push(leds);
            }
            assert_eq!(status.reading.is_some(), matches!(status.phase, Phase::Homed | Phase::Active));
            Some([0.0, 0.0, 1.0])
        })
        .unwrap();
    assert_eq!(phases, [Phase::Silent, Phase::Homing, Phase::Homed, Phase::Active]);
    assert_eq!(lights, [Leds::OFF, Leds::RED, Leds::BLUE, Leds::GREEN]);
    assert_eq!(bench.unhomed_count(), 0);
    assert_eq!(bench.driver.statistics().timeouts, 0);
}

#[test]
fn nothing_is_homed_while_nobody_moves_it() {
    let mut bench = Bench::new(running(), StillHand, DriverConfig::DEFAULT);
    bench.run(seconds(1.0), |_, _| Some([4.0; 3])).unwrap();
    assert_eq!((bench.driver.status().phase, bench.driver.status().homed), (Phase::Homing, [false; 3]));
    assert_eq!((bench.unhomed_count(), bench.simulator.with(|device| device.observed().largest_count)), (0, 0));
}

#[test]
fn position_is_true_to_the_size_of_a_count() {
    // On a slow circle the only errors are the rounding of the encoders and a fraction of a millisecond of age at 20 mm/s.
    let mut bench = Bench::active(running(), [0.02, 0.015, -0.01], 0.2, DriverConfig::DEFAULT);
    let (mut worst, mut total, mut count) = (0.0_f64, 0.0, 0.0);
    let simulator = bench.simulator.clone();
    bench
        .run(seconds(5.0), |_, status| {
            let reading = status.reading.unwrap();
            let error = distance(in_device(reading.position), simulator.with(|device| device.position()));
            worst = worst.max(error);
            total += error;
            count += 1.0;
            None
        })
        .unwrap();
    // The rounding of half a count on three arms is at most √3/2 counts of at most 0.057 mm each. The report is at most two milliseconds old, at a speed of
    // at most 0.034 m/s.
    let bound = 0.87 * 0.057e-3 + 0.002 * TAU * 0.2 * distance([0.02, 0.015, -0.01], [0.0; 3]);
    assert!(worst < bound, "{worst} m, and {bound} m are allowed");
    assert!(total / count < 0.06e-3, "{} m on average", total / count);
}

#[test]
fn velocity_follows_a_sway_with_the_lag_that_is_stated() {
    let (amplitude, frequency) = (0.02, 1.0);
    let config = DriverConfig { velocity_bandwidth: 30.0, ..DriverConfig::DEFAULT };
    let mut bench = Bench::active(running(), [amplitude, 0.0, 0.0], frequency, config);
    let simulator = bench.simulator.clone();
    let mut worst = 0.0_f64;
    bench
        .run(seconds(2.0), |_, status| {
            let speed = status.reading.unwrap().velocity;
            worst = worst.max(distance(speed, simulator.with(|device| device.velocity())));
            None
        })
        .unwrap();
    // The bound adds 5.3 ms of the filter, 2 ms of age and half a millisecond of the difference at the largest acceleration, and a count of 0.05 mm on three
    // arms through the filter.
    let acceleration = amplitude * (TAU * frequency) * (TAU * frequency);
    let bound = 0.0078 * acceleration * 1.1 + 3.0_f64.sqrt() * 0.05 * 0.1718;
    assert!(worst < bound, "{worst} m/s, and {bound} m/s are allowed");
}

#[test]
fn buttons_arrive() {
    let mut bench = Bench::new(running(), StillHand, DriverConfig::DEFAULT);
    for bits in 0..16 {
        bench.simulator.with(|device| device.press(Buttons::from_bits(bits)));
        bench.run(5 * MILLISECOND, |_, _| None).unwrap();
        assert_eq!(bench.driver.status().buttons, Buttons::from_bits(bits));
    }
}

#[test]
fn a_spring_of_1000_newtons_per_metre_holds_the_grip() {
    let config = DriverConfig { limits: Limits { force: 8.0, ..Limits::DEFAULT }, ..DriverConfig::DEFAULT };
    let mut bench = Bench::active(running(), [0.0; 3], 0.0, config);
    // The hand lets go of the grip, and the spring takes over.
    bench.simulator.with(|device| device.set_hand(StillHand));
    let spring = |position: [f64; 3]| position.map(|part| -1000.0 * part);
    bench.run(seconds(0.5), |_, status| Some(spring(status.reading.unwrap().position))).unwrap();
    // A push of 3 N for a tenth of a second.
    bench.simulator.with(|device| device.set_hand(|_, _, _| [2.0, 1.0, -2.0]));
    let mut farthest = 0.0_f64;
    bench
        .run(seconds(0.1), |_, status| {
            farthest = farthest.max(distance(status.reading.unwrap().position, [0.0; 3]));
            Some(spring(status.reading.unwrap().position))
        })
        .unwrap();
    // The overshoot is at most twice the static deflection of 3 mm.
    assert!(farthest > 0.001 && farthest < 0.006, "{farthest}");
    bench.simulator.with(|device| device.set_hand(StillHand));
    bench.run(seconds(1.5), |_, status| Some(spring(status.reading.unwrap().position))).unwrap();
    let mut rest = 0.0_f64;
    bench
        .run(seconds(0.5), |_, status| {
            rest = rest.max(distance(status.reading.unwrap().position, [0.0; 3]));
            Some(spring(status.reading.unwrap().position))
        })
        .unwrap();
    assert_eq!(bench.driver.status().phase, Phase::Active);
    // Dry friction of 0.2 N holds the grip within 0.2 mm. The rest is the rounding of the encoders and the last oscillation.
    assert!(rest < 0.0006, "{rest}");
}

#[test]
fn force_is_what_was_asked_for_where_the_calibration_is_true() {
    for (gain, scale) in [(10_000.0, 1.0), (5_000.0, 2.0)] {
        let mut bench = Bench::active(SimulatorConfig { counts_per_newton_metre: gain, ..running() }, [0.0; 3], 0.0, DriverConfig::DEFAULT);
        for force in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.7, 0.7, -0.7]] {
            bench.run(seconds(0.3), |_, _| Some(force)).unwrap();
            let felt = bench.simulator.with(|device| device.motor_force());
            // Half a count of three motors is 0.5/10000 N·m each, at about 40 rad/m at most. The grip also moves within a millisecond.
            assert!(distance(felt, force.map(|part| part * scale)) < 0.01 * scale, "{felt:?} for {force:?} and {gain}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let run = || {
        let mut bench = Bench::active(running(), [0.02, 0.0, 0.01], 1.0, DriverConfig::DEFAULT);
        bench.run(seconds(0.5), |_, status| Some(status.reading.unwrap().position.map(|part| -200.0 * part))).unwrap();
        (*bench.driver.status(), *bench.driver.statistics())
    };
    assert_eq!(run(), run());
}
