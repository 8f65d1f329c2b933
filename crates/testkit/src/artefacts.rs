//! What a test that fails leaves behind.

use std::path::PathBuf;

use crate::core::Seen;
use crate::trace::Trace;

/// Where a test that fails writes what happened.
#[derive(Clone, Debug)]
pub(crate) struct Artefacts {
    pub(crate) folder: PathBuf,
}

impl Artefacts {
    pub(crate) fn write(&self, _trace: &Trace, _packets: &[Seen]) -> String {
        self.folder.display().to_string()
    }
}
