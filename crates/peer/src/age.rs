//! How much of a sender's newest sample counts, when nothing has been heard of it for a while or it has just come back.

use alloc::vec::Vec;

use crate::rotation::{Attitude, HeldAttitude, Rotation};
use crate::wire::{Extra, Sample};
use crate::{Device, Peer, ReceiveError, Reception, State, Strategy};

/// The state held in place of that of a sender: weight·\[(1 − share)·before + share·newest\] + (1 − weight)·own, with its newest sample, the state held before it came
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

/// The ages of those senders that have one, as one receiver sees them.
///
/// They are kept beside the [`Peer`], not in it: most peers never have any, and are not to be larger for them nor to ask for them at every tick. The driver of
/// a peer with ages calls [`Ages::handle_sample`] in place of [`Peer::handle_sample`], and [`Ages::apply`] before every [`Peer::compute`]. A state that
/// [`Peer::hold`] puts in the place of a sender with an age is not kept.
///
/// The others count in order, with the receiver left out. Every method takes the same peer.
#[derive(Clone, Debug, Default)]
pub struct Ages<const A: usize> {
    aged: Vec<Aged<A>>,
    /// Whether the own state was part of the state held after the latest [`Ages::apply`]: it moves, so the mean does.
    fading: bool,
}

#[derive(Clone, Debug)]
struct Aged<const A: usize> {
    place: usize,
    age: Age,
    newest: State<A>,
    /// What was held when it came back.
    before: State<A>,
    /// Its newest attitude and the one that was held when it came back, if the object turns: matrices and angular velocities in world axes are blended.
    turned: Option<(HeldAttitude, HeldAttitude)>,
    /// From this number on a sample is a return.
    awaited: Option<u64>,
    returned: bool,
}

impl<const A: usize> Ages<A> {
    /// Sets how much of another peer's newest sample counts from the next tick on. Until it is first set it is [`Age::WHOLE`], and then forces are what they
    /// would be without ages, to the bit.
    ///
    /// Weight and share should change in small steps: a step of either is a step of the force.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    pub fn set<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, other: usize, age: Age) {
        self.of(peer, other).age = age;
        *peer.aged_parts().2 = true;
    }

    /// From now on the first sample from another peer with that sequence number or a later one is its *return*: it is taken in as always, and what was held
    /// before it, [`Age::share`] included, is kept as that from which the share counts. See [`Ages::take_return`].
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    pub fn await_return<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, other: usize, sequence: u64) {
        let aged = self.of(peer, other);
        (aged.awaited, aged.returned) = (Some(sequence), false);
    }

    /// Whether another peer has returned since this was last asked.
    ///
    /// The caller then sets the age anew before the next tick: with a weight above zero, to a share of zero that rises from there.
    pub fn take_return(&mut self, other: usize) -> bool {
        self.aged.iter_mut().find(|aged| aged.place == other).is_some_and(|aged| core::mem::take(&mut aged.returned))
    }

    /// Hands a sample to the peer.
    ///
    /// # Errors
    ///
    /// Those of [`Peer::handle_sample`]; nothing changed.
    pub fn handle_sample<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, sample: &Sample<A>) -> Result<Reception, ReceiveError> {
        self.handle_extended(peer, sample, &Extra::NONE)
    }

    /// [`Ages::handle_sample`] with what a sample for this peer says beyond position and velocity.
    ///
    /// # Errors
    ///
    /// Those of [`Peer::handle_sample`]; nothing changed.
    pub fn handle_extended<D: Device<A>, S: Strategy<A>>(
        &mut self,
        peer: &mut Peer<A, D, S>,
        sample: &Sample<A>,
        extra: &Extra<A>,
    ) -> Result<Reception, ReceiveError> {
        let received = peer.handle_extended(sample, extra)?;
        let place = peer.place_of(sample.sender).filter(|_| received == Reception::Newest);
        if let Some(aged) = self.aged.iter_mut().find(|aged| Some(aged.place) == place) {
            aged.turned(sample.sequence, &extra.attitude);
            aged.arrived(sample.sequence, sample.state);
        }
        Ok(received)
    }

    /// Lets the ages count at the tick whose forces are computed next.
    ///
    /// Where nobody fades the mean is that of [`crate::Held::refresh`], to the bit.
    pub fn apply<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>) {
        let (own, held, stale_mean, rotation) = peer.aged_parts();
        if self.aged.is_empty() || !(*stale_mean || self.fading) {
            return;
        }
        for aged in &self.aged {
            held.replace_state(aged.place, aged.held(own), aged.newest.velocity.map(|velocity| aged.age.weight * aged.age.share * velocity));
        }
        self.fading = self.aged.iter().any(|aged| !aged.age.is_whole());
        if self.fading {
            held.refresh_around(own);
        } else {
            held.refresh();
        }
        *stale_mean = false;
        if let Some(rotation) = rotation {
            self.apply_turned(rotation);
        }
    }

    fn apply_turned(&self, rotation: &mut Rotation) {
        let own = rotation.own_held();
        for aged in &self.aged {
            if let Some(held) = aged.held_turned(&own) {
                rotation.replace_held(aged.place, held);
            }
        }
        rotation.refresh_held(self.fading.then_some(&own));
    }

    fn of<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, place: usize) -> &mut Aged<A> {
        let index = self.aged.iter().position(|aged| aged.place == place).unwrap_or_else(|| {
            let (_, held, _, rotation) = peer.aged_parts();
            let newest = *held.state(place).expect("there is another peer in that place");
            let turned = rotation.map(|rotation| rotation.held(place)).map(|held| (held, held));
            self.aged.push(Aged { place, age: Age::WHOLE, newest, before: newest, turned, awaited: None, returned: false });
            self.aged.len() - 1
        });
        &mut self.aged[index]
    }
}

impl<const A: usize> Aged<A> {
    /// A sample that is newer than all before it.
    fn arrived(&mut self, sequence: u64, state: State<A>) {
        if self.awaited.is_some_and(|first| sequence >= first) {
            self.before = self.base();
            (self.awaited, self.returned) = (None, true);
        }
        self.newest = state;
    }

    /// An attitude that is newer than all before it.
    fn turned(&mut self, sequence: u64, attitude: &Attitude) {
        let returns = self.awaited.is_some_and(|first| sequence >= first);
        let before = if returns { self.base_turned() } else { None };
        if let Some((newest, kept)) = &mut self.turned {
            *kept = before.unwrap_or(*kept);
            *newest = HeldAttitude::of(attitude);
        }
    }

    fn held_turned(&self, own: &HeldAttitude) -> Option<HeldAttitude> {
        let (newest, _) = self.turned?;
        if self.age.is_whole() { Some(newest) } else { self.base_turned().map(|base| own.mix(&base, self.age.weight)) }
    }

    fn base_turned(&self) -> Option<HeldAttitude> {
        self.turned.map(|(newest, before)| if self.age.share < 1.0 { before.mix(&newest, self.age.share) } else { newest })
    }

    fn held(&self, own: &State<A>) -> State<A> {
        if self.age.is_whole() { self.newest } else { mix(own, &self.base(), self.age.weight) }
    }

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
