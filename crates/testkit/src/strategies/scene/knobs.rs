//! Numbers of a draft, in millionths, with their calm values.

use super::draft::{Draft, DraftHand, DraftPeer, Place};
use crate::strategies::shrink::Number;

/// Access to a number, or `None` if the draft does not have the number.
type In<T> = fn(&mut T) -> Option<&mut f64>;

/// A number of the scene, or of a peer.
#[derive(Clone, Copy, Debug)]
pub(super) enum Knob {
    Duration,
    Update,
    Scene(In<Draft>, u64),
    Peer(usize, In<DraftPeer>, u64),
}

/// One, in millionths.
const ONE: u64 = 1_000_000;

/// Numbers of a scene, with their calm values in millionths.
const SCENE: [(In<Draft>, u64); 12] = [
    (|draft| Some(&mut draft.mass), 450_000),
    (|draft| Some(&mut draft.damping), 0),
    (|draft| Some(&mut draft.gains.stiffness), 1_000 * ONE),
    (|draft| Some(&mut draft.gains.damping), 5 * ONE),
    (|draft| draft.position.get_mut(0), 0),
    (|draft| draft.position.get_mut(1), 0),
    (|draft| draft.position.get_mut(2), 0),
    (|draft| draft.velocity.get_mut(0), 0),
    (|draft| draft.velocity.get_mut(1), 0),
    (|draft| draft.velocity.get_mut(2), 0),
    (|draft| draft.enclosure.as_mut().map(|walls| &mut walls.stiffness), ONE),
    (|draft| draft.enclosure.as_mut().map(|walls| &mut walls.damping), 0),
];

/// Numbers of a peer, with their calm values in millionths.
const PEER: [(In<DraftPeer>, u64); 18] = [
    (|peer| Some(&mut peer.device.mass), 100_000),
    (|peer| Some(&mut peer.device.damping), 5 * ONE),
    (|peer| Some(&mut peer.coupling.stiffness), 3_500 * ONE),
    (|peer| Some(&mut peer.coupling.damping), 5 * ONE),
    (|peer| strength(peer)?.get_mut(0), 0),
    (|peer| strength(peer)?.get_mut(1), 0),
    (|peer| strength(peer)?.get_mut(2), 0),
    (|peer| if let DraftHand::Sine { frequency, .. } = &mut peer.hand { Some(frequency) } else { None }, ONE),
    (|peer| if let DraftHand::Sine { phase, .. } = &mut peer.hand { Some(phase) } else { None }, 0),
    (|peer| if let DraftHand::Arm { arm, .. } = &mut peer.hand { Some(&mut arm.mass) } else { None }, 0),
    (|peer| if let DraftHand::Arm { arm, .. } = &mut peer.hand { Some(&mut arm.damping) } else { None }, 0),
    (|peer| if let DraftHand::Arm { arm, .. } = &mut peer.hand { Some(&mut arm.stiffness) } else { None }, 0),
    (|peer| peer.position.as_mut()?.get_mut(0), 0),
    (|peer| peer.position.as_mut()?.get_mut(1), 0),
    (|peer| peer.position.as_mut()?.get_mut(2), 0),
    (|peer| peer.velocity.as_mut()?.get_mut(0), 0),
    (|peer| peer.velocity.as_mut()?.get_mut(1), 0),
    (|peer| peer.velocity.as_mut()?.get_mut(2), 0),
];

/// Returns the strength of the hand's force, or the position to which the arm pulls.
const fn strength(peer: &mut DraftPeer) -> Option<&mut Place> {
    match &mut peer.hand {
        DraftHand::None => None,
        DraftHand::Force(strength) | DraftHand::Sine { amplitude: strength, .. } | DraftHand::Arm { wanted: strength, .. } => Some(strength),
    }
}

pub(super) fn knobs(draft: &Draft) -> Vec<Knob> {
    let scene = SCENE.into_iter().map(|(place, calm)| Knob::Scene(place, calm));
    let peers = (0..draft.peers.len()).flat_map(|peer| PEER.into_iter().map(move |(place, calm)| Knob::Peer(peer, place, calm)));
    [Knob::Duration, Knob::Update].into_iter().chain(scene).chain(peers).collect()
}

impl Knob {
    pub(super) fn number(self, draft: &Draft) -> Option<Number> {
        // The accessors borrow mutably, also for reading, so the number is read from a copy.
        let mut draft = draft.clone();
        let (value, goal, step) = match self {
            Self::Duration => (draft.duration, 100, 1),
            Self::Update => (draft.update, 1_000, 1_000),
            Self::Scene(place, calm) => (millionths(*place(&mut draft)?), calm, 1),
            Self::Peer(peer, place, calm) => (millionths(*place(draft.peers.get_mut(peer)?)?), calm, 1),
        };
        Some(Number { value, goal, step })
    }

    /// Sets the absolute value of the number. The sign stays.
    pub(super) fn set(self, draft: &Draft, value: u64) -> Option<Draft> {
        let mut draft = draft.clone();
        match self {
            Self::Duration => draft.duration = value,
            Self::Update => draft.update = value,
            Self::Scene(place, _) => put(place(&mut draft)?, value),
            Self::Peer(peer, place, _) => put(place(draft.peers.get_mut(peer)?)?, value),
        }
        Some(draft)
    }
}

fn millionths(value: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers of a draft are finite; the cast saturates")]
    let millionths = (value.abs() * 1e6).round() as u64;
    millionths
}

fn put(place: &mut f64, millionths: u64) {
    #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
    let value = millionths as f64 / 1e6;
    *place = if *place < 0.0 && millionths > 0 { -value } else { value };
}
