//! The state machine of a link without immediately certain fates.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;
use crate::fates::stats::CrossCounts;
use crate::line::replay::ReplayStage;
use crate::line::staged::Staged;
use crate::netem::kernel_link::KernelStage;
use crate::packet::{Carried, Outputs, PacketInfo};

/// The current engine of a link, and earlier engines of different kinds with packets inside.
#[derive(Clone, Debug)]
pub(crate) struct Engine<T> {
    pub(crate) kind: Kind<T>,
    /// Earlier engines. Such an engine takes no new packets.
    retiring: Vec<Kind<T>>,
    /// Earliest announced instant of a wake of this engine; `None` without an outstanding wake.
    announced: Option<Instant>,
    /// Counts of the cross-traffic of earlier engines.
    crossed: CrossCounts,
}

#[derive(Clone, Debug)]
pub(crate) enum Kind<T> {
    Staged(Box<Staged<T>>),
    Replay(ReplayStage<T>),
    Kernel(Box<KernelStage<T>>),
}

impl<T: Clone> Kind<T> {
    fn next_at(&self) -> Option<Instant> {
        match self {
            Self::Staged(staged) => staged.next_at(),
            Self::Replay(replay) => replay.next_at(),
            Self::Kernel(kernel) => kernel.next_at(),
        }
    }

    fn pass(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        match self {
            Self::Staged(staged) => staged.pass(now, outputs),
            Self::Replay(replay) => replay.pass(now, outputs),
            Self::Kernel(kernel) => kernel.pass(now, outputs),
        }
    }
}

impl<T> Kind<T> {
    /// Returns the counts of the cross-traffic.
    fn crossed(&self) -> CrossCounts {
        match self {
            Self::Staged(staged) => staged.crossed(),
            Self::Replay(_) | Self::Kernel(_) => CrossCounts::default(),
        }
    }
}

impl<T> Engine<T> {
    /// Returns the counts of the cross-traffic, of this engine and of earlier engines.
    pub(crate) fn crossed(&self) -> CrossCounts {
        let mut counts = self.crossed;
        counts.add(self.kind.crossed(), 1);
        counts
    }
}

impl<T: Clone> Engine<T> {
    pub(crate) const fn new(kind: Kind<T>) -> Self {
        Self { kind, retiring: Vec::new(), announced: None, crossed: CrossCounts { offered: 0, dropped: 0, bytes: 0 } }
    }

    /// Offers a packet with `inside` further packets inside the link.
    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, inside: u64, outputs: &mut Outputs<T>) {
        match &mut self.kind {
            Kind::Staged(staged) => staged.offer(now, packet, inside, outputs),
            Kind::Replay(replay) => replay.offer(now, packet, outputs),
            Kind::Kernel(kernel) => kernel.offer(now, packet, outputs),
        }
    }

    /// Takes a packet if its fate is certain at once: see [`Staged::offer_at_once`].
    #[inline]
    pub(crate) fn offer_at_once(&mut self, now: Instant, number: u64, info: PacketInfo, until: Instant) -> Option<Result<Instant, DropCause>> {
        match &mut self.kind {
            // Nothing may be inside the link for a certain fate, so no earlier engine may hold packets.
            Kind::Staged(staged) if self.retiring.is_empty() => staged.offer_at_once(now, number, info, until),
            Kind::Staged(_) | Kind::Replay(_) | Kind::Kernel(_) => None,
        }
    }

    /// Lets everything due by `now` happen.
    pub(crate) fn pass(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        // Earlier engines go first, so older packets come out first at equal instants.
        for kind in &mut self.retiring {
            kind.pass(now, outputs);
        }
        // An engine without a next event holds no packet any more.
        self.retiring.retain(|kind| kind.next_at().is_some());
        self.kind.pass(now, outputs);
    }

    /// Computes the cross packets up to `now` that no packet of the link has met: see [`Staged::catch_up`].
    pub(crate) fn catch_up(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        if let Kind::Staged(staged) = &mut self.kind {
            staged.catch_up(now, outputs);
        }
    }

    /// Returns the instant of the next call of [`Engine::pass`], or `None` if no packet waits.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        let next = self.kind.next_at();
        if self.retiring.is_empty() {
            return next;
        }
        self.retiring.iter().filter_map(Kind::next_at).chain(next).min()
    }

    /// Notes the owner's wake of the engine for `at`, so the next wake is announced again.
    pub(crate) fn woken(&mut self, at: Instant) {
        if self.announced == Some(at) {
            self.announced = None;
        }
    }

    /// Returns the instant of the next call of [`Engine::pass`], if no wake at or before this instant was announced. For an owner that keeps announced
    /// instants.
    pub(crate) fn announce(&mut self) -> Option<Instant> {
        let next = self.next_at()?;
        // The announced wake comes first, and the engine announces the next wake then.
        if self.announced.is_some_and(|announced| announced <= next) {
            return None;
        }
        self.announced = Some(next);
        Some(next)
    }

    /// Replaces the current engine. Packets offered from now on enter the new engine, and packets inside go on in their engine.
    pub(crate) fn replace(&mut self, kind: Kind<T>) {
        let before = core::mem::replace(&mut self.kind, kind);
        self.crossed.add(before.crossed(), 1);
        // An engine without packets has nothing to finish.
        if before.next_at().is_some() {
            self.retiring.push(before);
        }
    }
}
