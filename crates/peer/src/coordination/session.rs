//! Parameters of controllers, the strategies besides laws, and the sum of energies heard from other peers.

use alloc::vec::Vec;

use super::{LawParameter, LawParameters, LawValues, Pull, UsedGains};
use crate::sample_kind::SampleKind;
use crate::{Contact, Gains, State};

/// Parameters of a strategy for which the parameters of a law are not enough.
#[derive(Clone, PartialEq, Debug)]
pub struct SessionParameters<const A: usize> {
    /// Parameters of laws.
    pub law: LawParameters,
    /// Place of the peer in the session, from 0.
    pub place: usize,
    /// M, the number of ticks from one sample to the next.
    pub samples_every: u64,
    /// Initial states of the copies of all peers, indexed by place.
    pub initial: Vec<State<A>>,
    /// Contact, KC and BC of the devices of all peers, indexed by place.
    pub couplings: Vec<(Contact, Gains)>,
}

impl<const A: usize> SessionParameters<A> {
    /// Returns N − 1, the number of other peers.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub(super) fn others(&self) -> f64 {
        (self.initial.len() - 1) as f64
    }
}

/// Properties of a strategy in the registry that is not a law.
pub(super) trait ControllerKind<const A: usize> {
    /// Pull of the strategy: towards the mean, or towards each copy.
    const PULL: Pull = Pull::Mean;
    /// Gains used by the strategy.
    const GAINS: UsedGains = UsedGains::Both;
    /// Kind of data in samples beyond position and velocity, unless [`ControllerKind::kind`] says otherwise.
    const KIND: SampleKind;
    /// Parameters of this strategy alone.
    const PARAMETERS: &[LawParameter];

    /// Returns the kind of data in samples beyond position and velocity, with these parameters.
    fn kind(_own: &LawValues) -> SampleKind {
        Self::KIND
    }

    /// Returns β [N·s/m], the damping of the peer's own copy by the strategy. β is part of the body, and the command leaves it out.
    fn damping(_parameters: &LawParameters) -> f64 {
        0.0
    }

    /// Returns the strategy of a peer.
    fn new(session: &SessionParameters<A>) -> Self;
}

/// Adds to `sum` the growth of an energy since the last call \[J\], and sets `newest` to `heard`. A lower energy marks a restart of the sender, whose count
/// begins at 0 again.
pub(super) fn hear_energy<const A: usize>(sum: &mut [f64; A], newest: &mut [f64; A], heard: &[f64; A]) {
    for axis in 0..A {
        // A sender counts no energy below zero: such a number was damaged on the way.
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
        // Growth, a repetition, a restart at 0.25, growth, a damaged number below zero, and growth after the restart at 0.
        for (heard, expected) in [(0.5, 0.5), (2.0, 2.0), (2.0, 2.0), (0.25, 2.25), (1.25, 3.25), (-1.0, 3.25), (0.5, 3.75)] {
            hear_energy(&mut sum, &mut newest, &[heard]);
            assert_eq!(sum, [expected], "{heard}");
        }
    }
}
