//! State of a running scene for a rotating object.

use cohaptic_peer::Gains;
use cohaptic_peer::rotation::{Attitude, Rotation, Triple};
use cohaptic_scene::Scene;

use crate::observer::Ended;
use crate::rows::{TickRow, TurnRow};
use crate::spread::Spread;

/// Attitudes of all copies, their spread, and the coming changes of the rotational gains.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    /// Attitude of each copy at its latest tick, indexed by peer.
    pub(super) latest: Vec<Attitude>,
    pub(super) spread: Spread,
    /// Rotational gains KR and BR after each change of gains, in reverse order of time: the next gains are popped from the end.
    gains: Vec<Gains<Triple>>,
    /// Radius √(tr J/3m) \[m\]. An angle \[rad\] times this radius is comparable with a distance.
    length: f64,
}

impl Turning {
    /// Returns the state before the first instant; `None` if the object does not turn.
    pub(super) fn new(scene: &Scene) -> Option<Box<Self>> {
        let rotation = scene.rotation.as_ref()?;
        let mut gains: Vec<_> = scene.rotation_gains_in_time().skip(1).collect();
        gains.reverse();
        let latest: Vec<Attitude> = rotation.peers.iter().map(|peer| peer.attitude).collect();
        let length = scene.gyration()?;
        Some(Box::new(Self { gains, latest, spread: Spread::default(), length }))
    }

    /// Returns the radius that converts angles \[rad\] to lengths \[m\].
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// Removes and returns the gains KR and BR that hold from the change that is due now.
    pub(super) fn next_gains(&mut self) -> Option<Gains<Triple>> {
        self.gains.pop()
    }

    /// Updates the spread with the orientations of the copies that are present.
    pub(super) fn measure(&mut self, is_there: impl Fn(usize) -> bool) {
        let there = self.latest.iter().enumerate().filter(|(place, _)| is_there(*place));
        self.spread.take(there.map(|(_, attitude)| attitude.orientation));
    }
}

/// Calls `show` with the tick of a peer that turns. A function of its own, so the loop over peers does not build the larger row for peers that do not turn.
#[inline(never)]
pub(super) fn on_tick(show: impl FnOnce(&TickRow<'_>) -> Result<(), Ended>, tick: TickRow<'_>, rotation: &Rotation) -> Result<(), Ended> {
    show(&TickRow {
        turn: Some(TurnRow {
            object: rotation.copy(),
            device: rotation.device(),
            coupling_torque: &rotation.computed().coupling,
            coordination_torque: &rotation.coordination_torque(),
        }),
        ..tick
    })
}
