//! Packets that are put out of order on purpose.

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

/// Which packets leave their place, and how.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reorder {
    /// Which packets.
    pub packets: Chance,
    /// What happens to them.
    pub how: Displacement,
}

/// How a packet leaves its place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Displacement {
    /// It jumps ahead: it takes no delay at all and overtakes the packets under way (netem's reordering). Only every `gap`-th packet may; 1: any.
    Jump {
        /// How many packets there are from one that may jump to the next.
        gap: NonZeroU32,
    },
    /// It is held back until this number of later packets has passed it; 1 swaps two neighbours. If they do not come, it goes on after `at_most`.
    Behind {
        /// How many pass it.
        packets: NonZeroU32,
        /// How long it is held at most.
        at_most: Duration,
    },
    /// The time that it takes in addition to its delay.
    Later {
        /// How much.
        by: Duration,
    },
}

/// What the stage says about a packet.
#[derive(Debug)]
pub(crate) enum Placed<T> {
    /// It goes on with its delay.
    InOrder(Carried<T>),
    /// It takes no delay.
    Jumps(Carried<T>),
    /// The additional time that it takes.
    Late(Carried<T>, Duration),
    /// It is held back.
    Held,
}

/// The stage and what it holds back.
#[derive(Clone, Debug)]
pub(crate) struct ReorderStage<T> {
    config: Option<Reorder>,
    packets: Option<ChanceStage>,
    /// Packets since the last one that jumped.
    since_jump: u32,
    /// In the order of being held; deadlines may be in another order after a live change.
    held: VecDeque<Held<T>>,
}

#[derive(Clone, Debug)]
struct Held<T> {
    packet: Carried<T>,
    passes: u32,
    deadline: Instant,
}

impl<T> ReorderStage<T> {
    pub(crate) const fn new() -> Self {
        Self { config: None, packets: None, since_jump: 0, held: VecDeque::new() }
    }

    pub(crate) fn configure(&mut self, config: Option<Reorder>) {
        self.packets = config.and_then(|config| ChanceStage::reconfigured(self.packets, config.packets));
        self.config = config;
    }

    /// Places a packet. Those that were waiting for it to pass are in `released`, behind it.
    pub(crate) fn place(&mut self, now: Instant, packet: Carried<T>, word: impl FnOnce() -> u64, released: &mut Vec<Carried<T>>) -> Placed<T> {
        let Some(config) = self.config else {
            self.pass(released);
            return Placed::InOrder(packet);
        };
        // As in netem, a packet that may not jump draws nothing, and the correlation is between those that may.
        let may = match config.how {
            Displacement::Jump { gap } => self.since_jump >= gap.get() - 1,
            Displacement::Behind { .. } | Displacement::Later { .. } => true,
        };
        let leaves = may && self.packets.as_mut().is_some_and(|packets| packets.happens(word()));
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

    /// Nobody leaves his place, and so nobody is held back.
    pub(crate) const fn is_idle(&self) -> bool {
        self.config.is_none()
    }

    /// When a packet is released although nobody has passed it.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        // Asked at every packet, and nearly always for nothing.
        if self.held.is_empty() { None } else { self.held.iter().map(|held| held.deadline).min() }
    }

    /// The packets whose deadline has come.
    pub(crate) fn release(&mut self, now: Instant, released: &mut VecDeque<Carried<T>>) {
        self.take(|held| held.deadline <= now, |packet| released.push_back(packet));
    }

    /// Everything that is held, in order.
    pub(crate) fn dismantle(&mut self) -> impl Iterator<Item = Carried<T>> + use<T> {
        core::mem::take(&mut self.held).into_iter().map(|held| held.packet)
    }

    /// One packet has passed those that are held.
    fn pass(&mut self, released: &mut Vec<Carried<T>>) {
        if self.held.is_empty() {
            return;
        }
        for held in &mut self.held {
            held.passes -= 1;
        }
        self.take(|held| held.passes == 0, |packet| released.push(packet));
    }

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

/// The parameter of reordering on purpose.
pub(crate) const KEYS: [Key; 1] =
    [usual("reorder", REORDER, "0", "Probability that a packet jumps ahead of those before it, or a table that says how packets leave their place")];
const REORDER: Form = Form::AnyOf(&[Form::Probability, Form::Table(&REORDER_TABLE)]);
static REORDER_TABLE: Table = Table::of(&[
    &CHANCES,
    &[
        usual("gap", Form::Integer(1, MOST_OF_32_BITS), "1", "Such a packet jumps ahead, at most one in this number of packets")
            .expecting("a number of packets of at least 1"),
        optional("behind", Form::Integer(1, MOST_OF_32_BITS), "Such a packet is held until this number of others has passed it; needs at-most")
            .expecting("a number of packets of at least 1"),
        optional("at-most", Form::Duration, "How long a packet is held behind others at most"),
        optional("later", Form::Duration, "Such a packet takes this much longer"),
    ],
]);

impl Reorder {
    /// The displacement in words.
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
