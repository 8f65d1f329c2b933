//! `cohaptic exec`: runs commands in networks of their own, whose packets pass emulated links.

mod answer;
mod plan;

use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use cohaptic_exec::{Failed, Line, Outcome, Plan, Stream, capture_path};
use cohaptic_units::visible_lines;

use crate::arguments::ExecArguments;
use crate::failure::{EXEC_FAILED, Failure};
use crate::file::{own_folder, write_into};
use crate::{output, report};

/// Runs commands. The exit status is that of the command, or 125 to 127 for a command that could not be run.
pub(crate) fn exec(arguments: &ExecArguments) -> ExitCode {
    match try_exec(arguments) {
        Ok(status) => ExitCode::from(status),
        Err(failure) => {
            report::report(&failure);
            ExitCode::from(EXEC_FAILED)
        }
    }
}

fn try_exec(arguments: &ExecArguments) -> Result<u8, Failure> {
    let plan = plan::plan(arguments)?;
    // The folder belongs to this run until the report is written.
    let _folder = arguments.out.as_deref().map(own_folder).transpose()?;
    match cohaptic_exec::run(&plan, &|line| print(&plan, line)) {
        Ok(outcome) => {
            if let Some(folder) = &arguments.out {
                write(folder, &plan, &outcome)?;
            }
            Ok(outcome.status)
        }
        Err(Failed { status, why }) => {
            // Without standard error only the status tells of the failure.
            let _ = write!(io::stderr(), "{}", visible_lines(&format!("cohaptic exec: {why}\n")));
            Ok(status)
        }
    }
}

/// Prints a line of a command's output, with the name of its host in front, on the stream to which the command has written.
fn print(plan: &Plan, line: Line<'_>) {
    // A single call writes the whole line, so that lines of several hosts do not mix.
    let text = [plan.hosts[line.host].name.as_bytes(), b" | ", line.bytes, b"\n"].concat();
    // The commands run on to their end even if nobody reads the output any more, so a failed write is ignored.
    let _ = match line.stream {
        Stream::Output => io::stdout().lock().write_all(&text).and_then(|()| io::stdout().flush()),
        Stream::Error => io::stderr().lock().write_all(&text),
    };
}

/// Writes the report, and names the files of the run.
fn write(folder: &Path, plan: &Plan, outcome: &Outcome) -> Result<(), Failure> {
    let captures = plan.hosts.iter().map(|host| output::path(&capture_path(folder, &host.name)));
    let report = write_into(folder, "report.txt", answer::describe(plan, outcome))?;
    if let Some(error) = &outcome.report.capture_error {
        return Err(Failure::System(format!("the captures in {} are not whole: {error}", output::path(folder))));
    }
    output::wrote(captures.chain([report]));
    Ok(())
}
