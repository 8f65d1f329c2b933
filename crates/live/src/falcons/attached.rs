//! Falcon of a peer, with the beginning of the session for the hand on a simulated Falcon.

use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_falcon::device::FalconDevice;
use cohaptic_falcon::driver::Phase;
use cohaptic_units::Instant;

use crate::scene_hand::Beginning;

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

/// Driven Falcon with `A` axes.
#[derive(Debug)]
pub(super) struct Attached<const A: usize> {
    device: FalconDevice<A>,
    /// Beginning of the session for the hand on a simulated Falcon. `None` for a real Falcon.
    beginning: Option<Beginning>,
}

impl<const A: usize> Attached<A> {
    pub(super) const fn new(device: FalconDevice<A>, beginning: Option<Beginning>) -> Self {
        Self { device, beginning }
    }

    pub(super) fn readiness(&self) -> Readiness {
        // `is_ready` decides here, and not the green light of the device: the light also needs a session that asks for force, and no session asks before it
        // begins.
        let (phase, is_ready) = self.device.snapshot().map_or((Phase::Silent, false), |snapshot| (snapshot.phase, snapshot.is_ready()));
        Readiness { is_ready, is_simulated: self.beginning.is_some(), phase }
    }
}

impl<const A: usize> Device for Attached<A> {
    fn description(&self) -> Description {
        self.device.description()
    }

    fn stopper(&self) -> Stopper {
        self.device.stopper()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        let reading = self.device.read(now);
        // The hand begins to follow the scene at the first tick with a reading of the device. Later calls of `begin` change nothing.
        if let (Some(beginning), Some(_), Some(snapshot)) = (&self.beginning, &reading, self.device.snapshot()) {
            beginning.begin(snapshot.at);
        }
        reading
    }

    fn hold(&mut self, now: Instant, span: Duration, force: GatedForce) {
        self.device.hold(now, span, force);
    }
}
