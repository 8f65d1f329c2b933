//! Newest sample of each sender, and the mean of these samples.
//!
//! In: decoded samples. Out: held states, their mean, and the mean lead of extrapolated samples. This module does not know the own state of the holder except
//! in `Held::refresh_around`.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::State;
use crate::exact_means::ExactMeans;
use crate::lead::{Lead, Moving};

/// Knowledge of a peer about the other peers: per sender, the arrived sample with the highest sequence number.
///
/// Until the first arrival, the initial state of a sender is held. The mean is stored until a sample changes it.
///
/// Below [`EXACT_FROM`] samples the mean is a sum in a fixed order, divided by the number of samples. From [`EXACT_FROM`] samples on it is the exact mean,
/// rounded once, and an update takes a time that does not grow with the number of samples.
#[derive(Clone, Debug)]
pub struct Held<const A: usize> {
    /// Held samples, indexed by place: the senders in the order of peers, without the holder.
    samples: Vec<HeldSample<A>>,
    mean: State<A>,
    /// Exact sums of the samples; `None` below [`EXACT_FROM`] samples.
    sums: Option<Box<ExactMeans<A>>>,
    /// Extrapolation of the samples; `None` unless [`Held::keep_ages`] was called.
    motions: Option<Motions<A>>,
    /// Mean lead at the last [`Held::move_on`] \[m\]; zero without `motions`. Outside of `motions`, because every tick reads the lead.
    lead: [f64; A],
    /// Senders and weights; `None` if the holder hears all other peers with equal weights.
    heard: Option<Box<Heard>>,
    /// `true` if a newer sample has only to be kept: without exact sums, extrapolation and weights.
    is_plain: bool,
    /// Places of the senders whose sample 2⁶⁴ − 1 has arrived. [`HeldSample::next`] has no number above this sample.
    ended: Vec<usize>,
}

/// Senders of a holder that hears only some peers, or gives different weights.
#[derive(Clone, Debug)]
struct Heard {
    /// Places of the senders in the session, in ascending order.
    senders: Vec<u32>,
    /// Factors on the held states, indexed by place; empty if all weights are equal.
    weights: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct HeldSample<const A: usize> {
    state: State<A>,
    /// Lowest sequence number that counts as newer than the held sample.
    next: u64,
}

/// Extrapolation of the held samples.
#[derive(Clone, Debug)]
struct Motions<const A: usize> {
    /// Greatest age to which a sample is extrapolated \[s\].
    horizon: f64,
    samples: Vec<Moving<A>>,
    lead: Lead<A>,
}

impl<const A: usize> Motions<A> {
    fn set(&mut self, place: usize, moving: Moving<A>) {
        self.samples[place] = moving;
        self.lead = Lead::STALE;
    }
}

/// Number of samples from which the mean is exact except for one rounding.
///
/// A sum in a fixed order takes a time that grows with the number of samples, and every engine must then use the same order. With fewer samples than this
/// constant, the fixed order takes less time than exact sums.
pub const EXACT_FROM: usize = 256;

impl<const A: usize> Held<A> {
    /// Returns the initial states of all other peers as held samples, in the order of the peers without the holder.
    #[must_use]
    pub fn new(initial: impl IntoIterator<Item = State<A>>) -> Self {
        let samples: Vec<_> = initial.into_iter().map(|state| HeldSample { state, next: 0 }).collect();
        let sums = (samples.len() >= EXACT_FROM).then(|| Box::new(ExactMeans::new(samples.iter().map(|sample| &sample.state))));
        let is_plain = sums.is_none();
        let mut held = Self { samples, mean: State::REST, sums, motions: None, lead: [0.0; A], heard: None, is_plain, ended: Vec::new() };
        held.refresh();
        held
    }

    /// Returns the initial states of some other peers as held samples. `initial` contains the places of these peers in the session, in ascending order.
    /// `weights` are the weights of a weighted mean, each already divided by the mean weight; `None` gives equal weights. Each state is held times its
    /// weight, so that the plain mean of held states is the weighted mean.
    #[must_use]
    pub fn of_some(initial: impl IntoIterator<Item = (u32, State<A>)>, weights: Option<Vec<f64>>) -> Self {
        let (senders, states): (Vec<u32>, Vec<State<A>>) = initial.into_iter().unzip();
        let weights = weights.unwrap_or_default();
        let weigh = |(place, state): (usize, State<A>)| weights.get(place).map_or(state, |weight| state.times(*weight));
        let mut held = Self::new(states.into_iter().enumerate().map(weigh));
        held.is_plain &= weights.is_empty();
        held.heard = Some(Box::new(Heard { senders, weights }));
        held
    }

    /// Returns the index of the sender `sender` among the samples held by the peer `own`, both places in the session; `None` for a sender that the holder
    /// does not hear.
    #[inline(always)]
    pub(crate) fn place_of(&self, sender: u32, own: u32) -> Option<usize> {
        if let Some(heard) = &self.heard {
            return heard.senders.binary_search(&sender).ok();
        }
        let (sender, own) = (sender as usize, own as usize);
        // Without `heard` all other peers are held in order, so places above the own place move down by one.
        let place = if sender < own { sender } else { sender.wrapping_sub(1) };
        (sender != own && place < self.samples.len()).then_some(place)
    }

    /// Returns a state times the weight of its sender.
    #[inline]
    fn weighed(&self, place: usize, state: State<A>) -> State<A> {
        let weight = self.heard.as_ref().and_then(|heard| heard.weights.get(place));
        weight.map_or(state, |weight| state.times(*weight))
    }

    /// Keeps send times and velocities for [`Held::lead`] from now on. Samples are extrapolated up to an age of `horizon` \[s\]. The samples held so far
    /// count as sampled at the instant 0 of their senders' clocks.
    pub fn keep_ages(&mut self, horizon: f64) {
        let moving = |sample: &HeldSample<A>| Moving { sent: Instant::ZERO, velocity: sample.state.velocity };
        self.motions = Some(Motions { horizon, samples: self.samples.iter().map(moving).collect(), lead: Lead::STALE });
        (self.lead, self.is_plain) = ([0.0; A], false);
    }

    /// Sets the greatest age `horizon` \[s\] of extrapolation from now on. No effect unless [`Held::keep_ages`] was called.
    pub(crate) fn set_horizon(&mut self, horizon: f64) {
        if let Some(motions) = self.motions.as_mut().filter(|motions| motions.horizon.to_bits() != horizon.to_bits()) {
            (motions.horizon, motions.lead) = (horizon, Lead::STALE);
        }
    }

    /// Returns the number of senders.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Returns whether there is no sender.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Returns the state held for the sender with index `place`, times its weight if weights differ; `None` beyond the last sender.
    #[must_use]
    pub fn state(&self, place: usize) -> Option<&State<A>> {
        self.samples.get(place).map(|sample| &sample.state)
    }

    /// Returns the state that the sender with index `place` has sent, without its weight; `None` beyond the last sender.
    #[must_use]
    pub fn sent_state(&self, place: usize) -> Option<State<A>> {
        let weight = self.heard.as_ref().and_then(|heard| heard.weights.get(place));
        self.state(place).map(|state| weight.map_or(*state, |weight| state.times(weight.recip())))
    }

    /// Returns the mean of the held states, as of the last [`Held::refresh`]; [`State::REST`] without other peers.
    #[must_use]
    pub fn mean(&self) -> &State<A> {
        &self.mean
    }

    /// Extrapolates the samples to the time `now` on the holder's own clock.
    pub fn move_on(&mut self, now: Instant) {
        let Some(motions) = &mut self.motions else { return };
        // The lead is linear in time until a sample reaches its send time or its horizon. A new sum is needed only then.
        if !motions.lead.holds_at(now) {
            motions.lead = Lead::of(motions.samples.iter().copied(), now, motions.horizon);
        }
        self.lead = motions.lead.at(now);
    }

    /// Returns the mean lead of the held samples as of the last [`Held::move_on`] \[m\]: the mean of min(age, horizon)·velocity. Zero unless
    /// [`Held::keep_ages`] was called.
    #[must_use]
    pub const fn lead(&self) -> [f64; A] {
        self.lead
    }

    /// Takes in a sample sent at `sent` on its sender's clock, and returns whether it is newer than the held sample. A late or repeated sample changes
    /// nothing.
    ///
    /// [`Held::refresh`] must be called before the next use of the mean.
    ///
    /// # Panics
    ///
    /// If the index `place` is out of range.
    #[inline(always)]
    pub fn accept(&mut self, place: usize, sequence: u64, sent: Instant, state: State<A>) -> bool {
        let sample = &mut self.samples[place];
        if sequence < sample.next {
            return false;
        }
        // One test takes the place of a test for each optional part (`benches/peers`, rows of watched packets).
        if self.is_plain && sequence < u64::MAX {
            *sample = HeldSample { state, next: sequence + 1 };
            return true;
        }
        self.accept_with_parts(place, sequence, sent, state)
    }

    /// Takes in a sample with a sequence number that is high enough, for a holder with optional parts, or the sample 2⁶⁴ − 1.
    #[inline(never)]
    fn accept_with_parts(&mut self, place: usize, sequence: u64, sent: Instant, state: State<A>) -> bool {
        // Sequence number 2^64 − 1 has no successor for `next`, so `ended` notes its arrival.
        let newer = sequence < u64::MAX || self.take_last(place);
        if newer {
            let state = self.weighed(place, state);
            self.replace(place, HeldSample { state, next: sequence.saturating_add(1) });
            // The lead uses the weighted velocity, as the mean uses the weighted position.
            if let Some(motions) = &mut self.motions {
                motions.set(place, Moving { sent, velocity: state.velocity });
            }
        }
        newer
    }

    /// Returns whether the sample 2⁶⁴ − 1 of this sender arrives for the first time, and notes the arrival. No later sample of the sender is newer.
    #[cold]
    fn take_last(&mut self, place: usize) -> bool {
        let is_first = !self.ended.contains(&place);
        if is_first {
            self.ended.push(place);
        }
        is_first
    }

    /// Holds `state`, sampled at `sent` on the sender's clock, as if nothing had ever arrived from this sender: any sample is newer.
    ///
    /// # Panics
    ///
    /// If the index `place` is out of range.
    pub(crate) fn hold(&mut self, place: usize, sent: Instant, state: State<A>) {
        let state = self.weighed(place, state);
        self.ended.retain(|ended| *ended != place);
        self.replace(place, HeldSample { state, next: 0 });
        if let Some(motions) = &mut self.motions {
            motions.set(place, Moving { sent, velocity: state.velocity });
        }
    }

    /// Replaces the state held for a sender, and the velocity of its extrapolation \[m/s\]. Sequence number and send time stay those of the newest sample.
    pub(crate) fn replace_state(&mut self, place: usize, state: State<A>, velocity: [f64; A]) {
        self.replace(place, HeldSample { state, ..self.samples[place] });
        if let Some(motions) = &mut self.motions {
            motions.set(place, Moving { velocity, ..motions.samples[place] });
        }
    }

    /// Replaces a held sample, and updates the exact sums.
    #[inline(always)]
    fn replace(&mut self, place: usize, sample: HeldSample<A>) {
        if let Some(sums) = &mut self.sums {
            sums.replace(&self.samples[place].state, &sample.state);
        }
        self.samples[place] = sample;
    }

    /// Like [`Held::refresh`], but sums differences from the holder's `own` state, so that senders held exactly at `own` leave the mean exactly at `own`.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub(crate) fn refresh_around(&mut self, own: &State<A>) {
        let count = self.samples.len() as f64;
        for axis in 0..A {
            let (mut position, mut velocity) = (0.0, 0.0);
            for HeldSample { state, .. } in &self.samples {
                position += state.position[axis] - own.position[axis];
                velocity += state.velocity[axis] - own.velocity[axis];
            }
            self.mean.position[axis] = own.position[axis] + position / count;
            self.mean.velocity[axis] = own.velocity[axis] + velocity / count;
        }
    }

    /// Computes the mean from the held samples.
    ///
    /// Below [`EXACT_FROM`] samples there are four partial sums, added in pairs. The order is the same on every machine, the latency is a quarter of the
    /// latency of one sum, and the error is at most (n/4 + 2)·2⁻⁵³·Σ|x|, a quarter of the error of one sum.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn refresh(&mut self) {
        if let Some(sums) = &self.sums {
            self.mean = sums.mean(self.samples.len());
            return;
        }
        if self.samples.is_empty() {
            return;
        }
        let mut sums = [State::<A>::REST; 4];
        let mut add = |sum: usize, sample: &HeldSample<A>| {
            for axis in 0..A {
                sums[sum].position[axis] += sample.state.position[axis];
                sums[sum].velocity[axis] += sample.state.velocity[axis];
            }
        };
        let mut quads = self.samples.chunks_exact(4);
        // Four independent additions at a time; a remainder of at most three samples goes to the first sums.
        for quad in &mut quads {
            add(0, &quad[0]);
            add(1, &quad[1]);
            add(2, &quad[2]);
            add(3, &quad[3]);
        }
        for (sum, sample) in quads.remainder().iter().enumerate() {
            add(sum, sample);
        }
        let count = self.samples.len() as f64;
        let [a, b, c, d] = sums;
        // Pairs in a fixed order: another order would give other bits.
        let mean = |a: f64, b: f64, c: f64, d: f64| ((a + b) + (c + d)) / count;
        self.mean = State {
            position: core::array::from_fn(|i| mean(a.position[i], b.position[i], c.position[i], d.position[i])),
            velocity: core::array::from_fn(|i| mean(a.velocity[i], b.velocity[i], c.velocity[i], d.velocity[i])),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> State<1> {
        State { position: [x], velocity: [-x] }
    }

    #[test]
    fn a_late_or_repeated_sample_never_replaces_a_newer_one() {
        let mut held = Held::new([at(0.0), at(0.0)]);
        let mut accept = |place, sequence, x| held.accept(place, sequence, Instant::ZERO, at(x));
        assert!(accept(1, 5, 5.0));
        assert!(!accept(1, 4, 4.0));
        assert!(!accept(1, 5, 99.0));
        assert!(accept(1, 6, 6.0));
        assert!(accept(0, 0, 1.0));
        held.refresh();
        assert_eq!(*held.mean(), at(3.5));
    }

    #[test]
    fn the_last_sequence_number_of_all_is_still_accepted_once() {
        let mut held = Held::new([at(0.0)]);
        assert!(held.accept(0, u64::MAX - 1, Instant::ZERO, at(1.0)));
        assert!(held.accept(0, u64::MAX, Instant::ZERO, at(2.0)));
        assert!(!held.accept(0, u64::MAX, Instant::ZERO, at(3.0)), "the same number twice");
        assert_eq!(held.state(0), Some(&at(2.0)));
        // `hold` resets the sequence numbers, so the sample 2^64 − 1 is new again.
        held.hold(0, Instant::ZERO, at(0.0));
        assert!(held.accept(0, u64::MAX, Instant::ZERO, at(4.0)) && !held.accept(0, u64::MAX, Instant::ZERO, at(5.0)));
    }

    #[test]
    fn weighted_samples_are_held_times_their_weights() {
        let mut held = Held::of_some([(2, at(1.0)), (5, at(2.0))], Some(vec![0.5, 1.5]));
        assert_eq!((held.state(0), held.state(1)), (Some(&at(0.5)), Some(&at(3.0))));
        assert!(held.accept(0, 0, Instant::ZERO, at(8.0)) && held.accept(1, 7, Instant::ZERO, at(4.0)));
        assert_eq!((held.state(0), held.state(1)), (Some(&at(4.0)), Some(&at(6.0))));
        held.refresh();
        assert_eq!(*held.mean(), at(5.0));
    }

    /// Ages of 30 ms and, limited by the horizon, 33 ms give (0.030·(−1) + 0.033·(−2))/2. No age is below zero.
    #[test]
    fn samples_move_on_up_to_the_horizon() {
        let at_ms = |ms: u64| Instant::from_nanos(ms * 1_000_000);
        let mut held = Held::new([at(0.0), at(0.0)]);
        let lead = |held: &mut Held<1>, ms| {
            held.move_on(at_ms(ms));
            held.lead()
        };
        // Without `keep_ages` there is no lead.
        assert_eq!(lead(&mut held, 10), [0.0]);
        held.keep_ages(0.033);
        held.accept(0, 0, at_ms(10), at(1.0));
        held.hold(1, at_ms(5), at(2.0));
        assert_eq!(lead(&mut held, 40), [-0.048]);
        // At 1 ms the holder's clock is before both send times, so no sample has moved.
        assert_eq!(lead(&mut held, 1), [0.0]);
        assert!(!held.accept(0, 0, at_ms(39), at(7.0)));
        assert_eq!(lead(&mut held, 40), [-0.048]);
        // A replaced velocity changes the lead, a stale sample does not.
        held.replace_state(1, at(3.0), [0.0]);
        assert_eq!(lead(&mut held, 40), [-0.015]);
    }

    /// The mean of equal states is that state, in any order of arrival and after any earlier samples.
    #[test]
    fn the_mean_of_many_is_exact() {
        let count = EXACT_FROM;
        let value = |place: usize| 0.1 + (place as f64).sin() * 1e-3;
        let mut held = Held::new((0..count).map(|place| at(value(place))));
        let mut reversed = Held::new((0..count).rev().map(|place| at(value(place))));
        // The sums of both orders are exact, so the means are equal to the bit.
        assert_eq!(held.mean(), reversed.mean());
        for place in 0..count {
            held.accept(place, 0, Instant::ZERO, at(1e9 / (place as f64 + 1.0)));
            held.accept(place, 1, Instant::ZERO, at(0.1));
            reversed.hold(count - 1 - place, Instant::ZERO, at(0.3));
            reversed.replace_state(count - 1 - place, at(0.1), [0.0]);
        }
        held.refresh();
        reversed.refresh();
        assert_eq!((*held.mean(), *reversed.mean()), (at(0.1), at(0.1)));
    }

    /// Weights 1 and 3 give the mean of 0.5·x and 1.5·y, for states and for leads. A peer that the holder does not hear has no index.
    #[test]
    fn a_weighted_mean_is_that_of_what_states_weigh() {
        let mut held = Held::of_some([(2, at(4.0)), (7, at(8.0))], Some(vec![0.5, 1.5]));
        assert_eq!((*held.mean(), held.state(1)), (at(7.0), Some(&at(12.0))));
        assert_eq!([2, 7, 0, 8].map(|sender| held.place_of(sender, 5)), [Some(0), Some(1), None, None]);
        held.keep_ages(1.0);
        held.accept(1, 0, Instant::ZERO, at(2.0));
        held.hold(0, Instant::ZERO, at(0.0));
        held.refresh();
        held.move_on(Instant::from_nanos(500_000_000));
        assert_eq!((*held.mean(), held.lead()), (at(1.5), [-0.75]));
        let some = Held::of_some([(1, at(1.0)), (4, at(2.0))], None);
        assert_eq!((some.place_of(4, 0), *some.mean()), (Some(1), at(1.5)));
    }

    #[test]
    fn the_mean_is_that_of_all_senders() {
        for count in 1..12_u32 {
            let held = Held::new((1..=count).map(|i| at(f64::from(i))));
            // 1 + 2 + … + n is exact, so only the division rounds.
            assert_eq!(*held.mean(), at(f64::from(count + 1) / 2.0));
        }
    }
}
