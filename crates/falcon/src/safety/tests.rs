use core::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use super::*;
use crate::calibration::{Calibration, MOTOR_LIMIT};
use crate::kinematics::Triple;

const CENTRE: Triple = [0.0, 0.0, 0.125];

fn at(milliseconds: u64) -> Instant {
    Instant::ZERO + Duration::from_millis(milliseconds)
}

/// Returns a moment at which every check passes.
fn well(now: Instant) -> Moment {
    Moment { now, homed: true, armed: true, reading_at: Some(now), setpoint_at: Some(now), position: Some(CENTRE) }
}

fn gate(limits: Limits) -> ForceGate {
    ForceGate::new(limits, Calibration::DEFAULT).unwrap()
}

/// Returns the cause, and asserts that no force went out.
fn cause(admitted: Admitted) -> ZeroCause {
    assert_eq!((admitted.force, admitted.motors), ([0.0; 3], MotorCounts::ZERO));
    match admitted.verdict {
        Verdict::Zero(cause) => cause,
        Verdict::Out(changes) => panic!("went out: {changes:?}"),
    }
}

#[test]
fn counts_are_those_of_the_design_page() {
    // The force of 1 N along z at z = 0.110 has 0.024180165286 N·m. With 10000 counts per N·m and the opposite sign, this is −241.8 counts.
    let mut gate = gate(Limits { slew: 1e6, ..Limits::DEFAULT });
    let place = |now| Moment { position: Some([0.0, 0.0, 0.110]), ..well(now) };
    gate.admit([0.0; 3], &place(at(0)));
    assert_eq!(gate.admit([0.0, 0.0, 1.0], &place(at(1))).motors.get(), [-242; 3]);
    assert_eq!(gate.admit([1.0, 0.0, 0.0], &place(at(2))).motors.get(), [-155, 527, -372]);
}

#[test]
fn a_motor_at_its_end_lowers_the_others_alike() {
    let mut gate = gate(Limits { force: 20.0, slew: 1e6, ..Limits::DEFAULT });
    gate.admit([0.0; 3], &well(at(0)));
    let small = gate.admit([1.0, 0.0, 0.0], &well(at(1))).motors.get();
    let large = gate.admit([20.0, 0.0, 0.0], &well(at(2)));
    assert!(matches!(large.verdict, Verdict::Out(Changes { saturated: true, .. })));
    let large = large.motors.get();
    assert_eq!(large.iter().map(|count| count.abs()).max(), Some(MOTOR_LIMIT));
    let scale = f64::from(large[1]) / f64::from(small[1]);
    for (small, large) in small.into_iter().zip(large) {
        // The tolerance is the rounding of half a count, scaled.
        assert!((f64::from(small) * scale - f64::from(large)).abs() < scale.abs() + 1.0);
    }
}

/// The gate of every device has tests of its own. Here each of its causes reaches the motors, under the words of a Falcon.
#[test]
fn each_reason_alone_stops_the_motors_at_once() {
    use cohaptic_device::ZeroCause as Cause;
    let strong = [0.0, 2.0, 0.0];
    let up = || {
        let mut gate = gate(Limits { slew: 1e6, ..Limits::DEFAULT });
        gate.admit(strong, &well(at(0)));
        assert!(gate.admit(strong, &well(at(1))).motors != MotorCounts::ZERO);
        gate
    };
    let now = at(2);
    let cases = [
        (strong, Moment { homed: false, ..well(now) }, ZeroCause::Gate(Cause::NotReady)),
        (strong, Moment { armed: false, ..well(now) }, ZeroCause::Gate(Cause::NotArmed)),
        (strong, Moment { reading_at: None, ..well(now) }, ZeroCause::Gate(Cause::StaleReading)),
        (strong, Moment { setpoint_at: None, ..well(now) }, ZeroCause::Gate(Cause::StaleSetpoint)),
        (strong, well(at(22)), ZeroCause::Gate(Cause::LoopLate)),
        ([0.0, f64::NAN, 0.0], well(now), ZeroCause::Gate(Cause::NotFinite)),
        (strong, Moment { position: None, ..well(now) }, ZeroCause::NoTorques),
        (strong, Moment { position: Some([0.0, 0.0, 0.5]), ..well(now) }, ZeroCause::NoTorques),
    ];
    for (wanted, moment, expected) in cases {
        let mut gate = up();
        assert_eq!(cause(gate.admit(wanted, &moment)), expected);
        // After zero, the force grows from zero: no time has passed since, so there is none yet.
        assert_eq!(gate.admit(strong, &well(moment.now)).motors, MotorCounts::ZERO);
    }
    let mut stopped = up();
    stopped.stop();
    assert_eq!(cause(stopped.admit(strong, &well(now))), ZeroCause::Gate(Cause::Stopped));
    assert!(stopped.is_stopped() && stopped.stopper().is_stopped());
}

#[test]
fn causes_have_the_words_of_a_falcon() {
    let names = ["stopped", "not homed", "not armed", "stale reading", "stale setpoint", "loop late", "not finite", "no torques"];
    assert_eq!(ZeroCause::ALL.map(ZeroCause::name), names);
}

properties! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// No count exceeds the limit of a motor, and a force that is zero has no counts, at any place and for any sequence of forces.
    #[test]
    fn motors_stay_within_their_limit(
        steps in vec(([-20.0..20.0, -20.0..20.0, -20.0..20.0], [-0.2..0.2, -0.2..0.2, -0.2..0.3], any::<bool>()), 1..60),
        slew in 1.0..1e5,
    ) {
        let mut gate = gate(Limits { force: 20.0, slew, ..Limits::DEFAULT });
        for (millisecond, (wanted, place, armed)) in (1000..).zip(steps) {
            let admitted = gate.admit(wanted, &Moment { armed, position: Some(place), ..well(at(millisecond)) });
            prop_assert!(admitted.motors.get().iter().all(|count| count.abs() <= MOTOR_LIMIT));
            if matches!(admitted.verdict, Verdict::Zero(_)) {
                prop_assert_eq!((admitted.force, admitted.motors), ([0.0; 3], MotorCounts::ZERO));
            }
            prop_assert!(armed || admitted.verdict == Verdict::Zero(ZeroCause::Gate(cohaptic_device::ZeroCause::NotArmed)));
        }
    }
}
