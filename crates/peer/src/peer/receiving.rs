//! Step 2 of a tick: samples of other peers.

use super::Peer;
use crate::wire::{DecodeError, Extra, Sample, SampleKind};
use crate::{Device, State, Strategy};

/// Effect of a valid sample on the receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Reception {
    /// The sample is the newest of its sender and is held from now on.
    Newest,
    /// The sample is late, and its displacement was added to the position held for its sender.
    Added,
    /// The sample is late or repeated. Nothing changed.
    Stale,
}

/// Reason for the refusal of a datagram. The peer is unchanged.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReceiveError {
    /// The datagram is no sample in the format of this session.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// The sample belongs to another session.
    #[error("a sample of session {found:#x}")]
    Session {
        /// Session in the sample.
        found: u64,
    },
    /// The sample is for another peer.
    #[error("a sample for peer {receiver}")]
    Receiver {
        /// Place of the receiver in the sample.
        receiver: u32,
    },
    /// The sender is this peer itself, or is no peer of this session that this peer hears.
    #[error("a sample from peer {sender}, which is not another peer of this session")]
    Sender {
        /// Place of the sender in the sample.
        sender: u32,
    },
}

impl<const A: usize, D: Device<A>, S: Strategy<A>> Peer<A, D, S> {
    /// Step 2: takes in a datagram of another peer.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] for a datagram that is no sample for this peer. Nothing changed.
    #[inline]
    pub fn handle_datagram(&mut self, datagram: &[u8]) -> Result<Reception, ReceiveError> {
        let (sample, extra) = Sample::decode_as(datagram, self.asked.kind, self.config.axes)?;
        // A personal sample for another peer carries numbers that mean nothing here.
        if self.asked.kind.is_personal() && extra.receiver != self.config.place {
            return Err(ReceiveError::Receiver { receiver: extra.receiver });
        }
        self.handle_extended(&sample, &extra)
    }

    /// Step 2 with a decoded datagram. Many peers can receive the same datagram, and one decoding is enough for them.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] for a sample that is not for this peer. Nothing changed.
    #[inline(always)]
    pub fn handle_sample(&mut self, sample: &Sample<A>) -> Result<Reception, ReceiveError> {
        if self.asked.kind != SampleKind::State {
            return self.handle_extended(sample, &Extra::NONE);
        }
        Ok(self.accept(sample)?.map_or(Reception::Stale, |_| Reception::Newest))
    }

    /// Like [`Peer::handle_sample`], with the `extra` data of a sample beyond position and velocity.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`] for a sample that is not for this peer. Nothing changed.
    #[inline(always)]
    pub fn handle_extended(&mut self, sample: &Sample<A>, extra: &Extra<A>) -> Result<Reception, ReceiveError> {
        if self.increments.is_some() {
            return self.handle_increment(sample, &extra.numbers);
        }
        let Some(place) = self.accept(sample)? else { return Ok(Reception::Stale) };
        if self.asked.kind != SampleKind::State {
            self.strategy.accept(place, &extra.numbers);
            if let Some(rotation) = &mut self.rotation {
                rotation.hold(place, &extra.attitude);
            }
        }
        Ok(Reception::Newest)
    }

    /// Takes in a sample with a displacement. The position held for the sender is the sum of all displacements, whatever the position in the sample is. Not
    /// inlined, because few peers sum displacements.
    #[inline(never)]
    fn handle_increment(&mut self, sample: &Sample<A>, displacement: &[f64; A]) -> Result<Reception, ReceiveError> {
        let place = self.sender_of(sample)?;
        let Some(increments) = &mut self.increments else { return Ok(Reception::Stale) };
        let is_added = increments.add(place, sample.sequence, displacement);
        let state = State { velocity: sample.state.velocity, ..increments.state(place) };
        let received = if self.held.accept(place, sample.sequence, sample.sent, state) {
            increments.set_velocity(place, state.velocity);
            Reception::Newest
        } else if is_added {
            // The velocity stays the velocity of the newest sample.
            let state = increments.state(place);
            self.held.replace_state(place, state, state.velocity);
            Reception::Added
        } else {
            Reception::Stale
        };
        self.stale_mean |= received != Reception::Stale;
        Ok(received)
    }

    /// Returns the index of a sample's sender in [`Held`].
    #[inline(always)]
    fn sender_of(&self, sample: &Sample<A>) -> Result<usize, ReceiveError> {
        // The session first: a sender's place has a meaning only inside its session.
        if sample.session != self.config.session {
            return Err(ReceiveError::Session { found: sample.session });
        }
        self.place_of(sample.sender).ok_or(ReceiveError::Sender { sender: sample.sender })
    }

    /// Takes in position and velocity, and returns the index of the sender in [`Held`]; `None` for a late or repeated sample.
    #[inline(always)]
    fn accept(&mut self, sample: &Sample<A>) -> Result<Option<usize>, ReceiveError> {
        let place = self.sender_of(sample)?;
        let is_newest = self.held.accept(place, sample.sequence, sample.sent, sample.state);
        // The mean waits until the tick: several samples may arrive before.
        self.stale_mean |= is_newest;
        Ok(is_newest.then_some(place))
    }

    /// Returns the index of `sender` in [`Held`]; `None` for a sender that this peer does not hear.
    #[inline(always)]
    pub(crate) fn place_of(&self, sender: u32) -> Option<usize> {
        self.held.place_of(sender, self.config.place)
    }

    /// Returns the state of the sender with index `place` after the sample `newest` was taken in: `newest` itself, or the sum of displacements.
    pub(crate) fn newest_of(&self, place: usize, newest: &State<A>) -> State<A> {
        self.increments.as_ref().map_or(*newest, |increments| increments.state(place))
    }
}
