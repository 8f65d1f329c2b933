//! Bytes that are put aside on a disk instead of in memory.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Seek as _, Write};
use std::path::{Path, PathBuf};

use crate::partial;

/// A file that is written once, read once, and removed when it is dropped. Its name ends in [`PARTIAL`](crate::PARTIAL), as that of any file that a killed
/// process leaves.
#[derive(Debug)]
pub struct ScratchFile {
    writer: BufWriter<File>,
    trace: Trace,
}

/// The name of a file, which is removed with it.
#[derive(Debug)]
struct Trace(PathBuf);

impl Drop for Trace {
    fn drop(&mut self) {
        // A file that stays is swept with others of that end.
        let _ = fs::remove_file(&self.0);
    }
}

impl ScratchFile {
    /// Begins a file beside another one, with the name of that, a dot and `what` in front of the end. Another process that does the same has a file of its own.
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub fn create(beside: &Path, what: &str) -> io::Result<Self> {
        let mut path = beside.as_os_str().to_owned();
        path.push(format!(".{what}"));
        let (file, path) = partial::create(path.as_ref())?;
        Ok(Self { writer: BufWriter::with_capacity(1 << 16, file), trace: Trace(path) })
    }

    /// The bytes that were written, from the first on. The file is removed with the reader.
    ///
    /// # Errors
    ///
    /// What the system says, of the last bytes too.
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

/// Fields are dropped in this order: Windows removes no file that is open.
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
