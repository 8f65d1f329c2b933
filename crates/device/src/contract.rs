//! Contract of a device.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::{GatedForce, Stopper};

/// Description of a device, which does not change while the device is in use.
#[derive(Clone, PartialEq, Debug)]
pub struct Description {
    /// Name of the device, as in messages and records, for example `falcon`.
    pub name: String,
    /// Number of motions with a motor, 0 to 3: the first axes of x, y, z.
    pub motions: usize,
    /// Greatest force that may be asked of the device \[N\], 0 to 20. The gate of a session takes the force as its limit; another number counts as 0.
    pub force: f64,
    /// Time from one exchange with the device to the next.
    pub period: Duration,
}

/// Position and velocity of the point that the hand holds.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Reading {
    /// Position \[m\].
    pub position: [f64; 3],
    /// Velocity \[m/s\].
    pub velocity: [f64; 3],
}

/// Haptic device in a person's hand, or pointer that pulls a simulated device.
///
/// Positions are in m, velocities in m/s, forces in N. x points to the user's right, y up, z towards the user; the origin is in the middle of the workspace.
/// Components beyond the axes of a scene are ignored.
///
/// A loop calls [`read`](Self::read) and then [`hold`](Self::hold) once per tick, on one thread. Neither may wait: together the calls take at most 50 µs in 99
/// of 100 ticks. A driver therefore exchanges data with the device in a thread of its own. That thread must give zero force for good after
/// [`Stopper::stop`], and at once if the last force is older than [`Limits::setpoint_age`](crate::Limits::setpoint_age), because the loop may have died. A
/// [`Gate`](crate::Gate) in the thread does both.
///
/// The loop calls [`stop`](Self::stop) at every end: at the end of the run, after a panic, and after a signal. A drop of the device must stop the device too.
pub trait Device: Send {
    /// Returns the description of the device.
    fn description(&self) -> Description;

    /// Returns the handle that stops the device from any thread. Every call returns a clone of the same stopper.
    fn stopper(&self) -> Stopper;

    /// Returns position \[m\] and velocity \[m/s\] at the tick at `now`. Returns `None` if the device is absent, does not answer, or is not ready or not armed:
    /// the force is then zero at once. While the driver's thread holds the newest reading, the reading before is the answer.
    ///
    /// A peer with a long silent device lets go of the object gradually, and takes the object up again gradually after the return of the device.
    fn read(&mut self, now: Instant) -> Option<Reading>;

    /// Applies the force on the hand `force` until the next tick, `span` after `now`.
    fn hold(&mut self, now: Instant, span: Duration, force: GatedForce);

    /// Switches the force off for good, without waiting. Works twice. The default calls [`Stopper::stop`], which suffices for a driver whose thread watches the
    /// stopper. A driver without a thread must also send zero force to the device.
    fn stop(&mut self) {
        self.stopper().stop();
    }
}
