//! Packets from the host to the device: motors, lights, and the homing bit.

use thiserror::Error;

use super::{PACKET, nibbles};
use crate::safety::MotorCounts;

/// Lights of the logo, in the order of the control bits as sent by existing drivers (0x2 green, 0x4 blue, 0x8 red). The order of the colours is not confirmed
/// on hardware.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Leds {
    /// Red. By convention, the device is not homed.
    pub red: bool,
    /// Green. By convention, forces are on.
    pub green: bool,
    /// Blue. By convention, the device is homed and forces are off.
    pub blue: bool,
}

impl Leds {
    /// All lights off.
    pub const OFF: Self = Self { red: false, green: false, blue: false };
    /// The red light alone.
    pub const RED: Self = Self { red: true, ..Self::OFF };
    /// The green light alone.
    pub const GREEN: Self = Self { green: true, ..Self::OFF };
    /// The blue light alone.
    pub const BLUE: Self = Self { blue: true, ..Self::OFF };

    const fn bits(self) -> u8 {
        (if self.green { 0x2 } else { 0 }) | (if self.blue { 0x4 } else { 0 }) | (if self.red { 0x8 } else { 0 })
    }

    const fn from_bits(bits: u8) -> Self {
        Self { green: bits & 0x2 != 0, blue: bits & 0x4 != 0, red: bits & 0x8 != 0 }
    }
}

/// Control bit of [`Command::homing`].
const HOMING: u8 = 0x1;

/// A packet to the device. Its motor counts are [`MotorCounts`], which only the [force gate](crate::safety::ForceGate) makes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Command {
    /// Counts of the motors.
    pub motors: MotorCounts,
    /// Lights of the logo.
    pub leds: Leds,
    /// Homing bit. Must be set in every packet: a packet without it makes the device forget its homing.
    pub homing: bool,
}

impl Command {
    /// Returns the 16 bytes of the packet.
    #[must_use]
    pub fn encode(&self) -> [u8; PACKET] {
        CommandParts { motors: self.motors.get(), leds: self.leds, homing: self.homing }.encode()
    }
}

/// Contents of a packet as read by a device, with motor counts from any source. Used by the simulator.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CommandParts {
    /// Counts of the motors top, right, left.
    pub motors: [i16; 3],
    /// Lights of the logo.
    pub leds: Leds,
    /// Homing bit.
    pub homing: bool,
}

impl CommandParts {
    pub(crate) fn encode(&self) -> [u8; PACKET] {
        nibbles::packet(self.motors, self.leds.bits() | if self.homing { HOMING } else { 0 })
    }

    /// Reads a packet. The byte before the last carries no data and is ignored.
    ///
    /// # Errors
    ///
    /// [`DecodeCommandError`] with the first byte that is not allowed at its place.
    pub fn decode(packet: &[u8; PACKET]) -> Result<Self, DecodeCommandError> {
        let wrong = |at: usize| DecodeCommandError { at, found: packet[at] };
        let (motors, control) = nibbles::contents(packet, nibbles::is_letter).map_err(wrong)?;
        Ok(Self { motors, leds: Leds::from_bits(control), homing: control & HOMING != 0 })
    }
}

/// Error of a byte that is not allowed at its place in a command.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[error("byte {at} of the command is {found:#04x}, which cannot be there")]
pub struct DecodeCommandError {
    /// Index of the byte in the packet, from 0.
    pub at: usize,
    /// Value of the byte.
    pub found: u8,
}

#[cfg(test)]
mod tests {
    use super::nibbles::BASE;
    use super::*;

    /// Packets captured from Novint's own library, as listed in libnifalcon's util/translate_packet.py.
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
