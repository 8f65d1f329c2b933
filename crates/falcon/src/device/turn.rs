//! One turn of the loop: the force of the peer, an exchange, and the state for the peer.

use core::time::Duration;

use cohaptic_device::{Description, GatedForce};
use cohaptic_units::Instant;
use thiserror::Error;

use super::Axes;
use crate::driver::{Driver, DriverConfig, DriverError, Phase, Reading, Setpoint, Statistics, Status};
use crate::kinematics::Triple;
use crate::protocol::Buttons;
use crate::transport::Transport;

/// Springs that hold the grip at the origin along the axes that the peer does not use.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hold {
    /// Stiffness along each axis \[N/m\].
    pub stiffness: f64,
    /// Damping along each axis \[N·s/m\].
    pub damping: f64,
    /// Greatest force along each axis \[N\].
    pub force: f64,
}

impl Hold {
    /// Default values: 500 N/m, 2 N·s/m, at most 2 N.
    pub const DEFAULT: Self = Self { stiffness: 500.0, damping: 2.0, force: 2.0 };

    fn along(&self, position: f64, velocity: f64) -> f64 {
        (-self.stiffness * position - self.damping * velocity).clamp(-self.force, self.force)
    }
}

/// Configuration of a Falcon as the device of a peer with A axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DeviceConfig<const A: usize> {
    /// Axes of the device that the peer uses.
    pub axes: Axes<A>,
    /// Configuration of the driver.
    pub driver: DriverConfig,
    /// Time from one exchange to the next, 250 us to 20 ms. USB allows at best one exchange per millisecond.
    pub period: Duration,
    /// Springs along the unused axes; `None` leaves these axes free.
    pub hold: Option<Hold>,
}

impl<const A: usize> DeviceConfig<A> {
    /// Returns a configuration with these axes, one exchange per millisecond, and default values.
    #[must_use]
    pub const fn new(axes: Axes<A>) -> Self {
        Self { axes, driver: DriverConfig::DEFAULT, period: Duration::from_millis(1), hold: Some(Hold::DEFAULT) }
    }

    /// Returns the configuration if period and springs are within their ranges. The driver checks its own configuration.
    ///
    /// # Errors
    ///
    /// [`DeviceConfigError`] with the number out of range.
    pub(crate) fn checked(self) -> Result<Self, DeviceConfigError> {
        if !(Duration::from_micros(250)..=Duration::from_millis(20)).contains(&self.period) {
            return Err(DeviceConfigError::Period(self.period));
        }
        if let Some(hold) = self.hold {
            // `contains` is false for NaN.
            let sound = |number: f64, most: f64| (0.0..=most).contains(&number);
            if !(sound(hold.stiffness, 3000.0) && sound(hold.damping, 20.0) && sound(hold.force, 20.0)) {
                return Err(DeviceConfigError::Hold(hold));
            }
        }
        Ok(self)
    }
}

/// Error of a configuration with a number out of range.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
#[non_exhaustive]
pub enum DeviceConfigError {
    /// The period is out of range.
    #[error("the period of the loop is {0:?}, not within 250 us to 20 ms: 1 ms is what USB gives")]
    Period(Duration),
    /// A number of the springs is out of range.
    #[error("{0:?} is not within 3000 N/m, 20 N·s/m and 20 N, which is what the device is said to hold")]
    Hold(Hold),
}

/// State of the loop of exchanges with a device. The owner of the thread calls `exchange` and `pace` in turn.
#[derive(Debug)]
pub(super) struct Turns<T: Transport, const A: usize> {
    pub(super) driver: Driver<T>,
    config: DeviceConfig<A>,
    /// Newest force on the grip, in the axes of the device.
    wanted: Option<Setpoint>,
    /// Begin of the next turn on the transport's clock.
    next: Instant,
    timing: LoopStatistics,
}

impl<T: Transport, const A: usize> Turns<T, A> {
    pub(super) fn open(transport: T, config: DeviceConfig<A>) -> Result<Self, DriverError> {
        let driver = Driver::open(transport, config.driver)?;
        let next = driver.now();
        Ok(Self { driver, config, wanted: None, next, timing: LoopStatistics::default() })
    }

    /// Sets the force on the hand, in the axes of the peer.
    pub(super) fn want(&mut self, force: GatedForce) {
        let along_axes = core::array::from_fn(|axis| force.newtons().get(axis).copied().unwrap_or(0.0));
        self.wanted = Some(Setpoint { force: self.config.axes.to_device(along_axes), at: self.driver.now() });
    }

    pub(super) fn exchange(&mut self) -> Result<(), DriverError> {
        // The springs follow the newest position, while the setpoint keeps the age of the peer's force.
        let setpoint = self.wanted.map(|wanted| Setpoint { force: self.held(wanted.force), ..wanted });
        self.driver.exchange(setpoint).map(|_| ())
    }

    /// Waits for the next turn. A late turn shifts all following turns, so that the loop does not catch up with turns in quick succession.
    pub(super) fn pace(&mut self) {
        self.timing.turns += 1;
        self.next = self.next.saturating_add(self.config.period);
        let now = self.driver.now();
        match now.checked_duration_since(self.next).filter(|late| !late.is_zero()) {
            Some(late) => {
                self.timing.late += 1;
                // The lateness of this turn, measured before the shift of the next turn.
                self.timing.worst = self.timing.worst.max(late);
                self.next = now;
            }
            None => self.driver.sleep_until(self.next),
        }
    }

    /// Returns `force` with each component along an axis that the peer does not use replaced by the force of the holding spring. Without a spring in the
    /// configuration, or without a reading, `force` stays as given.
    fn held(&self, mut force: Triple) -> Triple {
        if let (Some(hold), Some(reading)) = (self.config.hold, self.driver.status().reading) {
            for (axis, unused) in self.config.axes.unused().into_iter().enumerate() {
                if unused {
                    force[axis] = hold.along(reading.position[axis], reading.velocity[axis]);
                }
            }
        }
        force
    }

    pub(super) fn snapshot(&self) -> Snapshot {
        let Status { phase, armed, homed, encoders, buttons, reading, force, motors: _, verdict: _ } = *self.driver.status();
        let (at, statistics, timing) = (self.driver.now(), *self.driver.statistics(), self.timing);
        Snapshot { at, phase, armed, homed, encoders, buttons, reading, force, statistics, timing }
    }
}

/// Timing of the loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LoopStatistics {
    /// Turns so far.
    pub turns: u64,
    /// Turns that ended after the begin of the next turn.
    pub late: u64,
    /// Greatest lateness of a turn.
    pub worst: Duration,
}

/// The device after its last exchange.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Snapshot {
    /// Time of the snapshot, on the transport's clock.
    pub at: Instant,
    /// Phase of the device.
    pub phase: Phase,
    /// `true` if the device is homed, and the user has switched forces on since then.
    pub armed: bool,
    /// `true` for each encoder that is homed.
    pub homed: [bool; 3],
    /// Counts of the encoders.
    pub encoders: [i16; 3],
    /// Pressed buttons.
    pub buttons: Buttons,
    /// Position and velocity of the grip; `None` while unknown.
    pub reading: Option<Reading>,
    /// Force of the last packet \[N\].
    pub force: Triple,
    /// Counts of events since the start of the driver.
    pub statistics: Statistics,
    /// Timing of the loop.
    pub timing: LoopStatistics,
}

impl Snapshot {
    /// Returns whether a peer may begin: the position of the grip is known, and forces are switched on.
    #[must_use]
    pub const fn is_ready(&self) -> bool {
        self.armed && self.reading.is_some()
    }
}

/// Returns the reading of a snapshot along the axes of the peer; `None` unless a peer may begin. A reading that is too old has no velocity.
pub(super) fn reading<const A: usize>(snapshot: &Snapshot, config: &DeviceConfig<A>) -> Option<cohaptic_device::Reading> {
    let reading = snapshot.reading.filter(|_| snapshot.is_ready())?;
    // The position of an old reading is still the best estimate; its velocity is not.
    let fresh = snapshot.at.saturating_duration_since(reading.at) <= config.driver.limits.reading_age;
    let velocity = if fresh { config.axes.of_device(reading.velocity) } else { [0.0; A] };
    // Axes beyond the axes of the peer are zero.
    let widen = |values: [f64; A]| core::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
    Some(cohaptic_device::Reading { position: widen(config.axes.of_device(reading.position)), velocity: widen(velocity) })
}

/// Returns the description of a device with this configuration.
pub(super) fn description<const A: usize>(config: &DeviceConfig<A>) -> Description {
    Description { name: "falcon".to_owned(), motions: A, force: config.driver.limits.force, period: config.period }
}
