//! `cohaptic stability`: analyses and proves the stability of scenes without simulating the scenes.
//!
//! `point` judges a scene, `map` a plane of two keys, and `boundary` a range of a key. The remaining modules are shared by these three.

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

/// Runs the subcommand of the arguments.
pub(crate) fn stability(arguments: &StabilityArguments) -> Result<ExitCode, Failure> {
    match &arguments.command {
        StabilityCommand::Point(arguments) => point::point(arguments),
        StabilityCommand::Map(arguments) => map::map(arguments),
        StabilityCommand::Boundary(arguments) => boundary::boundary(arguments),
    }
}
