//! The newest sample from each of the other peers, and their mean.

use alloc::vec::Vec;

use crate::State;

/// What a peer knows of the others: per sender, the sample with the highest sequence number that has arrived.
///
/// Before anything has arrived from a sender it holds the sender's initial state. The mean is kept until a sample changes it.
#[derive(Clone, Debug)]
pub struct Held<const A: usize> {
    samples: Vec<HeldSample<A>>,
    mean: State<A>,
}

#[derive(Clone, Copy, Debug)]
struct HeldSample<const A: usize> {
    state: State<A>,
    /// The lowest sequence number that is newer than what is held.
    next: u64,
}

impl<const A: usize> Held<A> {
    /// Holds the initial state of each other peer, in the order of the peers with the holder left out.
    #[must_use]
    pub fn new(initial: impl IntoIterator<Item = State<A>>) -> Self {
        let samples = initial.into_iter().map(|state| HeldSample { state, next: 0 }).collect();
        let mut held = Self { samples, mean: State::REST };
        held.refresh();
        held
    }

    /// How many other peers there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there is no other peer.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The state held from the sender in that place, `None` beyond the last.
    #[must_use]
    pub fn state(&self, place: usize) -> Option<&State<A>> {
        self.samples.get(place).map(|sample| &sample.state)
    }

    /// The mean of the states held, as of the last [`Held::refresh`]; at rest at the origin if there is no other peer.
    #[must_use]
    pub fn mean(&self) -> &State<A> {
        &self.mean
    }

    /// Takes in a sample if it is newer than the one held, and says whether it was: a late or repeated sample changes nothing.
    ///
    /// Call [`Held::refresh`] before the mean is used again.
    ///
    /// # Panics
    ///
    /// If there is no sender in that place.
    #[inline]
    pub fn accept(&mut self, place: usize, sequence: u64, state: State<A>) -> bool {
        let held = &mut self.samples[place];
        let newer = sequence >= held.next;
        if newer {
            // A sequence number of 2^64 − 1 is the last there can be: nothing is newer.
            *held = HeldSample { state, next: sequence.saturating_add(1) };
        }
        newer
    }

    /// Holds that state from that sender, as if nothing had ever arrived from it: any sample is newer.
    ///
    /// # Panics
    ///
    /// If there is no sender in that place.
    pub fn hold(&mut self, place: usize, state: State<A>) {
        self.samples[place] = HeldSample { state, next: 0 };
    }

    /// Replaces the state held from a sender, whose newest sample stays as new as it was.
    pub(crate) fn replace_state(&mut self, place: usize, state: State<A>) {
        self.samples[place].state = state;
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
    /// Four partial sums, added in pairs: the same order whatever the machine, a quarter of the latency of one sum, and an error of at most
    /// (n/4 + 2)·2⁻⁵³·Σ|x|, a quarter of that of one sum.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn refresh(&mut self) {
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
        assert!(held.accept(1, 5, at(5.0)));
        assert!(!held.accept(1, 4, at(4.0)));
        assert!(!held.accept(1, 5, at(99.0)));
        assert!(held.accept(1, 6, at(6.0)));
        assert!(held.accept(0, 0, at(1.0)));
        held.refresh();
        assert_eq!(*held.mean(), at(3.5));
    }

    #[test]
    fn the_last_sequence_number_of_all_is_still_accepted_once() {
        let mut held = Held::new([at(0.0)]);
        assert!(held.accept(0, u64::MAX - 1, at(1.0)));
        assert!(held.accept(0, u64::MAX, at(2.0)));
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
