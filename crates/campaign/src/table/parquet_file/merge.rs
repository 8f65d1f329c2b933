//! Merges the parts into one file, each as a row group. The columns are copied without decoding, and only the metadata of one part are in memory.

use std::fs::File;
use std::io::Write;
use std::sync::Arc;

use cohaptic_files::WholeFile;
use parquet::column::writer::ColumnCloseResult;
use parquet::errors::ParquetError;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::file::writer::{SerializedRowGroupWriter, TrackedWrite};
use parquet::schema::types::SchemaDescriptor;

use super::index::{IndexWriter, MAGIC};
use super::{about, properties, schema};
use crate::table::Column;
use crate::table::content::{Head, OpenPart, TableError, rows_missing};

/// Writes the table. The bytes equal the bytes of the library's file writer for the same row groups.
pub(in crate::table) fn merge(
    file: &mut WholeFile,
    head: Head<'_>,
    parts: impl ExactSizeIterator<Item = Result<OpenPart, TableError>>,
) -> Result<(), TableError> {
    let schema = Arc::new(SchemaDescriptor::new(schema(head.columns)?));
    let properties = properties(head);
    let mut index = IndexWriter::create(file.path(), schema.clone())?;
    // The format has 16 bits for the index of a row group. The library states no index at all in a file with more row groups.
    let has_places = i16::try_from(parts.len()).is_ok();
    // Parts have this type of writer too, so that the library is compiled for a single type.
    let file: &mut (dyn Write + Send) = file;
    let mut to = TrackedWrite::new(file);
    to.write_all(MAGIC)?;
    for (place, part) in (0..).zip(parts) {
        let OpenPart { path, file: part, rows } = part?;
        // The digest covers the bytes and not their meaning, so columns and rows are checked here.
        let group = group(&part, head.columns, rows).map_err(TableError::of_part(&path))?;
        let place = if has_places { place } else { i32::MAX };
        let mut copied = SerializedRowGroupWriter::new(schema.clone(), properties.clone(), &mut to, place, None);
        append(&mut copied, &part, &group)?;
        index.add(Arc::unwrap_or_clone(copied.close()?))?;
    }
    index.finish(&mut to, head.program, about(head))?;
    Ok(to.flush()?)
}

/// Returns the only row group of a part, after a check of its columns and of its number of rows.
fn group(part: &File, columns: &[Column], expected: u64) -> Result<RowGroupMetaData, TableError> {
    let reader = SerializedFileReader::new(part.try_clone()?)?;
    let metadata = reader.metadata();
    let described = metadata.file_metadata().schema_descr();
    if described.columns().len() != columns.len() || columns.iter().enumerate().any(|(place, column)| described.column(place).name() != column.name) {
        return Err(TableError::Content("other columns than this campaign has".to_owned()));
    }
    let found = u64::try_from(metadata.file_metadata().num_rows()).unwrap_or_default();
    match metadata.row_groups() {
        [group] if found == expected => Ok(group.clone()),
        _ => Err(rows_missing(found, expected)),
    }
}

pub(super) fn append<W: Write + Send>(to: &mut SerializedRowGroupWriter<'_, W>, part: &File, group: &RowGroupMetaData) -> Result<(), ParquetError> {
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
