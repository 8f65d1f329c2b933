//! What the host tells the device: motors, lights, and whether to stay homed.

use thiserror::Error;

use super::{PACKET, nibbles};
use crate::safety::MotorCounts;

/// The lights of the logo, in the order of the control bits as existing drivers send them (0x2 green, 0x4 blue, 0x8 red). The order of the colours is
/// not confirmed on hardware.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Leds {
    /// Red: not homed, by habit.
    pub red: bool,
    /// Green: forces are on, by habit.
    pub green: bool,
    /// Blue: homed, forces are off, by habit.
    pub blue: bool,
}

impl Leds {
    /// All dark.
    pub const OFF: Self = Self { red: false, green: false, blue: false };
    /// Red alone.
    pub const RED: Self = Self { red: true, ..Self::OFF };
    /// Green alone.
    pub const GREEN: Self = Self { green: true, ..Self::OFF };
    /// Blue alone.
    pub const BLUE: Self = Self { blue: true, ..Self::OFF };

    const fn bits(self) -> u8 {
        (if self.green { 0x2 } else { 0 }) | (if self.blue { 0x4 } else { 0 }) | (if self.red { 0x8 } else { 0 })
    }

    const fn from_bits(bits: u8) -> Self {
        Self { green: bits & 0x2 != 0, blue: bits & 0x4 != 0, red: bits & 0x8 != 0 }
    }
}

const HOMING: u8 = 0x1;

/// A packet to the device. Its motors are [`MotorCounts`], which only the [force gate](crate::safety::ForceGate) hands out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Command {
    /// What the motors are told.
    pub motors: MotorCounts,
    /// The lights.
    pub leds: Leds,
    /// Must be set in every packet: a device that is told otherwise forgets that it was homed.
    pub homing: bool,
}

impl Command {
    /// Its 16 bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; PACKET] {
        CommandParts { motors: self.motors.get(), leds: self.leds, homing: self.homing }.encode()
    }
}

/// What a device reads from a packet: numbers that nobody vouches for. A simulator needs it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CommandParts {
    /// Counts of the motors top, right, left.
    pub motors: [i16; 3],
    /// The lights.
    pub leds: Leds,
    /// Whether the device is to stay homed.
    pub homing: bool,
}

impl CommandParts {
    pub(crate) fn encode(&self) -> [u8; PACKET] {
        nibbles::packet(self.motors, self.leds.bits() | if self.homing { HOMING } else { 0 })
    }

    /// Reads a packet. The byte before the last carries nothing and is not looked at.
    ///
    /// # Errors
    ///
    /// [`DecodeCommandError`] at the first byte that cannot be there.
    pub fn decode(packet: &[u8; PACKET]) -> Result<Self, DecodeCommandError> {
        let wrong = |at: usize| DecodeCommandError { at, found: packet[at] };
        let (motors, control) = nibbles::contents(packet, nibbles::is_letter).map_err(wrong)?;
        Ok(Self { motors, leds: Leds::from_bits(control), homing: control & HOMING != 0 })
    }
}

/// A byte that cannot stand where it stands in a command.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[error("byte {at} of the command is {found:#04x}, which cannot be there")]
pub struct DecodeCommandError {
    /// Its place in the packet, from 0.
    pub at: usize,
    /// The byte.
    pub found: u8,
}

#[cfg(test)]
mod tests {
    use super::nibbles::BASE;
    use super::*;

    /// Captured from Novint's own library, as listed in libnifalcon's util/translate_packet.py.
    const CAPTURED: [([u8; PACKET], [i16; 3]); 4] = [
        (*b"<PLPPIIAABGPPEA>", [-65, 136, -159]),
        (*b"<JFNPBOJAKLIPEA>", [-679, 2529, -1862]),
        (*b"<AMKAMNKAIELAEA>", [2752, 2780, 2888]),
        (*b"<PPPACEPACMPAEA>", [4095, 3906, 4034]),
    ];

    #[test]
    fn captured_packets_are_read_and_written() {
        let hex: [u8; PACKET] = [0x3c, 0x50, 0x4c, 0x50, 0x50, 0x49, 0x49, 0x41, 0x41, 0x42, 0x47, 0x50, 0x50, 0x45, 0x41, 0x3e];
        assert_eq!(CAPTURED[0].0, hex);
        for (bytes, motors) in CAPTURED {
            let parts = CommandParts { motors, leds: Leds::BLUE, homing: false };
            assert_eq!(CommandParts::decode(&bytes), Ok(parts));
            assert_eq!(parts.encode(), bytes);
        }
    }

    #[test]
    fn the_null_packet() {
        assert_eq!(&Command::default().encode(), b"<AAAAAAAAAAAAAA>");
    }

    #[test]
    fn control_bits_are_those_that_existing_drivers_send() {
        let control = |leds, homing| Command { leds, homing, ..Command::default() }.encode()[13] - BASE;
        assert_eq!(control(Leds::OFF, true), 0x1);
        assert_eq!(control(Leds::GREEN, false), 0x2);
        assert_eq!(control(Leds::BLUE, false), 0x4);
        assert_eq!(control(Leds::RED, false), 0x8);
    }

    #[test]
    fn a_wrong_byte_is_named() {
        let mut packet = Command::default().encode();
        packet[7] = b'Q';
        assert_eq!(CommandParts::decode(&packet), Err(DecodeCommandError { at: 7, found: b'Q' }));
    }
}
