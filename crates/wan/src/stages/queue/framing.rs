//! Framing: bytes transmitted with a packet beyond the packet's bytes.

use crate::parameters::{Form, Table, required, usual};
use alloc::format;
use alloc::string::String;
use cohaptic_units::Bytes;

/// Framing of packets in transmission. The default adds nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Framing {
    /// Bytes added to every packet, such as 28 for IPv4 and UDP. A negative number is subtracted, down to an empty packet.
    pub overhead: i32,
    /// Cells of a fixed size for packets in transmission. Under `None` packets are sent whole.
    pub cells: Option<Cells>,
}

/// Cells of a fixed size, the last cell of a packet padded. A cell of ATM carries 48 bytes and adds 5.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cells {
    /// Payload of a cell \[byte\], at least 1.
    pub payload: core::num::NonZeroU32,
    /// Overhead of a cell \[byte\].
    pub overhead: u32,
}

impl Framing {
    /// Returns the number of transmitted bytes for a packet of `size`.
    #[must_use]
    pub fn on_the_line(&self, size: Bytes) -> Bytes {
        let packet = size.get().saturating_add_signed(self.overhead.into());
        Bytes::new(match self.cells {
            None => packet,
            Some(Cells { payload, overhead }) => {
                let cell = u64::from(payload.get());
                // The last cell is padded, so a part of a cell costs as much as a full cell.
                packet.div_ceil(cell).saturating_mul(cell + u64::from(overhead))
            }
        })
    }
}

/// Parameters of cells.
pub(crate) static CELLS: Table = Table::of(&[&[
    required("payload", Form::Size, "Bytes of packets that a cell carries").expecting("what a cell carries, a size such as \"48B\""),
    usual("overhead", Form::Size, "\"0B\"", "Bytes of a cell beyond its payload"),
]]);
/// Form of a size that may be negative.
pub(crate) const SIGNED_SIZE: Form = Form::Like(&["28B", "-14B"]);

impl Framing {
    /// Returns the framing in words after a comma, or an empty text if the framing adds nothing.
    pub(crate) fn words(self) -> String {
        let overhead = if self.overhead == 0 { String::new() } else { format!(", {:+} bytes a packet", self.overhead) };
        let cells = self.cells.map_or_else(String::new, |cells| format!(", in cells of {}+{} bytes", cells.payload, cells.overhead));
        overhead + &cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells have 53 bytes. 64 bytes and 28 bytes of overhead fill two cells of 48; 4 more bytes overflow into a third cell.
    #[test]
    fn the_last_cell_is_filled_up() {
        let atm = Framing { overhead: 28, cells: Some(Cells { payload: 48.try_into().unwrap(), overhead: 5 }) };
        assert_eq!([64, 68, 69, 0].map(|size| atm.on_the_line(Bytes::new(size)).get()), [106, 106, 159, 53]);
        let ip = Framing { overhead: -14, cells: None };
        assert_eq!([64, 10].map(|size| ip.on_the_line(Bytes::new(size)).get()), [50, 0]);
    }
}
