//! A Falcon as the device of a peer.

use core::time::Duration;

use cohaptic_device::{Device, Gate, GatedForce, Limits, Moment, Stopper};
use cohaptic_falcon::device::{Axes, Axis, DeviceConfig, Ended, FalconDevice, SteppedFalcon};
use cohaptic_falcon::driver::{DriverConfig, DriverError, Phase};
use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, StillHand, Waypoints};
use cohaptic_falcon::transport::TransportError;
use cohaptic_units::Instant;

use crate::common::{MILLISECOND, running, seconds};

fn homing() -> Simulator {
    Simulator::new(running(), Waypoints::homing(Duration::ZERO))
}

fn config<const A: usize>(axes: [Axis; A]) -> DeviceConfig<A> {
    DeviceConfig::new(Axes::new(axes).unwrap())
}

fn stepped<const A: usize>(axes: [Axis; A]) -> (SteppedFalcon<SimulatedTransport, A>, cohaptic_falcon::simulator::SharedSimulator) {
    let transport = SimulatedTransport::in_virtual_time(homing());
    let simulator = transport.simulator();
    let mut falcon = SteppedFalcon::start(transport, config(axes)).unwrap();
    assert!(falcon.wait(seconds(4.5)).unwrap().is_ready());
    (falcon, simulator)
}

/// Returns the wanted force on the hand \[N\] as an admitted force. The gate has admitted the same force long enough to leave the force unchanged.
fn admitted(force: [f64; 3]) -> GatedForce {
    let mut gate = Gate::new(Limits { force: 20.0, slew: 1e6, ..Limits::DEFAULT }, Stopper::default()).unwrap();
    let [_, second] = [0, 1].map(|millis| {
        let now = Instant::from_nanos(millis * 1_000_000);
        gate.admit(force, &Moment { now, ready: true, armed: true, reading_at: Some(now), setpoint_at: Some(now) }).force
    });
    assert_eq!(second.newtons(), force);
    second
}

/// Runs ticks of a loop, with the force on the hand as a function of the position.
fn ticks<const A: usize>(falcon: &mut SteppedFalcon<SimulatedTransport, A>, count: u64, force: impl Fn([f64; 3]) -> [f64; 3]) {
    for tick in 0..count {
        let now = Instant::from_nanos(tick * 1_000_000);
        let reading = falcon.read(now).unwrap_or_default();
        assert!(reading.position.into_iter().chain(reading.velocity).all(f64::is_finite));
        falcon.hold(now, MILLISECOND, admitted(force(reading.position)));
    }
}

fn position<const A: usize>(falcon: &mut SteppedFalcon<SimulatedTransport, A>) -> [f64; 3] {
    falcon.read(Instant::ZERO).unwrap().position
}

#[test]
fn the_grip_feels_the_held_force_along_the_axis_of_the_peer() {
    let (mut falcon, simulator) = stepped([Axis::Y]);
    ticks(&mut falcon, 200, |_| [-1.5, 9.0, 9.0]);
    simulator.with(|device| {
        let [x, y, z] = device.motor_force();
        assert!((y + 1.5).abs() < 0.01, "{y}");
        // The two unused axes are held in the middle, where the hand is too.
        assert!(x.abs() < 0.7 && z.abs() < 0.7, "{x} {z}");
    });
}

#[test]
fn axes_that_nobody_uses_are_held_in_the_middle() {
    let (mut falcon, simulator) = stepped([Axis::X]);
    simulator.with(|device| device.set_hand(|_, _, _| [0.0, 0.8, -0.8]));
    ticks(&mut falcon, 1500, |_| [0.0; 3]);
    simulator.with(|device| {
        let [_, y, z] = device.position();
        // A force of 0.8 N on 500 N/m gives 1.6 mm. Dry friction of 0.2 N may hold 0.4 mm of the way in either direction.
        assert!(((y - 0.0016).abs() < 0.0005) && ((z - 0.125 + 0.0016).abs() < 0.0005), "{y} {z}");
        device.set_hand(|_, _, _| [0.8, 0.0, 0.0]);
    });
    ticks(&mut falcon, 200, |_| [0.0; 3]);
    assert!(position(&mut falcon)[0] > 0.005, "the axis in use is free");
}

#[test]
fn two_falcons_meet_at_an_object() {
    let (mut left, left_device) = stepped([Axis::X, Axis::Z]);
    let (mut right, right_device) = stepped([Axis::X, Axis::Z]);
    // The hands are 20 mm apart, with a spring of 200 N/m between the grips.
    left_device.with(|device| device.set_hand(|_, place: [f64; 3], speed: [f64; 3]| hand([-0.01, 0.0, 0.125], place, speed)));
    right_device.with(|device| device.set_hand(|_, place: [f64; 3], speed: [f64; 3]| hand([0.01, 0.0, 0.125], place, speed)));
    for tick in 0..1500_u64 {
        let (a, b) = (position(&mut left), position(&mut right));
        let force = [0, 1, 2].map(|axis| 200.0 * (b[axis] - a[axis]));
        let now = Instant::from_nanos(tick * 1_000_000);
        left.hold(now, MILLISECOND, admitted(force));
        right.hold(now, MILLISECOND, admitted(force.map(|part| -part)));
    }
    // With two springs of 100 N/m at the hands and 200 N/m between the grips, ±10 mm become ±2 mm, except for 0.2 N of friction on 500 N/m.
    let (a, b) = (position(&mut left)[0], position(&mut right)[0]);
    assert!((a + 0.002).abs() < 0.0006 && (b - 0.002).abs() < 0.0006, "{a} {b}");
}

fn hand(to: [f64; 3], place: [f64; 3], speed: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| 100.0 * (to[axis] - place[axis]) - 5.0 * speed[axis])
}

#[test]
fn a_device_that_is_not_homed_has_no_reading_and_no_force() {
    let transport = SimulatedTransport::in_virtual_time(Simulator::new(running(), StillHand));
    let mut falcon = SteppedFalcon::start(transport, config([Axis::X, Axis::Y, Axis::Z])).unwrap();
    ticks(&mut falcon, 300, |_| [4.0; 3]);
    assert_eq!(falcon.read(Instant::ZERO), None);
    assert_eq!((falcon.snapshot().phase, falcon.snapshot().force), (Phase::Homing, [0.0; 3]));
}

#[test]
fn what_ends_the_driver_is_said_and_the_loop_goes_on() {
    let (mut falcon, simulator) = stepped([Axis::Z]);
    ticks(&mut falcon, 50, |_| [-0.5, 0.0, 0.0]);
    simulator.with(Simulator::unplug);
    ticks(&mut falcon, 50, |_| [-0.5, 0.0, 0.0]);
    assert_eq!(falcon.ended(), Some(&DriverError::Transport(TransportError::Unplugged)));
    assert_eq!(falcon.wait(seconds(0.1)).unwrap_err(), DriverError::Transport(TransportError::Unplugged));
    assert_eq!(falcon.read(Instant::ZERO), None);
}

/// Tests in real time, which assert only what a slow machine cannot change.
mod threaded {
    use super::*;

    /// Returns a device that becomes homed and active without a user.
    fn quick() -> (FalconDevice<1>, cohaptic_falcon::simulator::SharedSimulator) {
        // The hand sways across the index forever, so the device becomes homed however late the thread begins.
        let hand = Waypoints::new([(Duration::ZERO, [0.0, 0.0, 0.110])]).swaying([0.0, 0.0, 0.010], 2.0);
        let transport = SimulatedTransport::in_real_time(Simulator::new(running(), hand));
        let simulator = transport.simulator();
        let driver = DriverConfig { arm_beyond: None, longest_silence: seconds(60.0), ..DriverConfig::DEFAULT };
        let falcon = FalconDevice::start(transport, DeviceConfig { driver, ..config([Axis::Z]) }).unwrap();
        (falcon, simulator)
    }

    /// Waits until a condition holds.
    fn until(mut is_so: impl FnMut() -> bool) {
        while !is_so() {
            std::thread::park_timeout(MILLISECOND);
        }
    }

    /// Asks for a force along z until the device gives the force.
    fn push(falcon: &mut FalconDevice<1>) {
        until(|| {
            falcon.hold(Instant::ZERO, MILLISECOND, admitted([1.0, 0.0, 0.0]));
            falcon.snapshot().is_some_and(|snapshot| snapshot.force[2] > 0.9)
        });
    }

    #[test]
    fn a_thread_drives_the_device_and_stops_it() {
        let (mut falcon, simulator) = quick();
        assert_eq!((falcon.description().name.as_str(), falcon.description().motions, falcon.description().force), ("falcon", 1, 4.0));
        until(|| falcon.snapshot().is_some_and(|snapshot| snapshot.is_ready()));
        assert!(falcon.read(Instant::ZERO).is_some());
        // Force goes out while the session renews it.
        push(&mut falcon);
        assert_eq!(falcon.ended(), None);
        assert_eq!(falcon.stop_and_wait(), Some(Ended::Stopped));
        let last = falcon.snapshot().unwrap();
        assert_eq!((last.phase, last.force, last.statistics.farewells), (Phase::Stopped, [0.0; 3], 5));
        assert_eq!(simulator.with(|device| device.observed().largest_count_unhomed), 0);
        // Calls of a session after the stop have no effect, and a second stop neither.
        falcon.hold(Instant::ZERO, MILLISECOND, admitted([1.0, 0.0, 0.0]));
        falcon.stop();
        assert_eq!(falcon.read(Instant::ZERO), None);
        assert_eq!(falcon.stop_and_wait(), Some(Ended::Stopped));
    }

    #[test]
    fn a_session_that_stops_calling_ends_force() {
        let (mut falcon, _simulator) = quick();
        push(&mut falcon);
        until(|| falcon.snapshot().is_some_and(|snapshot| snapshot.force == [0.0; 3]));
        assert_eq!(falcon.ended(), None);
    }

    /// A panic of the session's thread drops the device.
    #[test]
    fn a_panic_beside_the_device_stops_it() {
        let (mut falcon, simulator) = quick();
        push(&mut falcon);
        let stopper = falcon.stopper();
        let panicked = std::thread::spawn(move || {
            let _falcon = falcon;
            panic!("in the loop");
        });
        assert!(panicked.join().is_err() && stopper.is_stopped());
        simulator.with(|device| assert_eq!(device.motor_force(), [0.0; 3]));
    }

    #[test]
    fn unplugging_ends_the_thread_and_is_said() {
        let (falcon, simulator) = quick();
        until(|| falcon.snapshot().is_some());
        simulator.with(Simulator::unplug);
        until(|| falcon.ended().is_some());
        assert_eq!(falcon.ended(), Some(Ended::Failed(DriverError::Transport(TransportError::Unplugged))));
        assert_eq!(falcon.snapshot().map(|snapshot| snapshot.force), Some([0.0; 3]));
    }

    #[test]
    fn somebody_else_can_stop_it() {
        let (falcon, _simulator) = quick();
        let stopper = falcon.stopper();
        std::thread::spawn(move || stopper.stop()).join().unwrap();
        until(|| falcon.ended().is_some());
        assert_eq!(falcon.ended(), Some(Ended::Stopped));
    }

    #[test]
    fn a_configuration_that_makes_no_sense_starts_nothing() {
        let transport = || SimulatedTransport::in_real_time(Simulator::new(SimulatorConfig::default(), StillHand));
        let bad = DeviceConfig { period: Duration::ZERO, ..config([Axis::X]) };
        assert!(FalconDevice::start(transport(), bad).unwrap_err().to_string().contains("period"));
        let bad = DeviceConfig { driver: DriverConfig { velocity_bandwidth: f64::NAN, ..DriverConfig::DEFAULT }, ..config([Axis::X]) };
        assert!(FalconDevice::start(transport(), bad).unwrap_err().to_string().contains("bandwidth"));
    }
}

#[test]
fn a_device_may_be_handed_to_another_thread() {
    fn sent<D: Device>() {}
    sent::<FalconDevice<1>>();
    sent::<SteppedFalcon<SimulatedTransport, 1>>();
}
