//! A Falcon as the device of a peer.

use core::time::Duration;

use cohaptic_falcon::device::{Axes, Axis, DeviceConfig, Ended, FalconDevice, SteppedFalcon};
use cohaptic_falcon::driver::{DriverConfig, DriverError, Phase};
use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, StillHand, Waypoints};
use cohaptic_falcon::transport::TransportError;
use cohaptic_peer::Device;
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

fn ticks<const A: usize>(falcon: &mut SteppedFalcon<SimulatedTransport, A>, count: u64, mut force: impl FnMut([f64; A]) -> [f64; A]) {
    for tick in 0..count {
        let state = falcon.state();
        assert!(state.is_finite());
        falcon.advance(Instant::from_nanos(tick * 1_000_000), MILLISECOND, force(state.position));
    }
}

#[test]
fn the_grip_feels_the_coupling_force_with_the_opposite_sign() {
    let (mut falcon, simulator) = stepped([Axis::Y]);
    ticks(&mut falcon, 200, |_| [1.5]);
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
    ticks(&mut falcon, 1500, |_| [0.0]);
    simulator.with(|device| {
        let [_, y, z] = device.position();
        // A force of 0.8 N on 500 N/m gives 1.6 mm. Dry friction of 0.2 N may hold 0.4 mm of the way in either direction.
        assert!(((y - 0.0016).abs() < 0.0005) && ((z - 0.125 + 0.0016).abs() < 0.0005), "{y} {z}");
        device.set_hand(|_, _, _| [0.8, 0.0, 0.0]);
    });
    ticks(&mut falcon, 200, |_| [0.0]);
    assert!(falcon.state().position[0] > 0.005, "the axis in use is free");
}

#[test]
fn two_falcons_meet_at_an_object() {
    let (mut left, left_device) = stepped([Axis::X, Axis::Z]);
    let (mut right, right_device) = stepped([Axis::X, Axis::Z]);
    // The hands are 20 mm apart, with a spring of 200 N/m between the grips.
    left_device.with(|device| device.set_hand(|_, place: [f64; 3], speed: [f64; 3]| hand([-0.01, 0.0, 0.125], place, speed)));
    right_device.with(|device| device.set_hand(|_, place: [f64; 3], speed: [f64; 3]| hand([0.01, 0.0, 0.125], place, speed)));
    for tick in 0..1500_u64 {
        let (a, b) = (left.state(), right.state());
        let force = [0, 1].map(|axis| 200.0 * (a.position[axis] - b.position[axis]));
        let now = Instant::from_nanos(tick * 1_000_000);
        left.advance(now, MILLISECOND, force);
        right.advance(now, MILLISECOND, force.map(|part| -part));
    }
    // With two springs of 100 N/m at the hands and 200 N/m between the grips, ±10 mm become ±2 mm, except for 0.2 N of friction on 500 N/m.
    let (a, b) = (left.state().position[0], right.state().position[0]);
    assert!((a + 0.002).abs() < 0.0006 && (b - 0.002).abs() < 0.0006, "{a} {b}");
}

fn hand(to: [f64; 3], place: [f64; 3], speed: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| 100.0 * (to[axis] - place[axis]) - 5.0 * speed[axis])
}

#[test]
fn a_device_that_is_not_homed_rests_at_the_origin() {
    let transport = SimulatedTransport::in_virtual_time(Simulator::new(running(), StillHand));
    let mut falcon = SteppedFalcon::start(transport, config([Axis::X, Axis::Y, Axis::Z])).unwrap();
    ticks(&mut falcon, 300, |position| {
        assert_eq!(position, [0.0; 3]);
        [4.0; 3]
    });
    assert_eq!((falcon.snapshot().phase, falcon.snapshot().force), (Phase::Homing, [0.0; 3]));
}

#[test]
fn what_ends_the_driver_is_said_and_the_peer_goes_on() {
    let (mut falcon, simulator) = stepped([Axis::Z]);
    ticks(&mut falcon, 50, |_| [0.5]);
    simulator.with(Simulator::unplug);
    ticks(&mut falcon, 50, |_| [0.5]);
    assert_eq!(falcon.ended(), Some(&DriverError::Transport(TransportError::Unplugged)));
    assert_eq!(falcon.wait(seconds(0.1)).unwrap_err(), DriverError::Transport(TransportError::Unplugged));
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

    #[test]
    fn a_thread_drives_the_device_and_stops_it() {
        let (mut falcon, simulator) = quick();
        until(|| falcon.snapshot().is_some_and(|snapshot| snapshot.is_ready()));
        // The state is latched: the thread goes on, and the state stays the same until the next `advance`.
        falcon.advance(Instant::ZERO, MILLISECOND, [0.0]);
        let state = falcon.state();
        let turns = falcon.snapshot().unwrap().timing.turns;
        until(|| falcon.snapshot().is_some_and(|snapshot| snapshot.timing.turns > turns + 20));
        assert_eq!(falcon.state(), state);
        // Force goes out while the peer renews it.
        until(|| {
            falcon.advance(Instant::ZERO, MILLISECOND, [-1.0]);
            falcon.snapshot().is_some_and(|snapshot| snapshot.force[2] > 0.9)
        });
        assert_eq!(falcon.ended(), None);
        assert_eq!(falcon.stop(), Some(Ended::Stopped));
        let last = falcon.snapshot().unwrap();
        assert_eq!((last.phase, last.force, last.statistics.farewells), (Phase::Stopped, [0.0; 3], 5));
        assert_eq!(simulator.with(|device| device.observed().largest_count_unhomed), 0);
        // Calls of a peer after the stop have no effect.
        falcon.advance(Instant::ZERO, MILLISECOND, [-1.0]);
        assert!(falcon.state().is_finite());
    }

    #[test]
    fn a_peer_that_stops_calling_ends_force() {
        let (mut falcon, _simulator) = quick();
        until(|| {
            falcon.advance(Instant::ZERO, MILLISECOND, [-1.0]);
            falcon.snapshot().is_some_and(|snapshot| snapshot.force[2] > 0.9)
        });
        until(|| falcon.snapshot().is_some_and(|snapshot| snapshot.force == [0.0; 3]));
        assert_eq!(falcon.ended(), None);
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
    fn sent<D: Device<1> + Send>() {}
    sent::<FalconDevice<1>>();
    sent::<SteppedFalcon<SimulatedTransport, 1>>();
}
