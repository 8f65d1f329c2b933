//! The verdict on a scene, as the project means the word stable.

use cohaptic_scene::Scene;

use crate::network::chance_of;
use crate::{Analysis, AnalysisError, Limits, MeanSquare, Method, Verdict, VerdictKind, analyse_watched, mean_square_watched};

/// A verdict, and what it rests on.
#[derive(Clone, PartialEq, Debug)]
pub struct Judgement {
    /// That of the second moment where the network leaves something to chance and its moments can be followed; that of the spectral radius otherwise.
    pub verdict: Verdict,
    /// The scene with nothing left to chance. Its notes say which part of the verdict is nominal.
    pub analysis: Analysis,
    /// `None` where nothing is left to chance, or where the second moment cannot be followed; then a note says why.
    pub mean_square: Option<MeanSquare>,
    /// Random parts of the links that the verdict leaves out, in words; empty of a verdict that leaves none out.
    pub left_out: Vec<&'static str>,
}

impl Judgement {
    /// Returns the verdict of an analysis that follows no chance of the links of a scene.
    #[must_use]
    pub fn nominal(scene: &Scene, analysis: Analysis) -> Self {
        Self { verdict: analysis.verdict(), analysis, mean_square: None, left_out: left_out(scene) }
    }

    /// Returns the question that the verdict answers.
    #[must_use]
    pub const fn kind(&self) -> VerdictKind {
        match (&self.mean_square, self.left_out.is_empty()) {
            (Some(_), _) => VerdictKind::MeanSquare,
            (None, true) => VerdictKind::Certain,
            (None, false) => VerdictKind::Nominal,
        }
    }
}

/// How the note begins that says why a second moment is not followed.
pub const NOMINAL: &str = "the verdict is nominal: ";

/// Whether a scene is stable: with links that leave something to chance, in the mean square, as long as that takes no more than `most` unknowns (see
/// [`Limits::unknowns`]).
///
/// # Errors
///
/// As for [`analyse`](crate::analyse).
pub fn judge(scene: &Scene, method: Method, most: usize) -> Result<Judgement, AnalysisError> {
    judge_watched(scene, method, &Limits::of_unknowns(most))
}

/// [`judge`] within limits, watched.
///
/// # Errors
///
/// As for [`judge`], and [`AnalysisError::Stopped`] if the watcher ends it.
pub fn judge_watched(scene: &Scene, method: Method, limits: &Limits<'_>) -> Result<Judgement, AnalysisError> {
    let mut analysis = analyse_watched(scene, method, limits.watch)?;
    if !has_chance(scene) {
        return Ok(Judgement::nominal(scene, analysis));
    }
    match mean_square_watched(scene, limits) {
        Err(AnalysisError::Stopped) => Err(AnalysisError::Stopped),
        Ok(mean_square) => Ok(Judgement { verdict: mean_square.verdict(), analysis, mean_square: Some(mean_square), left_out: Vec::new() }),
        Err(error) => {
            analysis.notes.push(format!("{NOMINAL}{error}"));
            Ok(Judgement::nominal(scene, analysis))
        }
    }
}

/// Returns the random parts of the links of a scene, in words and each once: what a nominal verdict leaves out. Empty if the links leave nothing to chance.
#[must_use]
pub fn left_out(scene: &Scene) -> Vec<&'static str> {
    if !has_chance(scene) {
        return Vec::new();
    }
    let named = chance_of(scene);
    // A part that no name fits must not make a nominal verdict look certain.
    if named.is_empty() { vec!["chance"] } else { named }
}

/// Whether the network of a scene leaves anything to chance.
#[must_use]
pub fn has_chance(scene: &Scene) -> bool {
    let lines = scene.peers.iter().flat_map(|peer| peer.uplink.iter().chain(&peer.downlink));
    scene.used_links().iter().any(|(link, _)| link.has_chance()) || lines.into_iter().any(|line| line.has_chance())
}
