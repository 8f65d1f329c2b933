//! Reasons for a study to be refused or to end early.

use std::io;
use std::path::{Path, PathBuf};

use cohaptic_linkfile::FileError;

use crate::codes::PersonCode;
use crate::sequence::SequenceError;

/// Reason for which a study cannot begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The study file or its scene is refused.
    #[error(transparent)]
    Study(#[from] FileError),
    /// The session does not take the event now. Nothing has changed.
    #[error(transparent)]
    Refused(#[from] SequenceError),
    /// The folder holds another study.
    #[error("{} holds another study: {}.\nRepeat the command that began it to go on there, or give this one a folder of its own", path.display(), differences.join("; "))]
    Other {
        /// The folder.
        path: PathBuf,
        /// The differences between the two studies, in words.
        differences: Vec<String>,
    },
    /// The folder holds files but no study.
    #[error("{} holds files, {found} among them, and no study: expected a folder of its own for the study, which need not exist yet", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The first foreign file by name.
        found: String,
    },
    /// The folder holds no study.
    #[error("{} holds no study: expected the folder that cohaptic study was given with --out", path.display())]
    NoStudy {
        /// The folder.
        path: PathBuf,
    },
    /// The folder is in use by another process.
    #[error("another process works on the study in {}: wait until it has ended, or choose another folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A file is not as a study writes it.
    #[error("{} is not as a study writes it ({message}): restore the file from a copy, or remove the folder", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The fault.
        message: String,
    },
    /// The code belongs to nobody in the study.
    #[error("nobody in the study in {} has the code {person}: expected a code such as those in answers.csv", path.display())]
    Nobody {
        /// The folder.
        path: PathBuf,
        /// The code.
        person: PersonCode,
    },
    /// A file cannot be read or written. What is kept stays kept.
    #[error("cannot {verb} {}: {error}", path.display())]
    File {
        /// The refused operation, such as `read` or `write`.
        verb: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        error: io::Error,
    },
}

impl StudyError {
    pub(crate) fn damaged(path: &Path, message: impl Into<String>) -> Self {
        Self::Damaged { path: path.to_path_buf(), message: message.into() }
    }

    pub(crate) fn file(verb: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |error| Self::File { verb, path, error }
    }
}
