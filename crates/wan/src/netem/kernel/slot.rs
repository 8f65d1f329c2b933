//! Slots: when packets may leave.

use core::num::NonZeroU32;

use super::correlated::distributed;
use super::parameters::{nanos, sigma};
use super::prng::{Prng, Unseeded};
use super::table::Table;
use crate::netem::{SlotGap, SlotSpec};

/// The slots of a qdisc, and the packets and bytes that the present one still takes.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    gap: Gap,
    packets: i32,
    bytes: i32,
    /// When the present slot opens, or opened \[ns\].
    pub(super) next: i64,
    packets_left: i32,
    bytes_left: i32,
}

#[derive(Clone, Debug)]
enum Gap {
    Range { min: i64, width: i64 },
    Drawn { mean: i64, sigma: i32, table: Option<Table> },
}

impl Slots {
    /// The slots as they begin: the first is open. `None` if all their times are zero, which is no slots to the kernel.
    pub(super) fn new(said: &SlotSpec, table: Option<Table>) -> Option<Self> {
        let gap = match &said.gap {
            SlotGap::Range { min, max } => {
                let longest = nanos(max.unwrap_or(*min));
                if longest == 0 {
                    return None;
                }
                Gap::Range { min: nanos(*min), width: longest - nanos(*min) }
            }
            SlotGap::Drawn { delay, jitter, .. } => Gap::Drawn { mean: nanos(*delay), sigma: sigma(nanos(*jitter)), table },
        };
        let count = |said: Option<NonZeroU32>| said.map_or(i32::MAX, |count| i32::try_from(count.get()).unwrap_or(i32::MAX));
        let (packets, bytes) = (count(said.packets), count(said.bytes));
        Some(Self { gap, packets, bytes, next: 0, packets_left: packets, bytes_left: bytes })
    }

    /// The next slot, counted from `now`.
    ///
    /// The width of a range is multiplied by 32 bits in 64: above 2³¹ ns (2.1 s) the product can wrap around, and the slot lie in the past.
    pub(super) fn advance(&mut self, now: i64, prng: &mut Prng, unseeded: &mut Unseeded) {
        let gap = match &self.gap {
            Gap::Range { min, width } => min.wrapping_add(i64::from(unseeded.next_u32()).wrapping_mul(*width) >> 32),
            Gap::Drawn { mean, sigma, table } => distributed(*mean, *sigma, || prng.next_u32(), table.as_ref()),
        };
        self.next = now.saturating_add(gap);
        self.packets_left = self.packets;
        self.bytes_left = self.bytes;
    }

    /// Takes a packet of `size` bytes from the budget; says whether nothing is left of it.
    pub(super) fn spend(&mut self, size: u32) -> bool {
        self.packets_left = self.packets_left.wrapping_sub(1);
        self.bytes_left = self.bytes_left.wrapping_sub_unsigned(size);
        self.packets_left <= 0 || self.bytes_left <= 0
    }
}
