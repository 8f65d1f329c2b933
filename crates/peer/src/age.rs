//! Fading of silent senders: weight of a sender's newest sample after a silence and after a return.
//!
//! In: ages from a driver, and samples. Out: blended states in [`Held`](crate::Held) of the receiver. This module does not know how long a sender was silent;
//! the driver decides that and sets the ages.

use alloc::vec::Vec;

use crate::rotation::{Attitude, HeldAttitude, Rotation};
use crate::wire::{Extra, Sample};
use crate::{Device, Peer, ReceiveError, Reception, State, Strategy};

/// Weights of a blended state. The state held for a sender is weight·\[(1 − share)·before + share·newest\] + (1 − weight)·own, where *newest* is the sender's
/// newest sample, *before* the state held until the sender's return, and *own* the state of the receiver's copy. Weight and share lie from 0 to 1.
///
/// A sender with a weight of 0 exerts no force.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Age {
    /// Remaining part of the sender's pull, 0 to 1.
    pub weight: f64,
    /// Progress from the state held before the return, 0, to the newest sample, 1.
    pub share: f64,
}

impl Age {
    /// A present sender: the newest sample alone.
    pub const WHOLE: Self = Self { weight: 1.0, share: 1.0 };
    /// An absent sender: the receiver's own state.
    pub const GONE: Self = Self { weight: 0.0, share: 1.0 };

    #[expect(clippy::float_cmp, reason = "one is one: anything below it is computed")]
    fn is_whole(self) -> bool {
        self.weight == 1.0 && self.share == 1.0
    }
}

/// Ages of senders, as seen by one receiver. A sender without an age counts as [`Age::WHOLE`].
///
/// Ages are kept beside the [`Peer`], not in it: most peers never have an age, and neither their size nor their ticks should pay for ages. The driver of a
/// peer with ages calls [`Ages::handle_sample`] in place of [`Peer::handle_sample`], and [`Ages::apply`] before every [`Peer::compute`]. A state that
/// [`Peer::hold`] sets for a sender with an age is lost at the next [`Ages::apply`].
///
/// The index `other` counts the other peers in their order, without the receiver. Every method must be called with the same peer.
#[derive(Clone, Debug, Default)]
pub struct Ages<const A: usize> {
    aged: Vec<Aged<A>>,
    /// `true` if the own state was part of a held state at the latest [`Ages::apply`]. The own state moves, so the mean must then be computed at each tick.
    fading: bool,
}

/// A sender with an age.
#[derive(Clone, Debug)]
struct Aged<const A: usize> {
    /// Index of the sender in [`Held`](crate::Held).
    place: usize,
    age: Age,
    newest: State<A>,
    /// State held at the time of the return.
    before: State<A>,
    /// Newest attitude, and attitude held at the time of the return, for a rotating object. Matrices and angular velocities in world axes are blended.
    turned: Option<(HeldAttitude, HeldAttitude)>,
    /// Sequence number from which a sample counts as a return; `None` without an awaited return.
    awaited: Option<u64>,
    /// `true` if the sender has returned since the last [`Ages::take_return`].
    returned: bool,
}

impl<const A: usize> Ages<A> {
    /// Sets the age of the other peer `other` from the next tick on. Before the first call the age is [`Age::WHOLE`], and forces equal the forces without
    /// ages, to the bit.
    ///
    /// Weight and share should change in small steps: a step of weight or share is a step of the force.
    ///
    /// # Panics
    ///
    /// If the index `other` is out of range.
    pub fn set<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, other: usize, age: Age) {
        self.of(peer, other).age = age;
        // A new age changes the mean as a new sample does.
        *peer.aged_parts().2 = true;
    }

    /// Awaits a return of the other peer `other`: the first sample with the number `sequence` or a later number. The returning sample is taken in as usual,
    /// and the state held before it, blended by [`Age::share`], becomes the state from which the share counts. See [`Ages::take_return`].
    ///
    /// # Panics
    ///
    /// If the index `other` is out of range.
    pub fn await_return<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, other: usize, sequence: u64) {
        let aged = self.of(peer, other);
        (aged.awaited, aged.returned) = (Some(sequence), false);
    }

    /// Returns whether the peer `other` has returned since the last call.
    ///
    /// After a return the caller sets a new age before the next tick: with a weight above zero, and a share that rises from zero.
    pub fn take_return(&mut self, other: usize) -> bool {
        self.aged.iter_mut().find(|aged| aged.place == other).is_some_and(|aged| core::mem::take(&mut aged.returned))
    }

    /// Passes a sample to the peer, and notes a return.
    ///
    /// # Errors
    ///
    /// The errors of [`Peer::handle_sample`]. Nothing changed.
    pub fn handle_sample<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, sample: &Sample<A>) -> Result<Reception, ReceiveError> {
        self.handle_extended(peer, sample, &Extra::NONE)
    }

    /// Like [`Ages::handle_sample`], with the `extra` data of a sample beyond position and velocity.
    ///
    /// # Errors
    ///
    /// The errors of [`Peer::handle_sample`]. Nothing changed.
    pub fn handle_extended<D: Device<A>, S: Strategy<A>>(
        &mut self,
        peer: &mut Peer<A, D, S>,
        sample: &Sample<A>,
        extra: &Extra<A>,
    ) -> Result<Reception, ReceiveError> {
        // The peer decides whether the sample changes what is held; only then the age sees the sample.
        let received = peer.handle_extended(sample, extra)?;
        let place = peer.place_of(sample.sender).filter(|_| received != Reception::Stale);
        if let Some(aged) = self.aged.iter_mut().find(|aged| Some(aged.place) == place) {
            // The attitude first: `arrived` clears `awaited`, by which `turned` recognises a return.
            aged.turned(sample.sequence, &extra.attitude);
            aged.arrived(sample.sequence, peer.newest_of(aged.place, &sample.state));
        }
        Ok(received)
    }

    /// Writes the blended states into the samples held by the peer, for the next [`Peer::compute`].
    ///
    /// If no sender fades, the mean equals the mean of [`crate::Held::refresh`], to the bit.
    pub fn apply<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>) {
        let (own, held, stale_mean, rotation) = peer.aged_parts();
        if self.aged.is_empty() || !(*stale_mean || self.fading) {
            return;
        }
        // A stale mean comes from a new sample or a new age, so all blended states are written again.
        for aged in &self.aged {
            // The lead extrapolates with the part of the velocity that is still in the blend.
            held.replace_state(aged.place, aged.held(own), aged.newest.velocity.map(|velocity| aged.age.weight * aged.age.share * velocity));
        }
        self.fading = self.aged.iter().any(|aged| !aged.age.is_whole());
        // Sums around the own state cancel exactly for senders of weight 0, which then exert no force.
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
        // Matrices are blended, not quaternions: the mean of matrices is what the torque uses, and a blend of matrices has no sign to choose.
        let own = rotation.own_held();
        for aged in &self.aged {
            if let Some(held) = aged.held_turned(&own) {
                rotation.replace_held(aged.place, held);
            }
        }
        rotation.refresh_held(self.fading.then_some(&own));
    }

    fn of<D: Device<A>, S: Strategy<A>>(&mut self, peer: &mut Peer<A, D, S>, place: usize) -> &mut Aged<A> {
        // Few senders have an age, so a linear search is enough. The first age of a sender begins with the sample held now.
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
    /// Takes in a sample that is newer than all earlier samples of this sender.
    fn arrived(&mut self, sequence: u64, state: State<A>) {
        // The share counts from the state that acted until now, so that the force does not jump.
        if self.awaited.is_some_and(|first| sequence >= first) {
            self.before = self.base();
            (self.awaited, self.returned) = (None, true);
        }
        self.newest = state;
    }

    /// Takes in an attitude that is newer than all earlier attitudes of this sender.
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

/// Returns the point between `from` and `to` at the fraction `part` of the way; exactly `from` at 0.
fn mix<const A: usize>(from: &State<A>, to: &State<A>, part: f64) -> State<A> {
    State {
        position: core::array::from_fn(|axis| from.position[axis] + part * (to.position[axis] - from.position[axis])),
        velocity: core::array::from_fn(|axis| from.velocity[axis] + part * (to.velocity[axis] - from.velocity[axis])),
    }
}
