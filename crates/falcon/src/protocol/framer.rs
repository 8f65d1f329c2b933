//! Search for packets in a stream of bytes with lost, added and changed bytes.

use super::report::is_status;
use super::{CommandParts, END, PACKET, Report, START, nibbles};

/// A kind of packet that a [`Framer`] looks for.
pub trait Frame: Sized {
    /// Returns whether the byte can be the status or control byte at index 13.
    fn is_thirteenth(byte: u8) -> bool;

    /// Reads a packet in which every byte is allowed at its place.
    fn read(packet: &[u8; PACKET]) -> Option<Self>;
}

impl Frame for Report {
    fn is_thirteenth(byte: u8) -> bool {
        is_status(byte)
    }

    fn read(packet: &[u8; PACKET]) -> Option<Self> {
        Self::decode(packet).ok()
    }
}

impl Frame for CommandParts {
    fn is_thirteenth(byte: u8) -> bool {
        nibbles::is_letter(byte)
    }

    fn read(packet: &[u8; PACKET]) -> Option<Self> {
        Self::decode(packet).ok()
    }
}

/// Finds packets in a stream of bytes. The framer holds at most the beginning of one packet in a fixed buffer, and never allocates.
///
/// Every byte is checked at its arrival. At the first byte that is not allowed at its place, the start of the supposed packet is discarded, and the search
/// continues at the next `<` among the held bytes. Within a packet, only the first byte can be `<`, except for the byte of unknown meaning at index 14, which
/// is followed by `>` and so cannot begin a packet. A complete packet is therefore always found, whatever bytes precede it. The protocol has no checksum: a
/// byte changed into another allowed byte is not detected here.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Framer {
    held: [u8; PACKET],
    count: usize,
    garbage: u64,
}

impl Framer {
    /// Returns a framer without held bytes.
    #[must_use]
    pub const fn new() -> Self {
        Self { held: [0; PACKET], count: 0, garbage: 0 }
    }

    /// Takes a byte, and returns the packet that the byte completes.
    pub fn push<F: Frame>(&mut self, byte: u8) -> Option<F> {
        self.held[self.count] = byte;
        self.count += 1;
        if !fits::<F>(self.count - 1, byte) {
            self.realign::<F>();
            return None;
        }
        if self.count < PACKET {
            return None;
        }
        self.count = 0;
        F::read(&self.held)
    }

    /// Returns the number of discarded bytes, which belonged to no complete packet.
    #[must_use]
    pub(crate) const fn garbage(&self) -> u64 {
        self.garbage
    }

    /// Discards bytes from the front until the rest can be the beginning of a packet.
    fn realign<F: Frame>(&mut self) {
        loop {
            // The byte at index 0 did not begin a packet, so the search starts at index 1.
            let next = (1..self.count).find(|at| self.held[*at] == START).unwrap_or(self.count);
            self.held.copy_within(next..self.count, 0);
            self.count -= next;
            self.garbage += next as u64;
            if (0..self.count).all(|at| fits::<F>(at, self.held[at])) {
                return;
            }
        }
    }
}

impl Default for Framer {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns whether a byte is allowed at the index `at` of a packet.
fn fits<F: Frame>(at: usize, byte: u8) -> bool {
    match at {
        0 => byte == START,
        1..=12 => nibbles::is_letter(byte),
        13 => F::is_thirteenth(byte),
        14 => true,
        _ => byte == END,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Buttons;
    use cohaptic_tests_common::properties;
    use proptest::collection::vec;
    use proptest::prelude::*;

    fn all(framer: &mut Framer, bytes: &[u8]) -> Vec<Report> {
        bytes.iter().filter_map(|byte| framer.push(*byte)).collect()
    }

    fn reports() -> impl Strategy<Value = Report> {
        (any::<[i16; 3]>(), any::<[bool; 3]>(), any::<u8>()).prop_map(|(encoders, homed, buttons)| Report {
            encoders,
            homed,
            buttons: Buttons::from_bits(buttons),
        })
    }

    /// Returns garbage that resembles packets more often than random bytes do.
    fn garbage() -> impl Strategy<Value = Vec<u8>> {
        vec(prop_oneof![Just(START), Just(END), b'A'..=b'P', any::<u8>()], 0..80)
    }

    #[test]
    fn a_cut_packet_costs_itself_alone() {
        let report = Report { encoders: [1, -2, 3], homed: [true; 3], buttons: Buttons::NONE };
        for cut in 0..PACKET {
            let mut framer = Framer::new();
            let bytes = [&report.encode()[..cut], &report.encode()[..], &report.encode()[..]].concat();
            assert_eq!(all(&mut framer, &bytes), [report, report], "cut at {cut}");
            assert_eq!(framer.garbage(), cut as u64);
        }
    }

    #[test]
    fn the_unknown_byte_may_be_anything() {
        for byte in 0..=u8::MAX {
            let mut packet = Report::default().encode();
            // Also `<` and `>`: the framer must not take this byte for a border of a packet.
            packet[14] = byte;
            let mut framer = Framer::new();
            assert_eq!(all(&mut framer, &[packet, packet].concat()), [Report::default(); 2], "{byte:#x}");
        }
    }

    properties! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn a_report_is_found_after_any_garbage(garbage in garbage(), report in reports()) {
            let mut framer = Framer::new();
            let before = all(&mut framer, &garbage).len();
            let found = all(&mut framer, &report.encode());
            prop_assert_eq!(found, [report]);
            // Every byte is part of a packet, held or counted as garbage.
            prop_assert_eq!(framer.count, 0);
            prop_assert_eq!(framer.garbage() + (before * PACKET) as u64, garbage.len() as u64);
        }

        #[test]
        fn any_bytes_are_taken(bytes in vec(any::<u8>(), 0..400)) {
            let mut framer = Framer::new();
            let found = all(&mut framer, &bytes).len();
            prop_assert_eq!(framer.garbage() + (found * PACKET + framer.count) as u64, bytes.len() as u64);
            let mut device = Framer::new();
            for byte in &bytes {
                let _: Option<CommandParts> = device.push(*byte);
            }
        }

        #[test]
        fn any_packet_is_read_or_refused(packet in any::<[u8; PACKET]>()) {
            if let Ok(report) = Report::decode(&packet) {
                prop_assert_eq!(&report.encode()[..14], &packet[..14]);
            }
            if let Ok(parts) = CommandParts::decode(&packet) {
                prop_assert_eq!(&parts.encode()[..14], &packet[..14]);
            }
        }
    }
}
