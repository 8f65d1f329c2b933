use core::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use super::*;

fn at(milliseconds: u64) -> Instant {
    Instant::ZERO + Duration::from_millis(milliseconds)
}

/// Returns a moment at which every check passes.
fn well(now: Instant) -> Moment {
    Moment { now, ready: true, armed: true, reading_at: Some(now), setpoint_at: Some(now) }
}

fn gate(limits: Limits) -> Gate {
    Gate::new(limits, Stopper::default()).unwrap()
}

fn length(v: [f64; 3]) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Returns the cause, and asserts that no force was admitted.
fn cause(admitted: Admitted) -> ZeroCause {
    assert_eq!(admitted.force, GatedForce::ZERO);
    match admitted.verdict {
        Verdict::Zero(cause) => cause,
        Verdict::Out(changes) => panic!("admitted: {changes:?}"),
    }
}

#[test]
fn force_comes_up_as_fast_as_it_may_and_no_faster() {
    let mut gate = gate(Limits { force: 3.0, slew: 1000.0, ..Limits::DEFAULT });
    let forces: Vec<f64> = (0..5).map(|ms| gate.admit([0.0, 0.0, 8.0], &well(at(ms))).force.newtons()[2]).collect();
    assert_eq!(forces, [0.0, 1.0, 2.0, 3.0, 3.0]);
    assert_eq!(gate.admit([0.0, 0.0, 8.0], &well(at(5))).verdict, Verdict::Out(Changes { limited: true, slewed: false }));
}

#[test]
fn each_reason_alone_makes_zero_at_once() {
    let strong = [0.0, 2.0, 0.0];
    let up = || {
        let mut gate = gate(Limits { slew: 1e6, ..Limits::DEFAULT });
        gate.admit(strong, &well(at(0)));
        assert_eq!(gate.admit(strong, &well(at(1))).force.newtons(), strong);
        gate
    };
    let now = at(2);
    let moments = [
        (Moment { ready: false, ..well(now) }, ZeroCause::NotReady),
        (Moment { armed: false, ..well(now) }, ZeroCause::NotArmed),
        (Moment { reading_at: None, ..well(now) }, ZeroCause::StaleReading),
        (Moment { now: at(13), setpoint_at: Some(at(13)), ..well(now) }, ZeroCause::StaleReading),
        (Moment { reading_at: Some(at(3)), ..well(now) }, ZeroCause::StaleReading),
        (Moment { setpoint_at: None, ..well(now) }, ZeroCause::StaleSetpoint),
        (Moment { now: at(53), reading_at: Some(at(53)), ..well(now) }, ZeroCause::StaleSetpoint),
        (well(at(22)), ZeroCause::LoopLate),
    ];
    for (moment, expected) in moments {
        let mut gate = up();
        assert_eq!(cause(gate.admit(strong, &moment)), expected);
        // After zero, the force grows from zero.
        assert_eq!(gate.admit(strong, &well(moment.now)).force, GatedForce::ZERO);
    }
    for wanted in [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, f64::NEG_INFINITY]] {
        assert_eq!(cause(up().admit(wanted, &well(now))), ZeroCause::NotFinite);
    }
    // At the limits themselves the force stays.
    for moment in [well(at(21)), Moment { reading_at: Some(at(1)), ..well(at(11)) }] {
        assert_eq!(up().admit(strong, &moment).force.newtons(), strong, "{moment:?}");
    }
}

/// The pause is between turns of the loop: a turn with zero force is a turn, too.
#[test]
fn turns_without_force_are_no_pause() {
    let mut gate = gate(Limits::DEFAULT);
    gate.admit([1.0; 3], &well(at(0)));
    for ms in [15, 30, 45] {
        assert_eq!(cause(gate.admit([1.0; 3], &Moment { armed: false, ..well(at(ms)) })), ZeroCause::NotArmed);
    }
    assert_eq!(gate.admit([0.0, 3.0, 0.0], &well(at(60))).force.newtons(), [0.0, 3.0, 0.0]);
}

#[test]
fn a_force_whose_length_overflows_keeps_its_direction() {
    let mut gate = gate(Limits { force: 3.0, slew: 1e6, ..Limits::DEFAULT });
    gate.admit([0.0; 3], &well(at(0)));
    let found = gate.admit([f64::MAX, -f64::MAX, f64::MAX], &well(at(1)));
    let part = 3.0_f64.sqrt();
    assert!([part, -part, part].iter().zip(found.force.newtons()).all(|(expected, found)| (found - expected).abs() < 1e-12), "{found:?}");
    assert_eq!(found.verdict, Verdict::Out(Changes { limited: true, slewed: false }));
}

/// With all conditions broken at once, the causes come in their order, as one condition after the other is repaired.
#[test]
fn the_first_cause_counts() {
    let mut gate = gate(Limits::DEFAULT);
    gate.admit([0.0; 3], &well(at(0)));
    let late = at(100);
    let broken = Moment { now: late, ready: false, armed: false, reading_at: None, setpoint_at: None };
    let ready = Moment { ready: true, ..broken };
    let armed = Moment { armed: true, ..ready };
    let read = Moment { reading_at: Some(late), ..armed };
    let asked = Moment { setpoint_at: Some(late), ..read };
    let mut found = Vec::new();
    for moment in [broken, ready, armed, read, asked] {
        // A moment has a gate of its own, so that every gate has paused equally long.
        let mut paused = Gate::new(*gate.limits(), Stopper::default()).unwrap();
        paused.admit([0.0; 3], &well(at(0)));
        found.push(cause(paused.admit([f64::NAN; 3], &moment)));
    }
    found.push(cause(gate.admit([f64::NAN; 3], &Moment { now: at(1), ..well(at(1)) })));
    assert_eq!(found, ZeroCause::ALL[1..]);
    gate.stop();
    assert_eq!(cause(gate.admit([f64::NAN; 3], &broken)), ZeroCause::Stopped);
    for (place, cause) in ZeroCause::ALL.into_iter().enumerate() {
        assert_eq!(cause.index(), place);
    }
}

#[test]
fn any_thread_stops_a_gate_for_good() {
    let mut gate = gate(Limits::DEFAULT);
    gate.admit([1.0; 3], &well(at(0)));
    assert!(gate.admit([1.0; 3], &well(at(1))).force != GatedForce::ZERO);
    let stopper = gate.stopper().clone();
    std::thread::spawn(move || {
        stopper.stop();
        stopper.stop();
    })
    .join()
    .unwrap();
    assert!(gate.is_stopped());
    for ms in 2..100 {
        assert_eq!(cause(gate.admit([1.0; 3], &well(at(ms)))), ZeroCause::Stopped);
    }
}

#[test]
fn a_withdrawn_force_is_zero_for_the_next_change() {
    let mut gate = gate(Limits::DEFAULT);
    for ms in 0..4 {
        gate.admit([3.0, 0.0, 0.0], &well(at(ms)));
    }
    gate.withdraw(at(3));
    assert_eq!(gate.admit([3.0, 0.0, 0.0], &well(at(4))).force.newtons(), [1.0, 0.0, 0.0]);
    // The zero may go out between two turns: the force has been zero for 1 ms of the 5 ms since the turn before.
    gate.withdraw(at(8));
    assert_eq!(gate.admit([3.0, 0.0, 0.0], &well(at(9))).force.newtons(), [1.0, 0.0, 0.0]);
}

#[test]
fn limits_that_make_no_sense_are_refused() {
    let refused = |limits: Limits| Gate::new(limits, Stopper::default()).is_err();
    for number in [-1.0, 20.1, f64::NAN, f64::INFINITY] {
        assert!(refused(Limits { force: number, ..Limits::DEFAULT }));
    }
    for number in [0.0, -1.0, 1.1e6, f64::NAN, f64::INFINITY] {
        assert!(refused(Limits { slew: number, ..Limits::DEFAULT }));
    }
    assert!(refused(Limits { gap: Duration::ZERO, ..Limits::DEFAULT }));
    assert!(refused(Limits { reading_age: Duration::ZERO, ..Limits::DEFAULT }));
    assert!(refused(Limits { setpoint_age: Duration::from_secs(2), ..Limits::DEFAULT }));
    assert!(!refused(Limits::DEFAULT));
}

fn moments() -> impl Strategy<Value = ([f64; 3], Moment, u64, bool)> {
    let part = || prop_oneof![4 => -20.0..20.0, 1 => any::<f64>()];
    let age = |longest: u64| prop_oneof![4 => Just(Some(0)), 1 => proptest::option::of(0..longest)];
    (([part(), part(), part()]), 0_u64..3_000_000, age(20_000_000), age(80_000_000), any::<u8>()).prop_map(
        |(wanted, step, reading, setpoint, dice)| {
            let moment = Moment {
                now: Instant::ZERO,
                ready: dice % 16 != 0,
                armed: dice % 16 != 5,
                reading_at: reading.map(Instant::from_nanos),
                setpoint_at: setpoint.map(Instant::from_nanos),
            };
            (wanted, moment, if dice == 2 { 1_000_000_000 } else { step }, dice == 3)
        },
    )
}

properties! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Every promise of the gate, stated independently, for any sequence of forces.
    #[test]
    fn promises_hold(steps in vec(moments(), 1..60), force in 0.0..20.0, slew in 1.0..1e5) {
        let limits = Limits { force, slew, ..Limits::DEFAULT };
        let mut gate = gate(limits);
        let (mut now, mut last, mut stopped) = (Instant::from_nanos(1_000_000_000), [0.0; 3], false);
        for (wanted, mut moment, step, stop) in steps {
            if stop {
                gate.stopper().stop();
                stopped = true;
            }
            now += Duration::from_nanos(step);
            moment.now = now;
            // The generator draws ages; the gate takes instants.
            let ages = [moment.reading_at, moment.setpoint_at].map(|age| age.map(|age| age.as_nanos()));
            [moment.reading_at, moment.setpoint_at] = ages.map(|age| age.map(|age| Instant::from_nanos(now.as_nanos() - age)));
            let admitted = gate.admit(wanted, &moment);

            let found = admitted.force.newtons();
            prop_assert!(found.iter().all(|part| part.is_finite()));
            prop_assert!(length(found) <= force * (1.0 + 1e-12));
            let change = length([0, 1, 2].map(|axis| found[axis] - last[axis]));
            let allowed = slew * Duration::from_nanos(step).as_secs_f64();
            prop_assert!(change <= allowed * (1.0 + 1e-9) + 1e-12 || found == [0.0; 3]);
            let reason_for_none = stopped
                || !moment.ready
                || !moment.armed
                || ages[0].is_none_or(|age| age > 10_000_000)
                || ages[1].is_none_or(|age| age > 50_000_000)
                || !wanted.iter().all(|part| part.is_finite());
            if reason_for_none {
                prop_assert_eq!(admitted.force, GatedForce::ZERO);
                prop_assert!(matches!(admitted.verdict, Verdict::Zero(_)));
            }
            last = found;
        }
    }
}
