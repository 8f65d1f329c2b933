//! Failures of commands, with messages and exit statuses.

use std::io;
use std::path::{Path, PathBuf};

use cohaptic_harness::record::RecordError;
use cohaptic_harness::{Model, TooLarge};
use cohaptic_scene::{Diagnostic, Scene, SceneError, at_peer};

use crate::input;

/// Exit status if an expectation failed.
pub(crate) const EXPECTATION: u8 = 1;
/// Exit status for a bad argument or scene.
pub(crate) const BAD_INPUT: u8 = 2;
/// Exit status for an error of input or output.
pub(crate) const INPUT_OUTPUT: u8 = 3;
/// Exit status of `exec` if this program failed, and not its command, by the convention of `env` and `timeout`.
pub(crate) const EXEC_FAILED: u8 = 125;
/// Exit status of an interrupted command, by the convention of shells: 128 plus the number of SIGINT.
pub(crate) const INTERRUPTED: u8 = 130;
/// Exit status if the reader closed standard output, by the convention of shells: 128 plus the number of SIGPIPE.
pub(crate) const CLOSED: u8 = 141;

#[derive(Debug)]
pub(crate) enum Failure {
    Scene(SceneError),
    /// A fault in an override by another option than `--set`.
    Override {
        option: &'static str,
        error: SceneError,
    },
    /// The scene is refused with the values of one combination of a campaign.
    Combination {
        error: Box<SceneError>,
        /// Option with the value at fault.
        option: &'static str,
        /// Line about the combination. Empty if the campaign varies nothing.
        combination: String,
    },
    Record(RecordError),
    /// A fault in the keys of a link.
    LinkKeys(SceneError),
    /// A fault in an argument or in an input file, as a message.
    Input(String),
    /// A file that cannot be read or written.
    File {
        /// Action that failed, such as "read" or "write".
        verb: &'static str,
        path: PathBuf,
        error: io::Error,
    },
    StandardOutput(io::Error),
    /// A refusal by the system, a device or the network, as a message.
    System(String),
    /// The user asked for the end before there was a result. The message tells how to continue.
    Interrupted(String),
}

impl Failure {
    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Scene(error) | Self::Override { error, .. } | Self::LinkKeys(error) => scene_status(error),
            Self::Combination { error, .. } => scene_status(error),
            Self::Input(_) => BAD_INPUT,
            // A closed pipe gives the status of a program that SIGPIPE ended, as shells expect.
            Self::StandardOutput(error) if error.kind() == io::ErrorKind::BrokenPipe => CLOSED,
            Self::Record(_) | Self::File { .. } | Self::System(_) | Self::StandardOutput(_) => INPUT_OUTPUT,
            Self::Interrupted(_) => INTERRUPTED,
        }
    }

    pub(crate) fn message(&self) -> String {
        match self {
            Self::Scene(error) | Self::Override { error, .. } | Self::LinkKeys(error) => self.in_words_of_options(error.to_string()),
            Self::Combination { error, combination, .. } => self.in_words_of_options(error.to_string()) + combination,
            Self::Record(error) => error.to_string(),
            Self::Input(message) | Self::Interrupted(message) | Self::System(message) => message.clone(),
            Self::File { verb, path, error } => format!("cannot {verb} {}: {error}", path.display()),
            Self::StandardOutput(error) => format!("cannot write to standard output: {error}"),
        }
    }

    /// Replaces `--set` in a message about the scene by the option of the user: the scene crate knows only `--set`.
    fn in_words_of_options(&self, message: String) -> String {
        let option = self.option();
        if matches!(self, Self::LinkKeys(_)) {
            // `--set link.` stands before the key at fault. The user typed the key without it.
            message.replacen("--set link.", "", 1)
        } else if option == "--set" {
            message
        } else {
            message.replacen("--set", option, 1)
        }
    }

    /// Returns the option of the override at fault.
    pub(crate) const fn option(&self) -> &'static str {
        match self {
            Self::Override { option, .. } => option,
            Self::Combination { option, .. } => option,
            Self::Scene(_)
            | Self::Record(_)
            | Self::LinkKeys(_)
            | Self::Input(_)
            | Self::File { .. }
            | Self::StandardOutput(_)
            | Self::System(_)
            | Self::Interrupted(_) => "--set",
        }
    }

    /// Returns the error of the scene or of the keys of a link, or `None` for other failures.
    pub(crate) fn scene_error(&self) -> Option<&SceneError> {
        match self {
            Self::Scene(error) | Self::Override { error, .. } | Self::LinkKeys(error) => Some(error),
            Self::Combination { error, .. } => Some(error),
            Self::Record(_) | Self::Input(_) | Self::File { .. } | Self::StandardOutput(_) | Self::System(_) | Self::Interrupted(_) => None,
        }
    }
}

/// Returns the failure of a scene with the `overrides` of an option other than `--set`. If the fault lies in one of these overrides, the failure names
/// `option`.
pub(crate) fn of_variant(error: SceneError, option: &'static str, overrides: &[String]) -> Failure {
    let text = error.diagnostic().and_then(Diagnostic::override_text);
    // The overrides of the option stand on top of `--set`, so that of two equal texts the one of the option counts.
    if text.is_some_and(|text| overrides.iter().any(|given| given == text)) { Failure::Override { option, error } } else { Failure::Scene(error) }
}

/// Returns the error for a valid scene with too many peers for a simulation, at the place of the peers in the file. Returns `None` if the scene can be
/// simulated.
pub(crate) fn too_large(scene: &Scene, overrides: &[String], model: Model, watched: bool) -> Option<SceneError> {
    let TooLarge { peer, reason } = cohaptic_harness::too_large(scene, model, watched)?;
    at_peer_of(scene, overrides, peer, &reason)
}

/// Returns an error at the place of a peer in the file of a readable scene.
pub(crate) fn at_peer_of(scene: &Scene, overrides: &[String], peer: usize, reason: &str) -> Option<SceneError> {
    // A scene from standard input has a name for messages as its file. The path `-` gives the kept bytes of standard input.
    let path = if scene.file == input::named(Path::new("-")) { Path::new("-") } else { &scene.file };
    let refused = |text: &str, file: &Path| Err::<(), SceneError>(at_peer(text, file, overrides, peer, reason));
    input::with(path, refused).err()
}

/// Returns the failure for a valid scene that cannot be analysed.
pub(crate) fn not_analysed(scene: &Path, error: &impl std::fmt::Display) -> Failure {
    Failure::Input(format!("{}: {error}", input::named(scene).display()))
}

/// Returns the exit status for a scene that cannot be read or is not valid.
pub(crate) fn scene_status(error: &SceneError) -> u8 {
    if error.is_io() { INPUT_OUTPUT } else { BAD_INPUT }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        Self::Record(error)
    }
}

/// Returns the end of an error: this program was built without a feature.
#[cfg(target_os = "linux")]
pub(crate) fn without_feature(feature: &str) -> String {
    format!("this program was built without the feature {feature}. Expected a program from: cargo build -p cohaptic-cli --features {feature}")
}
