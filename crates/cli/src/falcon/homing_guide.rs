//! Messages for a user during homing, from a silent device to an active device.

use cohaptic_falcon::driver::{Phase, Status};

use super::reach::say;
use crate::progress::Progress;

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
