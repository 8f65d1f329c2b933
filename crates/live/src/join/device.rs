//! Device of a joined peer: simulated with its hand, or in a person's hand.

use std::time::Duration;

use cohaptic_device::Reading;
use cohaptic_harness::live::{GateStats, GatedDevice};
use cohaptic_peer::{Device, SimulatedDevice, State};
use cohaptic_units::Instant;

/// Device at this computer.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "a program has one device")]
pub(super) enum JoinedDevice {
    Simulated(SimulatedDevice<3>),
    InHand {
        /// Device with the gate of this computer: a session cannot switch a force on.
        device: Box<GatedDevice>,
        /// State read last. Axes beyond the axes of the scene are zero.
        read: State<3>,
        /// `true` if the session is there, so that the coupling may act on the hand.
        is_coupled: bool,
    },
}

impl JoinedDevice {
    /// Reads the device at a tick at `now`, in time since tick 0, and at `clock` on the clock of this computer. Returns whether the device is present: always
    /// for a simulated device, and after a finite reading for a device in a hand.
    pub(super) fn attend(&mut self, now: Instant, clock: Instant, axes: usize) -> bool {
        let Self::InHand { device, read, .. } = self else { return true };
        let first = |values: [f64; 3]| core::array::from_fn(|axis| if axis < axes { values[axis] } else { 0.0 });
        let sound =
            |Reading { position, velocity }: Reading| Some(State { position: first(position), velocity: first(velocity) }).filter(State::is_finite);
        let Some(state) = device.read(now, clock, sound) else { return false };
        *read = state;
        true
    }

    /// Says whether the coupling may act on the hand. Otherwise the force is zero at once: as a force of the coupling, zero would be reached only as fast as
    /// the gate lets forces change.
    pub(super) const fn couple(&mut self, coupled: bool) {
        if let Self::InHand { is_coupled, .. } = self {
            *is_coupled = coupled;
        }
    }

    /// Stops a device in a hand for good.
    pub(super) fn stop(&mut self, now: Instant) {
        if let Self::InHand { device, .. } = self {
            device.stop(now);
        }
    }

    /// Returns the counts of the gate; `None` for a simulated device, which has no gate.
    pub(super) fn gate_stats(&self) -> Option<&GateStats> {
        if let Self::InHand { device, .. } = self { Some(device.stats()) } else { None }
    }
}

impl Device<3> for JoinedDevice {
    fn state(&self) -> State<3> {
        match self {
            Self::Simulated(device) => device.state(),
            Self::InHand { read, .. } => *read,
        }
    }

    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; 3]) {
        match self {
            Self::Simulated(device) => device.advance(now, span, coupling_force),
            // The coupling force acts on the copy, and with the opposite sign on the hand.
            Self::InHand { device, is_coupled: true, .. } => device.hold(now, span, coupling_force.map(|part| -part)),
            Self::InHand { device, is_coupled: false, .. } => device.let_go(now, span),
        }
    }
}
