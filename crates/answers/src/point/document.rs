//! The JSON document of a verdict.

use cohaptic_proofs::{Links, SceneWorstCase};
use cohaptic_scene::Scene;
use cohaptic_stability::{ContactMode, Judgement};
use serde::Serialize;

use super::speed::{Bounded, per_second, time_constant};
use super::worst_mode;
use crate::{document, notes};

/// Returns the answer of `cohaptic stability point --json`. `every`, `contacts`: documents of the proofs for every number of peers and for switching contacts,
/// if requested.
pub fn document(
    scene: &Scene,
    judgement: &Judgement,
    worst: Option<&SceneWorstCase>,
    every: Option<impl Serialize>,
    contacts: Option<impl Serialize>,
) -> impl Serialize {
    let Judgement { verdict, analysis, mean_square, left_out } = judgement;
    let radius = mean_square.as_ref().map(|mean_square| mean_square.radius);
    let constant = time_constant(analysis);
    let modes = analysis.modes.iter().map(|mode| {
        document! {
            // The components of the motion of an object that turns; absent otherwise.
            #[serde(flatten)]
            motion: (!mode.motion.is_empty()).then(|| document! { motion: mode.motion.clone() }),
            contacts: mode.contacts.as_str(),
            verdict: mode.radius.verdict().word(),
            spectral_radius: mode.radius.value,
            error_bound: mode.radius.error,
            parts: parts(scene, mode),
        }
    });
    document! {
        title: scene.title.as_str(),
        // In the mean square if the links have random parts.
        verdict: verdict.word(),
        // The question answered by the verdict, and the random parts of the links left out by a nominal verdict.
        judged: judgement.kind().word(),
        left_out: left_out.as_slice(),
        spectral_radius: analysis.radius.value,
        error_bound: analysis.radius.error,
        #[serde(flatten)]
        mean_square: radius.map(|radius| document! { mean_square_radius: radius.value, mean_square_error_bound: radius.error }),
        rigid_modes: analysis.rigid_modes,
        dimension: analysis.dimension,
        method: analysis.method.word(),
        frame_s: analysis.frame.as_secs_f64(),
        // Both are `null` if the bounds of the radius leave more than one percent of the number open.
        per_second: per_second(analysis).known(),
        time_constant_s: constant.and_then(|constant| constant.known()).filter(|seconds| *seconds != 0.0),
        // The least and the greatest time constant within the bounds of the radius.
        time_constant_bounds_s: constant.map(|Bounded { low, high, .. }| [low, high]),
        // The parts of the mode of contact with the largest radius.
        parts: worst_mode(analysis).map(|mode| parts(scene, mode)).into_iter().flatten().collect::<Vec<_>>(),
        modes: modes.collect::<Vec<_>>(),
        #[serde(flatten)]
        worst: worst.map(|worst| document! { worst_case: worst_case(worst) }),
        #[serde(flatten)]
        every: every.map(|every| document! { every_number: every }),
        #[serde(flatten)]
        switching: contacts.map(|contacts| document! { switching: contacts }),
        notes: notes(judgement),
    }
}

fn parts(scene: &Scene, mode: &ContactMode) -> Vec<impl Serialize + use<>> {
    let parts = mode.parts.iter().map(|part| {
        document! {
            kind: part.kind.word(),
            // The first peer of the part; absent for a part about all peers.
            #[serde(flatten)]
            peer: part.kind.peer().map(|peer| document! { peer: scene.peers[peer].name.clone() }),
            dimension: part.size,
            multiplicity: part.copies,
            spectral_radius: part.radius.value,
            error_bound: part.radius.error,
        }
    });
    parts.collect()
}

/// Returns the part of the document about the worst case.
fn worst_case(worst: &SceneWorstCase) -> impl Serialize {
    let part = worst.worst();
    document! {
        verdict: worst.verdict().word(),
        lower: worst.lower,
        upper: worst.upper,
        // `true` if the bounds are more than 1 % apart.
        open: worst.is_open(),
        // The rate proved by quadratic certificates.
        certificate: worst.certificate,
        links: match worst.links {
            Links::Together => "together",
            Links::Each => "each",
        },
        step_s: worst.step.as_secs_f64(),
        // The pattern which attains the lower bound.
        sequence: part.sequence.as_str(),
        period: part.period,
        dimension: part.dimension,
        products: worst.products(),
        notes: worst.notes.as_slice(),
    }
}
