//! Context of readers: the source texts, the names known so far, the files read so far, and the faults.

use core::any::Any;
use core::cell::RefCell;
use core::fmt;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_wan::Modulator;

use super::names::Names;
use crate::document::{Diagnostic, FileError, Node, Place, Sources};
use crate::fingerprint::Fingerprint;

/// First reported fault in the order of the texts. Readers go on after a fault, because a later reader can find an earlier fault of the text. Missing keys come
/// last: of a file with `mas = 0.45` and without a `[coordination]`, the wrong key is reported.
#[derive(Debug, Default)]
pub(crate) struct Faults(RefCell<Option<((Kind, Place), FileError)>>);

/// Kind of a fault. Wrong values and keys are reported before missing keys.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Kind {
    Wrong,
    Missing,
}

impl Faults {
    /// Keeps the fault unless an earlier fault is kept. Of several faults at the same place, the first reported fault is kept.
    fn report(&self, place: Place, error: impl FnOnce() -> FileError) {
        self.report_kind((Kind::Wrong, place), error);
    }

    fn report_kind(&self, order: (Kind, Place), error: impl FnOnce() -> FileError) {
        // The error is made only for a kept fault, because messages can be long.
        let mut first = self.0.borrow_mut();
        // `<` keeps the first of several faults at the same place.
        if first.as_ref().is_none_or(|(earlier, _)| order < *earlier) {
            *first = Some((order, error()));
        }
    }

    /// Returns the fault that stands first, or `None` if no fault was reported.
    pub(super) fn into_first(self) -> Option<FileError> {
        self.0.into_inner().map(|(_, error)| error)
    }
}

/// Modulators of a file by name, each with the names of the states.
pub type Modulators = BTreeMap<String, (Modulator, Vec<String>)>;

/// Collector of the links of the library that a document names, with version and, if the directions differ, direction.
#[derive(Debug, Default)]
pub(crate) struct Profiles(RefCell<BTreeSet<String>>);

/// Reader of the files named in a document: a function from a path to the bytes of the file.
///
/// A program that takes documents from strangers decides in this function which files may be opened, and how.
#[derive(Clone, Copy)]
pub struct FileReader<'a>(pub &'a dyn Fn(&Path) -> io::Result<Vec<u8>>);

impl FileReader<'_> {
    /// Opens any file, for a program whose user wrote the document: [`cohaptic_files::read_bytes`].
    pub(crate) const ANY: Self = FileReader(&cohaptic_files::read_bytes);
}

impl fmt::Debug for FileReader<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("FileReader")
    }
}

/// Context of a reader, passed on to the readers of the parts.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// Source texts: the file and the overrides.
    pub sources: Sources<'a>,
    /// Collector of faults.
    pub(crate) faults: &'a Faults,
    /// Files named in the document, as far as they have been read.
    pub(crate) files: &'a Files,
    /// Reader of the bytes of these files.
    pub(crate) reader: FileReader<'a>,
    /// Collector of the links of the library that the document names.
    pub(crate) profiles: &'a Profiles,
    /// Names of the ends of links. `None` before the list is read, and if the list was refused.
    pub names: Option<&'a Names>,
    /// Modulators of the file. `None` before the list is read, and if the list was refused.
    pub(crate) modulators: Option<&'a Arc<Modulators>>,
    /// `true` if a table is read without the table below, over which the table will be laid. No key is reported as missing then.
    pub partial: bool,
    /// Length of the run. `None` if the run has no fixed end, or if the time was refused.
    pub(crate) ends: Option<Duration>,
}

impl<'a> Context<'a> {
    /// Returns this context with the names of the ends of links.
    #[must_use]
    pub const fn with_names(self, names: Option<&'a Names>) -> Self {
        Self { names, ..self }
    }

    /// Returns this context with the modulators of the file.
    #[must_use]
    pub const fn with_modulators(self, modulators: Option<&'a Arc<Modulators>>) -> Self {
        Self { modulators, ..self }
    }

    /// Returns this context with the end of the run.
    #[must_use]
    pub const fn with_end(self, ends: Option<Duration>) -> Self {
        Self { ends, ..self }
    }

    /// Returns this context for a table read without the table below, over which the table will be laid.
    #[must_use]
    pub const fn of_part(self) -> Self {
        Self { partial: true, ..self }
    }

    /// Notes that the document names a link of the library, by the full name of the link.
    pub(crate) fn note_profile(&self, name: String) {
        self.profiles.0.borrow_mut().insert(name);
    }

    /// Returns the full names of the links of the library that the document has named so far, sorted.
    #[must_use]
    pub fn profiles(&self) -> Vec<String> {
        self.profiles.0.borrow().iter().cloned().collect()
    }

    /// Reports a fault at a place, with the dotted path of the key.
    pub fn fault(&self, place: Place, key: &str, message: impl Into<String>) {
        self.faults.report(place, || FileError::Invalid(Box::new(self.sources.diagnostic(place, key.to_owned(), message.into()))));
    }

    /// Reports a missing key in the table at a place.
    pub(super) fn missing(&self, place: Place, key: &str, message: String) {
        // A kind of its own: a wrong key often explains a missing key.
        let error = || FileError::Invalid(Box::new(self.sources.diagnostic(place, key.to_owned(), message)));
        self.faults.report_kind((Kind::Missing, place), error);
    }

    /// Reports a fault of a value.
    pub fn fault_at(&self, node: &Node, message: impl Into<String>) {
        self.fault(node.place, &node.path, message);
    }

    /// Reports a fault of a value. The message is made only if the fault is kept, because a message with the names of all peers is long.
    pub fn fault_with(&self, node: &Node, message: impl FnOnce() -> String) {
        self.faults.report(node.place, || FileError::Invalid(Box::new(self.sources.diagnostic(node.place, node.path.clone(), message()))));
    }

    /// Reports that the file named by `node` cannot be read.
    pub(super) fn unreadable(&self, node: &Node, path: PathBuf, source: io::Error) {
        let message = format!("cannot read {}: {source}: expected a file, relative to the folder of this file", path.display());
        self.faults.report(node.place, || {
            let place = self.sources.diagnostic(node.place, node.path.clone(), message);
            FileError::Read { path, source, place: Some(Box::new(place)) }
        });
    }

    /// Reports a fault in the file named by `node`. A note gives the place of `node`.
    pub(super) fn fault_in_file(&self, node: &Node, diagnostic: Diagnostic) {
        self.refused_file(node, FileError::Invalid(Box::new(diagnostic)));
    }

    /// Reports that the document in the file named by `node` was refused. The fault keeps its place in the file, and a note gives the place of `node`. A fault in
    /// a file which that document names has two notes, the inner first.
    pub fn refused_file(&self, node: &Node, error: FileError) {
        let note = format!("this file is named at {}, by the key {}", self.sources.describe(node.place), node.path);
        let noted = |diagnostic: Box<Diagnostic>| {
            let note = match &diagnostic.note {
                Some(inner) => format!("{inner}; {note}"),
                None => note.clone(),
            };
            Box::new(Diagnostic { note: Some(note), ..*diagnostic })
        };
        self.faults.report(node.place, || match error {
            FileError::Invalid(diagnostic) => FileError::Invalid(noted(diagnostic)),
            FileError::Read { path, source, place } => FileError::Read { path, source, place: place.map(noted) },
            error @ FileError::NoFile { .. } => error,
        });
    }
}

/// Files named in a document. A file is read once for each form in which the document uses it.
#[derive(Debug, Default)]
pub(crate) struct Files {
    /// Parsed content, by path and by form. `None` if the file was refused: the fault has been reported, and is not reported twice.
    pub(super) known: RefCell<BTreeMap<(PathBuf, String), Known>>,
    /// Fingerprint of the bytes of each readable file, by path.
    pub(super) held: RefCell<BTreeMap<PathBuf, Fingerprint>>,
}

pub(super) type Known = Option<Rc<dyn Any>>;

impl Files {
    /// Returns the fingerprint of each readable file, by path.
    pub(super) fn into_held(self) -> BTreeMap<PathBuf, Fingerprint> {
        self.held.into_inner()
    }
}
