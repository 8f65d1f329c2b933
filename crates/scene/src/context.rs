//! What every reader of a part of the scene needs to know, and where it reports what is wrong.

use core::cell::RefCell;
use std::path::PathBuf;

use crate::error::{Diagnostic, SceneError};
use crate::model::Axes;
use crate::names::Names;
use crate::sections::{Files, Modulators};
use crate::source::{Place, Sources};
use crate::tree::Node;

/// The first fault in the order of the texts. Readers go on after a fault, so that a later part of the walk can find one that stands earlier.
#[derive(Debug, Default)]
pub(crate) struct Faults(RefCell<Option<(Place, SceneError)>>);

impl Faults {
    /// Keeps the fault if none stands before it. Of several at one place the first one reported stays.
    fn report(&self, place: Place, error: impl FnOnce() -> SceneError) {
        let mut first = self.0.borrow_mut();
        if first.as_ref().is_none_or(|(earlier, _)| place < *earlier) {
            *first = Some((place, error()));
        }
    }

    pub(crate) fn into_first(self) -> Option<SceneError> {
        self.0.into_inner().map(|(_, error)| error)
    }
}

/// Where a reader stands. A reader answers `None` where it has reported a fault.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Context<'a> {
    pub(crate) sources: Sources<'a>,
    pub(crate) faults: &'a Faults,
    /// What has been learnt from the files that the scene names.
    pub(crate) files: &'a Files,
    /// `None`: not known, because the number itself was refused.
    pub(crate) axes: Option<Axes>,
    /// `None`: not known, because the list itself was refused.
    pub(crate) names: Option<&'a Names>,
    /// `None`: not known, because the list itself was refused.
    pub(crate) modulators: Option<&'a Modulators>,
    /// Whether defaults are looked at on their own: then nothing can be missing.
    pub(crate) partial: bool,
    /// Whether the scene is for a live session, where peers that live elsewhere need no model.
    pub(crate) live: bool,
}

impl Context<'_> {
    /// Reports what is wrong at a place.
    pub(crate) fn fault(&self, place: Place, key: &str, message: impl Into<String>) {
        self.faults.report(place, || SceneError::Invalid(Box::new(self.sources.diagnostic(place, key.to_owned(), message.into()))));
    }

    /// Reports what is wrong with a value.
    pub(crate) fn fault_at(&self, node: &Node, message: impl Into<String>) {
        self.fault(node.place, &node.path, message);
    }

    /// The same, with a message that takes long to find words for, such as one that goes through the names of all peers: it is made only if it is kept.
    pub(crate) fn fault_with(&self, node: &Node, message: impl FnOnce() -> String) {
        self.faults.report(node.place, || SceneError::Invalid(Box::new(self.sources.diagnostic(node.place, node.path.clone(), message()))));
    }

    /// Reports that the file which `node` names cannot be read.
    pub(crate) fn unreadable(&self, node: &Node, path: PathBuf, source: std::io::Error) {
        let message = format!("cannot read {}: {source}: expected a file, relative to the folder of the scene", path.display());
        self.faults.report(node.place, || {
            let place = self.sources.diagnostic(node.place, node.path.clone(), message);
            SceneError::Read { path, source, place: Some(Box::new(place)) }
        });
    }

    /// Reports a fault in the file that `node` names.
    pub(crate) fn fault_in_file(&self, node: &Node, diagnostic: Diagnostic) {
        let note = format!("this file is named at {}, by the key {}", self.sources.describe(node.place), node.path);
        self.faults.report(node.place, || SceneError::Invalid(Box::new(Diagnostic { note: Some(note), ..diagnostic })));
    }
}
