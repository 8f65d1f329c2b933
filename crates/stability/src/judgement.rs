//! The verdict on a scene, by the criterion that fits its links: the second moment if links are random, the spectral radius otherwise.

use cohaptic_scene::Scene;

use crate::network::chance_of;
use crate::{Analysis, AnalysisError, Limits, MeanSquare, Method, Verdict, VerdictKind, analyse_watched, mean_square_watched};

/// A verdict together with the analyses on which it rests.
#[derive(Clone, PartialEq, Debug)]
pub struct Judgement {
    /// Verdict of the second moment if the network is random and its moments can be followed; verdict of the spectral radius otherwise.
    pub verdict: Verdict,
    /// Analysis of the scene with nothing left to chance. If the verdict is nominal, a note of the analysis says why.
    pub analysis: Analysis,
    /// Result for the second moment. `None` if nothing is left to chance, or if the second moment cannot be followed; in the second case a note says why.
    pub mean_square: Option<MeanSquare>,
    /// Names of the random parts of the links that the verdict leaves out. Empty if it leaves none out.
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

/// Beginning of the note that says why a second moment is not followed.
pub const NOMINAL: &str = "the verdict is nominal: ";

/// Judges whether a scene is stable. If links are random, the verdict is on the mean square, as long as the second moment has at most `most` unknowns (see
/// [`Limits::unknowns`]).
///
/// # Errors
///
/// As for [`analyse`](crate::analyse).
pub fn judge(scene: &Scene, method: Method, most: usize) -> Result<Judgement, AnalysisError> {
    judge_watched(scene, method, &Limits::of_unknowns(most))
}

/// Like [`judge`], within limits and with a watch that can stop the computation.
///
/// # Errors
///
/// As for [`judge`], and [`AnalysisError::Stopped`] if the watch stops the computation.
pub fn judge_watched(scene: &Scene, method: Method, limits: &Limits<'_>) -> Result<Judgement, AnalysisError> {
    let mut analysis = analyse_watched(scene, method, limits.watch)?;
    if !has_chance(scene) {
        return Ok(Judgement::nominal(scene, analysis));
    }
    match mean_square_watched(scene, limits) {
        // Any other error only means that the second moment cannot be followed; the nominal verdict remains.
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

/// Tells whether the network of a scene leaves anything to chance: a used link or an access line of a peer.
#[must_use]
pub fn has_chance(scene: &Scene) -> bool {
    let lines = scene.peers.iter().flat_map(|peer| peer.uplink.iter().chain(&peer.downlink));
    scene.used_links().iter().any(|(link, _)| link.has_chance()) || lines.into_iter().any(|line| line.has_chance())
}
