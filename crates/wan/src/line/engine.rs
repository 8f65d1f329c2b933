//! The state machine of a link that cannot say at once what becomes of a packet.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::fates::fate::DropCause;
use crate::line::replay::ReplayStage;
use crate::line::staged::Staged;
use crate::netem::kernel_link::KernelStage;
use crate::packet::{Carried, Outputs, PacketInfo};

/// An engine and, after a change to one of another kind, those before it, until the packets inside them have left.
#[derive(Clone, Debug)]
pub(crate) struct Engine<T> {
    pub(crate) kind: Kind<T>,
    retiring: Vec<Kind<T>>,
    /// For when its owner has been told to wake it.
    announced: Option<Instant>,
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

impl<T: Clone> Engine<T> {
    pub(crate) const fn new(kind: Kind<T>) -> Self {
        Self { kind, retiring: Vec::new(), announced: None }
    }

    /// Takes a packet while `inside` others are inside the link.
    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, inside: u64, outputs: &mut Outputs<T>) {
        match &mut self.kind {
            Kind::Staged(staged) => staged.offer(now, packet, inside, outputs),
            Kind::Replay(replay) => replay.offer(now, packet, outputs),
            Kind::Kernel(kernel) => kernel.offer(now, packet, outputs),
        }
    }

    /// Takes a packet if it is known at once what becomes of it: see [`Staged::offer_at_once`].
    #[inline]
    pub(crate) fn offer_at_once(&mut self, now: Instant, number: u64, info: PacketInfo, until: Instant) -> Option<Result<Instant, DropCause>> {
        match &mut self.kind {
            Kind::Staged(staged) if self.retiring.is_empty() => staged.offer_at_once(now, number, info, until),
            Kind::Staged(_) | Kind::Replay(_) | Kind::Kernel(_) => None,
        }
    }

    /// Lets all happen that is due.
    pub(crate) fn pass(&mut self, now: Instant, outputs: &mut Outputs<T>) {
        for kind in &mut self.retiring {
            kind.pass(now, outputs);
        }
        self.retiring.retain(|kind| kind.next_at().is_some());
        self.kind.pass(now, outputs);
    }

    /// When [`Engine::pass`] must be called.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        let next = self.kind.next_at();
        if self.retiring.is_empty() {
            return next;
        }
        self.retiring.iter().filter_map(Kind::next_at).chain(next).min()
    }

    /// The owner was woken for that instant: says again when it must be.
    pub(crate) fn woken(&mut self, at: Instant) {
        if self.announced == Some(at) {
            self.announced = None;
        }
    }

    /// When [`Engine::pass`] must be called, if that was not said yet: for an owner that notes it.
    pub(crate) fn announce(&mut self) -> Option<Instant> {
        let next = self.next_at()?;
        if self.announced.is_some_and(|announced| announced <= next) {
            return None;
        }
        self.announced = Some(next);
        Some(next)
    }

    /// Another engine takes what comes from now on; packets inside go on in the engine that took them.
    pub(crate) fn replace(&mut self, kind: Kind<T>) {
        let before = core::mem::replace(&mut self.kind, kind);
        if before.next_at().is_some() {
            self.retiring.push(before);
        }
    }
}
