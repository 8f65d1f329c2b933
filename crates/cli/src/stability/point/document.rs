//! The JSON document of a verdict.

use cohaptic_scene::Scene;
use cohaptic_stability::{Analysis, ContactMode, Judgement, PartKind, SceneWorstCase};
use serde::Serialize;

use super::speed::{Bounded, per_second, time_constant};
use super::worst;
use crate::document_schema::document;

/// The answer of `cohaptic stability point --json`.
pub(super) fn of(scene: &Scene, judgement: &Judgement, worst: Option<&SceneWorstCase>) -> impl Serialize {
    let Judgement { verdict, analysis, mean_square } = judgement;
    let radius = mean_square.as_ref().map(|mean_square| mean_square.radius);
    let constant = time_constant(analysis);
    let modes = analysis.modes.iter().map(|mode| {
        document! {
            contacts: mode.contacts.as_str(),
            verdict: mode.radius.verdict().word(),
            spectral_radius: mode.radius.value,
            error_bound: mode.radius.error,
            parts: parts(scene, mode),
        }
    });
    document! {
        title: scene.title.as_str(),
        // In the mean square where links leave something to chance.
        verdict: verdict.word(),
        spectral_radius: analysis.radius.value,
        error_bound: analysis.radius.error,
        #[serde(flatten)]
        mean_square: radius.map(|radius| document! { mean_square_radius: radius.value, mean_square_error_bound: radius.error }),
        rigid_modes: analysis.rigid_modes,
        dimension: analysis.dimension,
        method: analysis.method.word(),
        frame_s: analysis.frame.as_secs_f64(),
        // Both `null` where the bounds of the radius leave more than a percent of them open.
        per_second: per_second(analysis).known(),
        time_constant_s: constant.and_then(|constant| constant.known()).filter(|seconds| *seconds != 0.0),
        // The least and the most that the bounds of the radius allow.
        time_constant_bounds_s: constant.map(|Bounded { low, high, .. }| [low, high]),
        // Of the mode of contact with the largest radius.
        parts: worst_mode(analysis).map(|mode| parts(scene, mode)).into_iter().flatten().collect::<Vec<_>>(),
        modes: modes.collect::<Vec<_>>(),
        #[serde(flatten)]
        worst: worst.map(|worst| document! { worst_case: worst::document(worst) }),
        notes: notes(judgement),
    }
}

fn parts(scene: &Scene, mode: &ContactMode) -> Vec<impl Serialize + use<>> {
    let parts = mode.parts.iter().map(|part| {
        let (kind, peer) = match part.kind {
            PartKind::Whole => ("whole", None),
            PartKind::Together => ("together", None),
            PartKind::Apart { peer } => ("apart", Some(peer)),
            PartKind::Mode { .. } => ("mode", None),
            PartKind::LooseDevice { peer } => ("loose-device", Some(peer)),
        };
        document! {
            kind: kind,
            // The first peer that it is about; absent where it is about all peers.
            #[serde(flatten)]
            peer: peer.map(|peer| document! { peer: scene.peers[peer].name.clone() }),
            dimension: part.size,
            multiplicity: part.copies,
            spectral_radius: part.radius.value,
            error_bound: part.radius.error,
        }
    });
    parts.collect()
}

/// The simplifications of the analysis and of the mean square, each once. Where there are both figures, a note says which of them it is about.
pub(super) fn notes(judgement: &Judgement) -> Vec<String> {
    let Some(mean_square) = &judgement.mean_square else {
        return judgement.analysis.notes.clone();
    };
    let nominal = &judgement.analysis.notes;
    let of_nominal = nominal.iter().map(|note| match mean_square.notes.contains(note) {
        true => format!("both radii: {note}"),
        false => format!("the spectral radius, with nothing left to chance: {note}"),
    });
    let of_mean_square = mean_square.notes.iter().filter(|note| !nominal.contains(note)).map(|note| format!("the mean-square radius: {note}"));
    of_nominal.chain(of_mean_square).collect()
}

/// The mode of contact with the largest radius.
pub(super) fn worst_mode(analysis: &Analysis) -> Option<&ContactMode> {
    analysis.modes.iter().max_by(|one, other| one.radius.value.total_cmp(&other.radius.value))
}
