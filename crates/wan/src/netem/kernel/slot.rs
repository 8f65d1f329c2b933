//! Slots: the times of possible departures.

use core::num::NonZeroU32;

use super::correlated::distributed;
use super::parameters::{nanos, sigma};
use super::prng::{Prng, Unseeded};
use super::table::Table;
use crate::netem::{SlotGap, SlotSpec};

/// The slots of a qdisc, and the budget of packets and bytes left in the current slot.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    gap: Gap,
    packets: i32,
    bytes: i32,
    /// Opening time of the current slot \[ns\].
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
    /// Makes the slots in their initial state, with the first slot open. Returns `None` if all times of a range are zero: no slots for the kernel.
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
        // The kernel reads a missing budget as the largest budget.
        let count = |said: Option<NonZeroU32>| said.map_or(i32::MAX, |count| i32::try_from(count.get()).unwrap_or(i32::MAX));
        let (packets, bytes) = (count(said.packets), count(said.bytes));
        Some(Self { gap, packets, bytes, next: 0, packets_left: packets, bytes_left: bytes })
    }

    /// Moves on to the next slot, with its gap counted from `now` \[ns\].
    ///
    /// The width of a range is multiplied by 32 random bits in 64 bits. For widths above 2³¹ ns (2.1 s) the product can wrap around, and the slot then lies
    /// in the past, as in the kernel.
    pub(super) fn advance(&mut self, now: i64, prng: &mut Prng, unseeded: &mut Unseeded) {
        let gap = match &self.gap {
            Gap::Range { min, width } => min.wrapping_add(i64::from(unseeded.next_u32()).wrapping_mul(*width) >> 32),
            Gap::Drawn { mean, sigma, table } => distributed(*mean, *sigma, || prng.next_u32(), table.as_ref()),
        };
        self.next = now.saturating_add(gap);
        self.packets_left = self.packets;
        self.bytes_left = self.bytes;
    }

    /// Takes a packet of `size` bytes from the budget of the current slot, and returns whether the budget is used up.
    pub(super) fn spend(&mut self, size: u32) -> bool {
        // A packet larger than the rest of the budget has left all the same, and makes the budget negative.
        self.packets_left = self.packets_left.wrapping_sub(1);
        self.bytes_left = self.bytes_left.wrapping_sub_unsigned(size);
        self.packets_left <= 0 || self.bytes_left <= 0
    }
}
