//! `cohaptic exec`: runs commands in networks of their own, whose packets pass emulated links.

mod answer;
mod lost;
mod plan;
mod trials;

use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use cohaptic_exec::{Failed, Line, Outcome, Plan, Stream, capture_path};

use crate::arguments::ExecArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{EXEC_FAILED, Failure};
use crate::file::{own_folder, write_into};
use crate::{output, report};
use trials::Stop;

/// Runs commands. The exit status is that of the command, or 125 to 127 for a command that could not be run.
pub(crate) fn exec(arguments: &ExecArguments) -> ExitCode {
    match try_exec(arguments) {
        Ok(status) => ExitCode::from(status),
        Err(Stop::Failure(failure)) => report::report_with(&failure, EXEC_FAILED),
        Err(Stop::Failed(Failed { status, why })) => report::command_failed("cohaptic exec", &why, status),
        Err(Stop::Signal(number, so_far)) => {
            let why = format!("a signal has ended the trials{so_far}");
            report::report_with(&Failure::Interrupted(why), 128 + number)
        }
    }
}

fn try_exec(arguments: &ExecArguments) -> Result<u8, Stop> {
    let plan = plan::plan(arguments)?;
    // The folder belongs to this run until the report is written.
    let _folder = arguments.out.as_deref().map(own_folder).transpose()?;
    if arguments.seeds.is_some() || arguments.runs.is_some() {
        return trials::run(arguments, &plan);
    }
    let outcome = cohaptic_exec::run(&plan, &|line| print(&plan, line, arguments.json)).map_err(Stop::Failed)?;
    let files = match &arguments.out {
        Some(folder) => write(folder, &plan, &outcome)?,
        None => Vec::new(),
    };
    if arguments.json {
        output::json(DocumentSchema::EXEC, &answer::document(&plan, &outcome, files))?;
    }
    Ok(outcome.status)
}

/// Prints a line of a command's output, with the name of its host in front, on the stream to which the command has written. Under `--json` standard output
/// is for the document alone.
fn print(plan: &Plan, line: Line<'_>, json: bool) {
    // A single call writes the whole line, so that lines of several hosts do not mix.
    let text = [plan.hosts[line.host].name.as_bytes(), b" | ", line.bytes, b"\n"].concat();
    // The commands run on to their end even if nobody reads the output any more, so a failed write is ignored.
    let _ = match line.stream {
        Stream::Output if !json => io::stdout().lock().write_all(&text).and_then(|()| io::stdout().flush()),
        Stream::Output | Stream::Error => io::stderr().lock().write_all(&text),
    };
}

/// Writes the report, and names the files of the run. Returns the names.
fn write(folder: &Path, plan: &Plan, outcome: &Outcome) -> Result<Vec<String>, Failure> {
    let captures = plan.hosts.iter().map(|host| output::path(&capture_path(folder, &host.name)));
    let report = write_into(folder, "report.txt", answer::describe(plan, outcome))?;
    if let Some(error) = &outcome.report.capture_error {
        return Err(Failure::System(format!("the captures in {} are not whole: {error}", output::path(folder))));
    }
    let files: Vec<String> = captures.chain([report]).collect();
    output::wrote(&files);
    Ok(files)
}
