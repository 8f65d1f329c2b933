//! The JSON document of a verdict.

use cohaptic_scene::Scene;
use cohaptic_stability::{Analysis, ContactMode, Judgement, Part, PartKind, SceneWorstCase};
use serde::Serialize;

use super::worst::WorstDocument;
use super::{per_second, time_constant};

/// What `cohaptic stability point --json` prints.
#[derive(Serialize)]
pub(super) struct Document<'a> {
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
    per_second: f64,
    time_constant_s: Option<f64>,
    /// Of the mode of contact with the largest radius.
    parts: Vec<PartDocument<'a>>,
    modes: Vec<ModeDocument<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    worst_case: Option<WorstDocument<'a>>,
    notes: Vec<&'a str>,
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

impl<'a> Document<'a> {
    pub(super) fn new(scene: &'a Scene, judgement: &'a Judgement, worst: Option<&'a SceneWorstCase>) -> Self {
        let Judgement { verdict, analysis, mean_square } = judgement;
        let radius = mean_square.as_ref().map(|mean_square| mean_square.radius);
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
            per_second: per_second(analysis),
            time_constant_s: time_constant(analysis),
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

/// What is left out, by the analysis and by the mean square, each once.
pub(super) fn notes(judgement: &Judgement) -> Vec<&str> {
    let mean_square = judgement.mean_square.iter().flat_map(|mean_square| &mean_square.notes);
    let mut notes: Vec<&str> = Vec::new();
    for note in judgement.analysis.notes.iter().chain(mean_square) {
        if !notes.contains(&note.as_str()) {
            notes.push(note);
        }
    }
    notes
}

/// The mode of contact with the largest radius.
pub(super) fn worst_mode(analysis: &Analysis) -> Option<&ContactMode> {
    analysis.modes.iter().max_by(|one, other| one.radius.value.total_cmp(&other.radius.value))
}
