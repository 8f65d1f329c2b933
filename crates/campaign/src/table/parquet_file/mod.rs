//! The table as an Apache Parquet file. The file depends on the rows alone: no times and no random names. Nothing is compressed: the last digits of most
//! numbers look random, and repeated values are stored in dictionaries anyway.

mod compact;
mod index;
mod merge;
mod read;
#[cfg(test)]
mod tests;

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties, WriterPropertiesPtr};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::content::{Head, TableError};
use super::{Column, Kind, Row, Value};

pub(super) use merge::merge;
pub(super) use read::{read_columns, read_gists};

pub(super) fn write(to: &mut (dyn Write + Send), head: Head<'_>, rows: &[Row]) -> Result<(), TableError> {
    let mut writer = SerializedFileWriter::new(to, schema(head.columns)?, properties(head))?;
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

/// Returns the properties of a file, equal for the parts and the table.
fn properties(head: Head<'_>) -> WriterPropertiesPtr {
    let properties = WriterProperties::builder()
        .set_created_by(head.program.to_owned())
        .set_key_value_metadata(Some(vec![about(head)]))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        // The merge copies column chunks without the offset index.
        .set_offset_index_disabled(true)
        .set_max_row_group_row_count(None)
        .build();
    Arc::new(properties)
}

fn about(head: Head<'_>) -> KeyValue {
    let (key, text) = head.about;
    KeyValue::new(key.to_owned(), text.to_owned())
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
        // The definition level: 1 for a value, 0 for none. The library takes the values themselves without gaps.
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
