//! What peers hear that tick at instants of their own: between the ticks of two of them others may arrive.
//!
//! All hold the same at one instant, each without its own sample. A mean is a sum in a fixed order over the places in which a receiver holds samples: those of
//! the senders before it, in their places as the last peer holds them, then those of the senders after it, one place earlier, as the first peer holds them.

use super::super::quads::{self, Quad};
use super::super::{Sample, count};
use super::{Broadcast, Sent};
use crate::arrays::bodies::Bodies;

/// How many means are taken at once.
pub(in crate::arrays) const TOGETHER: usize = 4;

/// What receivers know that tick one after the other.
#[derive(Clone, Debug)]
pub(super) struct Heard<const P: usize, const L: usize> {
    /// The samples held from each sender, in its own place.
    before: [Vec<Quad<L>>; P],
    /// How many samples of others had arrived when a peer took its mean; by peer.
    known: Vec<u64>,
    arrived: u64,
    /// By quad the sum of those before it in `before`, up to the first one that has changed.
    sums: [Vec<Quad<L>>; P],
}

impl<const P: usize, const L: usize> Heard<P, L> {
    /// A sample is held.
    pub(super) fn hold(&mut self, sender: usize, sample: &Sample<P, L>) {
        self.arrived += 1;
        for pair in 0..P {
            self.sums[pair].truncate(sender / 4 + 1);
            for run in 0..L {
                quads::set(&mut self.before[pair], sender, run, sample.position[pair][run], sample.velocity[pair][run]);
            }
        }
    }
}

impl<const P: usize> Broadcast<P, 1> {
    /// Samples in flight and held, where time counts nanoseconds; [`Broadcast::new`].
    pub(in crate::arrays) fn one_after_the_other(initial: &[Sample<P, 1>], delay: u64) -> Self {
        let peers = initial.len();
        let mut heard = Heard {
            before: std::array::from_fn(|_| quads::empty(peers)),
            known: vec![u64::MAX; peers],
            arrived: 0,
            sums: std::array::from_fn(|_| vec![[[0.0]; 8]]),
        };
        initial.iter().enumerate().for_each(|(sender, sample)| heard.hold(sender, sample));
        heard.arrived = 0;
        Self { heard: Some(Box::new(heard)), ..Self::new(initial, delay) }
    }

    /// [`Broadcast::deliver`] to peers that tick one after the other.
    pub(in crate::arrays) fn deliver_in_turn(&mut self, now: u64) {
        while let Some(Sent { sender, sample, .. }) = self.next_due(now) {
            self.hold(sender, &sample);
            self.arrived[sender] += 1;
            self.heard.iter_mut().for_each(|heard| heard.hold(sender, &sample));
        }
    }

    /// Whether a peer has heard something since its mean was computed.
    #[inline(always)]
    pub(in crate::arrays) fn has_heard(&self, peer: usize) -> bool {
        self.heard.as_ref().is_some_and(|heard| heard.known[peer] != heard.arrived - self.arrived[peer])
    }

    /// Whether anything has arrived by now that is not held yet.
    #[inline(always)]
    pub(in crate::arrays) fn is_due(&self, now: u64) -> bool {
        self.on_the_way.front().is_some_and(|sent| sent.due <= now)
    }

    /// The means of up to [`TOGETHER`] peers are those of what they hold now.
    ///
    /// Each is one chain of additions. Beyond the sums that receivers have in common, several chains go on together, as fast as one.
    #[inline(always)]
    pub(in crate::arrays) fn take_means<const A: usize>(&mut self, peers: &[usize], bodies: &mut impl Bodies<A, P>) {
        let Self { heard: Some(heard), held, arrived, sums: exact, peers: number, .. } = self else { return };
        for peer in peers {
            heard.known[*peer] = heard.arrived - arrived[*peer];
        }
        if exact.is_some() {
            return peers.iter().for_each(|peer| self.take_exact_mean(*peer, bodies));
        }
        let (quads, count) = ((*number - 1).div_ceil(4), count(*number - 1));
        let mut own = [usize::MAX; TOGETHER];
        own.iter_mut().zip(peers).for_each(|(own, peer)| *own = peer / 4);
        for (pair, after) in held.iter().enumerate() {
            let (before, common) = (&heard.before[pair], &mut heard.sums[pair]);
            let mut sums: [Quad<1>; TOGETHER] = [[[0.0]; 8]; TOGETHER];
            for (sum, peer) in sums.iter_mut().zip(peers) {
                *sum = sum_before(common, before, peer / 4);
                if peer / 4 < quads {
                    let mut both = after[peer / 4];
                    for place in 0..peer % 4 {
                        (both[place], both[place + 4]) = (before[peer / 4][place], before[peer / 4][place + 4]);
                    }
                    quads::add(sum, &[both]);
                }
            }
            let first = own.into_iter().min().unwrap_or(quads) + 1;
            for (quad, numbers) in after.iter().enumerate().take(quads).skip(first) {
                for (sum, own) in sums.iter_mut().zip(own) {
                    let goes_on = if quad > own { u64::MAX } else { 0 };
                    for (sum, number) in sum.iter_mut().zip(numbers) {
                        // To add −0 changes no sum.
                        sum[0] += f64::from_bits(number[0].to_bits() & goes_on | (-0.0_f64).to_bits() & !goes_on);
                    }
                }
            }
            for (sum, peer) in sums.iter().zip(peers) {
                let (x, v) = quads::mean_of(sum, count);
                bodies.set_target(pair, *peer, x, v);
            }
        }
    }

    #[cold]
    fn take_exact_mean<const A: usize>(&self, peer: usize, bodies: &mut impl Bodies<A, P>) {
        let Some(sums) = &self.sums else { return };
        let mean = sums.mean_without(&self.held_from(peer), self.peers - 1);
        for pair in 0..P {
            bodies.set_target(pair, peer, [mean.position[pair]], [mean.velocity[pair]]);
        }
    }
}

/// The sum of the quads before one; `common` has those of the first ones, and from now on this one.
#[inline(always)]
fn sum_before(common: &mut Vec<Quad<1>>, quads: &[Quad<1>], end: usize) -> Quad<1> {
    while common.len() <= end {
        let mut sum = common[common.len() - 1];
        quads::add(&mut sum, &quads[common.len() - 1..common.len()]);
        common.push(sum);
    }
    common[end]
}
