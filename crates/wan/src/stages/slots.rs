//! Slots: a line that sends only at some instants, and then all gathered packets (Wi-Fi aggregation, a modem's grants; netem's `slot`).

use alloc::collections::VecDeque;
use alloc::format;
use alloc::string::String;
use alloc::string::ToString as _;
use alloc::vec::Vec;
use cohaptic_units::print::{Counted, Span};
use core::fmt;
use core::num::NonZeroU64;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant};

use crate::packet::Carried;
use crate::parameters::{Form, Key, MOST, NONE, Table, optional, usual};
use crate::random::{Purpose, Stream, unit};
use crate::stages::delay::JITTER;
use crate::stages::delay::{Delay, DelayStage};

/// Instants of opening slots, and the number of packets and bytes for a slot.
///
/// A packet offered before the next slot waits for this slot. A packet without a coming slot opens the next slot, a gap after its offer. When a slot's packets
/// or bytes are used up, the next slot opens a gap later.
#[derive(Clone, PartialEq, Debug)]
pub struct Slots {
    gap: SlotGap,
    /// Number of packets for a slot. `None` sets no limit.
    pub packets: Option<NonZeroU64>,
    /// Number of bytes for a slot, including the whole packet at the limit. `None` sets no limit.
    pub bytes: Option<NonZeroU64>,
}

/// Law of the gap from slot to slot.
#[derive(Clone, PartialEq, Debug)]
pub enum SlotGap {
    /// Uniform gap between two spans.
    Between {
        /// Shortest gap.
        min: Duration,
        /// Longest gap, not below the shortest gap.
        max: Duration,
    },
    /// Gap drawn from the law of a delay. A correlation is the correlation of a gap with the next gap.
    Drawn(Delay),
}

/// Error: the longest gap is shorter than the shortest gap.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SlotsError {
    /// Shortest gap asked for.
    pub min: Duration,
    /// Longest gap asked for.
    pub max: Duration,
}

impl fmt::Display for SlotsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { min, max } = self;
        write!(f, "gaps between slots of {} to {}: expected the longest not below the shortest", Span(*min), Span(*max))
    }
}

impl core::error::Error for SlotsError {}

impl Slots {
    /// Returns slots with uniform gaps between two spans, and without a limit on packets and bytes.
    ///
    /// # Errors
    ///
    /// [`SlotsError`] if `max` is below `min`.
    pub fn new(min: Duration, max: Duration) -> Result<Self, SlotsError> {
        if max < min {
            return Err(SlotsError { min, max });
        }
        Ok(Self { gap: SlotGap::Between { min, max }, packets: None, bytes: None })
    }

    /// Returns slots with gaps from the law of a delay, and without a limit on packets and bytes.
    #[must_use]
    pub const fn drawn(gap: Delay) -> Self {
        Self { gap: SlotGap::Drawn(gap), packets: None, bytes: None }
    }

    /// Returns the law of the gap from slot to slot.
    #[must_use]
    pub const fn gap(&self) -> &SlotGap {
        &self.gap
    }
}

/// Stage with the packets waiting for a slot.
#[derive(Clone, Debug)]
pub(crate) struct SlotStage<T> {
    config: Slots,
    /// Stage for the gaps of [`SlotGap::Drawn`]. `None` for uniform gaps.
    law: Option<DelayStage>,
    waiting: VecDeque<Carried<T>>,
    /// Instant of the next slot, or of the last slot if no slot is coming.
    opens: Instant,
    /// Number of slots opened so far: the address of the next slot's random numbers.
    count: u64,
    packets_left: u64,
    bytes_left: u64,
}

impl<T> SlotStage<T> {
    pub(crate) fn new(config: Slots) -> Self {
        let law = match &config.gap {
            SlotGap::Between { .. } => None,
            SlotGap::Drawn(delay) => Some(DelayStage::new(delay)),
        };
        Self { config, law, waiting: VecDeque::new(), opens: Instant::ZERO, count: 0, packets_left: 0, bytes_left: 0 }
    }

    /// Sets the configuration from the next slot on. A chain of correlated gaps continues from its present state.
    pub(crate) fn reconfigure(&mut self, config: Slots) {
        // The coming slot keeps its instant; only later gaps follow the new law.
        self.law = match (self.law.take(), &config.gap) {
            (_, SlotGap::Between { .. }) => None,
            (None, SlotGap::Drawn(delay)) => Some(DelayStage::new(delay)),
            (Some(mut law), SlotGap::Drawn(delay)) => {
                law.reconfigure(delay);
                Some(law)
            }
        };
        self.config = config;
    }

    /// Takes a packet for a slot.
    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, draws: Stream) {
        // A waiting packet implies a coming slot. Without a waiting packet, the last slot may lie in the past or be used up.
        if self.waiting.is_empty() && (self.count == 0 || self.opens < now || self.is_used_up()) {
            self.open_next(now, draws);
        }
        self.waiting.push_back(packet);
    }

    /// Returns the instant of the awaited slot, or `None` if no packet waits.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        (!self.waiting.is_empty()).then_some(self.opens)
    }

    /// Appends the packets of the slot opening `now` to `released`.
    pub(crate) fn release(&mut self, now: Instant, draws: Stream, released: &mut VecDeque<Carried<T>>) {
        while !self.is_used_up() {
            let Some(packet) = self.waiting.pop_front() else { return };
            self.packets_left -= 1;
            // An empty packet counts as a byte.
            self.bytes_left = self.bytes_left.saturating_sub(packet.info.size.get().max(1));
            released.push_back(packet);
        }
        // The slot is used up: waiting packets leave with the next slot.
        self.open_next(now, draws);
    }

    /// Returns all waiting packets in order.
    pub(crate) fn dismantle(self) -> impl Iterator<Item = Carried<T>> {
        self.waiting.into_iter()
    }

    const fn is_used_up(&self) -> bool {
        self.packets_left == 0 || self.bytes_left == 0
    }

    /// Sets the next slot, a drawn gap after `now`.
    fn open_next(&mut self, now: Instant, draws: Stream) {
        let draws = draws.packet(self.count);
        let word = draws.first(Purpose::Slot);
        let gap = match (&self.config.gap, &mut self.law) {
            (SlotGap::Between { min, max }, _) => {
                #[expect(
                    clippy::cast_precision_loss,
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a gap of some milliseconds"
                )]
                let beyond = (unit(word) * (*max - *min).as_nanos() as f64) as u64;
                min.saturating_add(Duration::from_nanos(beyond))
            }
            (SlotGap::Drawn(_), Some(law)) => Duration::from_nanos(law.draw_nanos_for(Purpose::Slot, now, word, || draws)),
            // Cannot occur: `new` and `reconfigure` make a law for every drawn gap.
            (SlotGap::Drawn(delay), None) => delay.mean(),
        };
        self.count += 1;
        self.opens = now.saturating_add(gap);
        // A slot without limits still counts down, from more than a run can send.
        self.packets_left = self.config.packets.map_or(u64::MAX, NonZeroU64::get);
        self.bytes_left = self.config.bytes.map_or(Bytes::new(u64::MAX).get(), NonZeroU64::get);
    }
}

/// Parameter of slots.
pub(crate) const KEYS: [Key; 1] =
    [usual("slots", Form::AnyOf(const { &[Form::Table(&SLOTS), NONE] }), "\"none\"", "Slots in which the line sends; between them packets gather")];
static SLOTS: Table = Table::of(&[&[
    optional("min", Form::Duration, "Shortest time from slot to slot").expecting("the shortest time from slot to slot, a duration such as \"10ms\""),
    optional("max", Form::Duration, "Longest time from slot to slot; min by default"),
    optional("delay", Form::Duration, "Mean time from slot to slot, in place of min and max"),
    optional("jitter", JITTER, "Variation of the time from slot to slot, with delay"),
    optional("packets", Form::Integer(1, MOST), "Largest number of packets that leave in a slot").expecting("a number of packets of at least 1"),
    optional("bytes", Form::Size, "Largest number of bytes that leave in a slot"),
]]);

impl Slots {
    /// Returns the slots in words.
    pub(crate) fn words(&self) -> String {
        let gap = match self.gap() {
            SlotGap::Between { min, max } if min == max => format!("every {}", Span(*min)),
            SlotGap::Between { min, max } => format!("every {} to {}", Span(*min), Span(*max)),
            SlotGap::Drawn(gap) => format!("every {}", gap.words()),
        };
        let packets = self.packets.map(|packets| Counted(packets.get(), "packet").to_string());
        let bytes = self.bytes.map(|bytes| Counted(bytes.get(), "byte").to_string());
        let share: Vec<String> = [packets, bytes].into_iter().flatten().collect();
        format!("slots {gap}{}", if share.is_empty() { String::new() } else { format!(" for {}", share.join(" or ")) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::{Marks, Packet};

    fn run(config: Slots, offers: &[u64]) -> Vec<(u64, u64)> {
        let draws = Stream::new(1, b"slots");
        let mut stage = SlotStage::new(config);
        let mut left = Vec::new();
        let pass = |stage: &mut SlotStage<u64>, until: u64, left: &mut Vec<(u64, u64)>| {
            while let Some(at) = stage.next_at().filter(|at| at.as_nanos() <= until) {
                let mut released = VecDeque::new();
                stage.release(at, draws, &mut released);
                left.extend(released.into_iter().map(|packet| (packet.item, at.as_nanos())));
            }
        };
        for &t in offers {
            pass(&mut stage, t, &mut left);
            let now = Instant::from_nanos(t);
            let packet = Packet::new(0, Bytes::new(40).into(), Marks::default(), t);
            stage.offer(now, packet, draws);
        }
        pass(&mut stage, u64::MAX, &mut left);
        left
    }

    fn every(nanos: u64) -> Slots {
        Slots::new(Duration::from_nanos(nanos), Duration::from_nanos(nanos)).unwrap()
    }

    #[test]
    fn what_gathers_leaves_together() {
        assert_eq!(run(every(10), &[0, 3, 9, 25]), [(0, 10), (3, 10), (9, 10), (25, 35)]);
    }

    #[test]
    fn a_slot_takes_its_share() {
        let two = Slots { packets: NonZeroU64::new(2), ..every(10) };
        assert_eq!(run(two, &[0, 1, 2, 3, 4]), [(0, 10), (1, 10), (2, 20), (3, 20), (4, 30)]);
        // The second packet of 40 bytes exceeds the 41 bytes of the slot and still leaves. The slot is then used up.
        let bytes = Slots { bytes: NonZeroU64::new(41), ..every(10) };
        assert_eq!(run(bytes, &[0, 1, 2]), [(0, 10), (1, 10), (2, 20)]);
    }

    #[test]
    fn gaps_lie_between_the_two_spans() {
        let config = Slots::new(Duration::from_nanos(100), Duration::from_nanos(300)).unwrap();
        let offers: Vec<u64> = (0..2000).map(|n| n * 1000).collect();
        let gaps: Vec<u64> = run(config, &offers).into_iter().map(|(offered, left)| left - offered).collect();
        assert!(gaps.iter().all(|gap| (100..300).contains(gap)));
        // Uniform: mean 200, standard error 57.7/√2000 = 1.29.
        let mean = gaps.iter().sum::<u64>() as f64 / 2000.0;
        assert!((mean - 199.5).abs() < 4.5 * 1.29, "{mean}");
        assert!(Slots::new(Duration::from_nanos(2), Duration::from_nanos(1)).is_err());
    }

    /// Gaps are normal with 400 ± 50 ns. Of 2000 gaps the mean has a standard error of 50/√2000 = 1.12 ns and the deviation one of 50/√4000 = 0.79 ns; the
    /// bound is 4.5 of them.
    #[test]
    fn gaps_have_the_law_of_a_delay() {
        let law = crate::stages::delay::Jitter::new(Duration::from_nanos(50), crate::laws::delay::Distribution::Normal);
        let config = Slots::drawn(Delay::with_jitter(Duration::from_nanos(400), law).unwrap());
        let offers: Vec<u64> = (0..2000).map(|n| n * 1000).collect();
        let gaps: Vec<f64> = run(config, &offers).into_iter().map(|(offered, left)| (left - offered) as f64).collect();
        let mean = gaps.iter().sum::<f64>() / 2000.0;
        let sd = (gaps.iter().map(|gap| (gap - mean).powi(2)).sum::<f64>() / 2000.0).sqrt();
        assert!((mean - 400.0).abs() < 4.5 * 1.12, "{mean}");
        assert!((sd - 50.0).abs() < 4.5 * 0.79, "{sd}");
        assert_eq!(run(Slots::drawn(Delay::constant(Duration::from_nanos(10))), &[0, 3, 9, 25]), [(0, 10), (3, 10), (9, 10), (25, 35)]);
    }
}
