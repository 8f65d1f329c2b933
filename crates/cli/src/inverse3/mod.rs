//! `cohaptic inverse3`: probes, watches or simulates a Haply Inverse3.
//!
//! ```text
//!   probe  watch  simulate
//!     └──┬───┘       │
//!      bench         │         a device by the wall clock, one turn per millisecond
//!        └─────┬─────┘
//!            answer            parts of the answers
//! ```

mod answer;
mod bench;
mod probe;
mod simulate;
mod watch;

use std::process::ExitCode;

use crate::arguments::{Inverse3Arguments, Inverse3Command};
use crate::failure::Failure;

pub(crate) use answer::Exchanges;

/// Runs the subcommand of the arguments.
pub(crate) fn inverse3(arguments: &Inverse3Arguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        Inverse3Command::Probe(arguments) => probe::probe(arguments),
        Inverse3Command::Watch(arguments) => watch::watch(arguments),
        Inverse3Command::Simulate(arguments) => simulate::simulate(arguments),
    }
}
