//! What strategies that are not laws are made from, and how they hear of energies.

use alloc::vec::Vec;

use super::{LawParameter, LawParameters, Pull, UsedGains};
use crate::wire::SampleKind;
use crate::{Contact, Gains, State};

/// What a strategy is made from, where the parameters of a law are not enough.
#[derive(Clone, PartialEq, Debug)]
pub struct SessionParameters<const A: usize> {
    /// The parameters that laws have.
    pub law: LawParameters,
    /// The place of the peer in the session.
    pub place: usize,
    /// M, how many of its ticks are between two of its samples.
    pub samples_every: u64,
    /// Where the copies of all peers begin.
    pub initial: Vec<State<A>>,
    /// How the devices of all peers touch the object, with KC and BC.
    pub couplings: Vec<(Contact, Gains)>,
}

impl<const A: usize> SessionParameters<A> {
    /// N − 1.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub(super) fn others(&self) -> f64 {
        (self.initial.len() - 1) as f64
    }
}

/// What the registry knows of a strategy that is not a law.
pub(super) trait ControllerKind<const A: usize> {
    /// How it pulls towards the others.
    const PULL: Pull = Pull::Mean;
    /// Which gains it uses.
    const GAINS: UsedGains = UsedGains::Both;
    /// What samples carry beyond the state.
    const KIND: SampleKind;
    /// The parameters that it alone has.
    const PARAMETERS: &[LawParameter];

    /// β [N·s/m]: by how much the strategy damps the peer's own copy. It is part of the body, and the command leaves it out.
    fn damping(_parameters: &LawParameters) -> f64 {
        0.0
    }

    /// The strategy of a peer.
    fn new(session: &SessionParameters<A>) -> Self;
}

/// Adds what an energy that only grows has grown by since it was heard last. One that has fallen begins a new life of its sender, from 0.
pub(super) fn hear_energy<const A: usize>(sum: &mut [f64; A], newest: &mut [f64; A], heard: &[f64; A]) {
    for axis in 0..A {
        // An energy below zero was damaged on the way.
        let heard = heard[axis].max(0.0);
        sum[axis] += if heard >= newest[axis] { heard - newest[axis] } else { heard };
        newest[axis] = heard;
    }
}

#[cfg(test)]
mod tests {
    use super::hear_energy;

    #[test]
    fn an_energy_that_falls_begins_a_new_life() {
        let (mut sum, mut newest) = ([0.0], [0.0]);
        for (heard, expected) in [(0.5, 0.5), (2.0, 2.0), (2.0, 2.0), (0.25, 2.25), (1.25, 3.25), (-1.0, 3.25), (0.5, 3.75)] {
            hear_energy(&mut sum, &mut newest, &[heard]);
            assert_eq!(sum, [expected], "{heard}");
        }
    }
}
