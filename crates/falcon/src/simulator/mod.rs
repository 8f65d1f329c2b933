//! Simulated Falcon: the bytes of the real device, a mass in a hand, and faults on demand.
//!
//! ```text
//!   host ── bytes ──► chip ──► boot loader / firmware ──► motors ──► mass, friction, end stops ◄── hand
//!        ◄── packets, latency timer ──┘        ▲                                │
//!                                              └── encoders, index, buttons ◄───┘
//! ```
//!
//! [`Simulator`] has no clock: time is an argument. [`SimulatedTransport`] adds a virtual clock or the machine's clock, and connects a driver. Each unknown
//! property of the device is a parameter of [`SimulatorConfig`].

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

use cohaptic_device::Dice;
use cohaptic_units::Instant;

use crate::ftdi::{BAUD_HANDSHAKE, BAUD_RUNNING, DTR_HIGH, DTR_LOW, PURGE_RX, PURGE_TX};
use crate::kinematics::Triple;
use crate::protocol::{Buttons, Leds};
use crate::transport::Request;
use chip::Chip;
use encoders::Encoders;
use mechanics::Mechanics;
use program::Program;

/// A device, its chip and the hand on its grip.
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
    /// Returns a device that was just switched on, in the hand `hand`.
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

    /// Advances the simulation to the time `to`. No effect if `to` has passed.
    pub fn advance(&mut self, to: Instant) {
        while let Some((at, byte)) = self.chip.next_for_device(to) {
            // Only a byte with an answer needs the grip at its own time; all other bytes leave the mechanics for later.
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

    /// Moves the grip and the encoders to the time `to`.
    fn move_until(&mut self, to: Instant) {
        let homing = self.program.homing();
        while let Some(step) = self.mechanics.next_step(to) {
            // Torques are computed at each step, because the torque time-out may end within the span.
            let torques = if self.plugged { self.program.torques(self.mechanics.at(), &self.config) } else { [0.0; 3] };
            self.mechanics.step(step, torques, self.hand.as_mut());
            self.encoders.turn(self.mechanics.counts(), homing);
        }
    }

    /// Delivers a byte to the device, and the answer of the device to the chip.
    fn hear(&mut self, at: Instant, byte: u8) {
        let Some(byte) = faults::pass(&mut self.dice, byte, self.faults.drop_to_device, self.faults.garble_to_device) else { return };
        let was_homing = self.program.homing();
        let answer = self.program.hear(at, byte, self.chip.divisor(), self.dtr, &self.config, &self.faults, &self.encoders);
        // The firmware forgets the homing at the packet that clears the homing bit.
        if was_homing && !self.program.homing() {
            self.encoders.forget();
        }
        if self.faults.mute {
            return;
        }
        for byte in answer.bytes() {
            if self.dice.happens(self.faults.insert_to_host) {
                // An inserted byte precedes the real one, and both are sent.
                let strange = self.dice.byte();
                self.chip.send_to_host(at, strange);
            }
            if let Some(byte) = faults::pass(&mut self.dice, *byte, self.faults.drop_to_host, self.faults.garble_to_host) {
                // The answer leaves at the arrival of the last byte of the packet.
                self.chip.send_to_host(at, byte);
            }
        }
    }

    /// Makes a control transfer at the present time.
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
                    // A rising edge of DTR at the speed of the greeting wakes the boot loader.
                    if !self.dtr && self.chip.divisor() == BAUD_HANDSHAKE {
                        self.program.wake();
                        self.encoders.forget();
                    }
                    self.dtr = true;
                }
                // RTS is not connected in the device.
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

    /// Sends bytes from the host at the present time.
    pub fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.chip.send_to_device(self.now, *byte);
        }
    }

    /// Returns the time of the next packet to the host, if no more bytes come from the device until then. At the end of the latency timer the packet may have
    /// no payload.
    #[must_use]
    pub fn next_packet(&self) -> Instant {
        self.chip.next_packet().max(self.now)
    }

    /// Returns the time at which the device receives the next byte; `None` without bytes on the way. The answer of the device may lead to an earlier packet.
    #[must_use]
    pub(crate) fn next_heard(&self) -> Option<Instant> {
        self.chip.next_heard()
    }

    /// Writes the packet that is due at the present time into `into`, as on USB: two status bytes, then payload. Returns its length \[bytes\], or 0 if no
    /// packet is due.
    pub fn read_packet(&mut self, into: &mut [u8; crate::ftdi::PACKET]) -> usize {
        if self.next_packet() > self.now {
            return 0;
        }
        let fragment = if self.dice.happens(self.faults.fragment) { Some(usize::from(self.dice.byte()) % 16) } else { None };
        self.chip.take_packet(self.now, into, fragment)
    }

    /// Unplugs the device: no more packets, and no torque of the motors.
    pub const fn unplug(&mut self) {
        self.plugged = false;
    }

    /// Plugs the device in and switches it on: boot loader, encoders not homed. The grip stays at its position.
    pub fn power_cycle(&mut self) {
        self.plugged = true;
        self.dtr = false;
        self.chip = Chip::new();
        self.program = Program::switched_on(false);
        self.encoders = Encoders::new(self.config.index, self.mechanics.counts(), &mut self.dice);
    }

    /// Presses exactly these buttons.
    pub const fn press(&mut self, buttons: Buttons) {
        self.program.press(buttons);
    }

    /// Sets the faults from now on.
    pub const fn set_faults(&mut self, faults: Faults) {
        self.faults = faults;
    }

    /// Replaces the hand on the grip.
    pub fn set_hand(&mut self, hand: impl Hand + 'static) {
        self.hand = Box::new(hand);
    }

    /// Shifts the counts of one encoder, 0 top, 1 right or 2 left, unnoticed by the device.
    pub fn slip(&mut self, encoder: usize, counts: i16) {
        self.encoders.slip(encoder, counts);
    }

    /// Ends the homing of one encoder, 0 top, 1 right or 2 left, which the device then reports.
    pub const fn lose_homing(&mut self, encoder: usize) {
        self.encoders.lose(encoder);
    }

    /// Returns the present time.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Returns whether the device is plugged in.
    #[must_use]
    pub(crate) const fn is_plugged(&self) -> bool {
        self.plugged
    }

    /// Returns the true position of the grip, in the frame of the device \[m\].
    #[must_use]
    pub const fn position(&self) -> Triple {
        self.mechanics.position()
    }

    /// Returns the true velocity of the grip \[m/s\].
    #[must_use]
    pub const fn velocity(&self) -> Triple {
        self.mechanics.velocity()
    }

    /// Returns the present force of the motors on the grip \[N\].
    #[must_use]
    pub fn motor_force(&self) -> Triple {
        if self.plugged { self.mechanics.force_of(self.program.peek_torques(self.now, &self.config)) } else { [0.0; 3] }
    }

    /// Returns which encoders are homed: top, right, left.
    #[must_use]
    pub const fn homed(&self) -> [bool; 3] {
        self.encoders.homed()
    }

    /// Returns the lights of the last packet.
    #[must_use]
    pub const fn leds(&self) -> Leds {
        self.program.leds()
    }

    /// Returns the activity of the processor.
    #[must_use]
    pub const fn activity(&self) -> Activity {
        self.program.activity()
    }

    /// Returns the observations of the device on its host so far.
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
