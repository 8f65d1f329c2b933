//! Datagrams of a joining in a session with a key.
//!
//! Send [`Joining::hello`] every quarter of a second, until [`Joining::handle_welcome`] accepts a received datagram. Then seal each sent sample with
//! [`Joined::seal`], and open each received datagram with [`Joined::open`].

use cohaptic_peer::wire::SampleKind;

use crate::handshake::{HANDSHAKE_LEN, HandshakeError, Hello, Welcome};
use crate::seal::{JoiningKeys, MAX_DATAGRAM, NONCE_LEN, SEAL_LEN, Sealed};
use crate::{Entropy, EntropyError, Label, Nonce, Place, SessionKey};

/// Peer that asks for a seat: a hello without an answer so far.
#[derive(Clone, Debug)]
pub struct Joining {
    hello: Hello,
    key: SessionKey,
    /// Kind of the samples, unless the welcome says that samples carry attitudes.
    kind: SampleKind,
}

impl Joining {
    /// Returns a joining for a session with samples of states, or of attitudes if the welcome says so. `client_nonce` must never have been used before.
    #[must_use]
    pub fn new(session: u64, place: Place, key: &SessionKey, client_nonce: Nonce) -> Self {
        Self { hello: Hello { session, place, client_nonce, scene: 0, label: Label::NONE }, key: key.clone(), kind: SampleKind::State }
    }

    /// Returns the joining with a hello that tells the fingerprint of the peer's scene and the label of its device. A session of another scene does not answer
    /// such a hello. A `scene` of 0 does not tell the scene.
    #[must_use]
    pub const fn introduced(mut self, scene: u64, label: Label) -> Self {
        (self.hello.scene, self.hello.label) = (scene, label);
        self
    }

    /// Returns the joining, for a session with samples of the kind `kind`.
    #[must_use]
    pub fn with_kind(self, kind: SampleKind) -> Self {
        Self { kind, ..self }
    }

    /// Returns a joining with a nonce drawn from `entropy`.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if the source has no random bytes.
    pub fn draw(session: u64, place: Place, key: &SessionKey, entropy: &mut impl Entropy) -> Result<Self, EntropyError> {
        let mut client_nonce = [0; NONCE_LEN];
        entropy.fill(&mut client_nonce)?;
        Ok(Self::new(session, place, key, client_nonce))
    }

    /// Returns the hello to be sent. Every call returns the same datagram.
    #[must_use]
    pub fn hello(&self) -> [u8; HANDSHAKE_LEN] {
        self.hello.encode(&self.key)
    }

    /// Checks whether `datagram` is the welcome for this joining, and returns the peer that has joined.
    ///
    /// # Errors
    ///
    /// [`WelcomeError`] if `datagram` is no welcome or the welcome for another joining. Such a datagram should be ignored. Never panics.
    pub fn handle_welcome(&self, datagram: &[u8]) -> Result<Joined, WelcomeError> {
        let welcome = Welcome::decode(datagram, &self.key)?;
        let Hello { session, place, client_nonce, .. } = self.hello;
        if (welcome.session, welcome.place, welcome.client_nonce) != (session, place, client_nonce) {
            return Err(WelcomeError::Other);
        }
        // The right tag and the nonce of this joining's hello prove that the welcome was made for this hello.
        let keys = JoiningKeys::derive(&self.key, session, place, client_nonce, welcome.server_nonce);
        let kind = if welcome.turns { SampleKind::Attitude } else { self.kind };
        Ok(Joined { welcome, keys, kind })
    }
}

/// Reason why a datagram is not the welcome for a joining.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WelcomeError {
    /// The datagram is no welcome, or was not made with the session key.
    #[error(transparent)]
    Handshake(#[from] HandshakeError),
    /// The welcome answers another hello.
    #[error("it answers another hello")]
    Other,
}

/// Peer with the keys of its joining. The peer has the seat as soon as the first sample is admitted.
#[derive(Debug)]
pub struct Joined {
    welcome: Welcome,
    keys: JoiningKeys,
    kind: SampleKind,
}

impl Joined {
    /// Returns the welcome, with the parameters of the session.
    #[must_use]
    pub const fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// Returns the kind of the session's samples.
    #[must_use]
    pub const fn kind(&self) -> SampleKind {
        self.kind
    }

    /// Writes the sealed sample to `out` and returns the length. Returns `None` if `sample` is too long for a sample.
    pub fn seal(&self, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<usize> {
        self.keys.to_door.seal(&self.keys.client_nonce, sample, out)
    }

    /// Returns the sample in a datagram from the session. The sample may be late or repeated: compare the sequence number with earlier samples of the same
    /// sender.
    ///
    /// # Errors
    ///
    /// [`OpenError`] if the datagram was not sealed for this joining. Never panics.
    pub fn open<'a>(&self, datagram: &'a [u8]) -> Result<&'a [u8], OpenError> {
        let expected = self.kind.datagram_len(usize::from(self.welcome.axes)) + SEAL_LEN;
        let sealed = Sealed::split(datagram).filter(|_| datagram.len() == expected).ok_or(OpenError::Length { found: datagram.len(), expected })?;
        // The nonce is compared before the tag, because the comparison is cheap and names the likelier cause, a sample of an earlier joining.
        if *sealed.client_nonce != self.keys.client_nonce {
            return Err(OpenError::OtherJoining);
        }
        if !self.keys.to_peer.verify(sealed.body, sealed.tag) {
            return Err(OpenError::Forged);
        }
        Ok(sealed.sample)
    }
}

/// Reason why a datagram from the session cannot be opened.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The datagram is not as long as a sealed sample of this session.
    #[error("{found} bytes; expected {expected}")]
    Length {
        /// Length of the datagram \[byte\].
        found: usize,
        /// Length of a sealed sample \[byte\].
        expected: usize,
    },
    /// The datagram was made for another joining, perhaps for an earlier joining of this peer.
    #[error("made for another joining")]
    OtherJoining,
    /// The tag is wrong: the datagram was made with another key, or changed.
    #[error("it was made with another key or changed on the way")]
    Forged,
}
