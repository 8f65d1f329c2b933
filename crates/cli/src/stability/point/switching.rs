//! The proof about opening and closing contacts, for `--switching`.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_proofs::{Guarantee, Switching, SwitchingError, SwitchingMotion, prove_switching};
use cohaptic_scene::Scene;
use cohaptic_stability::AnalysisError;
use cohaptic_units::print::Span;
use serde::Serialize;

use super::ended;
use crate::analysis_watch::Interruptible;
use crate::arguments::PointArguments;
use crate::document_schema::document;
use crate::failure::{Failure, not_analysed};
use crate::file::write_file;
use crate::input;
use crate::output::{self, figure};
use crate::stability::certificate::{self, Given};

/// Result of the proof, with the path of its certificate if a certificate was written.
pub(super) struct Proof {
    pub(super) found: Switching,
    pub(super) file: Option<String>,
}

/// Proves the verdict for opening and closing contacts and writes the certificate, or returns `None` if no option asks for the proof.
pub(super) fn of(scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<Proof>, Failure> {
    if !arguments.switching {
        return Ok(None);
    }
    let found = prove(scene, path)?;
    let Some(file) = &arguments.certificate else { return Ok(Some(Proof { found, file: None })) };
    let given = Given { title: &scene.title, text: &input::text(path)?, overrides: &arguments.scene.overrides.set };
    write_file(file, certificate::of_switching(&given, &found)?)?;
    Ok(Some(Proof { found, file: Some(output::path(file)) }))
}

fn prove(scene: &Scene, path: &Path) -> Result<Switching, Failure> {
    prove_switching(scene, &Interruptible).map_err(|error| match error {
        SwitchingError::Analysis(AnalysisError::Stopped) => ended(),
        SwitchingError::Analysis(error) => not_analysed(path, &error),
        SwitchingError::NoContact | SwitchingError::Chance | SwitchingError::NoSpring { .. } | SwitchingError::TooLarge { .. } | _ => {
            Failure::Input(format!("{}: --switching: {error}", output::path(input::named(path))))
        }
    })
}

/// Returns the proof's part of the JSON document.
pub(super) fn document(Proof { found: switching, file }: &Proof) -> impl Serialize + use<> {
    let motions = switching.motions.iter().map(|motion| {
        document! {
            // Name of the motion; empty if the scene has a single motion.
            motion: motion.name.clone(),
            verdict: motion.guarantee.word(),
            // Factor by which a norm is proven to shrink per frame; `null` unless stable.
            rate: motion.rate,
            // Factor by which the found motion grows per frame; `null` unless unstable.
            growth: motion.growing.map(|growing| growing.growth),
            // Number of frames over which the motion was followed, and number of openings and closings in these frames.
            frames: motion.growing.map(|growing| growing.frames),
            changes: motion.growing.map(|growing| growing.changes),
        }
    });
    document! {
        verdict: switching.guarantee().word(),
        motions: motions.collect::<Vec<_>>(),
        notes: switching.notes.clone(),
        // Path of the certificate; absent without `--certificate`.
        #[serde(flatten)]
        file: file.as_ref().map(|file| document! { file: file.clone() }),
    }
}

/// Returns the lines after the verdict. Notes in `said` are left out, because the verdict has printed these notes already.
pub(super) fn words(switching: &Switching, said: &[String]) -> String {
    let mut text = "\n  contacts that open and close:\n".to_owned();
    for motion in &switching.motions {
        let name = if motion.name.is_empty() { String::new() } else { format!("{}: ", motion.name) };
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {name}{}", verdict(motion));
    }
    for note in switching.notes.iter().filter(|note| !said.contains(note)) {
        let _ = writeln!(text, "    note: {note}");
    }
    text
}

fn verdict(motion: &SwitchingMotion) -> String {
    let frame = Span(motion.frame);
    match (motion.guarantee, motion.rate, motion.growing) {
        (Guarantee::Stable, Some(rate), _) => {
            format!(
                "stable however they do, proven: a norm of motion and contact forces shrinks to {} of itself or less in a frame of {frame}",
                figure(rate, 6)
            )
        }
        (Guarantee::Unstable, _, Some(growing)) => format!(
            "unstable: a motion was found that grows by a factor of {} a frame of {frame}, with {} changes of contacts in {} frames",
            figure(growing.growth, 6),
            growing.changes,
            growing.frames
        ),
        // A verdict without its number is shown as undecided.
        (Guarantee::Stable | Guarantee::Unstable | Guarantee::Undecided, _, _) => {
            "undecided: no norm was found that shrinks whatever they do, and no motion that grows".to_owned()
        }
    }
}
