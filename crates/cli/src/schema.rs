//! `cohaptic schema`.

use std::process::ExitCode;

use cohaptic_scene::schema::FileSchema;

use crate::arguments::{FileKind, SchemaArguments};
use crate::failure::Failure;
use crate::output;

/// Prints the JSON Schema of a kind of file.
pub(crate) fn schema(arguments: &SchemaArguments) -> Result<ExitCode, Failure> {
    let kind = match arguments.kind {
        FileKind::Scene => FileSchema::Scene,
        FileKind::Relay => FileSchema::Relay,
        FileKind::Router => FileSchema::Router,
    };
    output::raw(format!("{}\n", kind.json()).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
