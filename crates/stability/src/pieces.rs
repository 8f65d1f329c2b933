//! The scenes as which a scene is analysed: itself, or the one-axis scenes into which an object that turns splits.

use std::borrow::Cow;

use cohaptic_scene::{RotationPart, RotationParts, Scene};

use crate::AnalysisError;

/// A scene that moves apart from all others.
#[derive(Clone, Debug)]
pub struct Piece<'a> {
    /// The scene.
    pub scene: Cow<'a, Scene>,
    /// Along how many equal axes it moves.
    pub axes: usize,
    /// Of an object that turns, the components of its motion; otherwise empty.
    pub motion: String,
    /// The peers that have no device in it.
    pub absent: Vec<bool>,
}

/// The pieces of a scene; what does not split has none, and the error says why.
pub(crate) fn split(scene: &Scene) -> Result<Vec<Piece<'_>>, &'static str> {
    let Some(parts) = scene.rotation_parts() else {
        let (axes, absent) = (scene.axes.count(), vec![false; scene.peers.len()]);
        return Ok(vec![Piece { scene: Cow::Borrowed(scene), axes, motion: String::new(), absent }]);
    };
    let RotationParts { parts, .. } = parts?;
    let piece = |part: RotationPart| {
        let (axes, motion) = (part.components.len(), part.name());
        let absent = part.devices.iter().map(|device| !device).collect();
        Piece { scene: Cow::Owned(part.scene), axes, motion, absent }
    };
    Ok(parts.into_iter().map(piece).collect())
}

/// Returns the pieces of a scene, for an analysis of pieces alone.
///
/// # Errors
///
/// [`AnalysisError`] if the scene has a topology, or an object whose motion does not split.
pub fn pieces<'a>(scene: &'a Scene, what: &'static str) -> Result<Vec<Piece<'a>>, AnalysisError> {
    refuse_topology(scene, what)?;
    split(scene).map_err(|why| AnalysisError::Unsplit { what, why })
}

/// Refuses a topology, for an analysis that does not follow it.
///
/// # Errors
///
/// [`AnalysisError::Topology`].
pub fn refuse_topology(scene: &Scene, what: &'static str) -> Result<(), AnalysisError> {
    if scene.topology.is_some() { Err(AnalysisError::Topology { what }) } else { Ok(()) }
}

/// Refuses an object that turns, for an analysis that does not follow it at all.
pub(crate) fn refuse_turns(scene: &Scene, what: &'static str) -> Result<(), AnalysisError> {
    if scene.rotation.is_some() { Err(AnalysisError::NoTurns { what }) } else { Ok(()) }
}
