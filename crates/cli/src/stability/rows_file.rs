//! Files of rows of numbers, which keep the progress of a long computation, so that the same command continues an interrupted computation.
//!
//! A file begins with a header of text lines, which identifies the computation. Each row is a line: the number of the row, the values with the fewest digits
//! for the same `f64`, and the fingerprint of the text before. An incomplete last line, as after a power failure, is ignored. A line with a wrong fingerprint
//! is skipped, and the row is computed again.
//!
//! Each worker of a shared folder writes a file of its own, `NAME.WORKER.partial` beside `NAME.partial`, and reads the files of all workers.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use cohaptic_files::{PARTIAL, open_continued};
use cohaptic_scene::Fingerprint;

use crate::failure::Failure;
use crate::output;

/// A file of rows, open at its end.
#[derive(Debug)]
pub(crate) struct RowsFile {
    path: PathBuf,
    /// Paths of all files with rows of the same computation in the folder when the file was opened, of other workers too.
    others: Vec<PathBuf>,
    file: File,
    /// `true` if opening the file created its folder.
    made_folder: bool,
}

/// A row: the number, by which the computation recognises the row, and the values.
pub(crate) type Row = (usize, Vec<f64>);

/// Place of the files of rows of one computation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kept<'a> {
    pub(crate) folder: &'a Path,
    /// Name of the files, without the worker's name and the extension.
    pub(crate) name: &'static str,
    /// Header lines, which identify the computation.
    pub(crate) header: &'a [String],
}

impl Kept<'_> {
    /// Returns the path of the file of `worker`, or of a process that works alone if `worker` is `None`.
    pub(crate) fn path(self, worker: Option<&str>) -> PathBuf {
        let worker = worker.map_or_else(String::new, |worker| format!(".{worker}"));
        self.folder.join(format!("{}{worker}{PARTIAL}", self.name))
    }

    /// Reads the rows of all workers, and returns the rows with the paths of the files. A missing folder has no rows. Nothing is written.
    ///
    /// A file with another header is an input failure.
    pub(crate) fn read(self) -> Result<(Vec<Row>, Vec<PathBuf>), Failure> {
        let unreadable = |error| Failure::File { verb: "read", path: self.folder.to_path_buf(), error };
        let mut paths = Vec::new();
        match fs::read_dir(self.folder) {
            Ok(entries) => {
                for entry in entries {
                    let name = entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
                    // The name must end at the dot: `rows2.partial` belongs to another computation than `rows`.
                    if name.strip_prefix(self.name).is_some_and(|rest| rest.starts_with('.') && rest.ends_with(PARTIAL)) {
                        paths.push(self.folder.join(name));
                    }
                }
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(unreadable(error)),
        }
        // The system lists a folder in any order. Sorted paths make the order of rows the same in each run.
        paths.sort_unstable();
        let mut rows = Vec::new();
        for path in &paths {
            rows.extend(begun(path, self.header)?.rows);
        }
        Ok((rows, paths))
    }

    /// Opens or creates the file of `worker` (`None`: of a process that works alone) and the folder. Returns the file and the rows of all workers.
    ///
    /// Nothing is written if a file in the folder belongs to another computation.
    pub(crate) fn open(self, worker: Option<&str>) -> Result<(RowsFile, Vec<Row>), Failure> {
        let (rows, others) = self.read()?;
        let (file, _) = RowsFile::open(self.path(worker), self.header)?;
        Ok((RowsFile { others, ..file }, rows))
    }
}

/// Reads the header and the rows of a file. A missing file is read as an empty file.
fn begun(path: &Path, header: &[String]) -> Result<Begun, Failure> {
    let bytes = match cohaptic_files::read_bytes(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(Failure::File { verb: "read", path: path.to_path_buf(), error }),
    };
    // Rows are written as ASCII, so that reading stops at the first byte that is not text, as at an incomplete line.
    let text = match std::str::from_utf8(&bytes) {
        Ok(text) => text,
        Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
    };
    Begun::read(text, header).map_err(|difference| refused(path, &difference))
}

impl RowsFile {
    /// Opens or creates the file at `path`, and creates the folder. Returns the file and the rows of the file; a new file has no rows.
    ///
    /// Nothing is written if the file belongs to another computation.
    fn open(path: PathBuf, header: &[String]) -> Result<(Self, Vec<Row>), Failure> {
        let begun = begun(&path, header)?;
        // `abandon` removes the folder only if this call created the folder.
        let made_folder = path.parent().is_some_and(|folder| !folder.exists());
        let opened = Self::open_at(&path, begun.whole, header);
        let file = opened.map_err(|error| Failure::File { verb: "write", path: path.clone(), error })?;
        Ok((Self { path, others: Vec::new(), file, made_folder }, begun.rows))
    }

    /// Opens the file after the first `whole` bytes, and writes the header into a file without a header.
    fn open_at(path: &Path, whole: usize, header: &[String]) -> io::Result<File> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        // A torn last line is cut off, so that the next row begins on a line of its own.
        let mut file = open_continued(path, whole as u64)?;
        if whole == 0 {
            let lines: String = header.iter().map(|line| format!("{line}\n")).collect();
            file.write_all(lines.as_bytes())?;
        }
        Ok(file)
    }

    /// Appends a row, and returns when the operating system has the bytes: a killed process loses no added row.
    pub(crate) fn add(&mut self, number: usize, values: &[f64]) -> Result<(), Failure> {
        let mut line = number.to_string();
        for value in values {
            line.push_str(&format!(" {value:?}"));
        }
        // The fingerprint covers the number and all values, so that a damaged digit is found on reading.
        let fingerprint = Fingerprint::of(&line);
        line.push_str(&format!(" {fingerprint}\n"));
        let written = self.file.write_all(line.as_bytes());
        written.map_err(|error| Failure::File { verb: "write", path: self.path.clone(), error })
    }

    /// Removes the files of rows of all workers and the workers' logs. Called after the results are written.
    pub(crate) fn remove(self) -> Result<(), Failure> {
        let remove = |path: PathBuf| match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Failure::File { verb: "remove", path, error }),
            // Another worker may have removed the file before.
            Ok(()) | Err(_) => Ok(()),
        };
        let logs = self.path.parent().map_or_else(Vec::new, crate::shard::logs_in);
        std::iter::once(self.path).chain(self.others).chain(logs).try_for_each(remove)
    }

    /// Removes the file of a computation without results, and its folder if opening the file created the folder. Failures are ignored, because the command
    /// already reports an error.
    pub(crate) fn abandon(self) {
        let _ = fs::remove_file(&self.path);
        if let Some(folder) = self.path.parent().filter(|_| self.made_folder) {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Content of a file of rows.
struct Begun {
    rows: Vec<Row>,
    /// Number of bytes up to the end of the last complete line.
    whole: usize,
}

impl Begun {
    /// Reads a file's text. The error is the first line that differs from `header`.
    fn read(text: &str, header: &[String]) -> Result<Self, Difference> {
        // A last line without a line feed is torn, and drops out here.
        let mut lines = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
        let mut whole = 0;
        for expected in header {
            match lines.next() {
                Some(found) if found == expected => whole += found.len() + 1,
                Some(found) => return Err(Difference { found: found.to_owned(), expected: expected.clone() }),
                // The header itself is incomplete, so that the file has no rows and may begin again.
                None => return Ok(Self { rows: Vec::new(), whole: 0 }),
            }
        }
        let mut rows = Vec::new();
        for line in lines {
            // A damaged line still counts into `whole`: the rows after the line are kept.
            rows.extend(row(line));
            whole += line.len() + 1;
        }
        Ok(Self { rows, whole })
    }
}

/// Parses the row of a line; `None` if the line is damaged. A single wrong byte is always found, because FNV-1a maps different bytes to different
/// fingerprints if all other bytes are equal.
fn row(line: &str) -> Option<Row> {
    let (line, fingerprint) = line.rsplit_once(' ')?;
    if Fingerprint::of(line).to_string() != fingerprint {
        return None;
    }
    let mut words = line.split(' ');
    let number = words.next()?.parse().ok()?;
    Some((number, words.map(str::parse).collect::<Result<_, _>>().ok()?))
}

/// A header line that differs from the expected line.
#[derive(Debug)]
struct Difference {
    found: String,
    expected: String,
}

/// Returns the failure for a file of another computation. Lines are escaped and cut, since the file may be anything.
fn refused(path: &Path, Difference { found, expected }: &Difference) -> Failure {
    let shorten = |line: &str| line.chars().flat_map(char::escape_debug).take(200).collect::<String>();
    Failure::Input(format!(
        "{} holds the rows of another command: it says \"{}\", and this command \"{}\": repeat the command that began it, choose another folder, or remove the file",
        output::path(path),
        shorten(found),
        shorten(expected)
    ))
}

/// Returns the fingerprint of a text as a number.
pub(crate) fn fingerprint(text: &str) -> u64 {
    Fingerprint::of(text).get()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Vec<String> {
        vec!["a map".to_owned(), "grid 2x2".to_owned()]
    }

    #[test]
    fn rows_come_back_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/rows.partial");
        let (mut file, known) = RowsFile::open(path.clone(), &header()).unwrap();
        assert_eq!(known, Vec::<Row>::new());
        let rows = [(3, vec![0.0, 0.1 + 0.2, f64::INFINITY]), (1, vec![1.0, -0.0, 5e-324])];
        rows.iter().for_each(|(number, row)| file.add(*number, row).unwrap());
        let (file, known) = RowsFile::open(path.clone(), &header()).unwrap();
        assert_eq!(known, rows);
        file.remove().unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn what_is_abandoned_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let (mut file, _) = RowsFile::open(folder.path().join("new/rows.partial"), &header()).unwrap();
        file.add(0, &[1.0]).unwrap();
        file.abandon();
        assert!(!folder.path().join("new").exists());
        let (file, _) = RowsFile::open(folder.path().join("rows.partial"), &header()).unwrap();
        file.abandon();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    /// Writes a file with two rows, and returns its text.
    fn written(path: &Path) -> String {
        let (mut file, _) = RowsFile::open(path.to_path_buf(), &header()).unwrap();
        file.add(0, &[0.5]).unwrap();
        file.add(12, &[0.25, f64::INFINITY]).unwrap();
        fs::read_to_string(path).unwrap()
    }

    /// Flips every bit of the rows. A flipped line end joins two lines, and then neither row is read.
    #[test]
    fn no_flipped_bit_of_a_row_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.partial");
        let whole = written(&path).into_bytes();
        let rows = [(0, vec![0.5]), (12, vec![0.25, f64::INFINITY])];
        let header_end = "a map\ngrid 2x2\n".len();
        for bit in 8 * header_end..8 * whole.len() {
            let mut flipped = whole.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            fs::write(&path, flipped).unwrap();
            let (mut file, known) = RowsFile::open(path.clone(), &header()).unwrap();
            assert!(known.len() < 2 && known.iter().all(|row| rows.contains(row)), "bit {bit}: {known:?}");
            // A row added after the damaged row is read back.
            file.add(3, &[7.0]).unwrap();
            assert_eq!(RowsFile::open(path.clone(), &header()).unwrap().1.last(), Some(&(3, vec![7.0])), "bit {bit}");
        }
    }

    #[test]
    fn a_torn_line_is_forgotten_wherever_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.partial");
        let whole = written(&path);
        for end in 0..whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            let (mut file, known) = RowsFile::open(path.clone(), &header()).unwrap();
            assert_eq!(known.len(), whole[..end].matches('\n').count().saturating_sub(2), "{end}");
            file.add(3, &[7.0]).unwrap();
            let (_, again) = RowsFile::open(path.clone(), &header()).unwrap();
            assert_eq!((again.len(), again.last()), (known.len() + 1, Some(&(3, vec![7.0]))), "{end}");
        }
    }

    #[test]
    fn what_belongs_to_something_else_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.partial");
        for text in ["a map\ngrid 3x2\n0.0 0.5\n", "notes\n", "a map\ngrid 2x2 \n"] {
            fs::write(&path, text).unwrap();
            let Err(Failure::Input(message)) = RowsFile::open(path.clone(), &header()) else { panic!("{text:?} was taken") };
            assert!(message.contains("rows.partial holds the rows of another command"), "{message}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[test]
    fn workers_have_files_of_their_own_and_the_rows_of_all() {
        let folder = tempfile::tempdir().unwrap();
        let header = header();
        let kept = Kept { folder: &folder.path().join("new"), name: "map.rows", header: &header };
        assert_eq!(kept.read().unwrap(), (Vec::new(), Vec::new()));
        for (number, worker) in [(0, Some("node-7-1f")), (1, None), (2, Some("node-8-2f"))] {
            let (mut file, rows) = kept.open(worker).unwrap();
            assert_eq!(rows.len(), number);
            file.add(number, &[1.0]).unwrap();
        }
        let names: Vec<String> = kept.read().unwrap().1.iter().map(|path| path.file_name().unwrap().to_string_lossy().into_owned()).collect();
        assert_eq!(names, ["map.rows.node-7-1f.partial", "map.rows.node-8-2f.partial", "map.rows.partial"]);
        kept.open(None).unwrap().0.remove().unwrap();
        assert_eq!(fs::read_dir(kept.folder).unwrap().count(), 0);
    }
}
