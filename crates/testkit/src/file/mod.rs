//! Hosts and links from a file beside a test.

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

use crate::access::AccessLines;
use crate::fault::WordsError;
use crate::hit::PathHit;
use crate::link::LinkChange;
use crate::words::{self, DeviceLine};

/// Hosts and the links between them, read from a file.
///
/// A file whose name ends in `.toml` is a relay file, whose programs become the hosts (feature `files`), or a scene file, whose peers become the hosts (feature
/// `scenes`). The file gives the links, their changes during the run, the access lines, and the seed of the run. Devices, objects and expectations are ignored.
///
/// Any other file consists of plain words, an entry per line:
///
/// ```text
/// # Lines that begin with # say nothing.
/// seed: 17
/// hosts: client server other
/// nat home udp-timeout 30s: client
/// all: delay 10ms
/// home -> server: delay 24ms loss 1%
/// server -> home: replay fates-server-to-home.csv
/// server <-> other:
/// hit client -> home: drop 2nd packet
/// ```
///
/// After the colon follow words of `tc-netem` for an exact emulation, or nothing for the ideal link, or `replay` and the file of a fate log, relative to the
/// link file, or, with the feature `files`, the name of a link of the library such as `starlink/up`. `all` stands for every link without a line of its own;
/// without `all` such links are ideal. Without `hosts` the lines name the hosts, in the order of the lines. `hit` and a path hit [packets](crate::hit) of the
/// path. `nat` and `firewall`, with a name and [words](crate::Testbed::nat) of the behaviour, put the hosts after the colon behind a NAT or a firewall, and
/// `interfaces` and a host give the host the [interfaces](crate::Testbed::interfaces) after the colon. Such a line stands after `hosts`, and before the lines
/// that name the NAT or the interfaces.
///
/// Relative paths begin in the folder in which the test runs; under `cargo test` this is the folder of the package.
#[derive(Clone, PartialEq, Debug)]
pub struct LinkFile {
    /// Names of the hosts, then of NATs, firewalls and interfaces.
    pub(crate) hosts: Vec<String>,
    /// NATs, firewalls and interfaces, in the order of their names. A NAT stands after all that are behind it.
    pub(crate) devices: Vec<DeviceLine>,
    /// Link of every path that is not in `links`.
    pub(crate) every: LinkModel,
    /// Links by indices of sender and receiver.
    pub(crate) links: BTreeMap<(usize, usize), LinkModel>,
    /// Changes of links, sorted by time.
    pub(crate) changes: Vec<LinkChange>,
    /// Access lines by index of the host.
    pub(crate) access: BTreeMap<usize, AccessLines>,
    /// Hits on packets.
    pub(crate) hits: Vec<PathHit>,
    pub(crate) seed: Option<u64>,
}

/// Error of reading a link file.
#[derive(Debug)]
#[non_exhaustive]
pub enum LinkFileError {
    /// The file cannot be read.
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: io::Error,
    },
    /// The words of the file make no sense.
    Words {
        /// The file.
        path: PathBuf,
        /// Place and message of the error.
        error: WordsError,
    },
    /// The file is a scene file or a relay file, and this crate was built without the feature for it.
    NoDocuments {
        /// The file.
        path: PathBuf,
    },
    /// The file makes no sense as a scene file or a relay file.
    #[cfg(feature = "files")]
    Document(cohaptic_linkfile::FileError),
    /// The scene has a part that links between hosts cannot represent.
    NotLinks {
        /// The file.
        path: PathBuf,
        /// The part of the scene, and what was expected.
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
                "{}: a relay file needs the feature `files` of cohaptic-testkit, a scene file the feature `scenes`; expected that feature, or a file of plain \
                 words",
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
    /// Reads a link file.
    ///
    /// # Errors
    ///
    /// [`LinkFileError`] if the file cannot be read or makes no sense. The error names the place.
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

    /// Parses a text of plain words, which must not name files.
    ///
    /// # Errors
    ///
    /// [`WordsError`] if the text makes no sense. The error names the place.
    pub fn parse(text: &str) -> Result<Self, WordsError> {
        Self::parse_with(text, |_| Err("a text without a file of its own cannot name files: expected words of tc-netem".to_owned()))
    }

    /// Returns the names of the hosts.
    #[must_use]
    pub fn hosts(&self) -> &[String] {
        &self.hosts[..self.hosts.len() - self.devices.iter().map(DeviceLine::names).sum::<usize>()]
    }

    /// Returns the link from a host to another host at the beginning of the run. The hosts are given by their indices in [`LinkFile::hosts`]. NATs,
    /// firewalls and interfaces follow the hosts, in the order of their lines.
    #[must_use]
    pub fn between(&self, from: usize, to: usize) -> &LinkModel {
        self.links.get(&(from, to)).unwrap_or(&self.every)
    }

    fn parse_with(text: &str, file: impl FnMut(&str) -> Result<String, String>) -> Result<Self, WordsError> {
        let words::Words { hosts, devices, every, links, hits, seed } = words::parse(text, file)?;
        Ok(Self { hosts, devices, every, links, changes: Vec::new(), access: BTreeMap::new(), hits, seed })
    }

    #[cfg(not(feature = "files"))]
    fn document(_text: &str, path: &Path) -> Result<Self, LinkFileError> {
        Err(LinkFileError::NoDocuments { path: path.to_path_buf() })
    }
}
