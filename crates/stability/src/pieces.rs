//! Splits a scene into pieces that are analysed separately: the scene itself, or the scenes of one axis into which the motion of a turning object splits.

use std::borrow::Cow;

use cohaptic_peer::Exchange;
use cohaptic_scene::{RotationPart, RotationParts, Scene};

use crate::AnalysisError;
use crate::operators::Crossover;

/// A scene whose motion is independent of all other pieces.
#[derive(Clone, Debug)]
pub struct Piece<'a> {
    /// The scene of the piece.
    pub scene: Cow<'a, Scene>,
    /// Number of equal axes for which the piece stands.
    pub(crate) axes: usize,
    /// Names of the components of a turning object's motion. Empty if the object does not turn.
    pub motion: String,
    /// `true` if each peer has no device in this piece, indexed by peer.
    pub absent: Vec<bool>,
}

/// Returns the pieces of a scene, or the reason for which the motion of its turning object does not split.
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

/// Returns the pieces of a scene, for an analysis that works on pieces only and does not follow operators. `what` names the analysis in errors.
///
/// # Errors
///
/// [`AnalysisError`] if the scene has a topology, an operator with the law crossover, or an object whose motion does not split.
pub fn pieces<'a>(scene: &'a Scene, what: &'static str) -> Result<Vec<Piece<'a>>, AnalysisError> {
    refuse_operators(scene, what)?;
    pieces_with_operators(scene, what)
}

/// Like [`pieces`], for an analysis that follows operators with the law crossover.
pub(crate) fn pieces_with_operators<'a>(scene: &'a Scene, what: &'static str) -> Result<Vec<Piece<'a>>, AnalysisError> {
    refuse_topology(scene, what)?;
    split(scene).map_err(|why| AnalysisError::Unsplit { what, why })
}

/// Refuses a scene in which an operator with the law crossover holds a device, for an analysis that does not follow operators. `what` names the analysis in
/// errors. Of other laws of an operator the arm alone counts, as in all analyses.
///
/// # Errors
///
/// [`AnalysisError::Operator`] with the name of the first peer with such an operator.
pub fn refuse_operators(scene: &Scene, what: &'static str) -> Result<(), AnalysisError> {
    match Crossover::first_peer(scene) {
        Some(peer) => Err(AnalysisError::Operator { what, peer: scene.peers[peer].name.clone() }),
        None => Ok(()),
    }
}

/// Refuses a scene in which a device exchanges late or not at each tick, for an analysis that does not follow such devices. `what` names the analysis in
/// errors. Devices of peers that touch nothing count too.
///
/// # Errors
///
/// [`AnalysisError::SlowDevice`] with the name of the first peer with such a device.
pub fn refuse_slow_devices(scene: &Scene, what: &'static str) -> Result<(), AnalysisError> {
    match scene.peers.iter().find(|peer| peer.exchange != Exchange::EACH_TICK) {
        Some(peer) => Err(AnalysisError::SlowDevice { what, peer: peer.name.clone() }),
        None => Ok(()),
    }
}

/// Refuses a scene with a topology, for an analysis that does not follow topologies. `what` names the analysis in errors.
///
/// # Errors
///
/// [`AnalysisError::Topology`] if the scene has a topology.
pub fn refuse_topology(scene: &Scene, what: &'static str) -> Result<(), AnalysisError> {
    if scene.topology.is_some() { Err(AnalysisError::Topology { what }) } else { Ok(()) }
}

/// Refuses a scene whose object turns, for an analysis that does not follow rotation at all.
pub(crate) fn refuse_turns(scene: &Scene, what: &'static str) -> Result<(), AnalysisError> {
    if scene.rotation.is_some() { Err(AnalysisError::NoTurns { what }) } else { Ok(()) }
}
