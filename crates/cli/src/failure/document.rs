//! What went wrong, for programs: the document that stands on standard output in place of the answer.

use cohaptic_scene::Diagnostic;
use serde::Serialize;

use super::Failure;
use crate::document_schema::DocumentSchema;
use crate::output;

#[derive(Serialize)]
struct Document<'a> {
    /// The exit status.
    status: u8,
    /// As on standard error, without `error:`.
    message: &'a str,
    /// Where it is; `null` where no text is meant.
    place: Option<Place<'a>>,
}

#[derive(Serialize)]
struct Place<'a> {
    /// `null` for an option.
    file: Option<String>,
    /// What was given on the command line; `null` for a file.
    argument: Option<String>,
    /// From 1.
    line: usize,
    /// From 1, in characters.
    column: usize,
    /// The dotted path; `null` if the text could not be read that far.
    key: Option<&'a str>,
    /// The fault at that place and the expectation, in one line.
    fault: &'a str,
}

/// Prints the document of a failure.
pub(super) fn print(failure: &Failure, message: &str, status: u8) -> Result<(), Failure> {
    let place = failure.scene_error().and_then(|error| error.diagnostic()).map(|diagnostic| place(failure, diagnostic));
    output::json(DocumentSchema::Error, &Document { status, message, place })
}

/// Prints the document of arguments that make no sense.
pub(super) fn print_usage(message: &str, status: u8) -> Result<(), Failure> {
    let message = message.strip_prefix("error: ").unwrap_or(message).trim_end();
    output::json(DocumentSchema::Error, &Document { status, message, place: None })
}

fn place<'a>(failure: &Failure, diagnostic: &'a Diagnostic) -> Place<'a> {
    let argument = diagnostic.override_text().map(|text| {
        // Keys of a link are words of their own, and no override.
        let is_word = matches!(failure, Failure::LinkKeys(_));
        if is_word { text.strip_prefix("link.").unwrap_or(text).to_owned() } else { format!("{} {text}", failure.option()) }
    });
    let key = diagnostic.key();
    Place {
        file: diagnostic.file().map(output::path),
        argument,
        line: diagnostic.line(),
        column: diagnostic.column(),
        key: (!key.is_empty()).then_some(key),
        fault: diagnostic.message(),
    }
}
