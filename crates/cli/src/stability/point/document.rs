//! The JSON document of a verdict.

use cohaptic_scene::Scene;
use cohaptic_stability::{Analysis, ContactMode, Judgement, Part, PartKind, SceneWorstCase};
use serde::Serialize;

use super::speed::{Bounded, per_second, time_constant};
use super::worst::WorstDocument;

/// What `cohaptic stability point --json` prints.
#[derive(Serialize)]
pub(super) struct PointDocument<'a> {
    title: &'a str,
    /// In the mean square where links leave something to chance.
    verdict: &'static str,
    spectral_radius: f64,
    error_bound: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_square_radius: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_square_error_bound: Option<f64>,
    rigid_modes: usize,
    dimension: usize,
    method: &'static str,
    frame_s: f64,
    /// Both `null` where the bounds of the radius leave more than a percent of them open.
    per_second: Option<f64>,
    time_constant_s: Option<f64>,
    /// The least and the most that the bounds of the radius allow.
    time_constant_bounds_s: Option<[f64; 2]>,
    /// Of the mode of contact with the largest radius.
    parts: Vec<PartDocument<'a>>,
    modes: Vec<ModeDocument<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    worst_case: Option<WorstDocument<'a>>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct ModeDocument<'a> {
    contacts: &'a str,
    verdict: &'static str,
    spectral_radius: f64,
    error_bound: f64,
    parts: Vec<PartDocument<'a>>,
}

#[derive(Serialize)]
struct PartDocument<'a> {
    kind: &'static str,
    /// The first peer that it is about; of all peers where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    peer: Option<&'a str>,
    dimension: usize,
    multiplicity: usize,
    spectral_radius: f64,
    error_bound: f64,
}

impl<'a> PointDocument<'a> {
    pub(super) fn new(scene: &'a Scene, judgement: &'a Judgement, worst: Option<&'a SceneWorstCase>) -> Self {
        let Judgement { verdict, analysis, mean_square } = judgement;
        let radius = mean_square.as_ref().map(|mean_square| mean_square.radius);
        let constant = time_constant(analysis);
        Self {
            title: &scene.title,
            verdict: verdict.word(),
            mean_square_radius: radius.map(|radius| radius.value),
            mean_square_error_bound: radius.map(|radius| radius.error),
            spectral_radius: analysis.radius.value,
            error_bound: analysis.radius.error,
            rigid_modes: analysis.rigid_modes,
            dimension: analysis.dimension,
            method: analysis.method.word(),
            frame_s: analysis.frame.as_secs_f64(),
            per_second: per_second(analysis).known(),
            time_constant_s: constant.and_then(|constant| constant.known()).filter(|seconds| *seconds != 0.0),
            time_constant_bounds_s: constant.map(|Bounded { low, high, .. }| [low, high]),
            parts: worst_mode(analysis).map(|mode| parts(scene, mode)).unwrap_or_default(),
            modes: analysis.modes.iter().map(|mode| ModeDocument::new(scene, mode)).collect(),
            worst_case: worst.map(WorstDocument::new),
            notes: notes(judgement),
        }
    }
}

impl<'a> ModeDocument<'a> {
    fn new(scene: &'a Scene, mode: &'a ContactMode) -> Self {
        Self {
            contacts: &mode.contacts,
            verdict: mode.radius.verdict().word(),
            spectral_radius: mode.radius.value,
            error_bound: mode.radius.error,
            parts: parts(scene, mode),
        }
    }
}

fn parts<'a>(scene: &'a Scene, mode: &ContactMode) -> Vec<PartDocument<'a>> {
    mode.parts.iter().map(|part| PartDocument::new(scene, part)).collect()
}

impl<'a> PartDocument<'a> {
    fn new(scene: &'a Scene, part: &Part) -> Self {
        let (kind, peer) = match part.kind {
            PartKind::Whole => ("whole", None),
            PartKind::Together => ("together", None),
            PartKind::Apart { peer } => ("apart", Some(peer)),
            PartKind::Mode { .. } => ("mode", None),
            PartKind::LooseDevice { peer } => ("loose-device", Some(peer)),
        };
        Self {
            kind,
            peer: peer.map(|peer| scene.peers[peer].name.as_str()),
            dimension: part.size,
            multiplicity: part.copies,
            spectral_radius: part.radius.value,
            error_bound: part.radius.error,
        }
    }
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
