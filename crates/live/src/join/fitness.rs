//! Checks before and after joining: whether a scene allows joining, and whether a welcome fits the scene.

use core::fmt;
use std::time::Duration;

use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Hand, Strategy};
use cohaptic_scene::{ChangeKind, FromScene, Scene, Strategies};
use cohaptic_units::print::{Counted, Span};

use crate::handshake::Welcome;

/// Reason why a peer of a scene cannot be computed at another computer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Unfit {
    /// The law extrapolates samples to the present, and needs equal clocks.
    #[error(
        "the coordination extrapolates samples by their age, and one-way times between two computers do not tell the offset of their clocks: expected \
         another strategy, such as average-position"
    )]
    Extrapolated,
    /// The topology leaves out some pairs of peers.
    #[error("in a live session every peer sends to every other: expected a scene without [topology], or kind = \"full\"")]
    Topology,
    /// The hand is a modelled person.
    #[error("a modelled person sees the whole scene, which only the session has: expected another hand, or kind = \"simulated\" in the session")]
    Operator,
    /// The timeline changes a part of this peer.
    #[error(
        "the timeline changes {0} during the session, and a computer that joins does not know the session's time: expected changes of links only, or none"
    )]
    Timeline(&'static str),
    /// The peer is the server of clients with displacements in their samples.
    #[error(
        "this peer sums the displacements of its clients, of which none may be left out: expected sends = \"states\", or the server in the session"
    )]
    Increments,
}

/// Checks whether the peer at `place` can be computed at another computer.
///
/// # Errors
///
/// The first [`Unfit`].
pub(super) fn check(scene: &Scene, place: usize) -> Result<(), Unfit> {
    if FromScene.strategy::<3>(scene, place).horizon().is_some() {
        return Err(Unfit::Extrapolated);
    }
    if scene.topology.is_some() {
        return Err(Unfit::Topology);
    }
    if matches!(scene.peers[place].hand, Some(Hand::Operator { .. })) {
        return Err(Unfit::Operator);
    }
    if scene.sends_increments() && scene.server() == Some(place) {
        return Err(Unfit::Increments);
    }
    let changed = scene.timeline.iter().find_map(|change| match change.what {
        // Links are the session's, and so are the other peers.
        ChangeKind::Link(_) | ChangeKind::AllLinks(_) => None,
        ChangeKind::Contact { peer, .. } => (peer == place).then_some("the contact of this peer"),
        ChangeKind::Hand { peer, .. } | ChangeKind::HandTorque { peer, .. } => (peer == place).then_some("the hand of this peer"),
        ChangeKind::Coordination(_) | ChangeKind::RotationalGains(_) => Some("the gains of the coordination"),
        ChangeKind::Parameters(_) => Some("the parameters of the coordination"),
        ChangeKind::SendWhen(_) => Some("the dead bands"),
    });
    changed.map_or(Ok(()), |what| Err(Unfit::Timeline(what)))
}

/// Differences between a welcome and the scene.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("the session is another one: {}", .0.join("; "))]
pub struct Mismatch(Vec<String>);

/// Compares a welcome with the scene.
///
/// # Errors
///
/// [`Mismatch`] with every difference.
pub(super) fn compare(scene: &Scene, place: usize, welcome: &Welcome) -> Result<(), Mismatch> {
    let Welcome { axes, turns, peers, tick, update, .. } = *welcome;
    let axes = usize::from(axes);
    let mut parts = Vec::new();
    let mut part = |is_equal: bool, text: fmt::Arguments<'_>| {
        if !is_equal {
            parts.push(text.to_string());
        }
    };
    let own = scene.peers.len();
    part(peers as usize == own, format_args!("it has {}, this scene {own}", Counted(u64::from(peers), "peer")));
    part(axes == scene.axes.count(), format_args!("it has {}, this scene {}", Counted(axes, "axis"), scene.axes.count()));
    let says = |turns: bool| if turns { "turns" } else { "does not turn" };
    let own = scene.sample_kind() == SampleKind::Attitude;
    part(turns == own, format_args!("its object {}, that of this scene {}", says(turns), says(own)));
    let mut span = |name: &str, found: Duration, own: Duration| part(found == own, format_args!("its {name} is {}, here {}", Span(found), Span(own)));
    span("tick for this peer", tick, scene.peers[place].clock.tick);
    span("coordination.update", update, scene.coordination.update);
    if parts.is_empty() { Ok(()) } else { Err(Mismatch(parts)) }
}
