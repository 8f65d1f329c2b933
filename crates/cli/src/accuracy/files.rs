//! The files of `--out`.

use std::io::ErrorKind;
use std::path::Path;

use cohaptic_accuracy::{About, Row, csv, html, plots};
use cohaptic_picture::Size;

use crate::failure::Failure;
use crate::file::write_file;

/// The rows of a whole measurement, and those of one that was interrupted: a script that reads the first never takes the second for it.
const WHOLE: &str = "rows.csv";
const PARTIAL: &str = "rows-interrupted.csv";

/// Writes all files with pictures of this size, the page last. Each has its name only when it is whole.
pub(super) fn write(folder: &Path, rows: &[Row], about: &About, size: Size) -> Result<(), Failure> {
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
