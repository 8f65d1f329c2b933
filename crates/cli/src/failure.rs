//! Why a command ended without its result, and with which exit status.

use std::io;
use std::path::{Path, PathBuf};

use cohaptic_harness::record::RecordError;
use cohaptic_harness::{Model, TooLarge};
use cohaptic_scene::{Diagnostic, Scene, SceneError, at_peer};

use crate::input;

/// An expectation failed.
pub(crate) const EXPECTATION: u8 = 1;
/// A bad argument or scene.
pub(crate) const BAD_INPUT: u8 = 2;
/// An input or output error.
pub(crate) const INPUT_OUTPUT: u8 = 3;
/// Interrupted, as shells say it: 128 and the number of SIGINT.
pub(crate) const INTERRUPTED: u8 = 130;
/// Nobody reads standard output any more, as shells say it: 128 and the number of SIGPIPE.
pub(crate) const CLOSED: u8 = 141;

#[derive(Debug)]
pub(crate) enum Failure {
    Scene(SceneError),
    /// A fault in what an option other than `--set` puts into the scene.
    Override {
        option: &'static str,
        error: SceneError,
    },
    /// The scene is refused with the values of one combination of a campaign.
    Combination {
        error: Box<SceneError>,
        /// The option that gave the value with the fault.
        option: &'static str,
        /// Which combination it is, as a line of its own.
        combination: String,
    },
    Record(RecordError),
    /// A fault in the keys of a link.
    LinkKeys(SceneError),
    /// A fault in an argument or in a file that was read, in words.
    Input(String),
    /// A file that cannot be read or written.
    File {
        /// What cannot be done to it: "read".
        verb: &'static str,
        path: PathBuf,
        error: io::Error,
    },
    StandardOutput(io::Error),
    /// The system, a device or the network refuses something, in words.
    System(String),
    /// The user asked for the end before there was a result; how to go on, in words.
    Interrupted(String),
}

impl Failure {
    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Scene(error) | Self::Override { error, .. } | Self::LinkKeys(error) => scene_status(error),
            Self::Combination { error, .. } => scene_status(error),
            Self::Input(_) => BAD_INPUT,
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

    /// A message of the scene, which knows of overrides and not with which option they were given.
    fn in_words_of_options(&self, message: String) -> String {
        let option = self.option();
        if matches!(self, Self::LinkKeys(_)) {
            message.replacen("--set link.", "", 1)
        } else if option == "--set" {
            message
        } else {
            message.replacen("--set", option, 1)
        }
    }

    /// The option that a fault in an override was given with.
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

    /// Why the scene is refused, if it is.
    pub(crate) fn scene_error(&self) -> Option<&SceneError> {
        match self {
            Self::Scene(error) | Self::Override { error, .. } | Self::LinkKeys(error) => Some(error),
            Self::Combination { error, .. } => Some(error),
            Self::Record(_) | Self::Input(_) | Self::File { .. } | Self::StandardOutput(_) | Self::System(_) | Self::Interrupted(_) => None,
        }
    }
}

/// Why the variant of a scene that can be read cannot be had, where an option other than `--set` gave the difference.
pub(crate) fn of_variant(error: SceneError, option: &'static str, overrides: &[String]) -> Failure {
    let text = error.diagnostic().and_then(Diagnostic::override_text);
    if text.is_some_and(|text| overrides.iter().any(|given| given == text)) { Failure::Override { option, error } } else { Failure::Scene(error) }
}

/// Why a scene that makes sense is not simulated, at the place where there are too many peers; `None` if it can be.
pub(crate) fn too_large(scene: &Scene, overrides: &[String], model: Model, watched: bool) -> Option<SceneError> {
    let TooLarge { peer, reason } = cohaptic_harness::too_large(scene, model, watched)?;
    let path = if scene.file == input::named(Path::new("-")) { Path::new("-") } else { &scene.file };
    let refused = |text: &str, file: &Path| Err::<(), SceneError>(at_peer(text, file, overrides, peer, &reason));
    input::with(path, refused).err()
}

/// Why a scene that makes sense cannot be analysed.
pub(crate) fn not_analysed(scene: &Path, error: &impl std::fmt::Display) -> Failure {
    Failure::Input(format!("{}: {error}", input::named(scene).display()))
}

/// The exit status for a scene that could not be had.
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
