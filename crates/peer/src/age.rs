//! How much of a sender's newest sample counts, when nothing has been heard of it for a while or it has just come back.

use alloc::vec::Vec;

use crate::State;

/// What is held in place of a sender: weight·\[(1 − share)·before + share·newest\] + (1 − weight)·own, with its newest sample, what was held before it came
/// back, and the receiver's own copy. Both numbers lie from 0 to 1.
///
/// With a weight of 0 the sender exerts no force at all.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Age {
    /// How much of the sender's pull is left.
    pub weight: f64,
    /// How far it has come on its way from where it was to where it is now.
    pub share: f64,
}

impl Age {
    /// The newest sample and nothing else: a sender that is there.
    pub const WHOLE: Self = Self { weight: 1.0, share: 1.0 };
    /// The receiver's own state: a sender that is not there.
    pub const GONE: Self = Self { weight: 0.0, share: 1.0 };

    #[expect(clippy::float_cmp, reason = "one is one: anything below it is computed")]
    fn is_whole(self) -> bool {
        self.weight == 1.0 && self.share == 1.0
    }
}

/// The ages of those senders that have one.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ages<const A: usize>(Vec<Aged<A>>);

#[derive(Clone, Debug)]
struct Aged<const A: usize> {
    place: usize,
    age: Age,
    newest: State<A>,
    /// What was held when it came back.
    before: State<A>,
    /// From this number on a sample is a return.
    awaited: Option<u64>,
    returned: bool,
}

impl<const A: usize> Ages<A> {
    #[inline]
    pub(crate) const fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn set(&mut self, place: usize, age: Age, held: State<A>) {
        self.of(place, held).age = age;
    }

    pub(crate) fn await_return(&mut self, place: usize, sequence: u64, held: State<A>) {
        let aged = self.of(place, held);
        (aged.awaited, aged.returned) = (Some(sequence), false);
    }

    pub(crate) fn take_return(&mut self, place: usize) -> bool {
        self.0.iter_mut().find(|aged| aged.place == place).is_some_and(|aged| core::mem::take(&mut aged.returned))
    }

    /// A sample that is newer than all before it.
    #[cold]
    pub(crate) fn arrived(&mut self, place: usize, sequence: u64, state: State<A>) {
        let Some(aged) = self.0.iter_mut().find(|aged| aged.place == place) else { return };
        if aged.awaited.is_some_and(|first| sequence >= first) {
            aged.before = aged.base();
            (aged.awaited, aged.returned) = (None, true);
        }
        aged.newest = state;
    }

    pub(crate) fn replace(&mut self, place: usize, state: State<A>) {
        if let Some(aged) = self.0.iter_mut().find(|aged| aged.place == place) {
            (aged.newest, aged.before) = (state, state);
        }
    }

    /// What is held of each of them.
    pub(crate) fn held(&self, own: &State<A>) -> impl Iterator<Item = (usize, State<A>)> {
        self.0.iter().map(move |aged| (aged.place, if aged.age.is_whole() { aged.newest } else { mix(own, &aged.base(), aged.age.weight) }))
    }

    pub(crate) fn all_whole(&self) -> bool {
        self.0.iter().all(|aged| aged.age.is_whole())
    }

    fn of(&mut self, place: usize, held: State<A>) -> &mut Aged<A> {
        let index = self.0.iter().position(|aged| aged.place == place).unwrap_or_else(|| {
            self.0.push(Aged { place, age: Age::WHOLE, newest: held, before: held, awaited: None, returned: false });
            self.0.len() - 1
        });
        &mut self.0[index]
    }
}

impl<const A: usize> Aged<A> {
    fn base(&self) -> State<A> {
        if self.age.share < 1.0 { mix(&self.before, &self.newest, self.age.share) } else { self.newest }
    }
}

/// From `from` to `to`, that part of the way; exactly `from` at 0.
fn mix<const A: usize>(from: &State<A>, to: &State<A>, part: f64) -> State<A> {
    State {
        position: core::array::from_fn(|axis| from.position[axis] + part * (to.position[axis] - from.position[axis])),
        velocity: core::array::from_fn(|axis| from.velocity[axis] + part * (to.velocity[axis] - from.velocity[axis])),
    }
}
