//! A temporary file for data larger than memory.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Seek as _, Write};
use std::path::{Path, PathBuf};

use crate::partial;

/// A file that is written once, then read once, and removed when the value is dropped. The name ends in [`PARTIAL`](crate::PARTIAL), to mark a file left by
/// a killed process as unfinished.
#[derive(Debug)]
pub struct ScratchFile {
    writer: BufWriter<File>,
    trace: Trace,
}

/// Path of the file; dropping the value removes the file.
#[derive(Debug)]
struct Trace(PathBuf);

impl Drop for Trace {
    fn drop(&mut self) {
        // A file left over still ends in `.partial`, the mark of removable files.
        let _ = fs::remove_file(&self.0);
    }
}

impl ScratchFile {
    /// Creates a file next to `beside`. The name is the name of `beside`, a dot, `what`, and [`PARTIAL`](crate::PARTIAL). Processes that call this with the
    /// same arguments get different files.
    ///
    /// # Errors
    ///
    /// The system's error.
    pub fn create(beside: &Path, what: &str) -> io::Result<Self> {
        let mut path = beside.as_os_str().to_owned();
        path.push(format!(".{what}"));
        let (file, path) = partial::create(path.as_ref())?;
        Ok(Self { writer: BufWriter::with_capacity(1 << 16, file), trace: Trace(path) })
    }

    /// Ends writing and returns a reader of all written bytes. The file is removed when the reader is dropped.
    ///
    /// # Errors
    ///
    /// The system's error, also about buffered bytes that are written now.
    pub fn into_reader(self) -> io::Result<impl Read> {
        let Self { writer, trace } = self;
        let mut file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.rewind()?;
        Ok(ScratchReader { reader: BufReader::with_capacity(1 << 16, file), _trace: trace })
    }
}

impl Write for ScratchFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.writer.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

/// Reader of a scratch file. Fields are dropped in order: the file must be closed before its removal, because Windows refuses to remove open files.
struct ScratchReader {
    reader: BufReader<File>,
    _trace: Trace,
}

impl Read for ScratchReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_back_and_nothing_stays() {
        let folder = tempfile::tempdir().unwrap();
        let beside = folder.path().join("runs.parquet");
        let written: Vec<u8> = (0..300_000_u32).flat_map(u32::to_le_bytes).collect();
        let mut scratch = ScratchFile::create(&beside, "index").unwrap();
        scratch.write_all(&written).unwrap();
        assert!(folder.path().join("runs.parquet.index.partial").exists());
        let mut read = Vec::new();
        scratch.into_reader().unwrap().read_to_end(&mut read).unwrap();
        assert!(read == written);
        drop(ScratchFile::create(&beside, "index").unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn what_a_killed_process_left_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let beside = folder.path().join("runs.parquet");
        fs::write(folder.path().join("runs.parquet.index.partial"), b"of another time").unwrap();
        let mut scratch = ScratchFile::create(&beside, "index").unwrap();
        scratch.write_all(b"new").unwrap();
        let mut read = Vec::new();
        scratch.into_reader().unwrap().read_to_end(&mut read).unwrap();
        assert_eq!(read, b"new");
    }
}
