//! `cohaptic stability`: what can be said about a scene without simulating it.

mod boundary;
mod lines;
mod map;
mod point;
mod quantity;
mod rows_file;
mod source;
mod variants;

use std::path::Path;
use std::process::ExitCode;

use cohaptic_stability::AnalysisError;

use crate::arguments::{StabilityArguments, StabilityCommand};
use crate::failure::Failure;
use crate::output;

/// Runs the command that was asked for.
pub(crate) fn stability(arguments: &StabilityArguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        StabilityCommand::Point(arguments) => point::point(arguments),
        StabilityCommand::Map(arguments) => map::map(arguments),
        StabilityCommand::Boundary(arguments) => boundary::boundary(arguments),
    }
}

/// Why a scene that makes sense cannot be analysed.
fn not_analysed(scene: &Path, error: &AnalysisError) -> Failure {
    Failure::Input(format!("{}: {error}", output::path(scene)))
}
