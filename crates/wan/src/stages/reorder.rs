//! Reordering: packets put out of order on purpose.

use alloc::collections::VecDeque;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use cohaptic_units::print::Span;
use core::num::NonZeroU32;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::laws::chance::CHANCES;
use crate::laws::chance::{Chance, ChanceStage};
use crate::packet::Carried;
use crate::parameters::{Form, Key, MOST_OF_32_BITS, Table, optional, usual};

/// Choice of packets for a displacement in the order, and the kind of displacement.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reorder {
    /// Chance of a packet's displacement.
    pub packets: Chance,
    /// Displacement of a chosen packet.
    pub how: Displacement,
}

/// Displacement of a packet from its place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Displacement {
    /// The packet jumps ahead: the packet has no delay and overtakes the packets under way (netem's reordering). A packet may jump only if at least `gap` − 1
    /// packets came since the last jump; with 1, any packet may.
    Jump {
        /// Least distance from a jump to the next jump, in packets.
        gap: NonZeroU32,
    },
    /// The packet is held until a number of later packets has passed. With 1, two neighbours change places. If too few packets pass, the packet continues
    /// after `at_most`.
    Behind {
        /// Number of packets to pass the held packet.
        packets: NonZeroU32,
        /// Longest time of the hold.
        at_most: Duration,
    },
    /// The packet takes a time in addition to its delay.
    Later {
        /// Additional time.
        by: Duration,
    },
}

/// Decision of the stage about a packet.
#[derive(Debug)]
pub(crate) enum Placed<T> {
    /// The packet continues with its delay.
    InOrder(Carried<T>),
    /// The packet continues without delay.
    Jumps(Carried<T>),
    /// The packet continues with its delay and the additional time.
    Late(Carried<T>, Duration),
    /// The stage holds the packet.
    Held,
}

/// Stage with its held packets.
#[derive(Clone, Debug)]
pub(crate) struct ReorderStage<T> {
    config: Option<Reorder>,
    packets: Option<ChanceStage>,
    /// Number of packets since the last displaced packet.
    since_jump: u32,
    /// Held packets in the order of their offers. After a live change their deadlines may be in a different order.
    held: VecDeque<Held<T>>,
}

#[derive(Clone, Debug)]
struct Held<T> {
    packet: Carried<T>,
    /// Number of packets still to pass; at least 1 during the hold.
    passes: u32,
    deadline: Instant,
}

impl<T> ReorderStage<T> {
    pub(crate) const fn new() -> Self {
        Self { config: None, packets: None, since_jump: 0, held: VecDeque::new() }
    }

    /// Sets the configuration of later packets. Held packets stay, and a correlated choice continues from the previous packet.
    pub(crate) fn configure(&mut self, config: Option<Reorder>) {
        self.packets = config.and_then(|config| ChanceStage::reconfigured(self.packets, config.packets));
        self.config = config;
    }

    /// Places a packet. Held packets waiting for its passage are appended to `released`, and follow the packet.
    pub(crate) fn place(&mut self, now: Instant, packet: Carried<T>, word: impl FnOnce() -> u64, released: &mut Vec<Carried<T>>) -> Placed<T> {
        let Some(config) = self.config else {
            self.pass(released);
            return Placed::InOrder(packet);
        };
        // As in netem, a packet that may not jump draws no number, and the correlation is between packets that may jump.
        let may = match config.how {
            Displacement::Jump { gap } => self.since_jump >= gap.get() - 1,
            Displacement::Behind { .. } | Displacement::Later { .. } => true,
        };
        // `&&` is evaluated from the left: the word is drawn only for a packet that may leave its place.
        let leaves = may && self.packets.as_mut().is_some_and(|packets| packets.happens(word()));
        // A held packet has not passed anything yet, so the function returns before counting it as passing.
        self.since_jump = if leaves { 0 } else { self.since_jump.saturating_add(1) };
        if leaves && let Displacement::Behind { packets, at_most } = config.how {
            self.held.push_back(Held { packet, passes: packets.get(), deadline: now.saturating_add(at_most) });
            return Placed::Held;
        }
        self.pass(released);
        match config.how {
            _ if !leaves => Placed::InOrder(packet),
            Displacement::Jump { .. } => Placed::Jumps(packet),
            Displacement::Later { by } => Placed::Late(packet, by),
            Displacement::Behind { .. } => Placed::InOrder(packet),
        }
    }

    /// Returns whether no packet leaves its place, because the stage has no configuration.
    pub(crate) const fn is_idle(&self) -> bool {
        self.config.is_none()
    }

    /// Returns the earliest deadline of a held packet, or `None` if no packet is held.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        // The function is called at every packet, and the stage is nearly always empty.
        if self.held.is_empty() { None } else { self.held.iter().map(|held| held.deadline).min() }
    }

    /// Appends the packets with a due deadline to `released`.
    pub(crate) fn release(&mut self, now: Instant, released: &mut VecDeque<Carried<T>>) {
        self.take(|held| held.deadline <= now, |packet| released.push_back(packet));
    }

    /// Returns all held packets in order.
    pub(crate) fn dismantle(&mut self) -> impl Iterator<Item = Carried<T>> + use<T> {
        core::mem::take(&mut self.held).into_iter().map(|held| held.packet)
    }

    /// Counts a packet after its passage of all held packets, and releases held packets with enough passed packets.
    fn pass(&mut self, released: &mut Vec<Carried<T>>) {
        if self.held.is_empty() {
            return;
        }
        for held in &mut self.held {
            // At least 1 here: a count of 0 is taken out below, and a packet is held with at least 1.
            held.passes -= 1;
        }
        self.take(|held| held.passes == 0, |packet| released.push(packet));
    }

    /// Moves the selected held packets to `to`, in order.
    fn take(&mut self, which: impl Fn(&Held<T>) -> bool, mut to: impl FnMut(Carried<T>)) {
        let mut place = 0;
        while place < self.held.len() {
            if which(&self.held[place]) {
                if let Some(held) = self.held.remove(place) {
                    to(held.packet);
                }
            } else {
                place += 1;
            }
        }
    }
}

/// Parameter of reordering on purpose.
pub(crate) const KEYS: [Key; 1] =
    [usual("reorder", REORDER, "0", "Probability that a packet jumps ahead of those before it, or a table that says how packets leave their place")];
const REORDER: Form = Form::AnyOf(&[Form::Probability, Form::Table(&REORDER_TABLE)]);
static REORDER_TABLE: Table = Table::of(&[
    &CHANCES,
    &[
        usual("gap", Form::Integer(1, MOST_OF_32_BITS), "1", "Number of packets of which at most one jumps ahead")
            .expecting("a number of packets of at least 1"),
        optional("behind", Form::Integer(1, MOST_OF_32_BITS), "Number of packets that pass such a packet before it goes on; needs at-most")
            .expecting("a number of packets of at least 1"),
        optional("at-most", Form::Duration, "Longest time for which a packet is held behind others"),
        optional("later", Form::Duration, "Additional delay of such a packet"),
    ],
]);

impl Reorder {
    /// Returns the displacement in words.
    pub(crate) fn words(&self) -> String {
        let packets = self.packets.words();
        match self.how {
            Displacement::Jump { gap } if gap.get() == 1 => format!("{packets} jump ahead"),
            Displacement::Jump { gap } => format!("{packets} of every {gap}th packet jump ahead"),
            Displacement::Behind { packets: count, at_most } => format!("{packets} held until {count} have passed, at most {}", Span(at_most)),
            Displacement::Later { by } => format!("{packets} later by {}", Span(by)),
        }
    }
}
