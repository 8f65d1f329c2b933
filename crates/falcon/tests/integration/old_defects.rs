//! Defects of existing drivers, each shown to be absent in this driver.

use cohaptic_falcon::driver::{Driver, DriverConfig, Phase};
use cohaptic_falcon::kinematics::{Jacobian, angle_of_count, forward_from, inverse};
use cohaptic_falcon::protocol::{Framer, Report};
use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, StillHand};

use crate::common::{Bench, distance, running, seconds};

/// libnifalcon, issue 66: force along z is 13 to 37 % too strong, and 16 % of the force is sideways at 30 mm off the axis.
#[test]
fn a_force_along_z_is_along_z_and_as_strong_as_asked() {
    for z in [0.09, 0.11, 0.125, 0.14, 0.16] {
        for x in [0.0, 0.03] {
            let place = [x, 0.0, z];
            // The force of the torques follows from work: F·dp = τ·dθ for three small motions, with angles from inverse kinematics alone.
            let torques = Jacobian::at(place).unwrap().torques([0.0, 0.0, 1.0]).unwrap();
            let step = 1e-6;
            let force = [0, 1, 2].map(|axis| {
                let mut ends = [place; 2];
                ends[0][axis] -= step;
                ends[1][axis] += step;
                let [before, after] = ends.map(|end| inverse(end).unwrap());
                (0..3).map(|arm| torques[arm] * (after[arm] - before[arm])).sum::<f64>() / (2.0 * step)
            });
            assert!(distance(force, [0.0, 0.0, 1.0]) < 1e-5, "{place:?}: {force:?}");
        }
    }
}

/// libnifalcon has a tolerance of 0.01 rad and, on failure, silently returns the old position: an error of 0.24 mm at 25 mm and 1 Hz.
#[test]
fn a_moving_grip_is_followed_to_the_picometre() {
    let mut last = [0.0, 0.0, 0.125];
    for millisecond in 0..2000 {
        let angle = core::f64::consts::TAU * f64::from(millisecond) / 1000.0;
        let place = [0.025 * angle.sin(), 0.025 * (2.0 * angle).cos(), 0.125 + 0.02 * angle.cos()];
        let found = forward_from(inverse(place).unwrap(), last).unwrap();
        assert!(distance(found, place) < 1e-12, "{found:?} and {place:?}");
        last = found;
    }
    assert!(forward_from([angle_of_count(4000.0), angle_of_count(-4000.0), 0.0], last).is_err());
}

/// libnifalcon does not clamp torques: beyond sixteen bits the sign flips, and NaN reaches the motors.
#[test]
fn no_force_however_large_turns_its_sign() {
    let mut bench = Bench::active(running(), [0.0; 3], 0.0, DriverConfig::DEFAULT);
    bench.run(seconds(0.1), |_, _| Some([1.0, 0.0, 0.0])).unwrap();
    let sign = bench.driver.status().motors.get().map(i16::signum);
    for large in [10.0, 1e3, 1e6, 1e300, f64::MAX] {
        bench.run(seconds(0.02), |_, _| Some([large, 0.0, 0.0])).unwrap();
        assert_eq!(bench.driver.status().motors.get().map(i16::signum), sign, "{large}");
    }
}

/// libnifalcon does not initialise the homed flag, which may be true before the first packet.
#[test]
fn nothing_is_homed_before_the_first_report() {
    let driver = Driver::open(SimulatedTransport::in_virtual_time(Simulator::new(running(), StillHand)), DriverConfig::DEFAULT).unwrap();
    assert_eq!((driver.status().phase, driver.status().homed, driver.status().reading), (Phase::Silent, [false; 3], None));
}

/// libnifalcon continues 16 bytes after a malformed packet, and a stream out of step stays out of step.
#[test]
fn a_stream_out_of_step_is_in_step_with_the_next_packet() {
    for lost in 1..16 {
        let report = Report { encoders: [-1447, 12, 3], homed: [true; 3], ..Report::default() };
        let stream = [&report.encode()[lost..], &report.encode()[..], &report.encode()[..]].concat();
        let mut framer = Framer::new();
        let found = stream.iter().filter_map(|byte| framer.push::<Report>(*byte)).collect::<Vec<_>>();
        assert_eq!(found, [report, report]);
    }
}
