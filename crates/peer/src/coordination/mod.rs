//! Coordination strategies: what holds the copies of the shared object together.
//!
//! A strategy sees its own copy and the newest samples held from the others, and answers with the force FT that equation (8) subtracts. To add one,
//! write a file here that implements [`Strategy`] and add a line to [`Coordination`].

mod average_position;
mod proportional_derivative;

pub use average_position::AveragePosition;
pub use proportional_derivative::ProportionalDerivative;

use alloc::boxed::Box;

use cohaptic_units::Instant;

use crate::{Gains, Held, State};

/// What a strategy sees at a tick.
#[derive(Debug)]
pub struct Context<'a, const A: usize> {
    /// The instant of the tick.
    pub now: Instant,
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

/// The strategies that a scene can name: the registry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Coordination {
    /// Each copy is pulled towards the mean of the others.
    AveragePosition,
    /// Each copy is pulled towards each of the others.
    ProportionalDerivative,
}

impl Coordination {
    /// Every strategy.
    pub const ALL: [Self; 2] = [Self::AveragePosition, Self::ProportionalDerivative];

    /// The name in a scene file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::AveragePosition => "average-position",
            Self::ProportionalDerivative => "proportional-derivative",
        }
    }

    /// The gains with which average-position coordination among that many peers is the same, force for force; `None` if there are none, and then the
    /// stability analysis takes the general path.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn as_average_position(self, gains: Gains, peers: usize) -> Option<Gains> {
        match self {
            Self::AveragePosition => Some(gains),
            Self::ProportionalDerivative => Some(gains.scaled(peers.saturating_sub(1) as f64)),
        }
    }

    /// Makes the strategy for one peer out of `peers`.
    #[must_use]
    pub fn strategy(self, gains: Gains, peers: usize) -> BuiltIn {
        match self {
            Self::AveragePosition => BuiltIn::AveragePosition(AveragePosition::new(gains)),
            Self::ProportionalDerivative => BuiltIn::ProportionalDerivative(ProportionalDerivative::new(gains, peers)),
        }
    }
}

/// A strategy of this crate, without a pointer in between.
#[derive(Clone, Debug)]
pub enum BuiltIn {
    /// See [`AveragePosition`].
    AveragePosition(AveragePosition),
    /// See [`ProportionalDerivative`].
    ProportionalDerivative(ProportionalDerivative),
}

impl<const A: usize> Strategy<A> for BuiltIn {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        match self {
            Self::AveragePosition(strategy) => strategy.command(context),
            Self::ProportionalDerivative(strategy) => strategy.command(context),
        }
    }

    fn set_gains(&mut self, gains: Gains) {
        match self {
            Self::AveragePosition(strategy) => Strategy::<A>::set_gains(strategy, gains),
            Self::ProportionalDerivative(strategy) => Strategy::<A>::set_gains(strategy, gains),
        }
    }

    fn memory(&self) -> &[f64] {
        match self {
            Self::AveragePosition(strategy) => Strategy::<A>::memory(strategy),
            Self::ProportionalDerivative(strategy) => Strategy::<A>::memory(strategy),
        }
    }

    fn set_memory(&mut self, memory: &[f64]) {
        match self {
            Self::AveragePosition(strategy) => Strategy::<A>::set_memory(strategy, memory),
            Self::ProportionalDerivative(strategy) => Strategy::<A>::set_memory(strategy, memory),
        }
    }
}
