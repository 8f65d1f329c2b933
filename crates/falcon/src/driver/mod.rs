//! One exchange after the other: a packet out, a report in, and everything in between that keeps a hand safe.

mod config;
mod error;
mod statistics;
mod status;
mod velocity;

pub use config::{DriverConfig, DriverConfigError};
pub use error::DriverError;
pub use statistics::Statistics;
pub use status::{Phase, Reading, Setpoint, Status};
pub use velocity::VelocityFilter;

use core::time::Duration;

use cohaptic_units::Instant;

use crate::ftdi::{self, PAYLOAD};
use crate::kinematics::{Triple, angles_of_counts, forward_from};
use crate::protocol::{Command, Framer, Report};
use crate::safety::{ForceGate, Moment, MotorCounts, Verdict};
use crate::transport::{Transport, TransportError};

/// How often zero force is sent when it stops.
const FAREWELLS: u32 = 5;
/// Time between two of them.
const BETWEEN_FAREWELLS: Duration = Duration::from_millis(2);
/// Failed transfers in a row after which it gives up.
const PATIENCE_WITH_FAULTS: u32 = 10;
/// Implausible reports in a row after which they are believed, and homing is confirmed anew.
const STUBBORN: u32 = 3;
/// However long nothing was heard, an encoder may not have turned further than within this. A hand that did turn it further is believed at its third report.
const LONGEST_LEAP: Duration = Duration::from_millis(3);
/// Answers that may be on their way from packets before: what the chip's 256 bytes hold.
const MOST_OWED: usize = 16;
/// Exchanges that wait for answers still owed, until those are taken for lost.
const WAITS: u32 = 3;

/// The driver of a device whose firmware runs: see [`crate::boot`].
///
/// [`Driver::exchange`] is one turn of a loop that somebody else paces, at best once a millisecond: USB gives no more. It allocates nothing.
/// Whatever is asked for, what goes to the motors comes from a [`ForceGate`]. When it is dropped it [stops](Driver::stop).
#[derive(Debug)]
pub struct Driver<T: Transport> {
    transport: T,
    config: DriverConfig,
    gate: ForceGate,
    framer: Framer,
    filter: VelocityFilter,
    statistics: Statistics,
    status: Status,
    /// When the last report was believed.
    heard_at: Option<Instant>,
    /// When it began, or was last heard: for silence.
    alive_at: Instant,
    /// In the frame of the device; of the last report that was homed.
    position: Option<Triple>,
    homed_in_row: u32,
    unhomed_in_row: u32,
    armed: bool,
    implausible_in_row: u32,
    faults_in_row: u32,
    owed: usize,
    waits: u32,
}

impl<T: Transport> Driver<T> {
    /// Sets the serial chip up for the running firmware. No packet is sent yet.
    ///
    /// # Errors
    ///
    /// [`DriverError::Config`] if a number makes no sense, [`DriverError::Transport`] if the chip cannot be set up.
    pub fn open(mut transport: T, config: DriverConfig) -> Result<Self, DriverError> {
        let config = config.checked()?;
        let gate = ForceGate::new(config.limits, config.calibration).map_err(DriverConfigError::from)?;
        ftdi::set_up_running(&mut transport)?;
        let alive_at = transport.now();
        Ok(Self {
            transport,
            gate,
            framer: Framer::new(),
            filter: VelocityFilter::new(config.velocity_bandwidth),
            statistics: Statistics::default(),
            status: Status::UNKNOWN,
            heard_at: None,
            alive_at,
            position: None,
            homed_in_row: 0,
            unhomed_in_row: 0,
            armed: false,
            implausible_in_row: 0,
            faults_in_row: 0,
            owed: 0,
            waits: 0,
            config,
        })
    }

    /// Sends a packet with the force that somebody wants, as far as the gate lets it pass, and takes the report that answers it. `None` wants none.
    ///
    /// A report that does not come within the patience of the configuration is counted; the reading stays, and ages.
    ///
    /// # Errors
    ///
    /// [`DriverError::Transport`] if the device is gone or transfers keep failing, [`DriverError::Silent`] if it has not answered for too long. Force is off
    /// for good then.
    pub fn exchange(&mut self, wanted: Option<Setpoint>) -> Result<&Status, DriverError> {
        let outcome = self.exchange_once(wanted);
        if outcome.is_err() {
            self.gate.stop();
            (self.status.phase, self.status.armed) = (Phase::Stopped, false);
            (self.status.force, self.status.motors) = ([0.0; 3], MotorCounts::ZERO);
        }
        outcome.map(|()| &self.status)
    }

    fn exchange_once(&mut self, wanted: Option<Setpoint>) -> Result<(), DriverError> {
        self.statistics.exchanges += 1;
        self.send(wanted)?;
        self.receive()?;
        let silence = self.transport.now().saturating_duration_since(self.alive_at);
        if silence > self.config.longest_silence {
            return Err(DriverError::Silent { silence });
        }
        Ok(())
    }

    fn send(&mut self, wanted: Option<Setpoint>) -> Result<(), DriverError> {
        let moment = Moment {
            now: self.transport.now(),
            homed: self.is_homed(),
            armed: self.armed,
            reading_at: self.heard_at,
            setpoint_at: wanted.map(|setpoint| setpoint.at),
            position: self.position,
        };
        let admitted = self.gate.admit(wanted.map_or([0.0; 3], |setpoint| setpoint.force), &moment);
        if wanted.is_some() {
            self.statistics.count(admitted.verdict);
        }
        (self.status.force, self.status.motors, self.status.verdict) = (admitted.force, admitted.motors, admitted.verdict);
        self.status.phase = self.phase();
        let command = Command { motors: admitted.motors, leds: self.status.phase.leds(), homing: true };
        let sent = self.transport.write(&command.encode());
        self.survive(sent)
    }

    /// Takes reports until the one that answers the last packet is there, or its time is over.
    fn receive(&mut self) -> Result<(), DriverError> {
        let deadline = self.transport.now().saturating_add(self.config.patience);
        let (mut reports, mut newest) = (0, None);
        let mut bytes = [0; PAYLOAD];
        while reports <= self.owed {
            let Some(rest) = deadline.checked_duration_since(self.transport.now()).filter(|rest| !rest.is_zero()) else { break };
            let read = self.transport.read(&mut bytes, rest);
            let count = match read {
                Ok(count) => count,
                Err(error) => {
                    self.survive(Err(error))?;
                    break;
                }
            };
            for byte in &bytes[..count] {
                if let Some(report) = self.framer.push::<Report>(*byte) {
                    reports += 1;
                    newest = Some((report, self.transport.now()));
                }
            }
        }
        self.statistics.garbage_bytes = self.framer.garbage();
        self.statistics.reports += reports as u64;
        match newest {
            Some((report, at)) => {
                self.settle(reports);
                self.faults_in_row = 0;
                self.take(report, at);
            }
            None => {
                self.owed = (self.owed + 1).min(MOST_OWED);
                self.statistics.timeouts += 1;
            }
        }
        self.status.phase = self.phase();
        self.status.armed = self.armed && self.is_homed() && !self.gate.is_stopped();
        Ok(())
    }

    /// An answer that did not come in time makes all later ones late until it is read; one that is lost is not waited for for ever.
    fn settle(&mut self, reports: usize) {
        self.owed = (self.owed + 1).saturating_sub(reports);
        self.waits = if self.owed == 0 { 0 } else { self.waits + 1 };
        if self.waits == WAITS {
            (self.owed, self.waits) = (0, 0);
        }
    }

    fn take(&mut self, report: Report, now: Instant) {
        self.alive_at = now;
        if self.is_implausible(&report, now) {
            self.statistics.implausible += 1;
            self.implausible_in_row += 1;
            if self.implausible_in_row < STUBBORN {
                return;
            }
            // Not a bit on the wire, then: the coordinates have jumped, and nothing that was known holds.
            self.homed_in_row = 0;
            self.filter.reset();
        }
        self.implausible_in_row = 0;
        self.heard_at = Some(now);
        (self.status.homed, self.status.encoders, self.status.buttons) = (report.homed, report.encoders, report.buttons);
        if report.all_homed() {
            self.homed_in_row = self.homed_in_row.saturating_add(1);
            self.unhomed_in_row = 0;
            self.locate(&report, now);
        } else {
            self.unhomed();
        }
    }

    /// A homed device cannot have moved so far: a byte was changed on its way into another that can be there.
    fn is_implausible(&self, report: &Report, now: Instant) -> bool {
        let Some(heard_at) = self.heard_at.filter(|_| self.homed_in_row > 0 && report.all_homed()) else { return false };
        let passed = now.saturating_duration_since(heard_at).min(LONGEST_LEAP).as_micros();
        let farthest = (u128::from(self.config.fastest_encoder) * passed).div_ceil(1000);
        report.encoders.iter().zip(self.status.encoders).any(|(new, old)| u128::from(new.abs_diff(old)) > farthest)
    }

    fn locate(&mut self, report: &Report, now: Instant) {
        let origin = self.config.calibration.origin();
        self.position = match forward_from(angles_of_counts(report.encoders), self.position.unwrap_or(origin)) {
            Ok(position) => Some(position),
            Err(_) => {
                self.statistics.unlocated += 1;
                None
            }
        };
        let Some(place) = self.position else { return self.status.reading = None };
        let position = core::array::from_fn(|axis| place[axis] - origin[axis]);
        let velocity = self.filter.update(now, position);
        if self.is_homed() {
            self.armed |= self.config.arm_beyond.is_none_or(|z| place[2] >= z);
            self.status.reading = Some(Reading { at: now, position, velocity });
        } else {
            self.status.reading = None;
        }
    }

    /// One report like that ends force; as many as it takes to believe the opposite end what was known.
    fn unhomed(&mut self) {
        if self.homed_in_row >= self.config.homing_confirmations {
            self.statistics.unhomed += 1;
        }
        self.homed_in_row = 0;
        self.unhomed_in_row = self.unhomed_in_row.saturating_add(1);
        if self.unhomed_in_row >= self.config.homing_confirmations {
            self.armed = false;
            self.position = None;
        }
        self.status.reading = None;
        self.filter.reset();
    }

    const fn is_homed(&self) -> bool {
        self.homed_in_row >= self.config.homing_confirmations
    }

    const fn phase(&self) -> Phase {
        if self.gate.is_stopped() {
            Phase::Stopped
        } else if self.heard_at.is_none() {
            Phase::Silent
        } else if !self.is_homed() {
            Phase::Homing
        } else if self.armed && matches!(self.status.verdict, Verdict::Out(_)) {
            Phase::Active
        } else {
            Phase::Homed
        }
    }

    /// A transfer that fails now and then is counted; a device that is gone, or fails all the time, is an error.
    fn survive(&mut self, outcome: Result<(), TransportError>) -> Result<(), DriverError> {
        let Err(error) = outcome else { return Ok(()) };
        self.statistics.faults += 1;
        self.faults_in_row += 1;
        if error == TransportError::Unplugged || self.faults_in_row >= PATIENCE_WITH_FAULTS {
            return Err(DriverError::Transport(error));
        }
        Ok(())
    }

    /// Switches force off for good, and tells the device several times; then its lights are red. Further exchanges only look. What cannot be sent is not
    /// tried again: a device that hears nothing gives no force either, after its own time-out.
    pub fn stop(&mut self) {
        if self.gate.is_stopped() && self.status.phase == Phase::Stopped && self.statistics.farewells > 0 {
            return;
        }
        self.gate.stop();
        (self.status.phase, self.status.armed) = (Phase::Stopped, false);
        (self.status.force, self.status.motors) = ([0.0; 3], MotorCounts::ZERO);
        let packet = Command { motors: MotorCounts::ZERO, leds: Phase::Stopped.leds(), homing: true }.encode();
        for _ in 0..FAREWELLS {
            match self.transport.write(&packet) {
                Ok(()) => self.statistics.farewells += 1,
                Err(TransportError::Unplugged) => return,
                Err(TransportError::Io { .. }) => self.statistics.faults += 1,
            }
            let next = self.transport.now().saturating_add(BETWEEN_FAREWELLS);
            self.transport.sleep_until(next);
        }
    }

    /// The status of the device now.
    #[must_use]
    pub const fn status(&self) -> &Status {
        &self.status
    }

    /// What happened so far.
    #[must_use]
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The time on the transport's clock.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.transport.now()
    }

    /// Waits until then on the transport's clock.
    pub fn sleep_until(&mut self, until: Instant) {
        self.transport.sleep_until(until);
    }
}

impl<T: Transport> Drop for Driver<T> {
    fn drop(&mut self) {
        self.stop();
    }
}
