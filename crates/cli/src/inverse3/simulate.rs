//! `cohaptic inverse3 simulate`: runs the client against a simulated service in virtual time; or serves the simulated device to other programs by the wall
//! clock.

use std::net::SocketAddr;
use std::process::ExitCode;
use std::time::Duration;

use cohaptic_device::{Device as _, Gate, Limits, Moment};
use cohaptic_inverse3::client::{ClientConfig, Phase};
use cohaptic_inverse3::protocol::Format;
use cohaptic_inverse3::service::{Fault, FaultKind, Observed, Service, ServiceConfig, When};
use cohaptic_inverse3::socket::{ServiceThread, StartError};
use cohaptic_inverse3::stepped::SteppedInverse3;
use cohaptic_units::Instant;
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::answer::{Exchanges, Seen, seen};
use super::bench::{PERIOD, SWAY};
use crate::arguments::{FaultText, FaultWhen, FormatName, Inverse3SimulateArguments};
use crate::device_text::{Triple, block, length};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::realtime::say;
use crate::{interrupt, output};

/// Simulated time without `--for`.
const USUAL: Duration = Duration::from_secs(6);
/// Largest number of phase changes in the answer. With many faults the phase may change every few milliseconds.
const CHANGES: usize = 100;

/// Runs or serves the simulated device, and writes the answer.
pub(super) fn simulate(arguments: &Inverse3SimulateArguments) -> Result<ExitCode, Failure> {
    let faults = arguments.fault.iter().map(fault).collect::<Result<Vec<_>, _>>().map_err(Failure::Input)?;
    let format = match arguments.format {
        FormatName::Old => Format::V31,
        FormatName::Current => Format::V35,
    };
    let config = ServiceConfig { seed: arguments.seed, format, reply_after: arguments.reply_after, faults, ..ServiceConfig::default() };
    let service = Service::new(config, SWAY);
    match arguments.listen {
        Some(address) => serve(service, address, arguments),
        None => run(service, arguments),
    }
}

/// Returns a fault of the command line.
fn fault(text: &FaultText) -> Result<Fault, String> {
    let names = || FaultKind::ALL.map(FaultKind::name).join(", ");
    let kind = FaultKind::ALL.into_iter().find(|kind| kind.name() == text.name);
    let kind = kind.ok_or_else(|| format!("--fault: there is no fault {:?}: expected one of {}", text.name, names()))?;
    match text.when {
        FaultWhen::Chance(_) if !kind.hits_replies() => {
            Err(format!("--fault: {} is a state of service or device: expected {}@TIME+LENGTH", text.name, text.name))
        }
        FaultWhen::Chance(chance) => Ok(Fault { kind, when: When::Chance(chance.get()) }),
        FaultWhen::During(from, length) => Ok(Fault::during(kind, Instant::ZERO.saturating_add(from), length)),
    }
}

#[derive(Serialize)]
struct SimulateDocument {
    seed: u64,
    asked_n: Option<Triple>,
    ending: &'static str,
    changes: Vec<Change>,
    more_changes: u64,
    #[serde(flatten)]
    seen: Seen,
    exchanges: Exchanges,
    device: DeviceDocument,
    true_position_m: Triple,
    motor_force_n: Triple,
    largest_motor_force_n: f64,
}

/// A change of the client's phase: instant of the change \[s\], and name of the new phase.
#[derive(Serialize)]
struct Change {
    t_s: f64,
    phase: &'static str,
}

fn run(service: Service, arguments: &Inverse3SimulateArguments) -> Result<ExitCode, Failure> {
    let limits = Limits { force: arguments.limit, ..Limits::DEFAULT };
    // Services before 3.5 have no origin in the middle: the base of the simulated device has these coordinates.
    let origin = (arguments.format == FormatName::Old).then_some(cohaptic_inverse3::service::MIDDLE);
    let config = ClientConfig { limits, origin, ..ClientConfig::DEFAULT };
    let mut device = SteppedInverse3::new(service, config).map_err(|error| Failure::Input(error.to_string()))?;
    let mut gate = Gate::new(limits, device.stopper()).map_err(|error| Failure::Input(error.to_string()))?;
    let (mut changes, mut more_changes, mut phase, mut largest) = (Vec::new(), 0, None, 0.0_f64);
    let length_of_run = arguments.length.unwrap_or(USUAL);
    let (mut now, mut ending) = (Instant::ZERO, "complete");
    while now.as_nanos() < u64::try_from(length_of_run.as_nanos()).unwrap_or(u64::MAX) {
        if interrupt::requested() {
            ending = "interrupted";
            break;
        }
        let at = device.read(now).map(|_| now);
        let wanted = arguments.force.map(|force| force.0);
        let moment = Moment { now, ready: at.is_some(), armed: at.is_some(), reading_at: at, setpoint_at: wanted.map(|_| now) };
        device.hold(now, PERIOD, gate.admit(wanted.unwrap_or_default(), &moment).force);
        now += PERIOD;
        largest = largest.max(length(device.service().motor_force()));
        let present = device.snapshot().phase;
        if phase != Some(present) {
            phase = Some(present);
            if changes.len() < CHANGES {
                changes.push(Change { t_s: now.as_secs_f64(), phase: present.name() });
            } else {
                more_changes += 1;
            }
        }
    }
    let last = device.snapshot();
    // The final state is read after the stop: the motors show whether the force was switched off.
    device.stop();
    debug_assert!(matches!(device.snapshot().phase, Phase::Stopped | Phase::Refused(_)), "{:?}", device.snapshot());
    let document = SimulateDocument {
        seed: arguments.seed,
        asked_n: arguments.force.map(|force| force.0),
        ending,
        changes,
        more_changes,
        seen: Seen::of(&last),
        exchanges: Exchanges::of(&device.report(), PERIOD),
        device: DeviceDocument::of(device.service().observed()),
        true_position_m: device.service().position(),
        motor_force_n: device.service().motor_force(),
        largest_motor_force_n: largest,
    };
    let describe = || {
        let mut lines: Vec<String> = document.changes.iter().map(|change| format!("{:7.3} s  {}", change.t_s, change.phase)).collect();
        if document.more_changes > 0 {
            lines.push(format!("and {}", Counted(document.more_changes, "more change")));
        }
        lines.extend(seen(&last));
        lines.extend(document.exchanges.lines());
        let end = length(document.motor_force_n);
        lines.push(format!("the motors pushed with {:.3} N at most, and with {end:.3} N after the stop", document.largest_motor_force_n));
        lines.push(document.device.describe());
        block(&format!("simulated Inverse3, seed {}", document.seed), &lines)
    };
    output::answer(arguments.json, DocumentSchema::INVERSE3_SIMULATE, &document, describe, output::NO_FILES)?;
    Ok(if ending == "interrupted" { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// Counts of the simulated service over the messages of programs.
#[derive(Serialize)]
struct DeviceDocument {
    messages: u64,
    unreadable: u64,
    forces: u64,
    largest_force_n: f64,
    idled: u64,
}

impl DeviceDocument {
    const fn of(observed: &Observed) -> Self {
        let Observed { messages, unreadable, forces, largest_force, idled } = *observed;
        Self { messages, unreadable, forces, largest_force_n: largest_force, idled }
    }

    /// Returns the counts as one line of text.
    fn describe(&self) -> String {
        let Self { messages, unreadable, forces, largest_force_n, idled } = self;
        let idled = format!("the device idled {}", Counted(*idled, "time"));
        format!("the service took {messages} messages, {unreadable} not JSON, {forces} with a force, at most {largest_force_n:.3} N; {idled}")
    }
}

#[derive(Serialize)]
struct ServeDocument {
    address: String,
    ending: &'static str,
    device: DeviceDocument,
    true_position_m: Triple,
}

fn serve(service: Service, address: SocketAddr, arguments: &Inverse3SimulateArguments) -> Result<ExitCode, Failure> {
    let thread = ServiceThread::start(service, address).map_err(|error| match error {
        StartError::Remote(_) => Failure::Input(error.to_string()),
        StartError::Config(_) | StartError::Listen(..) | StartError::Thread(_) | _ => Failure::System(error.to_string()),
    })?;
    let address = format!("ws://{}/", thread.address());
    say(&format!("a simulated Inverse3 is served at {address}: end with Ctrl-C"));
    interrupt::has_results();
    let mut ending = "complete";
    while arguments.length.is_none_or(|length| u128::from(thread.now().as_nanos()) < length.as_nanos()) {
        if interrupt::requested() {
            ending = "interrupted";
            break;
        }
        if !thread.is_running() {
            return Err(Failure::System("the thread of the service has ended".to_owned()));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let (device, true_position_m) = thread.with(|service| (DeviceDocument::of(service.observed()), service.position()));
    let document = ServeDocument { address, ending, device, true_position_m };
    let describe = || block(&document.address, &[document.device.describe()]);
    output::answer(arguments.json, DocumentSchema::INVERSE3_SERVE, &document, describe, output::NO_FILES)?;
    Ok(if ending == "interrupted" { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

#[cfg(test)]
mod tests {
    use cohaptic_units::Probability;

    use super::*;

    #[test]
    fn faults_are_known_by_name() {
        let chance = |name: &str| fault(&FaultText { name: name.to_owned(), when: FaultWhen::Chance(Probability::new(0.5).unwrap()) });
        assert_eq!(chance("late"), Ok(Fault { kind: FaultKind::Late, when: When::Chance(0.5) }));
        assert!(chance("restart").unwrap_err().contains("restart@TIME+LENGTH"));
        assert!(chance("early").unwrap_err().contains("late, missing, doubled"));
    }
}
