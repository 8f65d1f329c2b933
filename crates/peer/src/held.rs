//! The newest sample from each of the other peers, and their mean.

use alloc::boxed::Box;
use alloc::vec::Vec;

use cohaptic_units::Instant;

use crate::State;
use crate::exact_means::ExactMeans;
use crate::lead::{Lead, Moving};

/// What a peer knows of the others: per sender, the sample with the highest sequence number that has arrived.
///
/// Before anything has arrived from a sender it holds the sender's initial state. The mean is kept until a sample changes it.
///
/// Of fewer than [`EXACT_FROM`] samples it is a sum in a fixed order over their number; of more it is the exact mean, rounded once ([`ExactSum`](crate::ExactSum)), and takes a
/// time that does not grow with their number.
#[derive(Clone, Debug)]
pub struct Held<const A: usize> {
    samples: Vec<HeldSample<A>>,
    mean: State<A>,
    /// The sums of the samples, from [`EXACT_FROM`] samples on.
    sums: Option<Box<ExactMeans<A>>>,
    /// How each sample moves on while it is held, if anybody asks for it.
    motions: Option<Motions<A>>,
    /// The senders, if they are not all others with equal weights.
    heard: Option<Box<Heard>>,
    /// Places of the senders from which the last number of all has come. [`HeldSample::next`] cannot say that nothing is newer.
    ended: Vec<usize>,
}

/// Senders that are some of the others, or differ in weight.
#[derive(Clone, Debug)]
struct Heard {
    /// Their places in the session, in order.
    senders: Vec<u32>,
    /// By what their states are multiplied; empty if by nothing.
    weights: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
struct HeldSample<const A: usize> {
    state: State<A>,
    /// The lowest sequence number that is newer than the sample held.
    next: u64,
}

/// How the samples move on while they are held.
#[derive(Clone, Debug)]
struct Motions<const A: usize> {
    /// Up to which age \[s\].
    horizon: f64,
    samples: Vec<Moving<A>>,
    lead: Lead<A>,
    /// The lead as of the last [`Held::move_on`].
    now: [f64; A],
}

impl<const A: usize> Motions<A> {
    fn set(&mut self, place: usize, moving: Moving<A>) {
        self.samples[place] = moving;
        self.lead = Lead::STALE;
    }
}

/// From that number of samples on their mean is exact but for one rounding.
///
/// A sum in a fixed order takes a time that grows with their number, and binds every engine to that order. Below this number it takes less time than
/// exact sums do.
pub const EXACT_FROM: usize = 256;

impl<const A: usize> Held<A> {
    /// Holds the initial state of each other peer, in the order of the peers with the holder left out.
    #[must_use]
    pub fn new(initial: impl IntoIterator<Item = State<A>>) -> Self {
        let samples: Vec<_> = initial.into_iter().map(|state| HeldSample { state, next: 0 }).collect();
        let sums = (samples.len() >= EXACT_FROM).then(|| Box::new(ExactMeans::new(samples.iter().map(|sample| &sample.state))));
        let mut held = Self { samples, mean: State::REST, sums, motions: None, heard: None, ended: Vec::new() };
        held.refresh();
        held
    }

    /// Holds the initial states of some of the other peers, with their places in the session, in order. `weights`, over their mean, are those of a weighted mean;
    /// `None`: all are equal. States are held times their weights, so that their mean is the weighted one.
    #[must_use]
    pub fn of_some(initial: impl IntoIterator<Item = (u32, State<A>)>, weights: Option<Vec<f64>>) -> Self {
        let (senders, states): (Vec<u32>, Vec<State<A>>) = initial.into_iter().unzip();
        let weights = weights.unwrap_or_default();
        let weigh = |(place, state): (usize, State<A>)| weights.get(place).map_or(state, |weight| state.times(*weight));
        let mut held = Self::new(states.into_iter().enumerate().map(weigh));
        held.heard = Some(Box::new(Heard { senders, weights }));
        held
    }

    /// The place of a peer of the session among those held by the one in the place `own`; `None` if it is not heard.
    #[inline(always)]
    pub(crate) fn place_of(&self, sender: u32, own: u32) -> Option<usize> {
        if let Some(heard) = &self.heard {
            return heard.senders.binary_search(&sender).ok();
        }
        let (sender, own) = (sender as usize, own as usize);
        let place = if sender < own { sender } else { sender.wrapping_sub(1) };
        (sender != own && place < self.samples.len()).then_some(place)
    }

    /// A state as it is held.
    #[inline]
    fn weighed(&self, place: usize, state: State<A>) -> State<A> {
        let weight = self.heard.as_ref().and_then(|heard| heard.weights.get(place));
        weight.map_or(state, |weight| state.times(*weight))
    }

    /// Keeps send times and velocities for [`Held::lead`] from now on, for samples that move on up to an age of `horizon` \[s\]: the samples held so far count as sampled at the instant 0 of their senders' clocks.
    pub fn keep_ages(&mut self, horizon: f64) {
        let moving = |sample: &HeldSample<A>| Moving { sent: Instant::ZERO, velocity: sample.state.velocity };
        self.motions = Some(Motions { horizon, samples: self.samples.iter().map(moving).collect(), lead: Lead::STALE, now: [0.0; A] });
    }

    /// Samples move on up to an age of `horizon` \[s\] from now on, if [`Held::keep_ages`] was called.
    pub(crate) fn set_horizon(&mut self, horizon: f64) {
        if let Some(motions) = self.motions.as_mut().filter(|motions| motions.horizon.to_bits() != horizon.to_bits()) {
            (motions.horizon, motions.lead) = (horizon, Lead::STALE);
        }
    }

    /// How many other peers are heard.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether no other peer is heard.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The state held from the sender in that place, times its weight if weights differ; `None` beyond the last.
    #[must_use]
    pub fn state(&self, place: usize) -> Option<&State<A>> {
        self.samples.get(place).map(|sample| &sample.state)
    }

    /// The mean of the states held, as of the last [`Held::refresh`]; at rest at the origin if there is no other peer.
    #[must_use]
    pub fn mean(&self) -> &State<A> {
        &self.mean
    }

    /// The holder's own clock shows `now`: samples have moved on since they were sent.
    pub fn move_on(&mut self, now: Instant) {
        let Some(motions) = &mut self.motions else { return };
        if !motions.lead.holds_at(now) {
            motions.lead = Lead::of(motions.samples.iter().copied(), now, motions.horizon);
        }
        motions.now = motions.lead.at(now);
    }

    /// By how much the samples held have moved on since they were sent, on average, as of the last [`Held::move_on`] \[m\]: the mean of
    /// min(age, horizon)·velocity. Zero unless [`Held::keep_ages`] was called.
    #[must_use]
    pub fn lead(&self) -> [f64; A] {
        self.motions.as_ref().map_or([0.0; A], |motions| motions.now)
    }

    /// Takes in a sample that was sent at `sent` on its sender's clock if it is newer than the one held, and says whether it was: a late or repeated sample
    /// changes nothing.
    ///
    /// Call [`Held::refresh`] before the mean is used again.
    ///
    /// # Panics
    ///
    /// If there is no sender in that place.
    #[inline]
    pub fn accept(&mut self, place: usize, sequence: u64, sent: Instant, state: State<A>) -> bool {
        let newer = sequence >= self.samples[place].next && (sequence < u64::MAX || self.take_last(place));
        if newer {
            let state = self.weighed(place, state);
            self.replace(place, HeldSample { state, next: sequence.saturating_add(1) });
            if let Some(motions) = &mut self.motions {
                motions.set(place, Moving { sent, velocity: state.velocity });
            }
        }
        newer
    }

    /// Whether a sample with the number 2^64 − 1 is the first one from that sender: nothing is newer.
    #[cold]
    fn take_last(&mut self, place: usize) -> bool {
        let is_first = !self.ended.contains(&place);
        if is_first {
            self.ended.push(place);
        }
        is_first
    }

    /// Holds that state, sampled at `sent` on the sender's clock, from that sender, as if nothing had ever arrived from it: any sample is newer.
    ///
    /// # Panics
    ///
    /// If there is no sender in that place.
    pub fn hold(&mut self, place: usize, sent: Instant, state: State<A>) {
        let state = self.weighed(place, state);
        self.ended.retain(|ended| *ended != place);
        self.replace(place, HeldSample { state, next: 0 });
        if let Some(motions) = &mut self.motions {
            motions.set(place, Moving { sent, velocity: state.velocity });
        }
    }

    /// Replaces the state held from a sender, whose newest sample stays as new as it was, and the velocity with which it moves on.
    pub(crate) fn replace_state(&mut self, place: usize, state: State<A>, velocity: [f64; A]) {
        self.replace(place, HeldSample { state, ..self.samples[place] });
        if let Some(motions) = &mut self.motions {
            motions.set(place, Moving { velocity, ..motions.samples[place] });
        }
    }

    #[inline]
    fn replace(&mut self, place: usize, sample: HeldSample<A>) {
        if let Some(sums) = &mut self.sums {
            sums.replace(&self.samples[place].state, &sample.state);
        }
        self.samples[place] = sample;
    }

    /// [`Held::refresh`] for a mean of the differences from the holder's own state, so that senders that are held exactly there leave exactly that.
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

    /// Computes the mean anew.
    ///
    /// Below [`EXACT_FROM`] samples four partial sums, added in pairs: the same order whatever the machine, a quarter of the latency of one sum, and an error of at most
    /// (n/4 + 2)·2⁻⁵³·Σ|x|, a quarter of that of one sum.
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
        // As if nothing had ever arrived.
        held.hold(0, Instant::ZERO, at(0.0));
        assert!(held.accept(0, u64::MAX, Instant::ZERO, at(4.0)) && !held.accept(0, u64::MAX, Instant::ZERO, at(5.0)));
    }

    /// Ages 30 ms and, beyond the horizon, 33 ms: (0.030·(−1) + 0.033·(−2))/2; none below zero.
    #[test]
    fn samples_move_on_up_to_the_horizon() {
        let at_ms = |ms: u64| Instant::from_nanos(ms * 1_000_000);
        let mut held = Held::new([at(0.0), at(0.0)]);
        let lead = |held: &mut Held<1>, ms| {
            held.move_on(at_ms(ms));
            held.lead()
        };
        assert_eq!(lead(&mut held, 10), [0.0]);
        held.keep_ages(0.033);
        held.accept(0, 0, at_ms(10), at(1.0));
        held.hold(1, at_ms(5), at(2.0));
        assert_eq!(lead(&mut held, 40), [-0.048]);
        assert_eq!(lead(&mut held, 1), [0.0]);
        assert!(!held.accept(0, 0, at_ms(39), at(7.0)));
        assert_eq!(lead(&mut held, 40), [-0.048]);
        held.replace_state(1, at(3.0), [0.0]);
        assert_eq!(lead(&mut held, 40), [-0.015]);
    }

    /// Whatever came before, and in whatever order: the mean of equal states is that state, of others the nearest to theirs.
    #[test]
    fn the_mean_of_many_is_exact() {
        let count = EXACT_FROM;
        let value = |place: usize| 0.1 + (place as f64).sin() * 1e-3;
        let mut held = Held::new((0..count).map(|place| at(value(place))));
        let mut reversed = Held::new((0..count).rev().map(|place| at(value(place))));
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

    /// Weights 1 and 3: the mean of 0.5·x and 1.5·y, and so are leads; a peer that is not heard has no place.
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
