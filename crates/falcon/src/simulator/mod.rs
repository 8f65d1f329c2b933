//! A Falcon that is not there: it speaks the same bytes, moves as a mass in somebody's hand, and fails as asked.
//!
//! ```text
//!   host ── bytes ──► chip ──► boot loader / firmware ──► motors ──► mass, friction, end stops ◄── hand
//!        ◄── packets, latency timer ──┘        ▲                                │
//!                                              └── encoders, index, buttons ◄───┘
//! ```
//!
//! [`Simulator`] knows no clock: time is an argument. [`SimulatedTransport`] gives it one, virtual or that of the machine, and is what a driver is given.
//! Each unknown of the device is a number of [`SimulatorConfig`].

mod chip;
mod config;
mod encoders;
mod faults;
mod hand;
mod mechanics;
mod program;
mod transport;

pub use config::{MechanicsConfig, SimulatorConfig};
pub use faults::Faults;
pub use hand::{Hand, StillHand, Waypoints};
pub use program::{Activity, Observed};
pub use transport::{SharedSimulator, SimulatedTransport};

use core::fmt;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::ftdi::{BAUD_HANDSHAKE, BAUD_RUNNING, DTR_HIGH, DTR_LOW, PURGE_RX, PURGE_TX};
use crate::kinematics::Triple;
use crate::protocol::{Buttons, Leds};
use crate::transport::Request;
use chip::Chip;
use encoders::Encoders;
use faults::Dice;
use mechanics::Mechanics;
use program::Program;

/// The device, its chip and the hand that holds it.
pub struct Simulator {
    config: SimulatorConfig,
    now: Instant,
    plugged: bool,
    dtr: bool,
    chip: Chip,
    program: Program,
    mechanics: Mechanics,
    encoders: Encoders,
    hand: Box<dyn Hand>,
    dice: Dice,
    faults: Faults,
}

impl Simulator {
    /// A device that was just switched on, in somebody's hand.
    #[must_use]
    pub fn new(config: SimulatorConfig, hand: impl Hand + 'static) -> Self {
        let mut dice = Dice::new(config.seed);
        let mechanics = Mechanics::new(config.mechanics, config.position);
        let encoders = Encoders::new(config.index, mechanics.counts(), &mut dice);
        Self {
            now: Instant::ZERO,
            plugged: true,
            dtr: false,
            chip: Chip::new(),
            program: Program::switched_on(config.running),
            mechanics,
            encoders,
            hand: Box::new(hand),
            dice,
            faults: config.faults,
            config,
        }
    }

    /// Lets time pass until `to`; nothing happens if that has passed.
    pub fn advance(&mut self, to: Instant) {
        while let Some((at, byte)) = self.chip.next_for_device(to) {
            // The grip need not be moved to where it is at a byte that nothing follows from.
            if self.program.may_answer(byte) {
                self.move_until(at);
            }
            if self.plugged {
                self.hear(at, byte);
            }
        }
        self.move_until(to);
        self.now = self.now.max(to);
    }

    fn move_until(&mut self, to: Instant) {
        let homing = self.program.homing();
        while let Some(step) = self.mechanics.next_step(to) {
            let torques = if self.plugged { self.program.torques(self.mechanics.at(), &self.config) } else { [0.0; 3] };
            self.mechanics.step(step, torques, self.hand.as_mut());
            self.encoders.turn(self.mechanics.counts(), homing);
        }
    }

    /// A byte reaches the device.
    fn hear(&mut self, at: Instant, byte: u8) {
        let Some(byte) = self.dice.pass(byte, self.faults.drop_to_device, self.faults.garble_to_device) else { return };
        let was_homing = self.program.homing();
        let answer = self.program.hear(at, byte, self.chip.divisor(), self.dtr, &self.config, &self.faults, &self.encoders);
        if was_homing && !self.program.homing() {
            self.encoders.forget();
        }
        if self.faults.mute {
            return;
        }
        for byte in answer.bytes() {
            if self.dice.happens(self.faults.insert_to_host) {
                let strange = self.dice.byte();
                self.chip.send_to_host(at, strange);
            }
            if let Some(byte) = self.dice.pass(*byte, self.faults.drop_to_host, self.faults.garble_to_host) {
                self.chip.send_to_host(at, byte);
            }
        }
    }

    /// A control transfer at the present time.
    pub fn control(&mut self, request: Request, value: u16) {
        match request {
            Request::Reset => match value {
                PURGE_RX => self.chip.purge_to_host(self.now),
                PURGE_TX => self.chip.purge_to_device(),
                _ => self.chip.purge_to_host(self.now),
            },
            Request::ModemControl => match value {
                DTR_LOW => self.dtr = false,
                DTR_HIGH => {
                    if !self.dtr && self.chip.divisor() == BAUD_HANDSHAKE {
                        self.program.wake();
                        self.encoders.forget();
                    }
                    self.dtr = true;
                }
                // RTS, which nothing is connected to.
                _ => {}
            },
            Request::BaudRate => {
                self.chip.set_divisor(value);
                if value == BAUD_RUNNING {
                    self.program.start(&self.config);
                }
            }
            Request::LatencyTimer => self.chip.set_latency(Duration::from_millis(u64::from(value.clamp(1, 255)))),
            Request::FlowControl | Request::DataFormat => {}
        }
    }

    /// Bytes from the host at the present time.
    pub fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.chip.send_to_device(self.now, *byte);
        }
    }

    /// When the chip hands the next packet to the host, if nothing more comes from the device until then. At its latency timer that is a packet without payload.
    #[must_use]
    pub fn next_packet(&self) -> Instant {
        self.chip.next_packet().max(self.now)
    }

    /// When the device will hear the next byte; what it answers may let the chip hand a packet over sooner.
    #[must_use]
    pub fn next_heard(&self) -> Option<Instant> {
        self.chip.next_heard()
    }

    /// The packet that is due at the present time as it is on USB: two status bytes, then payload. Gives its length; 0 if none is due.
    pub fn read_packet(&mut self, into: &mut [u8; crate::ftdi::PACKET]) -> usize {
        if self.next_packet() > self.now {
            return 0;
        }
        let fragment = if self.dice.happens(self.faults.fragment) { Some(usize::from(self.dice.byte()) % 16) } else { None };
        self.chip.take_packet(self.now, into, fragment)
    }

    /// Pulls the plug: nothing comes any more, and the motors are off.
    pub const fn unplug(&mut self) {
        self.plugged = false;
    }

    /// Puts the plug back and switches the device on: boot loader, encoders unhomed. The grip stays where it is.
    pub fn power_cycle(&mut self) {
        self.plugged = true;
        self.dtr = false;
        self.chip = Chip::new();
        self.program = Program::switched_on(false);
        self.encoders = Encoders::new(self.config.index, self.mechanics.counts(), &mut self.dice);
    }

    /// Presses these buttons and lets go of the others.
    pub const fn press(&mut self, buttons: Buttons) {
        self.program.press(buttons);
    }

    /// Fails in these ways from now on.
    pub const fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
    }

    /// Gives the grip into another hand.
    pub fn set_hand(&mut self, hand: impl Hand + 'static) {
        self.hand = Box::new(hand);
    }

    /// Shifts the counts of one encoder, top, right or left, of which the device notices nothing.
    pub fn slip(&mut self, encoder: usize, counts: i16) {
        self.encoders.slip(encoder, counts);
    }

    /// Loses the homing of one encoder, top, right or left, and says so.
    pub const fn lose_homing(&mut self, encoder: usize) {
        self.encoders.lose(encoder);
    }

    /// The present time.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Whether it is plugged in.
    #[must_use]
    pub const fn is_plugged(&self) -> bool {
        self.plugged
    }

    /// Where the grip truly is, in the frame of the device \[m\].
    #[must_use]
    pub const fn position(&self) -> Triple {
        self.mechanics.position()
    }

    /// How fast it truly moves \[m/s\].
    #[must_use]
    pub const fn velocity(&self) -> Triple {
        self.mechanics.velocity()
    }

    /// The force \[N\] of the motors on the grip now.
    #[must_use]
    pub fn motor_force(&self) -> Triple {
        if self.plugged { self.mechanics.force_of(self.program.peek_torques(self.now, &self.config)) } else { [0.0; 3] }
    }

    /// Which encoders are homed.
    #[must_use]
    pub const fn homed(&self) -> [bool; 3] {
        self.encoders.homed()
    }

    /// The lights.
    #[must_use]
    pub const fn leds(&self) -> Leds {
        self.program.leds()
    }

    /// What its processor is at.
    #[must_use]
    pub const fn activity(&self) -> Activity {
        self.program.activity()
    }

    /// What it has seen of the host so far.
    #[must_use]
    pub const fn observed(&self) -> &Observed {
        self.program.observed()
    }
}

impl fmt::Debug for Simulator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Simulator")
            .field("now", &self.now)
            .field("activity", &self.activity())
            .field("position", &self.position())
            .finish_non_exhaustive()
    }
}
