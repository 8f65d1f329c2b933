//! Inverse3 as the device of a peer.

use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_inverse3::client::Phase;
use cohaptic_inverse3::socket::{Facts, Inverse3, ServiceThread};
use cohaptic_units::Instant;

use super::Readiness;
use crate::scene_hand::Beginning;

/// Driven Inverse3, and the service of a simulated Inverse3.
#[derive(Debug)]
pub(super) struct Attached {
    // Dropped first, because the driver sends a last zero force to the service.
    device: Inverse3,
    simulated: Option<(ServiceThread, Beginning)>,
}

impl Attached {
    pub(super) const fn real(device: Inverse3) -> Self {
        Self { device, simulated: None }
    }

    pub(super) const fn simulated(device: Inverse3, service: ServiceThread, beginning: Beginning) -> Self {
        Self { device, simulated: Some((service, beginning)) }
    }

    pub(super) fn readiness(&self) -> Readiness {
        let phase = self.device.snapshot().map_or(Phase::Connecting, |snapshot| snapshot.phase);
        Readiness { phase, is_simulated: self.simulated.is_some() }
    }

    pub(super) fn facts(&self) -> Facts {
        self.device.facts()
    }
}

impl Device for Attached {
    fn description(&self) -> Description {
        self.device.description()
    }

    fn stopper(&self) -> Stopper {
        self.device.stopper()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        let reading = self.device.read(now);
        // The hand begins to follow the scene at the first tick with a reading of the device. Later calls of `begin` change nothing.
        if let (Some((service, beginning)), Some(_)) = (&self.simulated, &reading) {
            beginning.begin(service.now());
        }
        reading
    }

    fn hold(&mut self, now: Instant, span: Duration, force: GatedForce) {
        self.device.hold(now, span, force);
    }

    fn stop(&mut self) {
        self.device.stop();
    }
}
