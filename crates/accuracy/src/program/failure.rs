//! Why the program ends without success, and with which exit status.

use std::io;
use std::path::PathBuf;

use cohaptic_accuracy::AccuracyError;

/// Exit status of an input or output error, and of a measurement that ended early by itself.
const INPUT_OUTPUT: u8 = 3;
/// Exit status after Ctrl-C, as shells have it: 128 and the number of SIGINT.
pub(crate) const INTERRUPTED: u8 = 130;
/// Exit status if standard output was closed, as shells have it: 128 and the number of SIGPIPE.
const CLOSED: u8 = 141;

#[derive(Debug)]
pub(crate) enum Failure {
    File {
        /// Verb that failed, such as "create".
        verb: &'static str,
        path: PathBuf,
        error: io::Error,
    },
    StandardOutput(io::Error),
    /// A scene of this crate is refused, which would be a fault of this crate, or the system refuses to wait.
    Measurement(AccuracyError),
}

impl Failure {
    pub(crate) fn status(&self) -> u8 {
        if self.is_closed_pipe() { CLOSED } else { INPUT_OUTPUT }
    }

    /// Returns whether the reader of standard output has read enough, which is no error and needs no message.
    pub(crate) fn is_closed_pipe(&self) -> bool {
        matches!(self, Self::StandardOutput(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    pub(crate) fn message(&self) -> String {
        match self {
            Self::File { verb, path, error } => format!("cannot {verb} {}: {error}", path.display()),
            Self::StandardOutput(error) => format!("cannot write to standard output: {error}"),
            Self::Measurement(error) => format!("the measurement ended early: {error}"),
        }
    }
}
