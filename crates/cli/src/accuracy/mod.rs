//! `cohaptic accuracy`.

use std::fmt::Write as _;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Instant as Clock, SystemTime, UNIX_EPOCH};

use cohaptic_accuracy::{About, AccuracyError, Options, Row, Subject, Watch, csv, html, measure, plots, text};
use cohaptic_picture::Size;
use cohaptic_units::print::Counted;
use serde::Serialize;

use crate::arguments::AccuracyArguments;
use crate::document_schema::{DocumentSchema, document};
use crate::failure::{Failure, INTERRUPTED};
use crate::file::write_file;
use crate::progress::Progress;
use crate::{interrupt, output};

/// Shows how far the work is, and keeps every row, so that none is lost if the work is ended early.
struct Keeper {
    bar: Progress,
    rows: Arc<Mutex<Vec<Row>>>,
}

impl Watch for Keeper {
    fn row(&self, row: &Row) {
        self.bar.one_more();
        self.bar.note(format!("{}, {}", row.subject.name(), row.case));
        self.rows.lock().unwrap_or_else(PoisonError::into_inner).push(row.clone());
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Measures speed against error.
pub(crate) fn accuracy(arguments: &AccuracyArguments) -> Result<ExitCode, Failure> {
    if let Some(folder) = &arguments.out {
        // A folder that cannot be had is found out before the work, not after it.
        std::fs::create_dir_all(folder).map_err(|error| Failure::File { verb: "create", path: folder.clone(), error })?;
    }
    let subjects: &[Subject] = if arguments.only.is_empty() { &Subject::ALL } else { &arguments.only };
    let keeper = Keeper { bar: Progress::new(0, "{spinner} {pos} rows measured, {elapsed} passed: {msg}"), rows: Arc::default() };
    let start = Clock::now();
    let (rows, out, json, line) = (Arc::clone(&keeper.rows), arguments.out.clone(), arguments.json, made_by(arguments));
    let size = arguments.pictures.size();
    // A row may take longer than there is time.
    interrupt::keep(move || {
        let rows = rows.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let said = format!("{} kept that had been measured until then", output::are(rows.len(), "row"));
        let concluded = Conclusion { rows, about: About { line, partial: true }, out, json, size, wall_s: start.elapsed().as_secs_f64() }.tell();
        concluded.map_or_else(|_| "the rows measured until then cannot be written".to_owned(), |()| said)
    });
    let measured = measure(subjects, Options { quick: arguments.quick }, &keeper);
    interrupt::kept();
    let wall_s = start.elapsed().as_secs_f64();
    keeper.bar.clear();
    // A fault of a scene of the program's own, which loses what was measured before it as little as Ctrl-C does.
    let (interrupted, fault) = match measured {
        Ok(_) => (false, None),
        Err(AccuracyError::Stopped) => (true, None),
        Err(error) => (true, Some(Failure::System(format!("the measurement ended early: {error}")))),
    };
    let rows = std::mem::take(&mut *keeper.rows.lock().unwrap_or_else(PoisonError::into_inner));
    let about = About { line: made_by(arguments), partial: interrupted };
    Conclusion { rows, about, out: arguments.out.clone(), json: arguments.json, size, wall_s }.tell()?;
    if let Some(fault) = fault {
        return Err(fault);
    }
    Ok(if interrupted { ExitCode::from(INTERRUPTED) } else { ExitCode::SUCCESS })
}

/// What was measured, and where it goes.
struct Conclusion {
    rows: Vec<Row>,
    about: About,
    out: Option<PathBuf>,
    json: bool,
    size: Size,
    wall_s: f64,
}

impl Conclusion {
    /// Writes the files and prints the rows; what was measured is printed even if the disk is full.
    fn tell(&self) -> Result<(), Failure> {
        let Self { rows, about, out, json, size, wall_s } = self;
        let written = out.as_ref().map_or(Ok(()), |folder| write(folder, rows, about, *size));
        if *json {
            output::json(
                DocumentSchema::ACCURACY,
                // Interrupted: the rows are only those that were measured until Ctrl-C, or until a fault.
                &document! { rows: rows.iter().map(document).collect::<Vec<_>>(), interrupted: about.partial, wall_s: *wall_s },
            )?;
        } else {
            let mut shown = text(rows);
            if about.partial {
                let _ = writeln!(shown, "INTERRUPTED after {wall_s:.1} s: this is what was measured until then, {}", Counted(rows.len(), "row"));
            }
            output::text(&shown)?;
            output::wrote(out.as_ref().filter(|_| written.is_ok()).map(|folder| folder.join("index.html")));
        }
        written
    }
}

fn document(row: &Row) -> impl Serialize {
    document! {
        subject: row.subject.name(),
        case: row.case.as_str(),
        method: row.method.as_str(),
        setting: row.setting.as_str(),
        cost: row.cost,
        cost_unit: row.cost_unit,
        error: row.error,
        error_unit: row.error_unit,
        reference: row.reference,
        note: row.note.as_str(),
    }
}

/// The program, the command, the processor and the date.
fn made_by(arguments: &AccuracyArguments) -> String {
    let mut command = "cohaptic accuracy".to_owned();
    if arguments.quick {
        command.push_str(" --quick");
    }
    if !arguments.only.is_empty() {
        let names: Vec<&str> = arguments.only.iter().map(|subject| subject.name()).collect();
        command.push_str(" --only ");
        command.push_str(&names.join(","));
    }
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    format!("{command}, version {}, on {}, {}.", env!("CARGO_PKG_VERSION"), processor(), date(seconds / 86_400))
}

/// What the processor calls itself, where the system says that.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    named.map_or_else(|| format!("a processor of the kind {}", std::env::consts::ARCH), |(_, name)| name.to_owned())
}

/// The date (UTC) of a day since 1 January 1970, in years of 400, 100, 4 and 1 that begin in March, when leap days come last.
fn date(day: u64) -> String {
    // 1 March 0000 was 719,468 days before 1 January 1970.
    let day = day + 719_468;
    let (era, in_era) = (day / 146_097, day % 146_097);
    let year_of_era = (in_era - in_era / 1460 + in_era / 36_524 - in_era / 146_096) / 365;
    let in_year = in_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * in_year + 2) / 153;
    let of_month = in_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{of_month:02}")
}

/// The rows of a whole measurement, and those of one that was interrupted: a script that reads the first never takes the second for it.
const WHOLE: &str = "rows.csv";
const PARTIAL: &str = "rows-interrupted.csv";

/// Writes all files with pictures of this size, the page last. Each has its name only when it is whole.
fn write(folder: &Path, rows: &[Row], about: &About, size: Size) -> Result<(), Failure> {
    let (name, other) = if about.partial { (PARTIAL, WHOLE) } else { (WHOLE, PARTIAL) };
    write_file(&folder.join(name), csv(rows))?;
    // Of the measurement before, which the pictures and the page no longer belong to.
    let old = folder.join(other);
    match std::fs::remove_file(&old) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(Failure::File { verb: "remove", path: old, error }),
        Ok(()) | Err(_) => {}
    }
    for plot in plots(rows, size) {
        write_file(&folder.join(format!("{}.svg", plot.id)), &plot.svg)?;
    }
    write_file(&folder.join("index.html"), html(rows, about, size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (day, text) in [
            (0, "1970-01-01"),
            (58, "1970-02-28"),
            (59, "1970-03-01"),
            (789, "1972-02-29"),
            (10_957, "2000-01-01"),
            (11_016, "2000-02-29"),
            (47_540, "2100-02-28"),
            (47_541, "2100-03-01"),
        ] {
            assert_eq!(date(day), text, "{day}");
        }
    }
}
