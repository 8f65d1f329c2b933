//! What a packet costs on the line beyond its own bytes.

use crate::parameters::{Form, Table, required, usual};
use alloc::format;
use alloc::string::String;
use cohaptic_units::Bytes;

/// How a packet is framed on the line. The default adds nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Framing {
    /// Bytes added to every packet, such as 28 for IPv4 and UDP; taken away if negative, down to nothing.
    pub overhead: i32,
    /// Whether the line carries cells of a fixed size.
    pub cells: Option<Cells>,
}

/// Cells of a fixed size, the last one filled up: 48 bytes and 5 more for ATM.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cells {
    /// What a cell carries \[byte\], at least 1.
    pub payload: core::num::NonZeroU32,
    /// What it adds \[byte\].
    pub overhead: u32,
}

impl Framing {
    /// The bytes that a packet takes on the line.
    #[must_use]
    pub fn on_the_line(&self, size: Bytes) -> Bytes {
        let packet = size.get().saturating_add_signed(self.overhead.into());
        Bytes::new(match self.cells {
            None => packet,
            Some(Cells { payload, overhead }) => {
                let cell = u64::from(payload.get());
                packet.div_ceil(cell).saturating_mul(cell + u64::from(overhead))
            }
        })
    }
}

/// The packets of a link in cells.
pub(crate) static CELLS: Table = Table::of(&[&[
    required("payload", Form::Size, "What a cell carries").expecting("what a cell carries, a size such as \"48B\""),
    usual("overhead", Form::Size, "\"0B\"", "What a cell costs beyond that"),
]]);
/// A size that may be negative.
pub(crate) const SIGNED_SIZE: Form = Form::Like(&["28B", "-14B"]);

impl Framing {
    /// The cost of a packet beyond its size in words, behind a comma; empty if there is none.
    pub(crate) fn words(self) -> String {
        let overhead = if self.overhead == 0 { String::new() } else { format!(", {:+} bytes a packet", self.overhead) };
        let cells = self.cells.map_or_else(String::new, |cells| format!(", in cells of {}+{} bytes", cells.payload, cells.overhead));
        overhead + &cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 53 bytes a cell: 64 bytes and 28 of overhead fill two cells of 48; 4 more begin a third.
    #[test]
    fn the_last_cell_is_filled_up() {
        let atm = Framing { overhead: 28, cells: Some(Cells { payload: 48.try_into().unwrap(), overhead: 5 }) };
        assert_eq!([64, 68, 69, 0].map(|size| atm.on_the_line(Bytes::new(size)).get()), [106, 106, 159, 53]);
        let ip = Framing { overhead: -14, cells: None };
        assert_eq!([64, 10].map(|size| ip.on_the_line(Bytes::new(size)).get()), [50, 0]);
    }
}
