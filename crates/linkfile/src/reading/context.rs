//! The state of a reader: the texts, the names that are known so far, and the faults.

use core::any::Any;
use core::cell::RefCell;
use core::fmt;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_wan::Modulator;

use super::names::Names;
use crate::document::{Diagnostic, FileError, Node, Place, Sources};
use crate::fingerprint::Fingerprint;

/// The first fault in the order of the texts. Readers go on after a fault, so that a later part of the walk can find one that stands earlier. Keys that are
/// missing come last: of a file with `mas = 0.45` and without a `[coordination]` the wrong key is told first.
#[derive(Debug, Default)]
pub(crate) struct Faults(RefCell<Option<((Kind, Place), FileError)>>);

/// The kind of a fault, in the order in which faults are told: something is wrong, or missing.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Kind {
    Wrong,
    Missing,
}

impl Faults {
    /// Keeps the fault if none stands before it. Of several at one place the first one reported stays.
    fn report(&self, place: Place, error: impl FnOnce() -> FileError) {
        self.report_kind((Kind::Wrong, place), error);
    }

    fn report_kind(&self, order: (Kind, Place), error: impl FnOnce() -> FileError) {
        let mut first = self.0.borrow_mut();
        if first.as_ref().is_none_or(|(earlier, _)| order < *earlier) {
            *first = Some((order, error()));
        }
    }

    /// The fault that stands first, if there is one.
    pub(super) fn into_first(self) -> Option<FileError> {
        self.0.into_inner().map(|(_, error)| error)
    }
}

/// The modulators of a file by name, each with the names of its states.
pub type Modulators = BTreeMap<String, (Modulator, Vec<String>)>;

/// The way in which the files are read that a document names: a function from a path to the bytes of the file.
///
/// A program that takes documents from strangers decides here which of their files it opens, and how.
#[derive(Clone, Copy)]
pub struct FileReader<'a>(pub &'a dyn Fn(&Path) -> io::Result<Vec<u8>>);

impl FileReader<'_> {
    /// Opens any file, as a program does for its own user: [`cohaptic_files::read_bytes`].
    pub const ANY: Self = FileReader(&cohaptic_files::read_bytes);
}

impl fmt::Debug for FileReader<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("FileReader")
    }
}

/// The state of a reader, which the readers of parts are given.
#[derive(Clone, Copy, Debug)]
pub struct Context<'a> {
    /// The file and the overrides.
    pub sources: Sources<'a>,
    /// Where faults are reported.
    pub(crate) faults: &'a Faults,
    /// The contents of the files that the document names.
    pub(crate) files: &'a Files,
    /// How these files are read.
    pub(crate) reader: FileReader<'a>,
    /// The names of the ends of links. `None`: not known, because the list was refused.
    pub names: Option<&'a Names>,
    /// `None`: not known, because the list was refused.
    pub modulators: Option<&'a Arc<Modulators>>,
    /// Whether a table is read without the table below it: then no key is missing.
    pub partial: bool,
    /// Time from the start of the run to its end. `None`: not known, because the run ends when somebody ends it, or because the time was refused.
    pub ends: Option<Duration>,
}

impl<'a> Context<'a> {
    /// This state with the names of the ends.
    #[must_use]
    pub const fn with_names(self, names: Option<&'a Names>) -> Self {
        Self { names, ..self }
    }

    /// This state with the modulators of the file.
    #[must_use]
    pub const fn with_modulators(self, modulators: Option<&'a Arc<Modulators>>) -> Self {
        Self { modulators, ..self }
    }

    /// This state with the end of the run.
    #[must_use]
    pub const fn with_end(self, ends: Option<Duration>) -> Self {
        Self { ends, ..self }
    }

    /// This state for a table that is read without the table below it.
    #[must_use]
    pub const fn of_part(self) -> Self {
        Self { partial: true, ..self }
    }

    /// Reports what is wrong at a place.
    pub fn fault(&self, place: Place, key: &str, message: impl Into<String>) {
        self.faults.report(place, || FileError::Invalid(Box::new(self.sources.diagnostic(place, key.to_owned(), message.into()))));
    }

    /// Reports that something is missing at a place.
    pub(super) fn missing(&self, place: Place, key: &str, message: String) {
        let error = || FileError::Invalid(Box::new(self.sources.diagnostic(place, key.to_owned(), message)));
        self.faults.report_kind((Kind::Missing, place), error);
    }

    /// Reports what is wrong with a value.
    pub fn fault_at(&self, node: &Node, message: impl Into<String>) {
        self.fault(node.place, &node.path, message);
    }

    /// Reports what is wrong with a value, with a message that is made only if it is kept: one that lists the names of all peers takes long.
    pub fn fault_with(&self, node: &Node, message: impl FnOnce() -> String) {
        self.faults.report(node.place, || FileError::Invalid(Box::new(self.sources.diagnostic(node.place, node.path.clone(), message()))));
    }

    /// Reports that the file which `node` names cannot be read.
    pub(super) fn unreadable(&self, node: &Node, path: PathBuf, source: io::Error) {
        let message = format!("cannot read {}: {source}: expected a file, relative to the folder of the scene", path.display());
        self.faults.report(node.place, || {
            let place = self.sources.diagnostic(node.place, node.path.clone(), message);
            FileError::Read { path, source, place: Some(Box::new(place)) }
        });
    }

    /// Reports a fault in the file that `node` names.
    pub(super) fn fault_in_file(&self, node: &Node, diagnostic: Diagnostic) {
        let note = format!("this file is named at {}, by the key {}", self.sources.describe(node.place), node.path);
        self.faults.report(node.place, || FileError::Invalid(Box::new(Diagnostic { note: Some(note), ..diagnostic })));
    }
}

/// What has been learnt from files, by path and by what they were read as: each is read once. `None`: it was refused.
#[derive(Debug, Default)]
pub(crate) struct Files {
    pub(super) known: RefCell<BTreeMap<(PathBuf, String), Known>>,
    /// What was in each file that could be read.
    pub(super) held: RefCell<BTreeMap<PathBuf, Fingerprint>>,
}

pub(super) type Known = Option<Rc<dyn Any>>;

impl Files {
    /// What was in each file that could be read.
    pub(super) fn into_held(self) -> BTreeMap<PathBuf, Fingerprint> {
        self.held.into_inner()
    }
}
