//! One turn of the loop: what the peer wants, an exchange, and what the peer is told.

use core::time::Duration;

use cohaptic_peer::State;
use cohaptic_units::Instant;
use thiserror::Error;

use super::Axes;
use crate::driver::{Driver, DriverConfig, DriverError, Phase, Reading, Setpoint, Statistics, Status};
use crate::kinematics::Triple;
use crate::protocol::Buttons;
use crate::transport::Transport;

/// What keeps the grip in the middle along the axes that the peer does not use.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hold {
    /// \[N/m\]
    pub stiffness: f64,
    /// \[N·s/m\]
    pub damping: f64,
    /// The most it pushes \[N\], along each axis.
    pub force: f64,
}

impl Hold {
    /// 500 N/m, 2 N·s/m, at most 2 N.
    pub const DEFAULT: Self = Self { stiffness: 500.0, damping: 2.0, force: 2.0 };

    fn along(&self, position: f64, velocity: f64) -> f64 {
        (-self.stiffness * position - self.damping * velocity).clamp(-self.force, self.force)
    }
}

/// A Falcon as the device of a peer with A axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DeviceConfig<const A: usize> {
    /// Which axes of the device the peer uses.
    pub axes: Axes<A>,
    /// How the device is driven.
    pub driver: DriverConfig,
    /// From one exchange to the next. USB gives at best one in a millisecond.
    pub period: Duration,
    /// What holds the other axes; `None` leaves them free.
    pub hold: Option<Hold>,
}

impl<const A: usize> DeviceConfig<A> {
    /// These axes, one exchange a millisecond, and defaults.
    #[must_use]
    pub const fn new(axes: Axes<A>) -> Self {
        Self { axes, driver: DriverConfig::DEFAULT, period: Duration::from_millis(1), hold: Some(Hold::DEFAULT) }
    }

    /// The same, if what this adds to the driver's configuration makes sense; the driver checks its own.
    ///
    /// # Errors
    ///
    /// [`DeviceConfigError`] names what does not.
    pub fn checked(self) -> Result<Self, DeviceConfigError> {
        if !(Duration::from_micros(250)..=Duration::from_millis(20)).contains(&self.period) {
            return Err(DeviceConfigError::Period(self.period));
        }
        if let Some(hold) = self.hold {
            let sound = |number: f64, most: f64| (0.0..=most).contains(&number);
            if !(sound(hold.stiffness, 3000.0) && sound(hold.damping, 20.0) && sound(hold.force, 20.0)) {
                return Err(DeviceConfigError::Hold(hold));
            }
        }
        Ok(self)
    }
}

/// A configuration that makes no sense.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
pub enum DeviceConfigError {
    /// No rate at which a Falcon can be driven.
    #[error("the period of the loop is {0:?}, not within 250 us to 20 ms: 1 ms is what USB gives")]
    Period(Duration),
    /// A spring that no Falcon can be.
    #[error("{0:?} is not within 3000 N/m, 20 N·s/m and 20 N, which is what the device is said to hold")]
    Hold(Hold),
}

/// The loop without what paces it.
#[derive(Debug)]
pub(super) struct Turns<T: Transport, const A: usize> {
    pub(super) driver: Driver<T>,
    config: DeviceConfig<A>,
    /// On the grip, in the axes of the device.
    wanted: Option<Setpoint>,
    next: Instant,
    timing: LoopStatistics,
}

impl<T: Transport, const A: usize> Turns<T, A> {
    pub(super) fn open(transport: T, config: DeviceConfig<A>) -> Result<Self, DriverError> {
        let driver = Driver::open(transport, config.driver)?;
        let next = driver.now();
        Ok(Self { driver, config, wanted: None, next, timing: LoopStatistics::default() })
    }

    /// The peer wants this force on the grip \[N\], in the axes of the device, from now on.
    pub(super) fn want(&mut self, force: Triple) {
        self.wanted = Some(Setpoint { force, at: self.driver.now() });
    }

    pub(super) fn exchange(&mut self) -> Result<(), DriverError> {
        let setpoint = self.wanted.map(|wanted| Setpoint { force: self.held(wanted.force), ..wanted });
        self.driver.exchange(setpoint).map(|_| ())
    }

    /// Waits for the next turn; a turn that took too long moves all that follow.
    pub(super) fn pace(&mut self) {
        self.timing.turns += 1;
        self.next = self.next.saturating_add(self.config.period);
        let now = self.driver.now();
        match now.checked_duration_since(self.next).filter(|late| !late.is_zero()) {
            Some(late) => {
                self.timing.late += 1;
                self.timing.worst = self.timing.worst.max(late);
                self.next = now;
            }
            None => self.driver.sleep_until(self.next),
        }
    }

    /// The force with that of the springs along the axes that the peer does not use.
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

/// How well the loop keeps its time.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LoopStatistics {
    /// Turns so far.
    pub turns: u64,
    /// Turns that ended after the next should have begun.
    pub late: u64,
    /// The longest that one was late.
    pub worst: Duration,
}

/// The device after its last exchange.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Snapshot {
    /// When that was, on the transport's clock.
    pub at: Instant,
    /// Where the device stands.
    pub phase: Phase,
    /// Whether the device is homed and the user has switched forces on since.
    pub armed: bool,
    /// Which encoders are homed.
    pub homed: [bool; 3],
    /// The counts of the encoders.
    pub encoders: [i16; 3],
    /// Which buttons are pressed.
    pub buttons: Buttons,
    /// Where the grip is, if that is known.
    pub reading: Option<Reading>,
    /// The force that went out \[N\].
    pub force: Triple,
    /// What happened so far.
    pub statistics: Statistics,
    /// How well the loop keeps its time.
    pub timing: LoopStatistics,
}

impl Snapshot {
    /// Whether a peer may begin: it is known where the grip is, and forces that are asked for go out.
    #[must_use]
    pub const fn is_ready(&self) -> bool {
        self.armed && self.reading.is_some()
    }
}

/// What the peer sees of a snapshot. A device that is not homed rests where it was last; a reading that is too old has no velocity.
pub(super) fn state<const A: usize>(snapshot: &Snapshot, config: &DeviceConfig<A>, last: State<A>) -> State<A> {
    let Some(reading) = snapshot.reading else { return State { velocity: [0.0; A], ..last } };
    let fresh = snapshot.at.saturating_duration_since(reading.at) <= config.driver.limits.reading_age;
    let velocity = if fresh { config.axes.of_device(reading.velocity) } else { [0.0; A] };
    State { position: config.axes.of_device(reading.position), velocity }
}
