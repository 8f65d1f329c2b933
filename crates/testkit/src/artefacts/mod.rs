//! What a test that fails leaves behind.

mod contents;
mod folder;

use std::ffi::OsStr;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::record::Record;
use crate::seed::Seed;
use crate::wire::HitCount;

/// If this variable of the environment names a folder, every test bed that fails writes what happened into a folder below it that has the name of the test.
pub const ARTEFACTS_VARIABLE: &str = "COHAPTIC_TEST_ARTEFACTS";

/// Why what happened is not in its folder.
#[derive(Debug)]
#[non_exhaustive]
pub enum WriteError {
    /// The folder holds something else.
    NotOurs {
        /// The folder.
        folder: PathBuf,
    },
    /// The path ends with `..`, or is empty.
    NoName {
        /// The path.
        folder: PathBuf,
    },
    /// The system refuses.
    Io {
        /// What could not be written.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotOurs { folder } => {
                write!(f, "{} is there already and was not written by a test bed; expected a folder of its own", folder.display())
            }
            Self::NoName { folder } => write!(f, "`{}` names no folder of its own; expected a path that ends with a name", folder.display()),
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
    /// Writes what happened into a folder, for people and for replays:
    ///
    /// - `summary.txt`: the seed, how to run it again, what every link did, and what every [law](crate::hit) hit;
    /// - `trace.txt`: all that happened, in words;
    /// - `fates-a-to-b.csv`: what became of every packet from `a` to `b` on its link, for every two hosts between which something was sent. It can be
    ///   [read back](cohaptic_wan::FateLog::parse) and [replayed](cohaptic_wan::LinkModel::Replay);
    /// - `packets-a-to-b.pcapng`: the same with what the packets carried, for packet analysers (feature `pcapng`, on by default);
    /// - `links.txt`: a [file of links](crate::Testbed::from_file) that replays all of it.
    ///
    /// In the names of files, characters of hosts' names other than letters, digits, `-` and `_` are `_`. A relative path is one from the folder in which the test
    /// runs, which `cargo test` makes that of the package. The folder that an earlier run has written is replaced as a whole: nobody sees it half-written.
    ///
    /// # Errors
    ///
    /// [`WriteError`] if the system refuses, or there is something else at that path; then nothing was changed.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), WriteError> {
        folder::replace(folder.as_ref(), &contents::files(self))
    }
}

/// Where a test that fails writes what happened.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Artefacts {
    folders: Vec<PathBuf>,
}

impl Artefacts {
    /// What the test has said, and what the environment says.
    pub(crate) fn new(said: Option<PathBuf>, seed: &Seed) -> Self {
        Self::of(std::env::var_os(ARTEFACTS_VARIABLE).as_deref(), said, seed)
    }

    fn of(environment: Option<&OsStr>, said: Option<PathBuf>, seed: &Seed) -> Self {
        let named = environment.filter(|folder| !folder.is_empty()).map(|folder| Path::new(folder).join(contents::file_name(&seed.test)));
        Self { folders: said.into_iter().chain(named).collect() }
    }

    /// Whether anything is to be written.
    pub(crate) const fn is_wanted(&self) -> bool {
        !self.folders.is_empty()
    }

    /// The lines about a run that has failed: in which task, if a task has panicked, a test that does the same again, where what happened is, how to run it
    /// again, and which laws hit nothing. Whatever goes wrong is told too, and no more: the test has failed for another reason.
    pub(crate) fn report(&self, task: Option<String>, again: String, record: Record) -> Vec<String> {
        let (hits, seed) = (record.hits().to_vec(), record.seed().clone());
        let task = task.map(|task| format!("{task} has panicked"));
        task.into_iter().chain((!again.is_empty()).then_some(again)).chain(self.lines(&seed, &hits, || record)).collect()
    }

    /// Writes the record, and gives the lines of the report.
    pub(crate) fn lines(&self, seed: &Seed, hits: &[HitCount], record: impl FnOnce() -> Record) -> Vec<String> {
        let mut lines = Vec::new();
        if self.is_wanted() {
            let record = record();
            for folder in &self.folders {
                match record.write(folder) {
                    Ok(()) => lines.push(format!("what happened is in {}", folder.display())),
                    Err(error) => lines.push(format!("what happened could not be written: {error}")),
                }
            }
        } else {
            lines.push(format!("{ARTEFACTS_VARIABLE}=FOLDER writes what happens: its trace, and all packets"));
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
