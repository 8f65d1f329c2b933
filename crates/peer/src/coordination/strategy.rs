//! What a peer asks of its coordination.

use alloc::boxed::Box;

use cohaptic_units::Instant;

use crate::{Gains, Held, State};

/// What a strategy sees at a tick.
#[derive(Debug)]
pub struct Context<'a, const A: usize> {
    /// The instant of the tick.
    pub now: Instant,
    /// What the peer's own clock shows.
    pub local_time: Instant,
    /// The peer's own copy of the object.
    pub own: &'a State<A>,
    /// The newest samples from the others.
    pub held: &'a Held<A>,
}

/// What a strategy answers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Command<const A: usize> {
    /// The coordination force FT \[N\]; equation (8) subtracts it.
    pub force: [f64; A],
    /// Where the strategy wants the copy to be, (xd, vd), for the record.
    pub target: State<A>,
}

/// A coordination strategy of one peer.
///
/// It must be deterministic: the answer depends on the calls made so far and on nothing else.
pub trait Strategy<const A: usize> {
    /// The command at a tick. Called exactly once a tick, after the samples that have arrived were taken in.
    fn command(&mut self, context: &Context<'_, A>) -> Command<A>;

    /// Whether the strategy asks for [`Held::lead`]; asked once, when the peer is made.
    fn needs_ages(&self) -> bool {
        false
    }

    /// New gains, from the next tick on. A strategy without gains ignores them.
    fn set_gains(&mut self, gains: Gains);

    /// Everything the strategy remembers from tick to tick, as numbers; always as many. Empty for one that remembers nothing.
    ///
    /// The stability analysis puts a strategy into a state and looks where it goes. A strategy that remembers what it does not show here is refused there.
    fn memory(&self) -> &[f64] {
        &[]
    }

    /// Puts [`Strategy::memory`] back, or replaces it by as many other numbers.
    fn set_memory(&mut self, _memory: &[f64]) {}
}

impl<const A: usize, S: Strategy<A> + ?Sized> Strategy<A> for Box<S> {
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        (**self).command(context)
    }

    fn needs_ages(&self) -> bool {
        (**self).needs_ages()
    }

    fn set_gains(&mut self, gains: Gains) {
        (**self).set_gains(gains);
    }

    fn memory(&self) -> &[f64] {
        (**self).memory()
    }

    fn set_memory(&mut self, memory: &[f64]) {
        (**self).set_memory(memory);
    }
}
