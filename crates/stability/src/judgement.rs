//! The verdict on a scene, as the project means the word stable.

use cohaptic_scene::Scene;

use crate::{Analysis, AnalysisError, Limits, MeanSquare, Method, Verdict, analyse_watched, mean_square_watched};

/// A verdict, and what it rests on.
#[derive(Clone, PartialEq, Debug)]
pub struct Judgement {
    /// That of the second moment where the network leaves something to chance and its moments can be followed; that of the spectral radius otherwise.
    pub verdict: Verdict,
    /// The scene with nothing left to chance. Its notes say which part of the verdict is nominal.
    pub analysis: Analysis,
    /// `None` where nothing is left to chance, or where the second moment cannot be followed; then a note says why.
    pub mean_square: Option<MeanSquare>,
}

/// How the note begins that says why a second moment is not followed.
pub const NOMINAL: &str = "the verdict is nominal: ";

/// Whether a scene is stable: with links that leave something to chance, in the mean square, as long as that takes no more than `most` unknowns (see
/// [`crate::mean_square_within`]).
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
        return Ok(Judgement { verdict: analysis.verdict(), analysis, mean_square: None });
    }
    match mean_square_watched(scene, limits) {
        Err(AnalysisError::Stopped) => Err(AnalysisError::Stopped),
        Ok(mean_square) => Ok(Judgement { verdict: mean_square.verdict(), analysis, mean_square: Some(mean_square) }),
        Err(error) => {
            analysis.notes.push(format!("{NOMINAL}{error}"));
            Ok(Judgement { verdict: analysis.verdict(), analysis, mean_square: None })
        }
    }
}

/// Whether the network of a scene leaves anything to chance.
#[must_use]
pub fn has_chance(scene: &Scene) -> bool {
    let lines = scene.peers.iter().flat_map(|peer| peer.uplink.iter().chain(&peer.downlink));
    scene.used_links().iter().any(|(link, _)| link.has_chance()) || lines.into_iter().any(|line| line.has_chance())
}
