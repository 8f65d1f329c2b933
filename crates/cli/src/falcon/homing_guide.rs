//! What a user is told on the way to an active device.

use cohaptic_falcon::driver::{Phase, Status};

use super::reach::say;
use crate::progress::Progress;

/// Says what to do whenever something else is to be done.
#[derive(Debug)]
pub(super) struct Guide {
    said: Option<Phase>,
    /// Whether somebody is going to ask for force.
    pushes: bool,
}

impl Guide {
    pub(super) const fn new(pushes: bool) -> Self {
        Self { said: None, pushes }
    }

    /// Says what to do in this phase, unless it is what was said last.
    pub(super) fn look(&mut self, status: &Status, line: &Progress) {
        if self.said == Some(status.phase) {
            return;
        }
        self.said = Some(status.phase);
        if let Some(what) = what_to_do(status.phase, self.pushes) {
            line.aside(|| say(what));
        }
    }
}

const fn what_to_do(phase: Phase, pushes: bool) -> Option<&'static str> {
    match phase {
        Phase::Silent | Phase::Stopped => None,
        Phase::Homing => Some("red light, not homed: pull the grip fully out, then push it fully in, until the light is blue"),
        Phase::Homed if pushes => Some("blue light, homed: pull the grip out once more, beyond 170 mm from the base, until the light is green"),
        Phase::Homed => Some("blue light, homed; no force goes out"),
        Phase::Active => Some("green light: active"),
    }
}
