//! Every fault of a service, in virtual time: the force is zero within the age of a reading and two ticks, and grows from zero as fast as the gate admits.

use std::time::Duration;

use cohaptic_device::{Device as _, Gate, Limits, Moment};
use cohaptic_inverse3::Triple;
use cohaptic_inverse3::client::{ClientConfig, Phase, Report};
use cohaptic_inverse3::protocol::Flaw;
use cohaptic_inverse3::service::{Fault, FaultKind, Service, ServiceConfig, When};
use cohaptic_inverse3::stepped::SteppedInverse3;
use cohaptic_units::Instant;

const TICK: Duration = Duration::from_millis(1);
/// Tick at which a fault begins, and tick at which a fault ends.
const FAULT: (u64, u64) = (1000, 1500);
/// Ticks of a run. A new connection may take 750 ms, and arming 200 ms.
const END: u64 = 4000;
/// Force that is asked for \[N\], along x. The hand, a spring of 100 N/m, gives way by 5 mm, and so arms the device again.
const ASKED: f64 = 0.5;

/// Row of a tick: the true force of the motors along x at the end \[N\], the force of the latest message, and the phase.
#[derive(Clone, Copy, Debug)]
struct Row {
    motors: f64,
    sent: Triple,
    phase: Phase,
}

fn at(milliseconds: u64) -> Instant {
    Instant::from_nanos(1_000_000 * milliseconds)
}

fn hold_at_origin(_: Instant, position: Triple, velocity: Triple) -> Triple {
    [0, 1, 2].map(|axis| -100.0 * position[axis] - 5.0 * velocity[axis])
}

fn run(faults: Vec<Fault>) -> (Vec<Row>, Report) {
    let service = Service::new(ServiceConfig { faults, ..ServiceConfig::default() }, hold_at_origin);
    let mut device = SteppedInverse3::new(service, ClientConfig::DEFAULT).unwrap();
    let mut gate = Gate::new(Limits::DEFAULT, device.stopper()).unwrap();
    let rows = (0..END).map(|tick| {
        let now = at(tick);
        let seen = device.read(now).map(|_| now);
        let moment = Moment { now, ready: seen.is_some(), armed: seen.is_some(), reading_at: seen, setpoint_at: Some(now) };
        let admitted = gate.admit([ASKED, 0.0, 0.0], &moment);
        device.hold(now, TICK, admitted.force);
        let snapshot = device.snapshot();
        Row { motors: device.service().motor_force()[0], sent: snapshot.force, phase: snapshot.phase }
    });
    (rows.collect(), device.report())
}

/// Runs a fault from 1000 to 1500 ms, and asserts what holds for each. `within`: ticks after which the force must be zero.
fn fault(kind: FaultKind, within: u64) -> (Vec<Row>, Report) {
    let length = Duration::from_millis(FAULT.1 - FAULT.0);
    let (rows, report) = run(vec![Fault::during(kind, at(FAULT.0), length)]);
    let row = |tick: u64| rows[usize::try_from(tick).unwrap()];
    // The last tick before the fault ends when the fault begins.
    assert_eq!(row(FAULT.0 - 2).motors, ASKED, "{kind:?}: {:?}", row(FAULT.0 - 2));
    // The last tick of the fault ends after it.
    for tick in FAULT.0 + within..FAULT.1 - 1 {
        assert_eq!(row(tick).motors, 0.0, "{kind:?} at {tick}: {:?}", row(tick));
    }
    // The force comes back, at most 1 N/ms, and stays.
    for pair in rows.windows(2) {
        let (before, after) = (pair[0].sent[0], pair[1].sent[0]);
        assert!(after == 0.0 || after - before <= 1.0 + 1e-9, "{kind:?}: {pair:?}");
    }
    assert_eq!((row(END - 1).motors, row(END - 1).phase), (ASKED, Phase::Active), "{kind:?}: {report:?}");
    (rows, report)
}

/// Age of a reading, 10 ms, and two ticks.
const AGE: u64 = 12;

#[test]
fn without_a_fault_the_force_stays() {
    let (rows, report) = run(Vec::new());
    let active = rows.iter().position(|row| row.phase == Phase::Active).unwrap();
    // Connecting, inventory and preset take a few milliseconds, arming 200.
    assert!((200..210).contains(&active), "{active}");
    assert!(rows[active + 2..].iter().all(|row| row.motors == ASKED));
    assert_eq!((report.losses, report.connections, report.lost, report.older, report.unasked), (0, 1, 0, 0, 0));
    assert!((report.per_second - 1000.0).abs() < 10.0, "{report:?}");
    assert_eq!((report.p50.as_micros(), report.exchange_every(TICK)), (200, 1));
    assert!(report.force_rms.unwrap() < 1e-6 && report.largest_force == ASKED, "{report:?}");
}

#[test]
fn replies_that_do_not_come_in_time_end_the_force() {
    let (_, late) = fault(FaultKind::Late, AGE);
    assert!(late.max >= Duration::from_millis(20) && late.losses == 0, "{late:?}");
    let (_, missing) = fault(FaultKind::Missing, AGE);
    assert!(missing.lost >= 5 && missing.losses == 0, "{missing:?}");
}

#[test]
fn replies_without_a_meaning_are_dropped_and_close_the_connection() {
    for (kind, flaws) in [
        (FaultKind::Split, &[Flaw::NotJson][..]),
        (FaultKind::Malformed, &[Flaw::NotJson]),
        (FaultKind::FieldMissing, &[Flaw::NoPosition, Flaw::NoVelocity]),
    ] {
        let (_, report) = fault(kind, AGE);
        let counted = |flaw: Flaw| report.flaws[Flaw::ALL.iter().position(|other| *other == flaw).unwrap()];
        assert!(flaws.iter().all(|flaw| counted(*flaw) > 0), "{kind:?}: {report:?}");
        assert_eq!(report.flaws.iter().sum::<u64>(), flaws.iter().map(|flaw| counted(*flaw)).sum::<u64>());
        assert!(report.connections > 1 && report.losses == 1, "{kind:?}: {report:?}");
    }
}

#[test]
fn a_device_that_is_away_is_without_force_and_armed_anew() {
    for (kind, phase) in [
        (FaultKind::Gone, Phase::NoDevice),
        (FaultKind::Renamed, Phase::NoDevice),
        (FaultKind::NotReady, Phase::NotReady),
        (FaultKind::Transformed, Phase::Turned),
        (FaultKind::Brake, Phase::Braked),
    ] {
        let (rows, report) = fault(kind, AGE);
        let during = rows[1100].phase;
        let first = rows.iter().skip(1500).position(|row| row.phase == Phase::Active).unwrap();
        assert_eq!((during, report.losses, report.connections), (phase, 1, 1), "{kind:?}: {report:?}");
        assert!(first >= 200, "{kind:?}: {first}");
    }
    let (rows, report) = fault(FaultKind::Stall, AGE);
    // A stall has no end that the service tells: the device may be armed at once, and the simulated motors give no force meanwhile.
    assert_eq!((rows[1010].phase, report.losses), (Phase::Disarmed, 1));
}

#[test]
fn a_new_connection_follows_a_restart() {
    let (rows, report) = fault(FaultKind::Restart, AGE);
    assert_eq!((rows[1100].phase, report.connections, report.losses), (Phase::Connecting, 2, 1));
    // Attempts after 250 and 750 ms: the second finds the service.
    let again = rows.iter().skip(1001).position(|row| row.phase != Phase::Connecting).unwrap();
    assert!((749..760).contains(&again), "{again}");
}

/// The configuration is looked at once a second, so that axes turned by a configuration are found after a second at most.
#[test]
fn turned_axes_are_found_within_a_second() {
    let turned = Fault::during(FaultKind::Turned, at(1000), Duration::from_millis(1500));
    let (rows, report) = run(vec![turned]);
    let found = rows.iter().skip(1000).position(|row| row.phase == Phase::Turned).unwrap();
    assert!(found <= 1000, "{found}");
    assert!(rows[1000 + found + 2..2500].iter().all(|row| row.motors == 0.0));
    assert_eq!((rows[3999].motors, report.losses), (ASKED, 1));
}

/// A position that jumps by 50 mm within a millisecond is dropped, and is taken if it stays there, because a hand may have been faster than the replies. A
/// frozen position cannot be told from a hand at rest: the limits of the gate alone hold.
#[test]
fn positions_that_jump_are_dropped_at_first() {
    let (_, report) = run(vec![Fault { kind: FaultKind::Jumping, when: When::Chance(0.01) }]);
    let jumps = report.flaws[Flaw::ALL.len() - 1];
    assert!((10..100).contains(&jumps), "{report:?}");
    assert_eq!((report.losses, report.connections), (0, 1));
    let (rows, _) = run(vec![Fault::during(FaultKind::Frozen, at(1000), Duration::from_millis(500))]);
    assert!(rows[300..].iter().all(|row| row.motors == ASKED));
}

#[test]
fn faults_by_chance_repeat_with_their_seed() {
    let kinds = FaultKind::ALL.into_iter().filter(|kind| kind.hits_replies());
    let faults: Vec<Fault> = kinds.map(|kind| Fault { kind, when: When::Chance(0.002) }).collect();
    let text = |seed| {
        let service = Service::new(ServiceConfig { seed, faults: faults.clone(), ..ServiceConfig::default() }, hold_at_origin);
        let mut device = SteppedInverse3::new(service, ClientConfig::DEFAULT).unwrap();
        let mut text = String::new();
        for _ in 0..4000 {
            device.wait(TICK);
            text += &format!("{:?}", device.snapshot());
        }
        text + &format!("{:?}", device.report())
    };
    assert_eq!(text(1), text(1));
    assert_ne!(text(1), text(2));
}

#[test]
fn a_stop_ends_the_force_and_the_connection() {
    let service = Service::new(ServiceConfig::default(), hold_at_origin);
    let mut device = SteppedInverse3::new(service, ClientConfig::DEFAULT).unwrap();
    let mut gate = Gate::new(Limits::DEFAULT, device.stopper()).unwrap();
    for tick in 0..400 {
        let now = at(tick);
        let moment = Moment { now, ready: true, armed: true, reading_at: Some(now), setpoint_at: Some(now) };
        let admitted = gate.admit([ASKED, 0.0, 0.0], &moment);
        device.hold(now, TICK, admitted.force);
    }
    assert_eq!(device.service().motor_force()[0], ASKED);
    device.stop();
    device.stop();
    assert_eq!((device.service().motor_force(), device.snapshot().phase), ([0.0; 3], Phase::Stopped));
    assert!(device.client().is_over());
    device.wait(Duration::from_secs(5));
    assert_eq!(device.report().connections, 1);
}
