//! Reads columns of a table, one row group at a time.

use std::fs::File;
use std::sync::Arc;

use parquet::column::reader::ColumnReader;
use parquet::errors::ParquetError;
use parquet::file::metadata::page_index::RowGroupPageIndex;
use parquet::file::metadata::{ColumnChunkMetaData, RowGroupMetaData};
use parquet::file::properties::ReaderProperties;
use parquet::file::reader::RowGroupReader;
use parquet::file::serialized_reader::SerializedRowGroupReader;
use parquet::file::statistics::Statistics;
use parquet::schema::types::SchemaDescriptor;

use super::index::IndexReader;
use crate::table::content::{COMPLETE, DIVERGED, GIST, Gist, Gists, RunColumns, TableError};

/// Returns the reader of a row group's columns.
fn row_group<'a>(file: &Arc<File>, group: &'a RowGroupMetaData) -> Result<SerializedRowGroupReader<'a, File>, ParquetError> {
    let properties = Arc::new(ReaderProperties::builder().build());
    SerializedRowGroupReader::new(file.clone(), group, RowGroupPageIndex::new(0, None), properties)
}

/// Returns the text common to all rows of a column in a row group, if the statistics prove that there is only one. Most row groups have complete runs only, and
/// then the texts need not be decoded.
fn only_text(column: &ColumnChunkMetaData) -> Option<&[u8]> {
    let Some(Statistics::ByteArray(statistics)) = column.statistics() else { return None };
    // Long texts are cut in the statistics. Equal cut texts prove nothing.
    let is_exact = statistics.min_is_exact() && statistics.max_is_exact();
    let (least, greatest) = (statistics.min_opt()?.data(), statistics.max_opt()?.data());
    (is_exact && least == greatest).then_some(least)
}

/// Returns the index of a column.
fn place_of(schema: &SchemaDescriptor, name: &str) -> Result<usize, TableError> {
    let found = schema.columns().iter().position(|column| column.name() == name);
    found.ok_or_else(|| TableError::Content(format!("no column {name}")))
}

pub(in crate::table) fn read_gists(file: File, each: Gists<'_>) -> Result<(), TableError> {
    let file = Arc::new(file);
    let mut index = IndexReader::open(&file)?;
    let described = index.schema().clone();
    let place = |name: &str| place_of(&described, name);
    let (ending, discrepancy) = (place(GIST[0])?, place(GIST[1])?);
    while let Some(group) = index.next_group()? {
        let group = row_group(&file, &group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or_default();
        let ColumnReader::DoubleColumnReader(mut discrepancy) = group.get_column_reader(discrepancy)? else { return Err(of_another_kind()) };
        let mut discrepancies = Vec::new();
        discrepancy.read_records(rows, None, None, &mut discrepancies)?;
        if let Some(text) = only_text(group.metadata().column(ending)) {
            let diverged = text == DIVERGED.as_bytes();
            discrepancies.into_iter().for_each(|max_discrepancy| each(Gist { diverged, max_discrepancy }));
            continue;
        }
        let ColumnReader::ByteArrayColumnReader(mut ending) = group.get_column_reader(ending)? else { return Err(of_another_kind()) };
        let mut endings = Vec::new();
        ending.read_records(rows, None, None, &mut endings)?;
        for (ending, max_discrepancy) in endings.iter().zip(discrepancies) {
            each(Gist { diverged: ending.data() == DIVERGED.as_bytes(), max_discrepancy });
        }
    }
    Ok(())
}

/// Reads columns of numbers, and which runs came to their end.
pub(in crate::table) fn read_columns(file: File, names: &[&str]) -> Result<RunColumns, TableError> {
    let file = Arc::new(file);
    let mut index = IndexReader::open(&file)?;
    let described = index.schema().clone();
    let place = |name: &str| place_of(&described, name);
    let ending = place(GIST[0])?;
    let places = names.iter().map(|name| place(name)).collect::<Result<Vec<usize>, TableError>>()?;
    let mut read = RunColumns::of(names.len());
    while let Some(group) = index.next_group()? {
        let group = row_group(&file, &group)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or_default();
        let mut endings = Vec::new();
        let ColumnReader::ByteArrayColumnReader(mut ending) = group.get_column_reader(ending)? else { return Err(of_another_kind()) };
        ending.read_records(rows, None, None, &mut endings)?;
        read.complete.extend(endings.iter().map(|ending| ending.data() == COMPLETE.as_bytes()));
        for (place, column) in places.iter().zip(&mut read.columns) {
            let optional = described.column(*place).max_def_level() > 0;
            column.extend(numbers(group.get_column_reader(*place)?, rows, optional)?);
        }
    }
    Ok(read)
}

/// Returns the values of a column in one row group; NaN for no value.
fn numbers(column: ColumnReader, rows: usize, optional: bool) -> Result<Vec<f64>, TableError> {
    let (mut integers, mut numbers, mut levels) = (Vec::new(), Vec::new(), Vec::new());
    let given = optional.then_some(&mut levels);
    match column {
        ColumnReader::Int64ColumnReader(mut column) => {
            column.read_records(rows, given, None, &mut integers)?;
            #[expect(clippy::cast_precision_loss, reason = "counts far below 2^53")]
            numbers.extend(integers.into_iter().map(|integer| integer as f64));
        }
        ColumnReader::DoubleColumnReader(mut column) => drop(column.read_records(rows, given, None, &mut numbers)?),
        ColumnReader::BoolColumnReader(_)
        | ColumnReader::Int32ColumnReader(_)
        | ColumnReader::Int96ColumnReader(_)
        | ColumnReader::FloatColumnReader(_)
        | ColumnReader::ByteArrayColumnReader(_)
        | ColumnReader::FixedLenByteArrayColumnReader(_) => return Err(of_another_kind()),
    }
    if !optional {
        return Ok(numbers);
    }
    // `numbers` has the present values only. A level above 0 marks a row with a value.
    let mut known = numbers.into_iter();
    Ok(levels.into_iter().map(|level| if level > 0 { known.next().unwrap_or(f64::NAN) } else { f64::NAN }).collect())
}

fn of_another_kind() -> TableError {
    TableError::Content("columns of another kind than was written".to_owned())
}
