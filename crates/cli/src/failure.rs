//! Why a command ended without its result, and with which exit status.

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue};
use cohaptic_harness::record::RecordError;
use cohaptic_scene::{Diagnostic, Scene, SceneError, at_peer};
use cohaptic_units::{Visible, visible_lines};

use crate::output;

/// An expectation failed.
pub(crate) const EXPECTATION: u8 = 1;
/// A bad argument or scene.
pub(crate) const BAD_INPUT: u8 = 2;
/// An input or output error.
pub(crate) const INPUT_OUTPUT: u8 = 3;
/// Interrupted, as shells say it: 128 and the number of SIGINT.
pub(crate) const INTERRUPTED: u8 = 130;

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
        /// Whether the fault is in one of these values.
        is_varied: bool,
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
    /// Says on standard error what went wrong, and gives the exit status.
    pub(crate) fn report(&self) -> ExitCode {
        let (message, status) = match self {
            Self::Scene(error) => (error.to_string(), scene_status(error)),
            // The scene knows of overrides, and not which option they came from.
            Self::Override { option, error } => (error.to_string().replacen("--set", option, 1), scene_status(error)),
            Self::Combination { error, is_varied, combination } => {
                let message = error.to_string();
                let message = if *is_varied { message.replacen("--set", "--vary", 1) } else { message };
                (message + combination, scene_status(error))
            }
            Self::Record(error) => (error.to_string(), INPUT_OUTPUT),
            // The scene knows of overrides, and not that these are words of their own.
            Self::LinkKeys(error) => (error.to_string().replacen("--set link.", "", 1), scene_status(error)),
            Self::Input(message) => (message.clone(), BAD_INPUT),
            Self::File { verb, path, error } => (format!("cannot {verb} {}: {error}", path.display()), INPUT_OUTPUT),
            Self::Interrupted(message) => (message.clone(), INTERRUPTED),
            Self::System(message) => (message.clone(), INPUT_OUTPUT),
            Self::StandardOutput(error) => (format!("cannot write to standard output: {error}"), INPUT_OUTPUT),
        };
        // If standard error cannot be written to either, the exit status is all that is left to say it with.
        let kind = if status == INTERRUPTED { "interrupted" } else { "error" };
        let _ = io::Write::write_all(&mut io::stderr(), visible_lines(&format!("{kind}: {message}\n")).as_bytes());
        ExitCode::from(status)
    }
}

/// Why the variant of a scene that can be read cannot be had, where an option other than `--set` said what is different.
pub(crate) fn of_variant(error: SceneError, option: &'static str, overrides: &[String]) -> Failure {
    let text = error.diagnostic().and_then(Diagnostic::override_text);
    if text.is_some_and(|text| overrides.iter().any(|given| given == text)) { Failure::Override { option, error } } else { Failure::Scene(error) }
}

/// The refusal of an argument, in which nothing that was typed disturbs a terminal.
pub(crate) fn visible(mut error: clap::Error) -> clap::Error {
    let shown = |text: &String| Visible(text).to_string();
    let texts: Vec<(ContextKind, ContextValue)> = error
        .context()
        .filter_map(|(kind, value)| match value {
            ContextValue::String(text) => Some((kind, ContextValue::String(shown(text)))),
            ContextValue::Strings(texts) => Some((kind, ContextValue::Strings(texts.iter().map(shown).collect()))),
            // Advice repeats what was typed; it loses its colours.
            ContextValue::StyledStrs(texts) => {
                Some((kind, ContextValue::StyledStrs(texts.iter().map(|text| StyledStr::from(shown(&text.to_string()))).collect())))
            }
            ContextValue::None | ContextValue::Bool(_) | ContextValue::StyledStr(_) | ContextValue::Number(_) | _ => None,
        })
        .collect();
    for (kind, value) in texts {
        error.insert(kind, value);
    }
    error
}

/// Why a scene that makes sense is not simulated, at the place where there are too many peers; `None` if it can be.
pub(crate) fn too_large(scene: &Scene, overrides: &[String]) -> Option<SceneError> {
    let reason = cohaptic_harness::too_large(scene)?;
    Some(at_peer(&scene.file, overrides, cohaptic_harness::MOST_PEERS, &reason))
}

/// Why a scene that makes sense cannot be analysed.
pub(crate) fn not_analysed(scene: &Path, error: &impl std::fmt::Display) -> Failure {
    Failure::Input(format!("{}: {error}", output::path(scene)))
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
