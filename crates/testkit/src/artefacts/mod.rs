//! Files left behind by a failing test.

mod contents;
mod folder;

use std::ffi::OsStr;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::record::Record;
use crate::seed::Seed;
use crate::wire::HitCount;

/// Name of the environment variable for a folder. Every failing test bed writes a record into a subfolder with the name of the test.
pub const ARTEFACTS_VARIABLE: &str = "COHAPTIC_TEST_ARTEFACTS";

/// Error of writing a record into a folder.
#[derive(Debug)]
#[non_exhaustive]
pub enum WriteError {
    /// The folder contains other files, and was not written by a test bed.
    NotOurs {
        /// The folder.
        folder: PathBuf,
    },
    /// The path ends with `..`, or is empty.
    NoName {
        /// The path.
        folder: PathBuf,
    },
    /// The system refused an operation.
    Io {
        /// Path that could not be written.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotOurs { folder } => {
                write!(f, "{} exists and was not written by a test bed; expected a new folder, or the folder of an earlier failure", folder.display())
            }
            Self::NoName { folder } => write!(f, "`{}` cannot be the folder of a failure; expected a path that ends with a name", folder.display()),
            Self::Io { path, source } => write!(f, "{}: {source}", path.display()),
        }
    }
}

impl std::error::Error for WriteError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            Self::NotOurs { .. } | Self::NoName { .. } => None,
        }
    }
}

impl Record {
    /// Writes the record into a folder, for readers and for replays:
    ///
    /// - `summary.txt`: the seed, how to repeat the run, the counts of every link, and the packets hit by every [law](crate::hit);
    /// - `trace.txt`: the events of the run, in words;
    /// - `fates-a-to-b.csv`: the fate of every packet from `a` to `b` on its link, for every two hosts between which a packet was sent. The file can be
    ///   [read back](cohaptic_wan::FateLog::parse) and [replayed](cohaptic_wan::LinkModel::Replay);
    /// - `packets-a-to-b.pcapng`: the same with the contents of the packets, for packet analysers (feature `pcapng`, on by default);
    /// - `links.txt`: a [file of links](crate::Testbed::from_file) that replays all links.
    ///
    /// In the names of files, every character of a host's name other than letters, digits, `-` and `_` becomes `_`. A relative path begins in the folder in
    /// which the test runs; under `cargo test` this is the folder of the package. A folder written by an earlier run is replaced as a whole, so that it is
    /// never seen half-written.
    ///
    /// # Errors
    ///
    /// [`WriteError`] if the system refuses, or the path belongs to other files. Nothing was changed in either case.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), WriteError> {
        folder::replace(folder.as_ref(), &contents::files(self))
    }
}

/// Folders for the record of a failing test.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Artefacts {
    folders: Vec<PathBuf>,
}

impl Artefacts {
    /// Collects the folder that the test has given (`said`), and the folder from the environment.
    pub(crate) fn new(said: Option<PathBuf>, seed: &Seed) -> Self {
        Self::of(std::env::var_os(ARTEFACTS_VARIABLE).as_deref(), said, seed)
    }

    fn of(environment: Option<&OsStr>, said: Option<PathBuf>, seed: &Seed) -> Self {
        let named = environment.filter(|folder| !folder.is_empty()).map(|folder| Path::new(folder).join(contents::file_name(&seed.test)));
        Self { folders: said.into_iter().chain(named).collect() }
    }

    /// Returns whether a record is to be written.
    pub(crate) const fn is_wanted(&self) -> bool {
        !self.folders.is_empty()
    }

    /// Writes the record of a failed run, and returns the lines of its report: the task that has panicked, if any, a test that repeats the failure, the folder
    /// of the record, how to repeat the run, and the laws that have hit nothing. A record that cannot be written is only reported, because the test has failed
    /// for another reason.
    pub(crate) fn report(&self, task: Option<String>, again: String, record: Record) -> Vec<String> {
        let (hits, seed) = (record.hits().to_vec(), record.seed().clone());
        let task = task.map(|task| format!("{task} has panicked"));
        task.into_iter().chain((!again.is_empty()).then_some(again)).chain(self.lines(&seed, &hits, || record)).collect()
    }

    /// Writes the record, and returns the lines of the report.
    pub(crate) fn lines(&self, seed: &Seed, hits: &[HitCount], record: impl FnOnce() -> Record) -> Vec<String> {
        let mut lines = Vec::new();
        if self.is_wanted() {
            // Made only here, because following all packets to their ends takes time.
            let record = record();
            for folder in &self.folders {
                match record.write(folder) {
                    Ok(()) => lines.push(format!("the record of the run is in {}", folder.display())),
                    Err(error) => lines.push(format!("the record of the run could not be written: {error}")),
                }
            }
        } else {
            lines.push(format!("{ARTEFACTS_VARIABLE}=FOLDER writes the record of a failed run: its trace, and all packets"));
        }
        for nothing in hits.iter().filter(|count| count.hit == 0) {
            lines.push(format!("note: {}", nothing.words()));
        }
        lines.push(seed.advice());
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_names_a_folder_beside_that_of_the_test() {
        let seed = Seed { value: 1, test: "links::it works".into(), is_of_place: true };
        assert!(!Artefacts::of(None, None, &seed).is_wanted());
        assert!(!Artefacts::of(Some(OsStr::new("")), None, &seed).is_wanted());
        let both = Artefacts::of(Some(OsStr::new("/tmp/all")), Some("mine".into()), &seed);
        assert_eq!(both.folders, [PathBuf::from("mine"), PathBuf::from("/tmp/all/links__it_works")]);
    }
}
