//! Driver of a device with running firmware. An exchange sends a packet and takes a report, and protects the user's hand.
//!
//! In: setpoints of force, and bytes of a transport. Out: packets with admitted forces, and the status of the device. The driver has no loop and no thread:
//! the caller paces the exchanges.

mod config;
mod error;
mod statistics;
mod status;
mod velocity;

pub use config::{DriverConfig, DriverConfigError};
pub use error::DriverError;
pub use statistics::Statistics;
pub use status::{Phase, Reading, Setpoint, Status};

use core::time::Duration;

use cohaptic_device::Stopper;
use cohaptic_units::Instant;

use crate::ftdi::{self, PAYLOAD};
use crate::kinematics::{Triple, angles_of_counts, forward_from};
use crate::protocol::{Command, Framer, Report};
use crate::safety::{ForceGate, Moment, MotorCounts, Verdict};
use crate::transport::{Transport, TransportError};
use velocity::VelocityFilter;

/// Number of packets of zero force that a stop sends.
const FAREWELLS: u32 = 5;
/// Time between two packets of zero force of a stop.
const BETWEEN_FAREWELLS: Duration = Duration::from_millis(2);
/// Consecutive failed transfers after which the driver fails.
const PATIENCE_WITH_FAULTS: u32 = 10;
/// Consecutive implausible reports after which the reports are believed, and homing is confirmed anew.
const STUBBORN: u32 = 3;
/// Longest time for which an encoder may have turned between two reports. After a longer silence, a hand that has turned an encoder further is believed at
/// the third report.
const LONGEST_LEAP: Duration = Duration::from_millis(3);
/// Greatest number of answers to earlier packets that may still arrive: the capacity of the chip's 256 bytes.
const MOST_OWED: usize = 16;
/// Exchanges that wait for answers still owed, before the answers count as lost.
const WAITS: u32 = 3;

/// Driver of a device with running firmware: see [`crate::boot`].
///
/// [`Driver::exchange`] is one turn of a loop that the caller paces, at best once per millisecond, the limit of USB. An exchange allocates no memory. All
/// motor counts come from a [`ForceGate`]. A drop [stops](Driver::stop) the driver.
#[derive(Debug)]
pub struct Driver<T: Transport> {
    transport: T,
    config: DriverConfig,
    gate: ForceGate,
    framer: Framer,
    filter: VelocityFilter,
    statistics: Statistics,
    status: Status,
    /// Arrival of the last believed report.
    heard_at: Option<Instant>,
    /// Arrival of the last report, or the start of the driver, for the measurement of silence.
    alive_at: Instant,
    /// Position of the grip in the frame of the device \[m\], from the last homed report.
    position: Option<Triple>,
    /// Consecutive believed reports with all encoders homed.
    homed_in_row: u32,
    /// Consecutive believed reports with an encoder that is not homed.
    unhomed_in_row: u32,
    /// `true` if the user has switched forces on since homing.
    armed: bool,
    implausible_in_row: u32,
    faults_in_row: u32,
    /// Answers to earlier packets that are still to come.
    owed: usize,
    /// Consecutive exchanges that had a report while answers were owed.
    waits: u32,
}

impl<T: Transport> Driver<T> {
    /// Opens the driver, and sets up the serial chip for the running firmware. No packet is sent yet.
    ///
    /// # Errors
    ///
    /// [`DriverError::Config`] for a number out of range, and [`DriverError::Transport`] if the chip cannot be set up.
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

    /// Sends a packet with the force `wanted`, as far as the gate admits it, and takes the report that answers the packet. `None` asks for zero force.
    ///
    /// If no report comes within the patience of the configuration, a timeout is counted, and the last reading stays and ages.
    ///
    /// # Errors
    ///
    /// [`DriverError::Transport`] if the device is unplugged or transfers keep failing, and [`DriverError::Silent`] if the device has been silent for too
    /// long. After an error the force stays zero.
    pub fn exchange(&mut self, wanted: Option<Setpoint>) -> Result<&Status, DriverError> {
        let outcome = self.exchange_once(wanted);
        if outcome.is_err() {
            // The gate stops before the caller sees the error, so no later exchange can give force.
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
        // The gate decides with the knowledge before this exchange: the report of this packet is still to come.
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
        // The homing bit is always set: a packet without it makes the device forget its homing.
        let command = Command { motors: admitted.motors, leds: self.status.phase.leds(), homing: true };
        let sent = self.transport.write(&command.encode());
        self.survive(sent)
    }

    /// Takes reports until the answer to the last packet has come, or the patience has passed.
    fn receive(&mut self) -> Result<(), DriverError> {
        // The patience counts from the sent packet, not from the last byte: noise must not prolong an exchange.
        let deadline = self.transport.now().saturating_add(self.config.patience);
        let (mut reports, mut newest) = (0, None);
        let mut bytes = [0; PAYLOAD];
        // Answers come in the order of packets, so the answer to this packet follows all owed answers.
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
                    // Only the newest report counts; older ones describe an earlier state.
                    newest = Some((report, self.transport.now()));
                }
            }
        }
        // Counted also for an exchange without a report.
        self.statistics.garbage_bytes = self.framer.garbage();
        self.statistics.reports += reports as u64;
        match newest {
            Some((report, at)) => {
                self.settle(reports);
                self.faults_in_row = 0;
                self.take(report, at);
            }
            None => {
                // The answer to this packet may still come, before the answers to later packets.
                self.owed = (self.owed + 1).min(MOST_OWED);
                self.statistics.timeouts += 1;
            }
        }
        self.status.phase = self.phase();
        self.status.armed = self.armed && self.is_homed() && !self.gate.is_stopped();
        Ok(())
    }

    /// Counts the owed answers after `reports` reports. An answer that was late makes all later answers late until it is read; a lost answer must not be
    /// awaited forever.
    fn settle(&mut self, reports: usize) {
        self.owed = (self.owed + 1).saturating_sub(reports);
        self.waits = if self.owed == 0 { 0 } else { self.waits + 1 };
        if self.waits == WAITS {
            (self.owed, self.waits) = (0, 0);
        }
    }

    /// Takes in the newest report of an exchange.
    fn take(&mut self, report: Report, now: Instant) {
        // An implausible report is no silence.
        self.alive_at = now;
        if self.is_implausible(&report, now) {
            self.statistics.implausible += 1;
            self.implausible_in_row += 1;
            // A plausible report sets this count to zero, so only consecutive reports add up.
            if self.implausible_in_row < STUBBORN {
                return;
            }
            // The same jump in several reports is no flipped bit: the coordinates have changed, and earlier knowledge is void.
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

    /// Returns whether a homed device cannot have moved so far since the last report, so that a byte must have changed on the wire into another valid byte.
    fn is_implausible(&self, report: &Report, now: Instant) -> bool {
        let Some(heard_at) = self.heard_at.filter(|_| self.homed_in_row > 0 && report.all_homed()) else { return false };
        // A device that is not homed has counts without meaning, so its jumps are not checked.
        let passed = now.saturating_duration_since(heard_at).min(LONGEST_LEAP).as_micros();
        // Rounded up, so that an encoder at exactly the greatest speed is plausible.
        let farthest = (u128::from(self.config.fastest_encoder) * passed).div_ceil(1000);
        report.encoders.iter().zip(self.status.encoders).any(|(new, old)| u128::from(new.abs_diff(old)) > farthest)
    }

    /// Computes the position of the grip from a homed report, and switches forces on if the grip is far enough out.
    fn locate(&mut self, report: &Report, now: Instant) {
        let origin = self.config.calibration.origin();
        self.position = match forward_from(angles_of_counts(report.encoders), self.position.unwrap_or(origin)) {
            Ok(position) => Some(position),
            Err(_) => {
                self.statistics.unlocated += 1;
                None
            }
        };
        // Homed angles without a position are an error of the encoders: without a position there is no force.
        let Some(place) = self.position else { return self.status.reading = None };
        let position = core::array::from_fn(|axis| place[axis] - origin[axis]);
        // The filter runs before homing is confirmed, so that the first reading has a settled velocity.
        let velocity = self.filter.update(now, position);
        if self.is_homed() {
            // Once armed, the device stays armed until its homing is lost for good.
            self.armed |= self.config.arm_beyond.is_none_or(|z| place[2] >= z);
            self.status.reading = Some(Reading { at: now, position, velocity });
        } else {
            self.status.reading = None;
        }
    }

    /// Takes in a report that is not homed. One such report ends the force. As many reports as homing needs confirmations discard the position and the
    /// arming.
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

    fn phase(&self) -> Phase {
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

    /// Counts a failed transfer. Returns an error for an unplugged device, and for too many consecutive failures.
    fn survive(&mut self, outcome: Result<(), TransportError>) -> Result<(), DriverError> {
        let Err(error) = outcome else { return Ok(()) };
        self.statistics.faults += 1;
        self.faults_in_row += 1;
        if error == TransportError::Unplugged || self.faults_in_row >= PATIENCE_WITH_FAULTS {
            return Err(DriverError::Transport(error));
        }
        Ok(())
    }

    /// Stops the force for good, and sends several packets of zero force with red lights. Later exchanges only read the device. Packets that cannot be sent
    /// are not repeated: a device that hears no packets switches its motors off after its own time-out.
    pub fn stop(&mut self) {
        // `exchange` may have stopped the gate without a packet, so the farewells decide whether the device knows.
        if self.gate.is_stopped() && self.status.phase == Phase::Stopped && self.statistics.farewells > 0 {
            return;
        }
        self.gate.stop();
        (self.status.phase, self.status.armed) = (Phase::Stopped, false);
        (self.status.force, self.status.motors) = ([0.0; 3], MotorCounts::ZERO);
        // The homing bit stays set, so that the next driver finds the device homed.
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

    /// Returns the handle that ends the force from any thread. After [`Stopper::stop`], no packet has a force; [`Driver::stop`] also tells the device.
    #[must_use]
    pub const fn stopper(&self) -> &Stopper {
        self.gate.stopper()
    }

    /// Returns the status of the device after the last exchange.
    #[must_use]
    pub const fn status(&self) -> &Status {
        &self.status
    }

    /// Returns the counts of events since the start.
    #[must_use]
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Returns the time on the transport's clock.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.transport.now()
    }

    /// Waits until `until` on the transport's clock.
    pub fn sleep_until(&mut self, until: Instant) {
        self.transport.sleep_until(until);
    }
}

impl<T: Transport> Drop for Driver<T> {
    fn drop(&mut self) {
        self.stop();
    }
}
