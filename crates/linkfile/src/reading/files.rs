//! The files that a document names, each read once.

use core::any::Any;
use core::cell::RefCell;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::rc::Rc;

use crate::fingerprint::Fingerprint;

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
