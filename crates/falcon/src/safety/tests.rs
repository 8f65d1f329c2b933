use core::time::Duration;

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

fn length(v: Triple) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
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
fn force_comes_up_as_fast_as_it_may_and_no_faster() {
    let mut gate = gate(Limits { force: 3.0, slew: 1000.0, ..Limits::DEFAULT });
    let heights: Vec<f64> = (0..5).map(|ms| gate.admit([0.0, 0.0, 8.0], &well(at(ms))).force[2]).collect();
    assert_eq!(heights, [0.0, 1.0, 2.0, 3.0, 3.0]);
    let Verdict::Out(changes) = gate.admit([0.0, 0.0, 8.0], &well(at(5))).verdict else { panic!("zero") };
    assert_eq!(changes, Changes { limited: true, slewed: false, saturated: false });
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

#[test]
fn each_reason_alone_makes_zero_at_once() {
    let strong = [0.0, 2.0, 0.0];
    let up = || {
        let mut gate = gate(Limits { slew: 1e6, ..Limits::DEFAULT });
        gate.admit(strong, &well(at(0)));
        assert_eq!(gate.admit(strong, &well(at(1))).force, strong);
        gate
    };
    let now = at(2);
    let moments = [
        (Moment { homed: false, ..well(now) }, ZeroCause::NotHomed),
        (Moment { armed: false, ..well(now) }, ZeroCause::NotArmed),
        (Moment { reading_at: None, ..well(now) }, ZeroCause::StaleReading),
        (Moment { now: at(13), setpoint_at: Some(at(13)), ..well(now) }, ZeroCause::StaleReading),
        (Moment { reading_at: Some(at(3)), ..well(now) }, ZeroCause::StaleReading),
        (Moment { setpoint_at: None, ..well(now) }, ZeroCause::StaleSetpoint),
        (Moment { now: at(53), reading_at: Some(at(53)), ..well(now) }, ZeroCause::StaleSetpoint),
        (well(at(22)), ZeroCause::LoopLate),
        (Moment { position: None, ..well(now) }, ZeroCause::NoTorques),
        (Moment { position: Some([0.0, 0.0, 0.5]), ..well(now) }, ZeroCause::NoTorques),
    ];
    for (moment, expected) in moments {
        let mut gate = up();
        assert_eq!(cause(gate.admit(strong, &moment)), expected);
        // After zero, the force grows from zero.
        let again = gate.admit(strong, &well(moment.now));
        assert_eq!(again.force, [0.0; 3]);
    }
    for wanted in [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, f64::NEG_INFINITY]] {
        assert_eq!(cause(up().admit(wanted, &well(now))), ZeroCause::NotFinite);
    }
}

#[test]
fn stopped_is_for_good() {
    let mut gate = gate(Limits::DEFAULT);
    gate.admit([1.0; 3], &well(at(0)));
    gate.stop();
    for ms in 1..100 {
        assert_eq!(cause(gate.admit([1.0; 3], &well(at(ms)))), ZeroCause::Stopped);
    }
}

#[test]
fn limits_that_make_no_sense_are_refused() {
    let refused = |limits: Limits| ForceGate::new(limits, Calibration::DEFAULT).is_err();
    assert!(refused(Limits { force: f64::NAN, ..Limits::DEFAULT }) && refused(Limits { force: -1.0, ..Limits::DEFAULT }));
    assert!(refused(Limits { force: f64::INFINITY, ..Limits::DEFAULT }) && refused(Limits { slew: 0.0, ..Limits::DEFAULT }));
    assert!(refused(Limits { slew: f64::NAN, ..Limits::DEFAULT }) && refused(Limits { gap: Duration::ZERO, ..Limits::DEFAULT }));
    assert!(refused(Limits { setpoint_age: Duration::from_secs(2), ..Limits::DEFAULT }));
}

fn moments() -> impl Strategy<Value = (Triple, Moment, u64, bool)> {
    let part = || prop_oneof![4 => -20.0..20.0, 1 => any::<f64>()];
    let age = |longest: u64| prop_oneof![4 => Just(Some(0)), 1 => proptest::option::of(0..longest)];
    let place = prop_oneof![4 => [-0.03..0.03, -0.03..0.03, 0.1..0.15], 1 => [-0.2..0.2, -0.2..0.2, -0.2..0.3]];
    (([part(), part(), part()]), 0_u64..3_000_000, age(20_000_000), age(80_000_000), place, any::<u8>()).prop_map(
        |(wanted, step, reading, setpoint, place, dice)| {
            let moment = Moment {
                now: Instant::ZERO,
                homed: dice % 16 != 0,
                armed: dice % 16 != 5,
                reading_at: reading.map(Instant::from_nanos),
                setpoint_at: setpoint.map(Instant::from_nanos),
                position: (dice % 16 != 1).then_some(place),
            };
            (wanted, moment, if dice == 2 { 1_000_000_000 } else { step }, dice == 3)
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Every promise of the gate, stated independently, for any sequence of forces.
    #[test]
    fn promises_hold(steps in vec(moments(), 1..60), force in 0.0..20.0, slew in 1.0..1e5) {
        let limits = Limits { force, slew, ..Limits::DEFAULT };
        let mut gate = gate(limits);
        let (mut now, mut last, mut stopped) = (Instant::from_nanos(1_000_000_000), [0.0; 3], false);
        for (wanted, mut moment, step, stop) in steps {
            if stop {
                gate.stop();
                stopped = true;
            }
            now += Duration::from_nanos(step);
            moment.now = now;
            // The generator draws ages; the gate takes instants.
            let ages = [moment.reading_at, moment.setpoint_at].map(|age| age.map(|age| age.as_nanos()));
            let instants = ages.map(|age| age.map(|age| Instant::from_nanos(now.as_nanos() - age)));
            [moment.reading_at, moment.setpoint_at] = instants;
            let admitted = gate.admit(wanted, &moment);

            let [x, y, z] = admitted.force;
            prop_assert!(x.is_finite() && y.is_finite() && z.is_finite());
            prop_assert!(length(admitted.force) <= force * (1.0 + 1e-12));
            prop_assert!(admitted.motors.get().iter().all(|count| count.abs() <= MOTOR_LIMIT));
            let change = length([0, 1, 2].map(|axis| admitted.force[axis] - last[axis]));
            let allowed = slew * Duration::from_nanos(step).as_secs_f64();
            prop_assert!(change <= allowed * (1.0 + 1e-9) + 1e-12 || admitted.force == [0.0; 3]);
            let reason_for_none = stopped
                || !moment.homed
                || !moment.armed
                || ages[0].is_none_or(|age| age > 10_000_000)
                || ages[1].is_none_or(|age| age > 50_000_000)
                || !wanted.iter().all(|part| part.is_finite());
            if reason_for_none {
                prop_assert_eq!(admitted.motors, MotorCounts::ZERO);
                prop_assert!(matches!(admitted.verdict, Verdict::Zero(_)));
            }
            last = admitted.force;
        }
    }
}
