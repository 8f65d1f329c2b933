//! The verdict on a scene, as the project means the word stable.

use cohaptic_scene::Scene;
use cohaptic_wan::LinkModel;

use crate::{Analysis, AnalysisError, MeanSquare, Method, Verdict, analyse, mean_square_within};

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

/// Whether a scene is stable: with links that leave something to chance, in the mean square, as long as that takes no more than `most` unknowns (see
/// [`crate::mean_square_within`]).
///
/// # Errors
///
/// As for [`analyse`].
pub fn judge(scene: &Scene, method: Method, most: usize) -> Result<Judgement, AnalysisError> {
    let mut analysis = analyse(scene, method)?;
    if !has_chance(scene) {
        return Ok(Judgement { verdict: analysis.verdict(), analysis, mean_square: None });
    }
    match mean_square_within(scene, most) {
        Ok(mean_square) => Ok(Judgement { verdict: mean_square.verdict(), analysis, mean_square: Some(mean_square) }),
        Err(error) => {
            analysis.notes.push(format!("the verdict is nominal: {error}"));
            Ok(Judgement { verdict: analysis.verdict(), analysis, mean_square: None })
        }
    }
}

/// Whether the network of a scene leaves anything to chance.
#[must_use]
pub fn has_chance(scene: &Scene) -> bool {
    let lines = scene.peers.iter().flat_map(|peer| peer.uplink.iter().chain(&peer.downlink));
    scene.links.used().any(|(link, _)| link.has_chance()) || lines.into_iter().any(LinkModel::has_chance)
}
