//! `cohaptic falcon simulate`: runs the driver on a simulated device in virtual time, and compares the driver's view with the device's true state.

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

/// Largest number of phase changes in the answer. With many faults the phase may change every few milliseconds.
const CHANGES: usize = 100;

#[derive(Serialize)]
struct SimulateDocument {
    hand: String,
    seed: u64,
    asked_n: Option<[f64; 3]>,
    ending: &'static str,
    /// Error with which the driver gave up; `None` if the driver ran to the end.
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

/// A change of the driver's phase: instant of the change \[s\], name of the new phase, colour of the light.
#[derive(Clone, Serialize)]
struct Change {
    t_s: f64,
    phase: &'static str,
    light: &'static str,
}

/// Runs driver and simulated device in virtual time, with the faults of the arguments, and writes the answer.
pub(super) fn simulate(arguments: &SimulateArguments) -> Result<ExitCode, Failure> {
    let probability = |given: Option<Probability>| given.map_or(0.0, Probability::get);
    let (garbage, drop) = (probability(arguments.garbage), probability(arguments.drop));
    // Garbage affects only bytes to the host; lost bytes affect both directions.
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
    // A driver that gives up is a success: users of this command inject faults to see how the driver reacts.
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

/// Simulated hand of `--hand`.
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

/// The task of `simulate`: asks for the configured force, and collects the driver's view and the device's true state.
struct Simulating {
    simulator: SharedSimulator,
    force: Option<Triple>,
    unplug_after: Option<Duration>,
    /// Origin of the driver's positions in the frame of the device \[m\].
    origin: Triple,
    truth: Truth,
    /// Status after the last exchange.
    last: Status,
    /// Time from the first exchange to the end of the last.
    until: Duration,
    /// Length of the largest force that the driver sent \[N\].
    largest_force: f64,
    /// Phase noted last.
    phase: Phase,
    /// First [`CHANGES`] changes of phase, in the order of time.
    changes: Vec<Change>,
    /// Number of changes of phase after the first [`CHANGES`].
    more_changes: u64,
}

impl Simulating {
    /// Notes the phase at `at`, if the phase differs from the phase noted last.
    fn change(&mut self, at: Duration, phase: Phase) {
        // The bench looks after each exchange, and a phase lasts for many exchanges.
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
        // The final state is read after the bench has stopped the driver: the phase and the motors show whether the force was switched off.
        self.change(bench.passed(), bench.status().phase);
        let motors = self.simulator.with(|device| (device.motor_force(), *device.observed()));
        (self.truth.motor_force, self.truth.observed) = motors;
        let Truth { position, motor_force, largest_motor_force, largest_error, observed } = self.truth;
        SimulateDocument {
            // The name on the command line, so that a reader can repeat the option.
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
            // Unplugging a device again has no effect, so that the instant of the first call counts.
            self.simulator.with(Simulator::unplug);
        }
        self.force
    }

    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure> {
        (self.last, self.until) = (*status, at);
        self.change(at, status.phase);
        self.largest_force = self.largest_force.max(answer::length(status.force));
        // Read in the same turn as the status, so that truth and status belong to the same exchange.
        self.truth.look(&self.simulator, status, self.origin);
        Ok(Go::On)
    }
}

/// True state of the simulated device after the last exchange, and the largest values over all exchanges. The driver does not see these values.
#[derive(Clone, Copy, Debug, Default)]
struct Truth {
    /// Position of the grip in the frame of the device \[m\].
    position: Triple,
    /// Force of the motors on the grip \[N\].
    motor_force: Triple,
    /// Largest length of `motor_force` \[N\].
    largest_motor_force: f64,
    /// Largest distance between the driver's position and the true position \[m\]; `None` if the driver never had a position.
    largest_error: Option<f64>,
    observed: Observed,
}

impl Truth {
    /// Reads the device's state after an exchange. `origin` is the origin of the driver's positions in the frame of the device \[m\].
    fn look(&mut self, simulator: &SharedSimulator, status: &Status, origin: Triple) {
        let look = |device: &mut Simulator| (device.position(), device.motor_force(), *device.observed());
        (self.position, self.motor_force, self.observed) = simulator.with(look);
        self.largest_motor_force = self.largest_motor_force.max(answer::length(self.motor_force));
        if let Some(reading) = status.reading {
            // The driver's position counts from `origin`, the device's from the base.
            let off = answer::length(std::array::from_fn(|axis| reading.position[axis] + origin[axis] - self.position[axis]));
            self.largest_error = Some(self.largest_error.unwrap_or(0.0).max(off));
        }
    }
}

/// Counts of the simulated device over the packets and bytes from the host.
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

    /// Returns the counts as one line of text.
    fn describe(&self) -> String {
        let Self { commands, garbage_bytes, misheard_bytes, largest_count, largest_count_unhomed, saturated, torque_timeouts } = self;
        format!(
            "the device took {commands} packets, {garbage_bytes} bytes of garbage and {misheard_bytes} at the wrong time; motor counts up to {largest_count}, {largest_count_unhomed} before it was homed; {saturated} saturated, {torque_timeouts} torque time-outs"
        )
    }
}
