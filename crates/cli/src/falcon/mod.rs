//! `cohaptic falcon`: looks at a Novint Falcon, homes it, watches it, or simulates one.
//!
//! ```text
//!   probe  home  watch  simulate
//!     └─────┴──┬───┴───────┘
//!            bench               exchanges, one a millisecond
//!              │
//!            reach               a device over USB or a simulated one, with firmware in it
//!              │
//!             way                bytes and a clock, whichever it is
//! ```

mod answer;
mod bench;
mod home;
mod homing_guide;
mod probe;
mod reach;
mod simulate;
mod watch;

use std::process::ExitCode;

use crate::arguments::{FalconArguments, FalconCommand};
use crate::failure::Failure;

/// Runs the command that was asked for.
pub(crate) fn falcon(arguments: &FalconArguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        FalconCommand::Probe(arguments) => probe::probe(arguments),
        FalconCommand::Home(arguments) => home::home(arguments),
        FalconCommand::Watch(arguments) => watch::watch(arguments),
        FalconCommand::Simulate(arguments) => simulate::simulate(arguments),
    }
}
