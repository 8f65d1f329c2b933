//! Lines over which displacements cannot be followed.

use cohaptic_scene::Scene;

use crate::AnalysisError;

/// Refuses a scene whose clients send displacements over a line that does more than delay all samples alike. Where every displacement arrives once and in
/// order, the sum at the server is the position of the device.
pub(super) fn refuse_lost_increments(scene: &Scene) -> Result<(), AnalysisError> {
    let Some(server) = scene.server().filter(|_| scene.sends_increments()) else { return Ok(()) };
    let (name, downlink) = (&scene.peers[server].name, scene.peers[server].downlink.as_deref());
    for (client, spec) in scene.peers.iter().enumerate().filter(|(client, _)| *client != server) {
        let lines = [
            (spec.uplink.as_deref(), format!("the uplink of {}", spec.name)),
            (Some(scene.links.between(client, server)), format!("the link from {} to {name}", spec.name)),
            (downlink, format!("the downlink of {name}")),
        ];
        if let Some((_, line)) = lines.into_iter().find(|(model, _)| model.is_some_and(|model| !model.is_constant_delay())) {
            return Err(AnalysisError::LostIncrements { line, peer: spec.name.clone() });
        }
    }
    Ok(())
}
