//! `cohaptic falcon simulate`: the driver on a device that is not there.

use std::process::ExitCode;
use std::time::Duration;

use clap::ValueEnum as _;
use cohaptic_falcon::driver::{DriverConfig, Phase, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_falcon::safety::Limits;
use cohaptic_falcon::simulator::{Faults, Hand, Observed, SharedSimulator, SimulatedTransport, Simulator, SimulatorConfig, StillHand, Waypoints};
use cohaptic_units::Probability;
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::answer;
use super::answer::{Forces, Seen, Traffic, light};
use super::bench::{Bench, End, Go, Task};
use super::reach::{AnyTransport, SWAY};
use crate::arguments::{Force, HandName, SimulateArguments};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::output;

/// Changes of phase that are kept. With many faults there may be one every few milliseconds.
const CHANGES: usize = 100;

#[derive(Serialize)]
struct SimulateDocument {
    hand: String,
    seed: u64,
    asked_n: Option<[f64; 3]>,
    ending: &'static str,
    /// Why the driver gave up, if it did.
    driver_error: Option<String>,
    changes: Vec<Change>,
    more_changes: u64,
    #[serde(flatten)]
    traffic: Traffic,
    #[serde(flatten)]
    seen: Seen,
    forces: Forces,
    device: DeviceDocument,
    true_position_m: [f64; 3],
    largest_position_error_m: Option<f64>,
    motor_force_n: [f64; 3],
    largest_motor_force_n: f64,
}

/// A phase that began.
#[derive(Clone, Serialize)]
struct Change {
    t_s: f64,
    phase: &'static str,
    light: &'static str,
}

/// Runs driver and device in virtual time.
pub(super) fn simulate(arguments: &SimulateArguments) -> Result<ExitCode, Failure> {
    let probability = |given: Option<Probability>| given.map_or(0.0, Probability::get);
    let (garbage, drop) = (probability(arguments.garbage), probability(arguments.drop));
    let faults = Faults { garble_to_host: garbage, insert_to_host: garbage, drop_to_host: drop, drop_to_device: drop, ..Faults::NONE };
    let config = SimulatorConfig { seed: arguments.seed, running: true, faults, ..SimulatorConfig::default() };
    let transport = SimulatedTransport::in_virtual_time(Simulator::new(config, HeldBy::of(arguments.hand)));
    let simulator = transport.simulator();
    let config = DriverConfig { limits: Limits { force: arguments.limit, ..Limits::DEFAULT }, ..DriverConfig::DEFAULT };
    let mut bench = Bench::open(AnyTransport::new(transport), config).map_err(|error| Failure::System(error.to_string()))?;
    let mut simulating = Simulating {
        simulator,
        force: arguments.force.map(|Force(force)| force),
        unplug_after: arguments.unplug_after,
        origin: config.calibration.origin(),
        truth: Truth::default(),
        last: *bench.status(),
        until: Duration::ZERO,
        largest_force: 0.0,
        phase: Phase::Silent,
        changes: Vec::new(),
        more_changes: 0,
    };
    let end = bench.run(Some(arguments.length), &mut simulating)?;
    let document = simulating.document(&bench, arguments, end);
    output::answer(arguments.json, DocumentSchema::FALCON_SIMULATE, &document, || document.describe(), output::NO_FILES)?;
    // A driver that gives up has done what was to be seen.
    Ok(if end == End::Interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

impl SimulateDocument {
    fn describe(&self) -> String {
        let mut lines: Vec<String> = self.changes.iter().map(|change| format!("{:7.3} s  {} ({})", change.t_s, change.phase, change.light)).collect();
        if self.more_changes > 0 {
            lines.push(format!("and {}", Counted(self.more_changes, "more change")));
        }
        lines.push(match &self.driver_error {
            Some(error) => format!("the driver gave up after {:.3} s: {error}", self.traffic.seconds),
            None => format!("the driver ran for {:.3} s", self.traffic.seconds),
        });
        lines.extend(answer::traffic(&self.traffic));
        lines.extend(answer::seen(&self.seen));
        if let (Some(position), Some(error)) = (self.seen.position_m, self.largest_position_error_m) {
            lines.push(format!(
                "the driver sees the grip at {} from the origin, {:.3} mm off the truth at most",
                answer::place(position),
                1e3 * error
            ));
        }
        lines.push(answer::forces(&self.forces));
        lines.push(format!(
            "the motors pushed with {:.3} N at most, and with {:.3} N at the end",
            self.largest_motor_force_n,
            answer::length(self.motor_force_n)
        ));
        lines.push(self.device.describe());
        answer::block(&format!("simulated Falcon, hand {}, seed {}", self.hand, self.seed), &lines)
    }
}

/// The hand that was chosen.
enum HeldBy {
    Nobody(StillHand),
    User(Waypoints),
}

impl HeldBy {
    fn of(name: HandName) -> Self {
        let homing = Waypoints::homing(Duration::ZERO);
        match name {
            HandName::Still => Self::Nobody(StillHand),
            HandName::Homing => Self::User(homing),
            HandName::Swaying => Self::User(homing.swaying(SWAY.0, SWAY.1)),
        }
    }
}

impl Hand for HeldBy {
    fn force(&mut self, now: cohaptic_units::Instant, position: Triple, velocity: Triple) -> Triple {
        match self {
            Self::Nobody(hand) => hand.force(now, position, velocity),
            Self::User(hand) => hand.force(now, position, velocity),
        }
    }
}

struct Simulating {
    simulator: SharedSimulator,
    force: Option<Triple>,
    unplug_after: Option<Duration>,
    origin: Triple,
    truth: Truth,
    last: Status,
    until: Duration,
    largest_force: f64,
    phase: Phase,
    changes: Vec<Change>,
    more_changes: u64,
}

impl Simulating {
    fn change(&mut self, at: Duration, phase: Phase) {
        if self.phase == phase {
            return;
        }
        self.phase = phase;
        if self.changes.len() < CHANGES {
            self.changes.push(Change { t_s: at.as_secs_f64(), phase: phase.name(), light: light(phase) });
        } else {
            self.more_changes += 1;
        }
    }

    fn document(mut self, bench: &Bench, arguments: &SimulateArguments, end: End) -> SimulateDocument {
        // How it was left: the driver has said farewell, or cannot.
        self.change(bench.passed(), bench.status().phase);
        let motors = self.simulator.with(|device| (device.motor_force(), *device.observed()));
        (self.truth.motor_force, self.truth.observed) = motors;
        let Truth { position, motor_force, largest_motor_force, largest_error, observed } = self.truth;
        SimulateDocument {
            hand: arguments.hand.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned()),
            seed: arguments.seed,
            asked_n: self.force,
            ending: end.name(),
            driver_error: if let End::Failed(error) = end { Some(error.to_string()) } else { None },
            changes: self.changes,
            more_changes: self.more_changes,
            traffic: Traffic::of(bench, self.until),
            seen: Seen::of(&self.last),
            forces: Forces::of(bench, arguments.limit, self.largest_force),
            device: DeviceDocument::of(&observed),
            true_position_m: position,
            largest_position_error_m: largest_error,
            motor_force_n: motor_force,
            largest_motor_force_n: largest_motor_force,
        }
    }
}

impl Task for Simulating {
    fn wants(&mut self, at: Duration, _status: &Status) -> Option<Triple> {
        if self.unplug_after.is_some_and(|after| at >= after) {
            self.simulator.with(Simulator::unplug);
        }
        self.force
    }

    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure> {
        (self.last, self.until) = (*status, at);
        self.change(at, status.phase);
        self.largest_force = self.largest_force.max(answer::length(status.force));
        self.truth.look(&self.simulator, status, self.origin);
        Ok(Go::On)
    }
}

/// The largest of what was seen of a device behind its driver's back.
#[derive(Clone, Copy, Debug, Default)]
struct Truth {
    /// In the frame of the device \[m\].
    position: Triple,
    /// \[N\]
    motor_force: Triple,
    largest_motor_force: f64,
    /// How far the driver's position was from the true one at most \[m\]; `None` if it never had one.
    largest_error: Option<f64>,
    observed: Observed,
}

impl Truth {
    /// Looks; `origin`: where the driver's positions count from.
    fn look(&mut self, simulator: &SharedSimulator, status: &Status, origin: Triple) {
        let look = |device: &mut Simulator| (device.position(), device.motor_force(), *device.observed());
        (self.position, self.motor_force, self.observed) = simulator.with(look);
        self.largest_motor_force = self.largest_motor_force.max(answer::length(self.motor_force));
        if let Some(reading) = status.reading {
            let off = answer::length(std::array::from_fn(|axis| reading.position[axis] + origin[axis] - self.position[axis]));
            self.largest_error = Some(self.largest_error.unwrap_or(0.0).max(off));
        }
    }
}

/// What the device has seen of its host.
#[derive(Serialize)]
struct DeviceDocument {
    commands: u64,
    garbage_bytes: u64,
    misheard_bytes: u64,
    largest_count: u16,
    largest_count_unhomed: u16,
    saturated: u64,
    torque_timeouts: u64,
}

impl DeviceDocument {
    const fn of(observed: &Observed) -> Self {
        let Observed { commands, garbage, misheard, largest_count, largest_count_unhomed, saturated, torque_timeouts } = *observed;
        Self { commands, garbage_bytes: garbage, misheard_bytes: misheard, largest_count, largest_count_unhomed, saturated, torque_timeouts }
    }

    /// In words.
    fn describe(&self) -> String {
        let Self { commands, garbage_bytes, misheard_bytes, largest_count, largest_count_unhomed, saturated, torque_timeouts } = self;
        format!(
            "the device took {commands} packets, {garbage_bytes} bytes of garbage and {misheard_bytes} at the wrong time; motor counts up to {largest_count}, {largest_count_unhomed} before it was homed; {saturated} saturated, {torque_timeouts} torque time-outs"
        )
    }
}
