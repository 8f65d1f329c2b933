//! `cohaptic stability`: what can be said about a scene without simulating it.

mod boundary;
mod certificate;
mod guarantee;
mod map;
mod point;
mod proof_blocks;
mod rows_file;
pub(crate) mod source;

use std::process::ExitCode;

use crate::arguments::{StabilityArguments, StabilityCommand};
use crate::failure::Failure;

/// Runs the command that was asked for.
pub(crate) fn stability(arguments: &StabilityArguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        StabilityCommand::Point(arguments) => point::point(arguments),
        StabilityCommand::Map(arguments) => map::map(arguments),
        StabilityCommand::Boundary(arguments) => boundary::boundary(arguments),
    }
}
