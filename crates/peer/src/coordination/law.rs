//! Coordination laws, in any [`Number`].

use core::time::Duration;

use cohaptic_units::parse;

use crate::{Gains, Motion, Number};

/// What a law is told at a tick, along one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observation<N = f64> {
    /// The peer's own copy of the object.
    pub own: Motion<N>,
    /// The mean of the newest samples held from the other peers.
    pub mean: Motion<N>,
    /// By how much those samples have moved on since they were sent, on average: the mean of min(age, [`Law::horizon`])·velocity \[m\]. Zero for a law that
    /// has no horizon.
    pub lead: N,
}

/// A coordination law: the force that holds the copies of the shared object together, as a function of what a peer knows. Each axis is by itself.
///
/// A law must be deterministic: the answer depends on the observation and the memory alone. It knows the other peers by their mean, so peers with equal
/// parameters may be analysed as one class.
pub trait Law<N: Number> {
    /// How many numbers the law remembers from tick to tick, along each axis.
    fn memory(&self) -> usize {
        0
    }

    /// Up to which age \[s\] samples are extrapolated; `None` for a law that takes them as they are.
    fn horizon(&self) -> Option<f64> {
        None
    }

    /// The coordination force FT of a tick \[N\]; equation (8) subtracts it. `memory` has [`Law::memory`] numbers: those that the law left at the tick
    /// before, zeros at the first.
    fn force(&self, seen: &Observation<N>, memory: &mut [N]) -> N;

    /// The desired motion of the copy (xd, vd), for the record.
    #[inline(always)]
    fn target(&self, seen: &Observation<N>) -> Motion<N> {
        seen.mean
    }
}

/// What the coefficients of a law are computed from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LawParameters {
    /// KT and BT.
    pub gains: Gains,
    /// How many peers there are.
    pub peers: usize,
    /// The period of the peer's tick, Tc.
    pub tick: Duration,
    /// The parameters that this law alone has.
    pub own: LawValues,
}

/// How a law pulls towards the others.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pull {
    /// Towards their mean: as strongly however many there are.
    Mean,
    /// Towards each of them: the more there are, the more strongly.
    Sum,
}

/// A parameter that one law alone has: a key of the table `[coordination.NAME]`, whose value is a duration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LawParameter {
    /// The key.
    pub key: &'static str,
    /// The value without the key, as TOML writes it.
    pub default: &'static str,
    /// What it means, without the last full stop.
    pub about: &'static str,
}

/// The values of a law's own parameters, in the order of [`Coordination::parameters`](super::Coordination::parameters).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LawValues([Duration; Self::MOST]);

impl LawValues {
    /// How many parameters of its own a law has at most.
    pub const MOST: usize = 4;

    /// Each at its default.
    ///
    /// # Panics
    ///
    /// If a default is no duration.
    #[must_use]
    pub fn defaults(parameters: &[LawParameter]) -> Self {
        let mut values = Self::default();
        for (value, parameter) in values.0.iter_mut().zip(parameters) {
            *value = parse::duration(parameter.default.trim_matches('"')).expect("the default of a law's parameter is a duration");
        }
        values
    }

    /// The value of the parameter at that place.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    #[must_use]
    pub const fn get(&self, place: usize) -> Duration {
        self.0[place]
    }

    /// Replaces the value of the parameter at that place.
    ///
    /// # Panics
    ///
    /// From [`LawValues::MOST`] on.
    pub const fn set(&mut self, place: usize, value: Duration) {
        self.0[place] = value;
    }
}
