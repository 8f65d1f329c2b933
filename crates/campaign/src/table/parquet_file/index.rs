//! The index at the end of a Parquet file, a row group at a time.
//!
//! It has the places and the statistics of the columns of each row group: some kilobytes a part in the file, and several times as much in memory. The library keeps it
//! as a whole, in writing and in reading; a campaign may have 100,000 parts. Here it is put aside on the disk as it is written, and read as it lies there. What a row
//! group says is the library's to write and to read.
//!
//! Source: <https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift>, `FileMetaData`, and the README beside it for the end of a file.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek as _, SeekFrom, Write};
use std::path::Path;

use cohaptic_files::ScratchFile;
use parquet::file::metadata::{
    FileMetaData, KeyValue, ParquetMetaData, ParquetMetaDataOptions, ParquetMetaDataReader, ParquetMetaDataWriter, RowGroupMetaData,
};
use parquet::schema::types::SchemaDescPtr;

use super::compact::{Compact, I64, LIST, STOP, STRUCT, no_metadata, put_list, put_varint};
use crate::table::TableError;

/// What a file begins and ends with.
pub(super) const MAGIC: &[u8; 4] = b"PAR1";
/// The length of the index and [`MAGIC`] behind it.
const TAIL: usize = 8;
/// The header of a field of kind [`LIST`] behind the field before it.
const NEXT_LIST: u8 = 1 << 4 | LIST;

/// An index that is read: of the fields of `FileMetaData`, the third is the number of rows and the fourth the list of row groups.
struct Fields<R> {
    from: Compact<R>,
    /// The fields before the number of rows, and the header of that.
    head: Vec<u8>,
    /// How many row groups are still to come.
    left: u64,
}

impl<R: Read> Fields<R> {
    fn open(from: R) -> Result<Self, TableError> {
        let mut from = Compact::new(from);
        for (expected, kind) in [(1, 5), (2, LIST)] {
            if from.field(expected - 1)? != Some((expected, kind)) {
                return Err(no_metadata());
            }
            from.skip(kind)?;
        }
        if from.field(2)? != Some((3, I64)) {
            return Err(no_metadata());
        }
        let head = from.take();
        from.integer()?;
        let (field, (left, kind)) = (from.field(3)?, from.list()?);
        if field != Some((4, LIST)) || (left > 0 && kind != STRUCT) {
            return Err(no_metadata());
        }
        from.take();
        Ok(Self { from, head, left })
    }

    /// The bytes of the next row group.
    fn next_group(&mut self) -> Result<Option<Vec<u8>>, TableError> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        self.from.skip(STRUCT)?;
        Ok(Some(self.from.take()))
    }
}

/// The fields up to the row groups, with the number of rows and that of row groups.
fn put_head(bytes: &mut Vec<u8>, head: &[u8], rows: u64, groups: u64) {
    bytes.extend_from_slice(head);
    // As a number with a sign.
    put_varint(bytes, rows << 1);
    bytes.push(NEXT_LIST);
    put_list(bytes, groups, STRUCT);
}

/// The index of a table while that is written.
pub(super) struct IndexWriter {
    schema: SchemaDescPtr,
    groups: ScratchFile,
    count: u64,
    rows: u64,
}

impl IndexWriter {
    /// The index of a table of that name.
    pub(super) fn create(table: &Path, schema: SchemaDescPtr) -> io::Result<Self> {
        Ok(Self { schema, groups: ScratchFile::create(table, "index")?, count: 0, rows: 0 })
    }

    /// Puts a row group behind those before it.
    pub(super) fn add(&mut self, group: RowGroupMetaData) -> Result<(), TableError> {
        self.count += 1;
        self.rows += u64::try_from(group.num_rows()).unwrap_or_default();
        let index = self.encoded(None, None, vec![group])?;
        let group = Fields::open(index.as_slice())?.next_group()?.ok_or_else(no_metadata)?;
        Ok(self.groups.write_all(&group)?)
    }

    /// Ends the file: with the index, its length and [`MAGIC`]. The bytes are those that the library writes.
    pub(super) fn finish(self, to: &mut impl Write, program: &str, about: KeyValue) -> Result<(), TableError> {
        let empty = self.encoded(Some(program.to_owned()), Some(vec![about]), Vec::new())?;
        let Self { groups, count, rows, .. } = self;
        let frame = Fields::open(empty.as_slice())?;
        let mut head = Vec::new();
        put_head(&mut head, &frame.head, rows, count);
        let rest = frame.from.rest()?;
        to.write_all(&head)?;
        let groups = io::copy(&mut groups.into_reader()?, to)?;
        to.write_all(&rest)?;
        let length = head.len() as u64 + groups + rest.len() as u64;
        let length = u32::try_from(length).map_err(|_| TableError::Content("an index of 4 GiB: expected fewer parts".to_owned()))?;
        to.write_all(&length.to_le_bytes())?;
        Ok(to.write_all(MAGIC)?)
    }

    /// An index of these row groups, as the library writes it.
    fn encoded(&self, program: Option<String>, about: Option<Vec<KeyValue>>, groups: Vec<RowGroupMetaData>) -> Result<Vec<u8>, TableError> {
        let metadata = FileMetaData::new(VERSION, 0, program, about, self.schema.clone(), None);
        let mut bytes = Vec::new();
        ParquetMetaDataWriter::new(&mut bytes, &ParquetMetaData::new(metadata, groups)).finish()?;
        bytes.truncate(bytes.len().saturating_sub(TAIL));
        Ok(bytes)
    }
}

/// Of the format: what the library's default is.
const VERSION: i32 = 1;

/// The row groups of a file, one after the other.
pub(super) struct IndexReader<'a> {
    fields: Fields<BufReader<io::Take<At<'a>>>>,
    schema: SchemaDescPtr,
    options: ParquetMetaDataOptions,
}

impl<'a> IndexReader<'a> {
    pub(super) fn open(file: &'a File) -> Result<Self, TableError> {
        let length = file.metadata()?.len();
        let end = length.checked_sub(TAIL as u64).ok_or_else(no_metadata)?;
        let mut tail = [0; TAIL];
        At { file, at: end }.read_exact(&mut tail)?;
        let [a, b, c, d, magic @ ..] = tail;
        let index = u64::from(u32::from_le_bytes([a, b, c, d]));
        if magic != *MAGIC || index > end {
            return Err(no_metadata());
        }
        let from = || BufReader::with_capacity(1 << 16, At { file, at: end - index }.take(index));
        let fields = Fields::open(from())?;
        let mut empty = Vec::new();
        put_head(&mut empty, &fields.head, 0, 0);
        empty.push(STOP);
        let schema = ParquetMetaDataReader::decode_schema(&empty)?;
        let options = ParquetMetaDataOptions::new().with_schema(schema.clone());
        Ok(Self { fields, schema, options })
    }

    pub(super) const fn schema(&self) -> &SchemaDescPtr {
        &self.schema
    }

    /// The next row group; `None` behind the last.
    pub(super) fn next_group(&mut self) -> Result<Option<RowGroupMetaData>, TableError> {
        let Some(group) = self.fields.next_group()? else { return Ok(None) };
        let mut index = Vec::new();
        put_head(&mut index, &self.fields.head, 0, 1);
        index.extend(group);
        index.push(STOP);
        let metadata = ParquetMetaDataReader::decode_metadata_with_options(&index, Some(&self.options))?;
        Ok(metadata.into_builder().take_row_groups().pop())
    }
}

/// A file from a place on. The place is its own: others may read the same file elsewhere in between.
struct At<'a> {
    file: &'a File,
    at: u64,
}

impl Read for At<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.seek(SeekFrom::Start(self.at))?;
        let read = self.file.read(buffer)?;
        self.at += read as u64;
        Ok(read)
    }
}
