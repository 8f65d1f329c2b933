//! Hosts and links from a file that a test can keep.

#[cfg(feature = "files")]
mod documents;
#[cfg(feature = "scenes")]
mod scene;

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use cohaptic_files::{MOST_TOML_BYTES, read_text, read_text_up_to};
use cohaptic_wan::LinkModel;

use crate::fault::WordsError;
use crate::hit::PathHit;
use crate::link::LinkChange;
use crate::words;

/// Hosts and the links between them, read from a file.
///
/// A file that ends in `.toml` is a relay file, whose programs are the hosts (feature `files`), or a scene file, whose peers are (feature `scenes`): its links are as it says, also
/// those that change while the run goes on, and its seed is that of the run. Devices, objects and expectations mean nothing here.
///
/// Any other file is of plain words, a line each:
///
/// ```text
/// # Lines that begin with # say nothing.
/// seed: 17
/// hosts: client server other
/// all: delay 10ms
/// client -> server: delay 24ms loss 1%
/// server -> client: replay fates-server-to-client.csv
/// client <-> other:
/// hit client -> server: drop 2nd packet
/// ```
///
/// After the colon stand words of `tc-netem`, done exactly, or nothing, which is the ideal link, or `replay` and the file of a fate log, beside the file itself. `all`
/// is every link that no other line names; without it they are ideal. Without `hosts` those take part whom lines name, in the order of the lines. `hit` and a path says which of
/// its packets are [hit](crate::hit).
///
/// Relative paths begin in the folder in which the test runs, which `cargo test` makes that of the package.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkFile {
    pub(crate) hosts: Vec<String>,
    /// What every link is that is not in `links`.
    pub(crate) every: LinkModel,
    /// By sender, then receiver.
    pub(crate) links: BTreeMap<(usize, usize), LinkModel>,
    /// In order of time.
    pub(crate) changes: Vec<LinkChange>,
    /// Which packets are hit.
    pub(crate) hits: Vec<PathHit>,
    pub(crate) seed: Option<u64>,
}

/// Why a file says no links.
#[derive(Debug)]
#[non_exhaustive]
pub enum LinkFileError {
    /// It cannot be read.
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Its words make no sense.
    Words {
        /// The file.
        path: PathBuf,
        /// Where, and why.
        error: WordsError,
    },
    /// It is a scene file or a relay file, and this crate was built without them.
    NoDocuments {
        /// The file.
        path: PathBuf,
    },
    /// It makes no sense as a scene file or a relay file.
    #[cfg(feature = "files")]
    Document(cohaptic_linkfile::FileError),
    /// A scene has what links between hosts cannot stand for.
    NotLinks {
        /// The file.
        path: PathBuf,
        /// What, and what was expected.
        what: String,
    },
}

impl fmt::Display for LinkFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Io { path, source } => write!(f, "{}: cannot be read: {source}", path.display()),
            Self::Words { path, error } => write!(f, "{}:{error}", path.display()),
            Self::NoDocuments { path } => write!(
                f,
                "{}: a relay file is read with the feature `files` of cohaptic-testkit only, a scene file with `scenes`; expected it, or a file of plain words",
                path.display()
            ),
            #[cfg(feature = "files")]
            Self::Document(error) => fmt::Display::fmt(error, f),
            Self::NotLinks { path, what } => write!(f, "{}: {what}", path.display()),
        }
    }
}

impl std::error::Error for LinkFileError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            #[cfg(feature = "files")]
            Self::Document(error) => std::error::Error::source(error),
            Self::Words { .. } | Self::NoDocuments { .. } | Self::NotLinks { .. } => None,
        }
    }
}

#[cfg(feature = "files")]
impl From<cohaptic_linkfile::FileError> for LinkFileError {
    fn from(error: cohaptic_linkfile::FileError) -> Self {
        Self::Document(error)
    }
}

impl LinkFile {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// [`LinkFileError`] if it cannot be read or makes no sense, with the place.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, LinkFileError> {
        let path = path.as_ref();
        let unreadable = |source| LinkFileError::Io { path: path.to_path_buf(), source };
        if path.extension().is_some_and(|extension| extension == "toml") {
            let text = read_text_up_to(path, MOST_TOML_BYTES).map_err(unreadable)?;
            return Self::document(&text, path);
        }
        let text = read_text(path).map_err(unreadable)?;
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        let file = |name: &str| read_text(&folder.join(name)).map_err(|error| format!("cannot be read: {error}"));
        Self::parse_with(&text, file).map_err(|error| LinkFileError::Words { path: path.to_path_buf(), error })
    }

    /// Reads a text of plain words, which names no files.
    ///
    /// # Errors
    ///
    /// [`WordsError`] if it makes no sense, with the place.
    pub fn parse(text: &str) -> Result<Self, WordsError> {
        Self::parse_with(text, |_| Err("a text names no files: expected words of tc-netem".to_owned()))
    }

    /// The names of the hosts.
    #[must_use]
    pub fn hosts(&self) -> &[String] {
        &self.hosts
    }

    /// The link from one host to another at the beginning, by their places in [`LinkFile::hosts`].
    #[must_use]
    pub fn between(&self, from: usize, to: usize) -> &LinkModel {
        self.links.get(&(from, to)).unwrap_or(&self.every)
    }

    fn parse_with(text: &str, file: impl FnMut(&str) -> Result<String, String>) -> Result<Self, WordsError> {
        let words::Words { hosts, every, links, hits, seed } = words::parse(text, file)?;
        Ok(Self { hosts, every, links, changes: Vec::new(), hits, seed })
    }

    #[cfg(not(feature = "files"))]
    fn document(_text: &str, path: &Path) -> Result<Self, LinkFileError> {
        Err(LinkFileError::NoDocuments { path: path.to_path_buf() })
    }
}
