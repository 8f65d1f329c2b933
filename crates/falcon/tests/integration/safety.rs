//! Promises of safety.

use cohaptic_device::ZeroCause as Cause;
use cohaptic_falcon::calibration::MOTOR_LIMIT;
use cohaptic_falcon::driver::{DriverConfig, Phase, Setpoint};
use cohaptic_falcon::protocol::Leds;
use cohaptic_falcon::safety::{Limits, ZeroCause};
use cohaptic_falcon::simulator::{Faults, SimulatorConfig, StillHand, Waypoints};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use core::time::Duration;
use proptest::prelude::*;

use crate::common::{Bench, MILLISECOND, distance, running, seconds};

fn active() -> Bench {
    Bench::active(running(), [0.0; 3], 0.0, DriverConfig::DEFAULT)
}

fn counts(bench: &Bench) -> [i16; 3] {
    bench.driver.status().motors.get()
}

#[test]
fn a_force_that_is_no_number_is_no_force() {
    let mut bench = active();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for axis in 0..3 {
            let mut force = [1.0; 3];
            force[axis] = bad;
            bench.run(20 * MILLISECOND, |_, _| Some([1.0; 3])).unwrap();
            assert!(counts(&bench) != [0; 3]);
            bench.run(MILLISECOND, |_, _| Some(force)).unwrap();
            assert_eq!(counts(&bench), [0; 3]);
        }
    }
    assert_eq!(bench.driver.statistics().zeroed_by(ZeroCause::Gate(Cause::NotFinite)), 9);
}

#[test]
fn a_force_that_nobody_renews_goes_to_zero() {
    let mut bench = active();
    bench.run(20 * MILLISECOND, |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    let old = Setpoint { force: [0.0, 1.0, 0.0], at: bench.driver.now() };
    let mut lasted = Duration::ZERO;
    while counts(&bench) != [0; 3] {
        bench.driver.exchange(Some(old)).unwrap();
        lasted = bench.driver.now() - old.at;
        assert!(lasted < seconds(0.06), "still there after {lasted:?}");
    }
    assert!(lasted > seconds(0.05));
    // No setpoint means zero force at once.
    bench.run(20 * MILLISECOND, |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    bench.run(MILLISECOND, |_, _| None).unwrap();
    assert_eq!(counts(&bench), [0; 3]);
    // A setpoint of the future is not fresh.
    bench.driver.exchange(Some(Setpoint { force: [1.0; 3], at: Instant::MAX })).unwrap();
    assert_eq!(counts(&bench), [0; 3]);
}

#[test]
fn a_loop_that_stands_still_begins_again_from_zero() {
    let mut bench = active();
    bench.run(20 * MILLISECOND, |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    let later = bench.driver.now() + seconds(0.5);
    bench.driver.sleep_until(later);
    let at = bench.driver.now();
    bench.driver.exchange(Some(Setpoint { force: [0.0, 1.0, 0.0], at })).unwrap();
    assert_eq!(counts(&bench), [0; 3]);
    // Meanwhile the device has switched its motors off by itself.
    assert_eq!(bench.simulator.with(|device| device.observed().torque_timeouts), 1);
    bench.run(20 * MILLISECOND, |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    assert!(counts(&bench) != [0; 3]);
}

#[test]
fn the_largest_force_and_its_fastest_change_are_kept() {
    let limits = Limits { force: 2.0, slew: 100.0, ..Limits::DEFAULT };
    let mut bench = Bench::active(running(), [0.0; 3], 0.0, DriverConfig { limits, ..DriverConfig::DEFAULT });
    let mut last = (bench.driver.now(), bench.driver.status().force);
    bench
        .run(seconds(1.0), |now, status| {
            let span = (now - last.0).as_secs_f64();
            assert!(distance(status.force, [0.0; 3]) <= 2.0 + 1e-12);
            // The force went out at some time within the last exchange and the present one, so twice the span bounds the change.
            assert!(distance(status.force, last.1) <= 100.0 * 2.0 * span + 1e-9);
            last = (now, status.force);
            // The wanted force alternates, far beyond the limits.
            let sign = if now.as_nanos() / 100_000_000 % 2 == 0 { 1.0 } else { -1.0 };
            Some([sign * 50.0, 0.0, 20.0])
        })
        .unwrap();
    assert!(bench.driver.statistics().limited > 500 && bench.driver.statistics().slewed > 100);
}

#[test]
fn motors_are_never_asked_for_more_than_they_have() {
    let limits = Limits { force: 20.0, ..Limits::DEFAULT };
    let mut bench = Bench::active(running(), [0.0; 3], 0.0, DriverConfig { limits, ..DriverConfig::DEFAULT });
    bench.run(seconds(0.5), |_, _| Some([20.0, -20.0, 20.0])).unwrap();
    let observed = bench.simulator.with(|device| *device.observed());
    assert_eq!((observed.largest_count, observed.saturated), (MOTOR_LIMIT.unsigned_abs(), 0));
    assert!(bench.driver.statistics().saturated > 100);
}

#[test]
fn stopping_is_told_several_times_and_is_for_good() {
    let mut bench = active();
    bench.run(20 * MILLISECOND, |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    bench.driver.stop();
    bench.driver.stop();
    assert_eq!(bench.driver.statistics().farewells, 5);
    let before = bench.driver.statistics().exchanges;
    bench.run(seconds(0.1), |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    assert_eq!((counts(&bench), bench.driver.status().phase), ([0; 3], Phase::Stopped));
    bench.simulator.with(|device| assert_eq!((device.motor_force(), device.leds()), ([0.0; 3], Leds::RED)));
    assert_eq!(bench.driver.statistics().zeroed_by(ZeroCause::Gate(Cause::Stopped)), bench.driver.statistics().exchanges - before);
}

#[test]
fn dropping_the_driver_stops_the_device() {
    let mut bench = active();
    bench.run(20 * MILLISECOND, |_, _| Some([0.0, 1.0, 0.0])).unwrap();
    assert!(bench.simulator.with(|device| device.motor_force()) != [0.0; 3]);
    let simulator = bench.simulator.clone();
    drop(bench);
    simulator.with(|device| {
        let now = device.now();
        device.advance(now + MILLISECOND);
        assert_eq!((device.motor_force(), device.leds()), ([0.0; 3], Leds::RED));
    });
}

#[test]
fn without_arming_forces_come_with_homing() {
    let config = DriverConfig { arm_beyond: None, ..DriverConfig::DEFAULT };
    let mut bench = Bench::new(running(), Waypoints::homing(Duration::ZERO), config);
    bench.run(seconds(1.5), |_, _| Some([0.0, 0.0, 0.5])).unwrap();
    assert_eq!(bench.driver.status().phase, Phase::Active);
    assert_eq!(bench.unhomed_count(), 0);
}

properties! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// No motor moves before homing, for any wanted force and on a very bad connection.
    #[test]
    fn no_force_before_homing(
        seed in any::<u64>(),
        force in (any::<f64>(), -100.0..100.0, -100.0..100.0),
        garble in 0.0..0.05,
        drop in 0.0..0.05,
        insert in 0.0..0.1,
        fragment in 0.0..0.5,
    ) {
        let faults = Faults { garble_to_host: garble, drop_to_host: drop, insert_to_host: insert, fragment, ..Faults::NONE };
        let config = DriverConfig { arm_beyond: None, longest_silence: seconds(60.0), ..DriverConfig::DEFAULT };
        let mut bench = Bench::new(SimulatorConfig { seed, faults, ..running() }, StillHand, config);
        bench.run(seconds(2.0), |_, _| Some(force.into())).unwrap();
        prop_assert_eq!(bench.unhomed_count(), 0);
        prop_assert_eq!(bench.simulator.with(|device| device.observed().largest_count), 0);
    }
}
