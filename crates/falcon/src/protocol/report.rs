//! What the device answers: encoders, homed bits, buttons.

use thiserror::Error;

use super::PACKET;
use super::nibbles::{self, BASE};

/// The buttons of the standard grip, seen from the front.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Buttons(u8);

impl Buttons {
    /// None is pressed.
    pub const NONE: Self = Self(0);
    /// Far right: plus.
    pub const PLUS: Self = Self(0x1);
    /// Forward: lightning.
    pub const FORWARD: Self = Self(0x2);
    /// Centre: the logo.
    pub const CENTRE: Self = Self(0x4);
    /// Far left: minus.
    pub const MINUS: Self = Self(0x8);

    /// The buttons of the low four bits; higher ones are not looked at.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & 0xF)
    }

    /// A bit for each button that is pressed.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether all buttons of `other` are pressed.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// These and those.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// A packet from the device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// Counts of the encoders top, right, left. Without meaning until the encoder is homed.
    pub encoders: [i16; 3],
    /// Which encoders have passed their index since power-on.
    pub homed: [bool; 3],
    /// Which buttons are pressed.
    pub buttons: Buttons,
}

impl Report {
    /// Whether all encoders are homed.
    #[must_use]
    pub const fn all_homed(&self) -> bool {
        self.homed[0] && self.homed[1] && self.homed[2]
    }

    /// Its 16 bytes, as the device would send them. The byte of which nobody knows the meaning is that of zero.
    #[must_use]
    pub fn encode(&self) -> [u8; PACKET] {
        let homed = self.homed.iter().rev().fold(0, |bits, homed| bits << 1 | u8::from(*homed));
        nibbles::packet(self.encoders, self.buttons.bits() | homed << 4)
    }

    /// Reads a packet. The byte before the last is not looked at: its meaning is unknown.
    ///
    /// # Errors
    ///
    /// [`DecodeReportError`] at the first byte that cannot be there.
    pub fn decode(packet: &[u8; PACKET]) -> Result<Self, DecodeReportError> {
        let wrong = |at: usize| DecodeReportError { at, found: packet[at] };
        let (encoders, status) = nibbles::contents(packet, is_status).map_err(wrong)?;
        Ok(Self { encoders, homed: [status & 0x10 != 0, status & 0x20 != 0, status & 0x40 != 0], buttons: Buttons::from_bits(status) })
    }
}

/// Whether a byte can be the status: four buttons and three homed bits, so up to 0x41 + 0x7F.
pub(super) const fn is_status(byte: u8) -> bool {
    byte >= BASE && byte <= BASE + 0x7F
}

/// A byte that cannot stand where it stands in a report.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
#[error("byte {at} of the report is {found:#04x}, which cannot be there")]
pub struct DecodeReportError {
    /// Its place in the packet, from 0.
    pub at: usize,
    /// The byte.
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
