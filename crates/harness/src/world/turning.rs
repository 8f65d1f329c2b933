//! What a running scene keeps of an object that turns.

use cohaptic_peer::Gains;
use cohaptic_peer::rotation::{Attitude, Rotation, Triple};
use cohaptic_scene::Scene;

use crate::observer::{Ended, Observer, TickRow, TurnRow};
use crate::spread::Spread;

/// The attitudes of all copies, and changes of the gains on them.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    /// The attitude of each copy at its latest tick.
    pub(super) latest: Vec<Attitude>,
    pub(super) spread: Spread,
    /// KR and BR after each change of the coordination gains, the next one last.
    gains: Vec<Gains<Triple>>,
    /// √(tr J/3m): angles times this are lengths \[m\].
    length: f64,
}

impl Turning {
    /// That of a scene at its beginning; `None` if its object does not turn.
    pub(super) fn new(scene: &Scene) -> Option<Box<Self>> {
        let rotation = scene.rotation.as_ref()?;
        let mut gains: Vec<_> = scene.rotation_gains_in_time().skip(1).collect();
        gains.reverse();
        let latest: Vec<Attitude> = rotation.peers.iter().map(|peer| peer.attitude).collect();
        let length = scene.gyration()?;
        Some(Box::new(Self { gains, latest, spread: Spread::default(), length }))
    }

    /// Angles times this are lengths \[m\].
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// KR and BR from the change on that is due now.
    pub(super) fn next_gains(&mut self) -> Option<Gains<Triple>> {
        self.gains.pop()
    }

    /// Takes in how far the copies that are there are turned apart, at their latest ticks.
    pub(super) fn measure(&mut self, is_there: impl Fn(usize) -> bool) {
        let there = self.latest.iter().enumerate().filter(|(place, _)| is_there(*place));
        self.spread.take(there.map(|(_, attitude)| attitude.orientation));
    }
}

/// Shows a tick of a peer that turns. Apart from the loop over peers, where the larger row would be written for those that do not turn as well.
#[inline(never)]
pub(super) fn on_tick(observer: &mut (impl Observer<Error = Ended> + ?Sized), tick: TickRow<'_>, rotation: &Rotation) -> Result<(), Ended> {
    observer.on_tick(&TickRow {
        turn: Some(TurnRow {
            object: rotation.copy(),
            device: rotation.device(),
            coupling_torque: &rotation.computed().coupling,
            coordination_torque: &rotation.coordination_torque(),
        }),
        ..tick
    })
}
