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
