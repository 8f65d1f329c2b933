//! `cohaptic falcon home`: waits until a user has homed the device, without any force on the grip. The messages for the user are those of `watch`, too.

use std::process::ExitCode;
use std::time::Duration;

use cohaptic_falcon::driver::{Phase, Status};
use cohaptic_falcon::kinematics::Triple;
use cohaptic_units::print::Span;

use super::answer::{self, Identity, Seen, Traffic};
use super::bench::{Bench, End, Go, Task};
use super::probe::WITHOUT_FORCE;
use super::reach::{self, FirmwareState};
use crate::arguments::HomeArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::{Failure, INTERRUPTED};
use crate::output;
use crate::progress::Progress;
use crate::realtime::say;

/// Waits until a user has homed the device and pulled the grip out, for at most the time of `--for`. A device that is not active by then is a failure.
pub(super) fn home(arguments: &HomeArguments) -> Result<ExitCode, Failure> {
    let which = &arguments.which;
    // The file is read before the device is opened, so that a missing file leaves the device alone.
    let firmware = reach::read_firmware(which.firmware.as_deref())?;
    let target = reach::target(which)?;
    let mut way = target.open().map_err(|error| Failure::System(error.to_string()))?;
    let state = reach::make_ready(&mut way, firmware.as_ref()).map_err(Failure::System)?;
    let mut bench = Bench::open(way, WITHOUT_FORCE).map_err(|error| Failure::System(error.to_string()))?;
    let mut homing = Homing { guide: Guide::new(true), line: Progress::new(0, "{msg}"), last: *bench.status(), until: Duration::ZERO };
    let end = bench.run(Some(arguments.length), &mut homing);
    // The line is cleared before any failure is printed.
    homing.line.clear();
    let (end, traffic) = (end?, Traffic::of(&bench, homing.until));
    let (seen, is_homed, is_active) = (Seen::of(&homing.last), homing.last.reading.is_some(), homing.last.phase == Phase::Active);
    let document = document! {
        #[serde(flatten)]
        identity: Identity::of(&target),
        firmware: state.name(),
        // A reading exists only if all three axes are homed.
        is_homed: is_homed,
        is_active: is_active,
        ending: end.name(),
        #[serde(flatten)]
        traffic: &traffic,
        #[serde(flatten)]
        seen: &seen,
    };
    let words = || describe(&target.name(), state, (is_homed, is_active), &traffic, &seen);
    output::answer(which.json, DocumentSchema::FALCON_HOME, &document, words, output::NO_FILES)?;
    match end {
        End::Enough => Ok(ExitCode::SUCCESS),
        End::Interrupted => Ok(ExitCode::from(INTERRUPTED)),
        End::Failed(error) => Err(Failure::System(error.to_string())),
        End::Over => Err(Failure::System(format!(
            "after {} the device is {}: pull the grip fully out, push it fully in, and pull it out again; --for gives more time",
            Span(arguments.length),
            if is_homed { "homed, but its grip was not pulled out beyond 170 mm" } else { "not homed" }
        ))),
    }
}

fn describe(name: &str, firmware: FirmwareState, homed_and_active: (bool, bool), traffic: &Traffic, seen: &Seen) -> String {
    let mut lines = Vec::new();
    if firmware == FirmwareState::Loaded {
        lines.push("its firmware was loaded just now".to_owned());
    }
    let seconds = traffic.seconds;
    lines.push(match homed_and_active {
        (_, true) => format!("homed and active after {seconds:.1} s"),
        (true, false) => format!("homed, and not active after {seconds:.1} s"),
        (false, false) => format!("not homed after {seconds:.1} s"),
    });
    lines.extend(seen.position_m.map(|position| format!("the grip is at {} from the origin", answer::place(position))));
    lines.extend(answer::seen(seen));
    lines.extend(answer::traffic(traffic));
    answer::block(name, &lines)
}

/// The task of `home`: guides the user, and keeps the last status.
struct Homing {
    guide: Guide,
    line: Progress,
    /// Status after the last exchange.
    last: Status,
    /// Time from the first exchange to the end of the last.
    until: Duration,
}

impl Task for Homing {
    /// Asks for a force of zero. A device becomes active, and the light turns green, only while somebody asks for force.
    fn wants(&mut self, _at: Duration, _status: &Status) -> Option<Triple> {
        Some([0.0; 3])
    }

    fn look(&mut self, at: Duration, status: &Status) -> Result<Go, Failure> {
        (self.last, self.until) = (*status, at);
        self.guide.look(status, &self.line);
        if self.line.is_seen() {
            let homed = status.homed.map(|homed| if homed { "homed" } else { "-" });
            self.line.show(format!("{:.1} s: top {}, right {}, left {}", at.as_secs_f64(), homed[0], homed[1], homed[2]));
        }
        Ok(if status.phase == Phase::Active { Go::Enough } else { Go::On })
    }
}

/// Prints the next step of homing whenever the driver's phase changes.
#[derive(Debug)]
pub(super) struct Guide {
    /// Phase seen last. The message of the phase, if any, has been printed.
    said: Option<Phase>,
    /// `true` if the command asks the device for force. Without force the device never becomes active, and the last step of homing is left out.
    pushes: bool,
}

impl Guide {
    pub(super) const fn new(pushes: bool) -> Self {
        Self { said: None, pushes }
    }

    /// Prints the message of the present phase to standard error, unless the phase is the same as at the last call.
    pub(super) fn look(&mut self, status: &Status, line: &Progress) {
        if self.said == Some(status.phase) {
            return;
        }
        // Phases without a message are noted too: a return from such a phase prints the message of the earlier phase again.
        self.said = Some(status.phase);
        if let Some(what) = what_to_do(status.phase, self.pushes) {
            line.aside(|| say(what));
        }
    }
}

/// Returns the message of a phase; `None` for phases in which the user has nothing to do.
const fn what_to_do(phase: Phase, pushes: bool) -> Option<&'static str> {
    match phase {
        Phase::Silent | Phase::Stopped => None,
        Phase::Homing => Some("red light, not homed: pull the grip fully out, then push it fully in, until the light is blue"),
        Phase::Homed if pushes => Some("blue light, homed: pull the grip out once more, beyond 170 mm from the base, until the light is green"),
        Phase::Homed => Some("blue light, homed; no force goes out"),
        Phase::Active => Some("green light: active"),
    }
}
