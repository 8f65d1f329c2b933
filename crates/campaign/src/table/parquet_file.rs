//! Apache Parquet. The file depends on the rows alone: no times, no random names. Nothing is compressed: most of a table is numbers whose last digits
//! look random, and what repeats is stored as a dictionary anyway.

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use cohaptic_files::WholeFile;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::column::writer::{ColumnCloseResult, ColumnWriter};
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::metadata::{ColumnChunkMetaData, KeyValue, RowGroupMetaData};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::file::statistics::Statistics;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use super::format::{COMPLETE, GIST, Gist, Gists, Head, RunColumns, TableError, rows_missing};
use super::{Column, Kind, Row, Value};

/// Under which key a file says what it belongs to.
const ABOUT: &str = "cohaptic.campaign";

pub(super) fn write(file: &mut WholeFile, head: Head<'_>, rows: &[Row]) -> Result<(), TableError> {
    let mut writer = begin(file, head)?;
    let mut group = writer.next_row_group()?;
    for place in 0..head.columns.len() {
        let Some(mut column) = group.next_column()? else { break };
        write_column(column.untyped(), &head.columns[place], rows.iter().map(|row| &row[place]))?;
        column.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

fn begin<'a>(file: &'a mut WholeFile, head: Head<'_>) -> Result<SerializedFileWriter<&'a mut WholeFile>, TableError> {
    let properties = WriterProperties::builder()
        .set_created_by(head.program.to_owned())
        .set_key_value_metadata(Some(vec![KeyValue::new(ABOUT.to_owned(), head.about.to_owned())]))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        // The parts are put together without it.
        .set_offset_index_disabled(true)
        .set_max_row_group_row_count(None)
        .build();
    Ok(SerializedFileWriter::new(file, schema(head.columns)?, Arc::new(properties))?)
}

fn schema(columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let field = |column: &Column| {
        let (physical, logical) = match column.kind {
            Kind::Integer => (Physical::INT64, None),
            Kind::Number => (Physical::DOUBLE, None),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = if column.optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
        Type::primitive_type_builder(&column.name, physical).with_logical_type(logical).with_repetition(repetition).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<TypePtr>, ParquetError>>()?;
    Type::group_type_builder("runs").with_fields(fields).build().map(Arc::new)
}

fn write_column<'a>(writer: &mut ColumnWriter<'_>, column: &Column, values: impl Iterator<Item = &'a Value>) -> Result<(), TableError> {
    let (mut integers, mut numbers, mut texts, mut levels) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(!matches!(value, Value::Absent)));
        match value {
            Value::Absent => {}
            Value::Integer(integer) => integers.push(*integer),
            Value::Number(number) => numbers.push(*number),
            Value::Text(text) => texts.push(ByteArray::from(&**text)),
        }
    }
    let levels = column.optional.then_some(levels.as_slice());
    match writer {
        ColumnWriter::Int64ColumnWriter(writer) => writer.write_batch(&integers, levels, None)?,
        ColumnWriter::DoubleColumnWriter(writer) => writer.write_batch(&numbers, levels, None)?,
        ColumnWriter::ByteArrayColumnWriter(writer) => writer.write_batch(&texts, levels, None)?,
        ColumnWriter::BoolColumnWriter(_)
        | ColumnWriter::Int32ColumnWriter(_)
        | ColumnWriter::Int96ColumnWriter(_)
        | ColumnWriter::FloatColumnWriter(_)
        | ColumnWriter::FixedLenByteArrayColumnWriter(_) => return Err(TableError::Content(format!("column {} is of no known kind", column.name))),
    };
    Ok(())
}

/// Puts the parts into one file as they are, a row group each: nothing is decoded.
pub(super) fn merge<'a>(file: &mut WholeFile, head: Head<'_>, parts: impl Iterator<Item = (&'a Path, u64)>) -> Result<(), TableError> {
    let mut writer = begin(file, head)?;
    for (path, expected) in parts {
        let of_part = TableError::of_part(path);
        let part = cohaptic_files::open(path, cohaptic_files::MOST_CAPTURE_BYTES).map_err(|error| of_part(error.into()))?;
        for group in &groups(&part, head.columns, expected).map_err(of_part)? {
            let mut to = writer.next_row_group()?;
            append(&mut to, &part, group)?;
            to.close()?;
        }
    }
    writer.close()?;
    Ok(())
}

/// The row groups of a part that is as it was written.
fn groups(part: &File, columns: &[Column], expected: u64) -> Result<Vec<RowGroupMetaData>, TableError> {
    let reader = SerializedFileReader::new(part.try_clone()?)?;
    let metadata = reader.metadata();
    let described = metadata.file_metadata().schema_descr();
    if described.columns().len() != columns.len() || columns.iter().enumerate().any(|(place, column)| described.column(place).name() != column.name) {
        return Err(TableError::Content("other columns than this campaign has".to_owned()));
    }
    let found = u64::try_from(metadata.file_metadata().num_rows()).unwrap_or_default();
    if found == expected { Ok(metadata.row_groups().to_vec()) } else { Err(rows_missing(found, expected)) }
}

fn append(to: &mut SerializedRowGroupWriter<'_, &mut WholeFile>, part: &File, group: &RowGroupMetaData) -> Result<(), ParquetError> {
    for column in group.columns() {
        let close = ColumnCloseResult {
            bytes_written: u64::try_from(column.compressed_size()).unwrap_or_default(),
            rows_written: u64::try_from(group.num_rows()).unwrap_or_default(),
            metadata: column.clone(),
            bloom_filter: None,
            column_index: None,
            offset_index: None,
        };
        to.append_column(part, close)?;
    }
    Ok(())
}

/// What the column `ending` says of a run that diverged.
const DIVERGED: &[u8] = b"diverged";

/// The text of every row of a column in a row group, if its statistics say that there is one only: most runs are complete, and a text takes longer to read than all
/// numbers that are summed up.
fn only_text(column: &ColumnChunkMetaData) -> Option<&[u8]> {
    let Some(Statistics::ByteArray(statistics)) = column.statistics() else { return None };
    let is_exact = statistics.min_is_exact() && statistics.max_is_exact();
    let (least, greatest) = (statistics.min_opt()?.data(), statistics.max_opt()?.data());
    (is_exact && least == greatest).then_some(least)
}

pub(super) fn read_gists(file: File, each: Gists<'_>) -> Result<(), TableError> {
    let reader = SerializedFileReader::new(file)?;
    let described = reader.metadata().file_metadata().schema_descr_ptr();
    let place = |name: &str| {
        let found = described.columns().iter().position(|column| column.name() == name);
        found.ok_or_else(|| TableError::Content(format!("no column {name}")))
    };
    let (ending, discrepancy) = (place(GIST[0])?, place(GIST[1])?);
    for number in 0..reader.num_row_groups() {
        let group = reader.get_row_group(number)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or_default();
        let ColumnReader::DoubleColumnReader(mut discrepancy) = group.get_column_reader(discrepancy)? else { return Err(of_another_kind()) };
        let mut discrepancies = Vec::new();
        discrepancy.read_records(rows, None, None, &mut discrepancies)?;
        if let Some(text) = only_text(group.metadata().column(ending)) {
            let diverged = text == DIVERGED;
            discrepancies.into_iter().for_each(|max_discrepancy| each(Gist { diverged, max_discrepancy }));
            continue;
        }
        let ColumnReader::ByteArrayColumnReader(mut ending) = group.get_column_reader(ending)? else { return Err(of_another_kind()) };
        let mut endings = Vec::new();
        ending.read_records(rows, None, None, &mut endings)?;
        for (ending, max_discrepancy) in endings.iter().zip(discrepancies) {
            each(Gist { diverged: ending.data() == DIVERGED, max_discrepancy });
        }
    }
    Ok(())
}

/// Columns of numbers, and which runs were complete.
pub(super) fn read_columns(file: File, names: &[&str]) -> Result<RunColumns, TableError> {
    let reader = SerializedFileReader::new(file)?;
    let described = reader.metadata().file_metadata().schema_descr_ptr();
    let place = |name: &str| {
        let found = described.columns().iter().position(|column| column.name() == name);
        found.ok_or_else(|| TableError::Content(format!("no column {name}")))
    };
    let ending = place(GIST[0])?;
    let places = names.iter().map(|name| place(name)).collect::<Result<Vec<usize>, TableError>>()?;
    let mut read = RunColumns::of(names.len());
    for number in 0..reader.num_row_groups() {
        let group = reader.get_row_group(number)?;
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

/// The values of a column in one row group: no number where there is none.
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
    let mut known = numbers.into_iter();
    Ok(levels.into_iter().map(|level| if level > 0 { known.next().unwrap_or(f64::NAN) } else { f64::NAN }).collect())
}

fn of_another_kind() -> TableError {
    TableError::Content("columns of another kind than was written".to_owned())
}

impl From<ParquetError> for TableError {
    fn from(error: ParquetError) -> Self {
        match error {
            ParquetError::External(error) => match error.downcast::<io::Error>() {
                Ok(error) => Self::Io(*error),
                Err(error) => Self::Content(error.to_string()),
            },
            error @ (ParquetError::General(_)
            | ParquetError::NYI(_)
            | ParquetError::EOF(_)
            | ParquetError::IndexOutOfBound(..)
            | ParquetError::NeedMoreData(_)
            | ParquetError::NeedMoreDataRange(_)
            | _) => Self::Content(error.to_string()),
        }
    }
}
