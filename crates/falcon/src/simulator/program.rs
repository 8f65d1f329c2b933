//! Simulated programs of the device: boot loader and firmware.

use cohaptic_units::Instant;

use super::encoders::Encoders;
use super::{Faults, SimulatorConfig};
use crate::boot::Firmware;
use crate::calibration::MOTOR_LIMIT;
use crate::ftdi::{BAUD_HANDSHAKE, BAUD_LOADING, BAUD_RUNNING};
use crate::kinematics::Triple;
use crate::protocol::{Buttons, CommandParts, END, Framer, Leds, PACKET, Report};

/// Activity of the processor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Activity {
    /// The device is switched on, and the boot loader is not awake.
    Asleep,
    /// The boot loader waits for a greeting.
    Listening,
    /// The boot loader was greeted, and waits for the request of a transfer.
    Greeted,
    /// The boot loader receives firmware.
    Loading,
    /// The firmware runs.
    Running,
}

/// Counts of packets and faults of the host, and the largest motor counts, as observed by the simulated device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Observed {
    /// Complete packets.
    pub commands: u64,
    /// Bytes outside of any packet.
    pub garbage: u64,
    /// Bytes at a wrong speed, or at a time at which the device accepts none.
    pub misheard: u64,
    /// Largest motor count, in either direction.
    pub largest_count: u16,
    /// Largest motor count while an encoder was not homed. A correct driver keeps this count at zero.
    pub largest_count_unhomed: u16,
    /// Packets with a motor count above the limit of a motor.
    pub saturated: u64,
    /// Times at which the motors went off because no packet came.
    pub torque_timeouts: u64,
}

/// Answer to a byte, at most a packet long.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    bytes: [u8; PACKET],
    count: usize,
}

impl Answer {
    const NONE: Self = Self { bytes: [0; PACKET], count: 0 };

    fn of(bytes: &[u8]) -> Self {
        let mut answer = Self { count: bytes.len().min(PACKET), ..Self::NONE };
        answer.bytes[..answer.count].copy_from_slice(&bytes[..answer.count]);
        answer
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.count]
    }
}

#[derive(Clone, Debug)]
pub(super) struct Program {
    activity: Activity,
    /// Last three bytes heard by the boot loader.
    heard: [u8; 3],
    /// Greetings heard, also the ignored ones.
    greetings: u32,
    /// Firmware received so far.
    loaded: Vec<u8>,
    /// `true` if the wrong echo of [`Faults`] has been sent.
    echoes_spoiled: bool,
    framer: Framer,
    /// Last complete packet.
    command: CommandParts,
    /// Arrival of the last complete packet.
    commanded: Option<Instant>,
    /// `true` if the torque time-out since the last packet is counted.
    timed_out: bool,
    buttons: Buttons,
    observed: Observed,
}

impl Program {
    pub(super) fn switched_on(running: bool) -> Self {
        Self {
            activity: if running { Activity::Running } else { Activity::Asleep },
            heard: [0; 3],
            greetings: 0,
            loaded: Vec::with_capacity(Firmware::LONGEST),
            echoes_spoiled: false,
            framer: Framer::new(),
            command: CommandParts::default(),
            commanded: None,
            timed_out: false,
            buttons: Buttons::NONE,
            observed: Observed::default(),
        }
    }

    /// Returns whether the byte may have an effect beyond its reception. The firmware answers only the last byte of a packet.
    pub(super) fn may_answer(&self, byte: u8) -> bool {
        self.activity != Activity::Running || byte == END
    }

    /// Restarts the boot loader after a pulse of DTR at 9600 baud, whatever program ran.
    pub(super) fn wake(&mut self) {
        self.activity = Activity::Listening;
        self.heard = [0; 3];
        self.loaded.clear();
        self.command = CommandParts::default();
        self.commanded = None;
    }

    /// Starts the loaded firmware, if it is complete, when the host changes to the speed of the running firmware.
    pub(super) fn start(&mut self, config: &SimulatorConfig) {
        if self.activity != Activity::Loading {
            return;
        }
        // Without a given image, every plausible length counts as complete firmware.
        let whole = config.image.as_ref().map_or(self.loaded.len() >= Firmware::SHORTEST, |image| *image == self.loaded);
        if whole {
            self.activity = Activity::Running;
            self.framer = Framer::new();
        }
    }

    /// Receives a byte and returns the answer.
    #[expect(clippy::too_many_arguments, reason = "one call, by the device that owns all of it")]
    pub(super) fn hear(
        &mut self,
        at: Instant,
        byte: u8,
        divisor: u16,
        dtr: bool,
        config: &SimulatorConfig,
        faults: &Faults,
        encoders: &Encoders,
    ) -> Answer {
        let understood = match self.activity {
            Activity::Asleep => false,
            Activity::Listening => divisor == BAUD_HANDSHAKE && dtr,
            // The host may greet again until it has changed the speed.
            Activity::Greeted => divisor == BAUD_HANDSHAKE || divisor == BAUD_LOADING && !dtr,
            Activity::Loading => divisor == BAUD_LOADING && !dtr,
            Activity::Running => divisor == BAUD_RUNNING,
        };
        if !understood {
            self.observed.misheard += 1;
            return Answer::NONE;
        }
        match self.activity {
            Activity::Asleep => Answer::NONE,
            Activity::Greeted if divisor == BAUD_LOADING => {
                if byte != 0x41 {
                    return Answer::NONE;
                }
                self.activity = Activity::Loading;
                Answer::of(&[byte])
            }
            Activity::Listening | Activity::Greeted => self.greet(byte, config),
            Activity::Loading => self.load(byte, faults),
            Activity::Running => self.run(at, byte, encoders),
        }
    }

    /// Receives a byte of a greeting.
    fn greet(&mut self, byte: u8, config: &SimulatorConfig) -> Answer {
        self.heard = [self.heard[1], self.heard[2], byte];
        if self.heard != [0x0A, 0x43, 0x0D] {
            return Answer::NONE;
        }
        // Ignored greetings count too, so that `deaf_greetings` is a number of greetings.
        self.greetings += 1;
        if self.greetings <= config.deaf_greetings {
            return Answer::NONE;
        }
        self.activity = Activity::Greeted;
        let answer = [0x00, 0x0A, 0x44, 0x2C, 0x0D];
        Answer::of(if config.leading_zero { &answer } else { &answer[1..] })
    }

    /// Receives a byte of firmware, and returns its echo.
    fn load(&mut self, byte: u8, faults: &Faults) -> Answer {
        let place = self.loaded.len();
        if place >= Firmware::LONGEST {
            self.observed.misheard += 1;
            return Answer::NONE;
        }
        self.loaded.push(byte);
        // Only once, so that a second attempt can succeed.
        let spoil = faults.wrong_echo == Some(place) && !self.echoes_spoiled;
        self.echoes_spoiled |= spoil;
        Answer::of(&[if spoil { byte ^ 0x20 } else { byte }])
    }

    /// Receives a byte of a packet, and returns a report for a complete packet.
    fn run(&mut self, at: Instant, byte: u8, encoders: &Encoders) -> Answer {
        let command: Option<CommandParts> = self.framer.push(byte);
        self.observed.garbage = self.framer.garbage();
        let Some(mut command) = command else { return Answer::NONE };
        let largest = command.motors.iter().fold(0, |largest, count| largest.max(count.unsigned_abs()));
        self.observed.commands += 1;
        self.observed.largest_count = self.observed.largest_count.max(largest);
        if encoders.homed() != [true; 3] {
            self.observed.largest_count_unhomed = self.observed.largest_count_unhomed.max(largest);
        }
        self.observed.saturated += u64::from(largest > MOTOR_LIMIT.unsigned_abs());
        // `saturated` has counted the excess; the motors give what they can.
        command.motors = command.motors.map(|count| count.clamp(-MOTOR_LIMIT, MOTOR_LIMIT));
        self.command = command;
        self.commanded = Some(at);
        self.timed_out = false;
        // The report already shows the effect of the homing bit in the packet that it answers.
        let homed = if command.homing { encoders.homed() } else { [false; 3] };
        Answer::of(&Report { encoders: encoders.read(), homed, buttons: self.buttons }.encode())
    }

    /// Returns the torques \[N·m\] at `now`, and counts a switch-off of the motors by the time-out.
    pub(super) fn torques(&mut self, now: Instant, config: &SimulatorConfig) -> Triple {
        if self.is_silent(now, config) && !self.timed_out && self.command.motors != [0; 3] {
            self.timed_out = true;
            self.observed.torque_timeouts += 1;
        }
        self.peek_torques(now, config)
    }

    /// Returns the torques \[N·m\] at `now`, without counting.
    pub(super) fn peek_torques(&self, now: Instant, config: &SimulatorConfig) -> Triple {
        if self.activity != Activity::Running || self.is_silent(now, config) {
            return [0.0; 3];
        }
        self.command.motors.map(|count| -f64::from(count) / config.counts_per_newton_metre)
    }

    /// Returns whether the last packet is older than the torque time-out.
    fn is_silent(&self, now: Instant, config: &SimulatorConfig) -> bool {
        self.commanded.is_none_or(|at| now.saturating_duration_since(at) > config.torque_timeout)
    }

    /// Returns whether the firmware runs and the last packet had the homing bit.
    pub(super) fn homing(&self) -> bool {
        self.activity == Activity::Running && self.command.homing
    }

    pub(super) const fn leds(&self) -> Leds {
        self.command.leds
    }

    pub(super) const fn press(&mut self, buttons: Buttons) {
        self.buttons = buttons;
    }

    pub(super) const fn activity(&self) -> Activity {
        self.activity
    }

    pub(super) const fn observed(&self) -> &Observed {
        &self.observed
    }
}
