//! The table as comma-separated values.

use std::fs::File;
use std::io::{self, BufReader, Read as _, Seek as _, SeekFrom, Write};

use cohaptic_files::WholeFile;

use super::content::{COMPLETE, DIVERGED, GIST, Gist, Gists, OpenPart, RunColumns, TableError};
use super::{Column, Row};
use crate::value::value_text;

pub(super) fn write(to: &mut dyn Write, columns: &[Column], rows: &[Row]) -> io::Result<()> {
    let mut to = csv::Writer::from_writer(to);
    to.write_record(columns.iter().map(|column| &column.name)).map_err(unwritten)?;
    for row in rows {
        to.write_record(row.iter().map(value_text)).map_err(unwritten)?;
    }
    to.flush()
}

fn unwritten(error: csv::Error) -> io::Error {
    let message = error.to_string();
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        csv::ErrorKind::Utf8 { .. }
        | csv::ErrorKind::UnequalLengths { .. }
        | csv::ErrorKind::Seek
        | csv::ErrorKind::Serialize(_)
        | csv::ErrorKind::Deserialize { .. }
        | _ => io::Error::other(message),
    }
}

pub(super) fn merge(to: &mut WholeFile, columns: &[Column], parts: impl Iterator<Item = Result<OpenPart, TableError>>) -> Result<(), TableError> {
    let mut header = Vec::new();
    csv::Writer::from_writer(&mut header).write_record(columns.iter().map(|column| &column.name)).map_err(unwritten)?;
    to.write_all(&header)?;
    let mut buffer = vec![0; 1 << 16];
    for part in parts {
        let OpenPart { path, mut file, .. } = part?;
        // Each part begins with the header of the table, as the checked digest ties the part to this campaign. The header is copied once only.
        file.seek(SeekFrom::Start(header.len() as u64))?;
        // `io::copy` does not tell a fault in reading from a fault in writing. A fault in reading must name the part.
        loop {
            let read = file.read(&mut buffer).map_err(|error| TableError::of_part(&path)(error.into()))?;
            if read == 0 {
                break;
            }
            to.write_all(&buffer[..read])?;
        }
    }
    Ok(())
}

fn unread(error: csv::Error) -> TableError {
    if error.is_io_error() { TableError::Io(unwritten(error)) } else { TableError::Content(error.to_string()) }
}

pub(super) fn read_gists(file: File, each: Gists<'_>) -> Result<(), TableError> {
    let mut reader = csv::Reader::from_reader(BufReader::new(file));
    let header = reader.headers().map_err(unread)?;
    let place = |name: &str| header.iter().position(|found| found == name).ok_or_else(|| TableError::Content(format!("no column {name}")));
    let (ending, discrepancy) = (place(GIST[0])?, place(GIST[1])?);
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(unread)? {
        let discrepancy = record.get(discrepancy).unwrap_or_default();
        let max_discrepancy = discrepancy.parse().map_err(|_| TableError::Content(format!("{discrepancy:?} is not a number")))?;
        each(Gist { diverged: record.get(ending) == Some(DIVERGED), max_discrepancy });
    }
    Ok(())
}

/// Reads columns of numbers, and which runs came to their end. An empty cell is read as NaN.
pub(super) fn read_columns(file: File, names: &[&str]) -> Result<RunColumns, TableError> {
    let mut reader = csv::Reader::from_reader(BufReader::new(file));
    let header = reader.headers().map_err(unread)?;
    let place = |name: &str| header.iter().position(|found| found == name).ok_or_else(|| TableError::Content(format!("no column {name}")));
    let ending = place(GIST[0])?;
    let places = names.iter().map(|name| place(name)).collect::<Result<Vec<usize>, TableError>>()?;
    let (mut read, mut record) = (RunColumns::of(names.len()), csv::StringRecord::new());
    while reader.read_record(&mut record).map_err(unread)? {
        read.complete.push(record.get(ending) == Some(COMPLETE));
        for (place, column) in places.iter().zip(&mut read.columns) {
            let cell = record.get(*place).unwrap_or_default();
            let number = if cell.is_empty() { Ok(f64::NAN) } else { cell.parse() };
            column.push(number.map_err(|_| TableError::Content(format!("{cell:?} is not a number")))?);
        }
    }
    Ok(read)
}
