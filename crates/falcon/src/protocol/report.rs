//! Packets from the device to the host: encoders, homed bits, buttons.

use thiserror::Error;

use super::PACKET;
use super::nibbles::{self, BASE};

/// Buttons of the standard grip, as seen from the front.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Buttons(u8);

impl Buttons {
    /// No button.
    pub const NONE: Self = Self(0);
    /// The far right button: plus.
    pub const PLUS: Self = Self(0x1);
    /// The front button: lightning.
    pub const FORWARD: Self = Self(0x2);
    /// The centre button: the logo.
    pub const CENTRE: Self = Self(0x4);
    /// The far left button: minus.
    pub const MINUS: Self = Self(0x8);

    /// Returns the buttons of the low four bits. Higher bits are ignored.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & 0xF)
    }

    /// Returns a bit for each pressed button.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Returns whether all buttons of `other` are pressed.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns the union of both sets of buttons.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A packet from the device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// Counts of the encoders top, right, left. A count has no meaning until its encoder is homed.
    pub encoders: [i16; 3],
    /// `true` if the encoder has passed its index since power-on, for each encoder.
    pub homed: [bool; 3],
    /// Pressed buttons.
    pub buttons: Buttons,
}

impl Report {
    /// Returns whether all encoders are homed.
    #[must_use]
    pub const fn all_homed(&self) -> bool {
        self.homed[0] && self.homed[1] && self.homed[2]
    }

    /// Returns the 16 bytes as sent by a device. The byte of unknown meaning is a nibble of zero.
    #[must_use]
    pub fn encode(&self) -> [u8; PACKET] {
        // The first encoder has the lowest homed bit.
        let homed = self.homed.iter().rev().fold(0, |bits, homed| bits << 1 | u8::from(*homed));
        nibbles::packet(self.encoders, self.buttons.bits() | homed << 4)
    }

    /// Reads a packet. The byte before the last is ignored, because its meaning is unknown.
    ///
    /// # Errors
    ///
    /// [`DecodeReportError`] with the first byte that is not allowed at its place.
    pub fn decode(packet: &[u8; PACKET]) -> Result<Self, DecodeReportError> {
        let wrong = |at: usize| DecodeReportError { at, found: packet[at] };
        let (encoders, status) = nibbles::contents(packet, is_status).map_err(wrong)?;
        Ok(Self { encoders, homed: [status & 0x10 != 0, status & 0x20 != 0, status & 0x40 != 0], buttons: Buttons::from_bits(status) })
    }
}

/// Returns whether a byte can be the status byte: four buttons and three homed bits, so at most 0x41 + 0x7F.
pub(super) const fn is_status(byte: u8) -> bool {
    byte >= BASE && byte <= BASE + 0x7F
}

/// Error of a byte that is not allowed at its place in a report.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[error("byte {at} of the report is {found:#04x}, which cannot be there")]
pub struct DecodeReportError {
    /// Index of the byte in the packet, from 0.
    pub at: usize,
    /// Value of the byte.
    pub found: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_status_byte_is_read_and_written() {
        for status in 0..0x80_u8 {
            let mut packet = *b"<JFKPAAAAAAAAAA>";
            packet[13] = BASE + status;
            let report = Report::decode(&packet).unwrap();
            assert_eq!(report.encoders, [-1447, 0, 0]);
            assert_eq!(report.homed, [4, 5, 6].map(|bit| status >> bit & 1 == 1));
            assert_eq!(report.buttons.bits(), status & 0xF);
            assert_eq!(report.encode(), packet);
        }
    }

    #[test]
    fn nothing_is_homed_before_the_device_says_so() {
        assert!(!Report::default().all_homed());
    }

    #[test]
    fn buttons_have_names() {
        let pressed = Buttons::PLUS.with(Buttons::MINUS);
        assert_eq!(pressed.bits(), 0x9);
        assert!(pressed.contains(Buttons::MINUS) && !pressed.contains(Buttons::CENTRE));
    }
}
