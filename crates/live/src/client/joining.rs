//! The datagrams of one joining in a session with a key.
//!
//! [`Joining::hello`] → send, again every quarter of a second until → [`Joining::handle_welcome`] → [`Joined::seal`] each sample sent, [`Joined::open`]
//! each datagram received.

use cohaptic_peer::wire::SampleKind;

use crate::handshake::{HANDSHAKE_LEN, HandshakeError, Hello, Welcome};
use crate::seal::{JoiningKeys, MAX_DATAGRAM, SEAL_LEN, Sealed};
use crate::{Entropy, EntropyError, Nonce, Place, SessionKey};

/// A peer that has asked for a seat, or is about to.
#[derive(Clone, Debug)]
pub struct Joining {
    hello: Hello,
    key: SessionKey,
    kind: SampleKind,
}

impl Joining {
    /// For a session whose samples are states, or carry attitudes, which the welcome says. With a nonce, which must never have been used before.
    #[must_use]
    pub fn new(session: u64, place: Place, key: &SessionKey, client_nonce: Nonce) -> Self {
        Self { hello: Hello { session, place, client_nonce }, key: key.clone(), kind: SampleKind::State }
    }

    /// For a session whose samples are of that kind.
    #[must_use]
    pub fn with_kind(self, kind: SampleKind) -> Self {
        Self { kind, ..self }
    }

    /// With a nonce that is drawn now.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if the source has no random bytes.
    pub fn draw(session: u64, place: Place, key: &SessionKey, entropy: &mut impl Entropy) -> Result<Self, EntropyError> {
        let mut client_nonce = [0; crate::NONCE_LEN];
        entropy.fill(&mut client_nonce)?;
        Ok(Self::new(session, place, key, client_nonce))
    }

    /// The datagram to send, the same each time.
    #[must_use]
    pub fn hello(&self) -> [u8; HANDSHAKE_LEN] {
        self.hello.encode(&self.key)
    }

    /// Takes in the answer.
    ///
    /// # Errors
    ///
    /// [`WelcomeError`] if it is no welcome, or none for this joining: it should be ignored. Never panics.
    pub fn handle_welcome(&self, datagram: &[u8]) -> Result<Joined, WelcomeError> {
        let welcome = Welcome::decode(datagram, &self.key)?;
        let Hello { session, place, client_nonce } = self.hello;
        if (welcome.session, welcome.place, welcome.client_nonce) != (session, place, client_nonce) {
            return Err(WelcomeError::Other);
        }
        let keys = JoiningKeys::derive(&self.key, session, place, client_nonce, welcome.server_nonce);
        let kind = if welcome.turns { SampleKind::Attitude } else { self.kind };
        Ok(Joined { welcome, keys, kind })
    }
}

/// Why a datagram is no welcome for this joining.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum WelcomeError {
    /// It is no welcome at all, or not one made with the key.
    #[error(transparent)]
    Handshake(#[from] HandshakeError),
    /// It answers another hello.
    #[error("it answers another hello")]
    Other,
}

/// A peer that may speak, and has a seat as soon as its first sample has arrived.
#[derive(Debug)]
pub struct Joined {
    welcome: Welcome,
    keys: JoiningKeys,
    kind: SampleKind,
}

impl Joined {
    /// What the session has said of the session.
    #[must_use]
    pub const fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// What samples of the session carry beyond the state.
    #[must_use]
    pub const fn kind(&self) -> SampleKind {
        self.kind
    }

    /// Writes a sample for the session and gives its length; `None` if `sample` is longer than a sample.
    pub fn seal(&self, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<usize> {
        self.keys.to_door.seal(&self.keys.client_nonce, sample, out)
    }

    /// The sample in a datagram from the session. It may be late or repeated: go by the number in it, sender by sender.
    ///
    /// # Errors
    ///
    /// [`OpenError`] if it was not made for this joining. Never panics.
    pub fn open<'a>(&self, datagram: &'a [u8]) -> Result<&'a [u8], OpenError> {
        let expected = self.kind.datagram_len(usize::from(self.welcome.axes)) + SEAL_LEN;
        let sealed = Sealed::split(datagram).filter(|_| datagram.len() == expected).ok_or(OpenError::Length { found: datagram.len(), expected })?;
        if *sealed.client_nonce != self.keys.client_nonce {
            return Err(OpenError::OtherJoining);
        }
        if !self.keys.to_peer.verify(sealed.body, sealed.tag) {
            return Err(OpenError::Forged);
        }
        Ok(sealed.sample)
    }
}

/// Why a datagram from the session cannot be opened.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum OpenError {
    /// It has another length than a sealed sample of this session.
    #[error("{found} bytes; expected {expected}")]
    Length {
        /// The length it has.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// It was made for another joining, perhaps an earlier one of this peer.
    #[error("made for another joining")]
    OtherJoining,
    /// Its tag is wrong.
    #[error("it was made with another key or changed on the way")]
    Forged,
}
