//! What a simulated device knows and its driver does not.

use cohaptic_falcon::driver::Status;
use cohaptic_falcon::kinematics::Triple;
use cohaptic_falcon::simulator::{Observed, SharedSimulator, Simulator};
use serde::Serialize;

use super::words;

/// The largest of what was seen of a device behind its driver's back.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Truth {
    /// In the frame of the device \[m\].
    pub(super) position: Triple,
    /// \[N\]
    pub(super) motor_force: Triple,
    pub(super) largest_motor_force: f64,
    /// How far the driver's position was from the true one at most \[m\]; `None` if it never had one.
    pub(super) largest_error: Option<f64>,
    pub(super) observed: Observed,
}

impl Truth {
    /// Looks; `origin`: where the driver's positions count from.
    pub(super) fn look(&mut self, simulator: &SharedSimulator, status: &Status, origin: Triple) {
        let look = |device: &mut Simulator| (device.position(), device.motor_force(), *device.observed());
        (self.position, self.motor_force, self.observed) = simulator.with(look);
        self.largest_motor_force = self.largest_motor_force.max(words::length(self.motor_force));
        if let Some(reading) = status.reading {
            let off = words::length(std::array::from_fn(|axis| reading.position[axis] + origin[axis] - self.position[axis]));
            self.largest_error = Some(self.largest_error.unwrap_or(0.0).max(off));
        }
    }
}

/// What the device has seen of its host.
#[derive(Serialize)]
pub(super) struct DeviceDocument {
    commands: u64,
    garbage_bytes: u64,
    misheard_bytes: u64,
    largest_count: u16,
    largest_count_unhomed: u16,
    saturated: u64,
    torque_timeouts: u64,
}

impl DeviceDocument {
    pub(super) const fn of(observed: &Observed) -> Self {
        let Observed { commands, garbage, misheard, largest_count, largest_count_unhomed, saturated, torque_timeouts } = *observed;
        Self { commands, garbage_bytes: garbage, misheard_bytes: misheard, largest_count, largest_count_unhomed, saturated, torque_timeouts }
    }

    /// In words.
    pub(super) fn describe(&self) -> String {
        let Self { commands, garbage_bytes, misheard_bytes, largest_count, largest_count_unhomed, saturated, torque_timeouts } = self;
        format!(
            "the device took {commands} packets, {garbage_bytes} bytes of garbage and {misheard_bytes} at the wrong time; motor counts up to {largest_count}, {largest_count_unhomed} before it was homed; {saturated} saturated, {torque_timeouts} torque time-outs"
        )
    }
}
