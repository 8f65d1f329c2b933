//! `cohaptic falcon`: probes, homes, watches or simulates a Novint Falcon.
//!
//! ```text
//!   probe  home  watch  simulate
//!     └─────┴──┬───┴───────┘
//!            bench               exchanges, one per millisecond
//!              │
//!            reach               opens a USB device or a simulated device, and loads its firmware
//!              │
//!        AnyTransport            bytes and a clock, for both kinds of device
//! ```

mod answer;
mod bench;
mod home;
mod probe;
mod reach;
mod simulate;
mod watch;

use std::process::ExitCode;

use cohaptic_falcon::boot::Progress;

use crate::arguments::{FalconArguments, FalconCommand};
use crate::failure::Failure;

/// Runs the subcommand of the arguments.
pub(crate) fn falcon(arguments: &FalconArguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        FalconCommand::Probe(arguments) => probe::probe(arguments),
        FalconCommand::Home(arguments) => home::home(arguments),
        FalconCommand::Watch(arguments) => watch::watch(arguments),
        FalconCommand::Simulate(arguments) => simulate::simulate(arguments),
    }
}

/// Describes the progress of loading the firmware of a Falcon. Returns `None` for events too frequent for a line.
pub(crate) fn loading(progress: Progress) -> Option<String> {
    match progress {
        Progress::Attempt(attempt) => Some(format!("loading the firmware, attempt {attempt}")),
        Progress::Greeted(_) => Some("the boot loader answers".to_owned()),
        // Each block of bytes is an event, and only the last block gets a line.
        Progress::Loaded { done, of } => (done == of).then(|| format!("all {of} bytes are sent")),
        Progress::Failed(error) => Some(error.to_string()),
        Progress::Running => Some("its firmware runs".to_owned()),
    }
}
