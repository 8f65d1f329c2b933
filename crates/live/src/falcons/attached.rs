//! Falcon as the device of a peer: translates between the snapshots of [`FalconDevice`] and the [`LiveDevice`] of a session.

use std::time::Duration;

use cohaptic_falcon::device::{FalconDevice, Snapshot, Stopper};
use cohaptic_falcon::driver::Phase;
use cohaptic_harness::live::LiveDevice;
use cohaptic_peer::{Device as _, State};
use cohaptic_units::Instant;

use super::hand::Beginning;

/// Time without a new snapshot after which a device counts as absent. The driver of the device has switched the force off long before.
const OLD: Duration = Duration::from_millis(20);

/// Readiness of a Falcon for a session.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Readiness {
    /// `true` if the Falcon takes part: the device is homed, and the user has switched forces on.
    pub is_ready: bool,
    /// `true` if the Falcon is simulated.
    pub is_simulated: bool,
    /// Phase of the device's driver.
    pub phase: Phase,
}

/// Driven Falcon with `A` axes, and the bookkeeping for noticing a silent Falcon.
#[derive(Debug)]
pub(super) struct Attached<const A: usize> {
    device: FalconDevice<A>,
    /// Beginning of the session for the hand on a simulated Falcon. `None` for a real Falcon.
    beginning: Option<Beginning>,
    /// Newest snapshot: the time on the clock of the device, and the instant of the session at the first look at the snapshot.
    newest: Option<(Instant, Instant)>,
}

impl<const A: usize> Attached<A> {
    pub(super) const fn new(device: FalconDevice<A>, beginning: Option<Beginning>) -> Self {
        Self { device, beginning, newest: None }
    }

    pub(super) fn readiness(&self) -> Readiness {
        // `is_ready` decides here, and not the green light of the device: the light also needs a session that asks for force, and no session asks before it
        // begins.
        let (phase, is_ready) = self.device.snapshot().map_or((Phase::Silent, false), |snapshot| (snapshot.phase, snapshot.is_ready()));
        Readiness { is_ready, is_simulated: self.beginning.is_some(), phase }
    }

    pub(super) fn stopper(&self) -> Stopper {
        self.device.stopper()
    }

    /// Returns the newest snapshot, if the device takes part and has given a new snapshot at most `OLD` ago.
    fn answer(&mut self, now: Instant) -> Option<Snapshot> {
        let snapshot = self.device.snapshot()?;
        // A repeated time stamp is a repeated snapshot, and keeps the instant of the first appearance.
        let came = match self.newest {
            Some((at, came)) if at == snapshot.at => came,
            _ => now,
        };
        self.newest = Some((snapshot.at, came));
        // A device with an ended thread keeps the last snapshot, which may say that the device is ready.
        let takes_part = snapshot.is_ready() && self.device.ended().is_none();
        (takes_part && now.saturating_duration_since(came) <= OLD).then_some(snapshot)
    }
}

impl<const A: usize> LiveDevice for Attached<A> {
    fn read(&mut self, now: Instant) -> Option<State<3>> {
        let snapshot = self.answer(now);
        // The hand begins to follow the scene at the first tick with a reading of the device. Later calls of `begin` change nothing.
        if let (Some(beginning), Some(snapshot)) = (&self.beginning, &snapshot) {
            beginning.begin(snapshot.at);
        }
        snapshot.map(|_| {
            // Axes beyond the axes of the scene are zero.
            let State { position, velocity } = self.device.state();
            let widen = |values: [f64; A]| core::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
            State { position: widen(position), velocity: widen(velocity) }
        })
    }

    fn hold(&mut self, now: Instant, span: Duration, coupling_force: [f64; 3]) {
        self.device.advance(now, span, core::array::from_fn(|axis| coupling_force.get(axis).copied().unwrap_or(0.0)));
    }
}
