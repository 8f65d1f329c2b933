//! Writes and reads the index of a Parquet file, one row group at a time.
//!
//! The index holds positions and statistics of the columns of each row group: some kilobytes per part in the file, and several times as much in memory. The
//! library keeps the whole index in memory, while a campaign may have 100,000 parts. Here the index goes to a temporary file while a table is written, and is
//! read one row group at a time. The bytes of a row group's entry are encoded and decoded by the library.
//!
//! Source: <https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift>, `FileMetaData`, and the README beside it for the end of a
//! file.

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

/// First and last bytes of a file.
pub(super) const MAGIC: &[u8; 4] = b"PAR1";
/// Length of the end of a file \[bytes\]: the length of the index and [`MAGIC`].
const TAIL: usize = 8;
/// Header of a list field numbered one above the field before.
const NEXT_LIST: u8 = 1 << 4 | LIST;

/// An index being read. In `FileMetaData`, the third field is the number of rows and the fourth the list of row groups.
struct Fields<R> {
    from: Compact<R>,
    /// Bytes of the fields before the number of rows, and the header of the number of rows.
    head: Vec<u8>,
    /// Number of row groups not yet read.
    left: u64,
}

impl<R: Read> Fields<R> {
    fn open(from: R) -> Result<Self, TableError> {
        let mut from = Compact::new(from);
        // The version, an `i32` (kind 5), and the schema. The fields must have the order in which the library writes them.
        for (expected, kind) in [(1, 5), (2, LIST)] {
            if from.field(expected - 1)? != Some((expected, kind)) {
                return Err(no_metadata());
            }
            from.skip(kind)?;
        }
        if from.field(2)? != Some((3, I64)) {
            return Err(no_metadata());
        }
        // Everything up to here is the same for an index with any row groups.
        let head = from.take();
        // The number of rows is dropped: `put_head` writes its own.
        from.integer()?;
        let (field, (left, kind)) = (from.field(3)?, from.list()?);
        if field != Some((4, LIST)) || (left > 0 && kind != STRUCT) {
            return Err(no_metadata());
        }
        from.take();
        Ok(Self { from, head, left })
    }

    /// Returns the bytes of the next row group; `None` after the last.
    fn next_group(&mut self) -> Result<Option<Vec<u8>>, TableError> {
        let Some(left) = self.left.checked_sub(1) else { return Ok(None) };
        self.left = left;
        self.from.skip(STRUCT)?;
        Ok(Some(self.from.take()))
    }
}

/// Appends the fields up to the row groups, with these numbers of rows and of row groups.
fn put_head(bytes: &mut Vec<u8>, head: &[u8], rows: u64, groups: u64) {
    bytes.extend_from_slice(head);
    // The number of rows is signed, and a zigzag code doubles a number without a minus.
    put_varint(bytes, rows << 1);
    bytes.push(NEXT_LIST);
    put_list(bytes, groups, STRUCT);
}

/// The index of a table during the writing of the table.
pub(super) struct IndexWriter {
    schema: SchemaDescPtr,
    groups: ScratchFile,
    count: u64,
    rows: u64,
}

impl IndexWriter {
    /// Begins the index of the table at the path `table`. Row groups are collected in a temporary file next to the table.
    pub(super) fn create(table: &Path, schema: SchemaDescPtr) -> io::Result<Self> {
        Ok(Self { schema, groups: ScratchFile::create(table, "index")?, count: 0, rows: 0 })
    }

    /// Appends a row group.
    pub(super) fn add(&mut self, group: RowGroupMetaData) -> Result<(), TableError> {
        self.count += 1;
        self.rows += u64::try_from(group.num_rows()).unwrap_or_default();
        // The library encodes whole indexes only. The entry of the group is cut out of an index with this group alone.
        let index = self.encoded(None, None, vec![group])?;
        let group = Fields::open(index.as_slice())?.next_group()?.ok_or_else(no_metadata)?;
        Ok(self.groups.write_all(&group)?)
    }

    /// Ends the file with the index, its length and [`MAGIC`]. The bytes equal the bytes written by the library.
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
        // The format has 32 bits for the length of the index.
        let length = u32::try_from(length).map_err(|_| TableError::Content("an index of 4 GiB: expected fewer parts".to_owned()))?;
        to.write_all(&length.to_le_bytes())?;
        Ok(to.write_all(MAGIC)?)
    }

    /// Returns an index of these row groups, encoded by the library, without its end.
    fn encoded(&self, program: Option<String>, about: Option<Vec<KeyValue>>, groups: Vec<RowGroupMetaData>) -> Result<Vec<u8>, TableError> {
        let metadata = FileMetaData::new(VERSION, 0, program, about, self.schema.clone(), None);
        let mut bytes = Vec::new();
        ParquetMetaDataWriter::new(&mut bytes, &ParquetMetaData::new(metadata, groups)).finish()?;
        // Without the length and the magic bytes, which follow once per file.
        bytes.truncate(bytes.len().saturating_sub(TAIL));
        Ok(bytes)
    }
}

/// Version of the format, the default of the library.
const VERSION: i32 = 1;

/// Reads the row groups of a file, one after the other.
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
        // A damaged length could point before the beginning of the file.
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

    /// Returns the next row group; `None` after the last.
    pub(super) fn next_group(&mut self) -> Result<Option<RowGroupMetaData>, TableError> {
        let Some(group) = self.fields.next_group()? else { return Ok(None) };
        let mut index = Vec::new();
        // The library decodes whole indexes only, so the group is wrapped in an index of its own.
        put_head(&mut index, &self.fields.head, 0, 1);
        index.extend(group);
        index.push(STOP);
        let metadata = ParquetMetaDataReader::decode_metadata_with_options(&index, Some(&self.options))?;
        Ok(metadata.into_builder().take_row_groups().pop())
    }
}

/// A file read from a position of its own. Other readers may move the position of the same file between two reads.
struct At<'a> {
    file: &'a File,
    at: u64,
}

impl Read for At<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        // The system keeps one position per open file, shared by all readers.
        self.file.seek(SeekFrom::Start(self.at))?;
        let read = self.file.read(buffer)?;
        self.at += read as u64;
        Ok(read)
    }
}
