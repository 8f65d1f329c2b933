//! Silence after which the seat of a program is free for another program.

use std::time::Duration;

use cohaptic_scene::{PeerKind, Scene};

/// Returns the silence after which the session of `scene` gives the seat of a program to another: the longest `silence.after` of the peers of kind `udp`, or
/// `None` in a scene without such peers.
///
/// The silence is one for all seats, so that a seat can be taken again only when the scene, too, counts the peer as silent.
#[must_use]
pub fn stale_after(scene: &Scene) -> Option<Duration> {
    let silences = scene.peers.iter().filter_map(|peer| if let PeerKind::Udp(silence) = peer.kind { Some(silence.after) } else { None });
    silences.max()
}
