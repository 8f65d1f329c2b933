//! `cohaptic accuracy`.

mod files;
mod machine;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant as Clock;

use cohaptic_accuracy::{About, AccuracyError, Options, Row, Subject, Watch, measure, text};
use cohaptic_picture::Size;
use serde::Serialize;

use cohaptic_units::print::Counted;

use crate::arguments::AccuracyArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, INTERRUPTED};
use crate::progress::Progress;
use crate::{interrupt, output};

#[derive(Serialize)]
struct AccuracyDocument<'a> {
    rows: Vec<RowDocument<'a>>,
    /// Whether the rows are only those that were measured until Ctrl-C, or until a fault.
    interrupted: bool,
    wall_s: f64,
}

#[derive(Serialize)]
struct RowDocument<'a> {
    subject: &'a str,
    case: &'a str,
    method: &'a str,
    setting: &'a str,
    cost: Option<f64>,
    cost_unit: &'a str,
    error: Option<f64>,
    error_unit: &'a str,
    reference: &'a str,
    note: &'a str,
}

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
    let keeper = Keeper { bar: Progress::through_measurements(), rows: Arc::default() };
    let start = Clock::now();
    let (rows, out, json, line) = (Arc::clone(&keeper.rows), arguments.out.clone(), arguments.json, machine::line(arguments));
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
    let about = About { line: machine::line(arguments), partial: interrupted };
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
        let written = out.as_ref().map_or(Ok(()), |folder| files::write(folder, rows, about, *size));
        if *json {
            output::json(
                DocumentSchema::ACCURACY,
                &AccuracyDocument { rows: rows.iter().map(document).collect(), interrupted: about.partial, wall_s: *wall_s },
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

fn document(row: &Row) -> RowDocument<'_> {
    let Row { subject, case, method, setting, cost, cost_unit, error, error_unit, reference, note } = row;
    RowDocument { subject: subject.name(), case, method, setting, cost: *cost, cost_unit, error: *error, error_unit, reference, note }
}
