//! Transmission time of a packet, in the kernel's arithmetic.

use crate::netem::{CellSpec, FramingSpec, RateSpec};

/// A rate, and the overhead added to a packet's length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Airtime {
    bytes_per_sec: u64,
    overhead: i32,
    cell: Option<Cell>,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    size: u32,
    overhead: i32,
}

impl Airtime {
    pub(super) fn new(rate: &RateSpec) -> Self {
        let cell = |cell: CellSpec| Cell { size: cell.size.get(), overhead: cell.overhead.unwrap_or(0) };
        let FramingSpec { overhead, cell: cells } = rate.framing.unwrap_or(FramingSpec { overhead: 0, cell: None });
        Self { bytes_per_sec: rate.bytes_per_sec.get(), overhead, cell: cells.map(cell) }
    }

    /// Returns the transmission time ⌊length·10⁹/rate⌋ \[ns\] of a packet of `size` bytes. Sums and products wrap around as in the kernel: an overhead below
    /// −size gives absurd times there too.
    pub(super) fn of(&self, size: u32) -> u64 {
        let mut length = u64::from(size).wrapping_add_signed(i64::from(self.overhead));
        if let Some(cell) = self.cell {
            #[expect(clippy::cast_possible_truncation, reason = "the kernel counts cells in 32 bits")]
            let mut cells = length as u32 / cell.size;
            // The division rounds down, and the last cell of a packet is padded.
            if length > u64::from(cells.wrapping_mul(cell.size)) {
                cells = cells.wrapping_add(1);
            }
            length = u64::from(cells.wrapping_mul(cell.size.wrapping_add_signed(cell.overhead)));
        }
        length.wrapping_mul(1_000_000_000) / self.bytes_per_sec
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::netem::Netem;

    fn airtime(words: &str) -> Airtime {
        Airtime::new(&Netem::parse(words).unwrap().rate.unwrap())
    }

    #[test]
    fn a_packet_takes_its_length_and_the_overhead() {
        assert_eq!(airtime("rate 8mbit").of(1000), 1_000_000);
        assert_eq!(airtime("rate 8mbit -14").of(1014), 1_000_000);
        assert_eq!(airtime("rate 1000000007bps").of(1000), 999, "999.99 ns are cut off");
    }

    #[test]
    fn cells_are_filled_up() {
        // The manual's example of ATM: 50 bytes need two cells of 48 + 5 bytes.
        let atm = airtime("rate 1000bps 0 48 5");
        assert_eq!(atm.of(50), 106_000_000);
        assert_eq!(atm.of(48), 53_000_000);
        assert_eq!(atm.of(0), 0);
    }

    #[test]
    fn more_negative_overhead_than_packet_wraps_around() {
        let wrapped = (u64::MAX - 5).wrapping_add(1).wrapping_mul(1_000_000_000);
        assert_eq!(airtime("rate 1000bps -70").of(65), wrapped / 1000);
    }
}
