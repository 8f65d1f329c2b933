//! The rows of a measurement, written into files and printed.

use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_accuracy::{About, Row, csv, html, plots, text};
use cohaptic_files::write_whole;
use cohaptic_picture::Size;
use cohaptic_units::print::Counted;
use cohaptic_units::visible_lines;
use serde::Serialize;

use super::failure::Failure;

/// File of the rows of a whole measurement. The file of an interrupted measurement has another name, because a script for whole measurements must never
/// read interrupted rows.
const WHOLE: &str = "rows.csv";
const PARTIAL: &str = "rows-interrupted.csv";

/// Rows, and where they go.
pub(crate) struct Conclusion<'a> {
    pub(crate) rows: &'a [Row],
    pub(crate) about: About,
    pub(crate) out: Option<&'a Path>,
    pub(crate) json: bool,
    pub(crate) size: Size,
    /// Wall time of the measurement \[s\].
    pub(crate) wall_s: f64,
}

impl Conclusion<'_> {
    /// Writes the files and prints the rows. A file that cannot be written is a failure, but the rows are still printed.
    pub(crate) fn tell(&self) -> Result<(), Failure> {
        let written = self.out.map_or(Ok(()), |folder| self.write(folder));
        if self.json {
            let rows = self.rows.iter().map(RowDocument::of).collect();
            print_json(&Document { schema: "cohaptic/accuracy", version: 1, rows, interrupted: self.about.partial, wall_s: self.wall_s })?;
        } else {
            let mut shown = text(self.rows);
            if self.about.partial {
                let (wall_s, rows) = (self.wall_s, Counted(self.rows.len(), "row"));
                // Writing to a string does not fail.
                let _ = writeln!(shown, "INTERRUPTED after {wall_s:.1} s: {rows} had been measured by then");
            }
            print(visible_lines(&shown).as_bytes())?;
            if let (Some(folder), Ok(())) = (self.out, &written) {
                let page = folder.join("index.html").to_string_lossy().into_owned();
                // A reader of standard output alone misses nothing.
                let _ = writeln!(io::stderr(), "wrote {}", visible_lines(&page));
            }
        }
        written
    }

    /// Writes all files, the page last.
    fn write(&self, folder: &Path) -> Result<(), Failure> {
        let (name, other) = if self.about.partial { (PARTIAL, WHOLE) } else { (WHOLE, PARTIAL) };
        write_file(folder.join(name), &csv(self.rows))?;
        // Rows of an earlier measurement do not belong to the plots and the page written below.
        let old = folder.join(other);
        match std::fs::remove_file(&old) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(Failure::File { verb: "remove", path: old, error }),
            Ok(()) | Err(_) => {}
        }
        for plot in plots(self.rows, self.size) {
            write_file(folder.join(format!("{}.svg", plot.id)), &plot.svg)?;
        }
        write_file(folder.join("index.html"), &html(self.rows, &self.about, self.size))
    }
}

/// The document of `--json`.
#[derive(Serialize)]
struct Document<'a> {
    schema: &'static str,
    version: u32,
    rows: Vec<RowDocument<'a>>,
    /// Whether the measurement ended early, by Ctrl-C or by a fault.
    interrupted: bool,
    wall_s: f64,
}

#[derive(Serialize)]
struct RowDocument<'a> {
    subject: &'static str,
    case: &'a str,
    method: &'a str,
    setting: &'a str,
    cost: Option<f64>,
    cost_unit: &'static str,
    error: Option<f64>,
    error_unit: &'static str,
    reference: &'static str,
    note: &'a str,
}

impl<'a> RowDocument<'a> {
    fn of(row: &'a Row) -> Self {
        Self {
            subject: row.subject.name(),
            case: &row.case,
            method: &row.method,
            setting: &row.setting,
            cost: row.cost,
            cost_unit: row.cost_unit,
            error: row.error,
            error_unit: row.error_unit,
            reference: row.reference,
            note: &row.note,
        }
    }
}

fn print_json(document: &Document<'_>) -> Result<(), Failure> {
    let mut text = serde_json::to_vec_pretty(document).map_err(io::Error::from).map_err(Failure::StandardOutput)?;
    text.push(b'\n');
    print(&text)
}

pub(super) fn print(content: &[u8]) -> Result<(), Failure> {
    cohaptic_files::print(content).map_err(Failure::StandardOutput)
}

fn write_file(path: PathBuf, content: &str) -> Result<(), Failure> {
    write_whole(&path, |file| file.write_all(content.as_bytes())).map_err(|error| Failure::File { verb: "write", path, error })
}
