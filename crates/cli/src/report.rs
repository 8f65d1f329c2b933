//! Reports a command without a result: as a message on standard error, and under `--json` also as a document on standard output in place of the answer.

use std::io::{self, IsTerminal as _, Write as _};
use std::process::ExitCode;

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};
use cohaptic_scene::Diagnostic;
use cohaptic_units::{Visible, visible_lines};
use serde::Serialize;

use crate::document_schema::{DocumentSchema, document};
use crate::failure::{CLOSED, Failure, INTERRUPTED};
use crate::output;

/// Prints a failure on standard error, and under `--json` also as a document on standard output. Returns the exit status.
pub(crate) fn report(failure: &Failure) -> ExitCode {
    report_with(failure, failure.status())
}

/// Like [`report`], with the exit status of a command that has other statuses than those of failures.
pub(crate) fn report_with(failure: &Failure, status: u8) -> ExitCode {
    // A reader that closes a pipe has read enough. This is no error for the user, so no message is printed.
    if failure.status() == CLOSED {
        return ExitCode::from(status);
    }
    let message = failure.message();
    let (kind, colour) = if failure.status() == INTERRUPTED { ("interrupted", AnsiColor::Yellow) } else { ("error", AnsiColor::Red) };
    let style = if AutoStream::choice(&io::stderr()) == ColorChoice::Never { Style::new() } else { colour.on_default().bold() };
    // If standard error cannot be written to, only the exit status tells of the failure.
    let _ = io::stderr()
        .write_all(visible_lines(&format!("{kind}: {message}\n")).replacen(&format!("{kind}:"), &format!("{style}{kind}:{style:#}"), 1).as_bytes());
    if output::wants_json_error() {
        let _ = print(failure, &message, status);
    }
    ExitCode::from(status)
}

/// Prints a line about a command of the user that could not be run, with the name of the program in front, and under `--json` a document. Returns the exit
/// status.
pub(crate) fn command_failed(program: &str, why: &str, status: u8) -> ExitCode {
    // Without standard error only the status tells of the failure.
    let _ = write!(io::stderr(), "{}", visible_lines(&format!("{program}: {why}\n")));
    if output::wants_json_error() {
        let _ = print_without_place(why, status);
    }
    ExitCode::from(status)
}

/// Reports invalid arguments as clap does, and under `--json` also as a document. Returns the exit status, which for a fault is `fault_status`, also in the
/// document. Help and version are no faults, unless they cannot be printed.
pub(crate) fn wrong_usage(error: &clap::Error, fault_status: u8) -> ExitCode {
    // Help and version are printed here if standard output is no terminal, so that a failed write is reported. On a terminal clap prints them with colours.
    if !error.use_stderr() && !io::stdout().is_terminal() {
        return output::raw(error.render().to_string().as_bytes()).map_or_else(|failure| report(&failure), |()| ExitCode::SUCCESS);
    }
    // A message that cannot be printed is dropped, as in clap itself.
    let _ = error.print();
    if is_former_command(error) {
        let _ = writeln!(io::stderr(), "{FORMER_COMMAND}");
    }
    if !error.use_stderr() {
        return ExitCode::SUCCESS;
    }
    if output::wants_json_error() {
        let _ = print_usage(&error.render().to_string(), fault_status);
    }
    ExitCode::from(fault_status)
}

/// Hint for users of the former command `accuracy`, now a separate program.
const FORMER_COMMAND: &str =
    "\nSpeed against error is a program of its own: cargo run --release -p cohaptic-accuracy. Of one scene: cohaptic explain SCENE --cost.";

/// Returns whether the user typed `accuracy`, a command of earlier versions.
fn is_former_command(error: &clap::Error) -> bool {
    matches!(error.get(ContextKind::InvalidSubcommand), Some(ContextValue::String(command)) if command == "accuracy")
}

/// Escapes control characters in the typed texts of a refused argument, because control characters could disturb a terminal.
pub(crate) fn visible(mut error: clap::Error) -> clap::Error {
    let shown = |text: &String| Visible(text).to_string();
    let texts: Vec<(ContextKind, ContextValue)> = error
        .context()
        .filter_map(|(kind, value)| match value {
            ContextValue::String(text) => Some((kind, ContextValue::String(shown(text)))),
            ContextValue::Strings(texts) => Some((kind, ContextValue::Strings(texts.iter().map(shown).collect()))),
            // Advice may repeat the typed text. The advice is therefore escaped too, and loses its colours.
            ContextValue::StyledStrs(texts) => {
                Some((kind, ContextValue::StyledStrs(texts.iter().map(|text| StyledStr::from(shown(&text.to_string()))).collect())))
            }
            ContextValue::None | ContextValue::Bool(_) | ContextValue::StyledStr(_) | ContextValue::Number(_) | _ => None,
        })
        .collect();
    for (kind, value) in texts {
        error.insert(kind, value);
    }
    error
}

/// Prints the document of a failure. `message` is the message on standard error without `error:`.
fn print(failure: &Failure, message: &str, status: u8) -> Result<(), Failure> {
    let location = failure.scene_error().and_then(|error| error.diagnostic()).map(|diagnostic| location(failure, diagnostic));
    // The place is `null` for a failure that has no place in a text.
    output::json(DocumentSchema::ERROR, &document! { status: status, message: message, place: location })
}

/// Prints the document of invalid arguments.
fn print_usage(message: &str, status: u8) -> Result<(), Failure> {
    print_without_place(message.strip_prefix("error: ").unwrap_or(message).trim_end(), status)
}

fn print_without_place(message: &str, status: u8) -> Result<(), Failure> {
    output::json(DocumentSchema::ERROR, &document! { status: status, message: message, place: None::<()> })
}

fn location(failure: &Failure, diagnostic: &Diagnostic) -> impl Serialize {
    let argument = diagnostic.override_text().map(|text| {
        // The user types the keys of a link as plain words, without `--set` and without `link.`.
        let is_word = matches!(failure, Failure::LinkKeys(_));
        if is_word { text.strip_prefix("link.").unwrap_or(text).to_owned() } else { format!("{} {text}", failure.option()) }
    });
    document! {
        // `null` for an option.
        file: diagnostic.file().map(output::path),
        // The text on the command line; `null` for a file.
        argument: argument,
        // Lines and columns, in characters, count from 1.
        line: diagnostic.line(),
        column: diagnostic.column(),
        // The dotted path; `null` if the text could not be read that far.
        key: Some(diagnostic.key()).filter(|key| !key.is_empty()),
        // The fault at that place and the expectation, in one line.
        fault: diagnostic.message(),
    }
}
