//! Coordination laws, in any [`Number`].

use crate::{Gains, Motion, Number};

/// What a law is told at a tick, along one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Observation<N = f64> {
    /// The peer's own copy of the object.
    pub own: Motion<N>,
    /// The mean of the newest samples held from the other peers.
    pub mean: Motion<N>,
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
}
