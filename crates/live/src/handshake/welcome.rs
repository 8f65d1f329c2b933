//! Welcome: the session's answer to a hello. A welcome tells the peer the parameters of the session.
//!
//! ```text
//! offset  size  field
//!      0     4  "CHPW"
//!      4     2  version, 1
//!      6     1  axes, 1 to 3
//!      7     1  1 if samples carry attitudes, else 0
//!      8     8  session
//!     16     4  place of the seat, as in the hello
//!     20     4  number of peers of the scene
//!     24    16  nonce of the client, as in the hello
//!     40    16  nonce of the server
//!     56     8  control tick of the peer [ns]
//!     64     8  period of sending [ns]
//!     72    16  tag under the session key
//! ```

use core::time::Duration;

use super::{BODY_LEN, HANDSHAKE_LEN, HandshakeError, VERSION, finish, open, part, verify};
use crate::{Nonce, Place, SessionKey};

/// First four bytes of a welcome.
pub(crate) const WELCOME_MAGIC: [u8; 4] = *b"CHPW";

/// Answer of the session to a [`Hello`](super::Hello): parameters of the session, and the nonces of both sides.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Welcome {
    /// Number of axes of a sample, 1 to 3.
    pub axes: u8,
    /// `true` if samples carry attitudes, as in scenes whose object turns.
    pub turns: bool,
    /// Number of the session.
    pub session: u64,
    /// Place of the seat, as in the hello. Below `peers`.
    pub place: Place,
    /// Number of peers of the scene, this peer included.
    pub peers: u32,
    /// Nonce of the client, copied from the hello. A peer recognizes the answer to its own hello by this nonce.
    pub client_nonce: Nonce,
    /// Nonce of the server. The keys of the joining are derived from both nonces.
    pub server_nonce: Nonce,
    /// Control tick Tc of the peer, above zero. Encoded in whole nanoseconds, at most 2⁶⁴ − 1 (584 years).
    pub tick: Duration,
    /// Period of sending Tn, above zero. Encoded in whole nanoseconds, at most 2⁶⁴ − 1 (584 years).
    pub update: Duration,
}

impl Welcome {
    /// Returns the datagram, tagged under `key`.
    #[must_use]
    pub fn encode(&self, key: &SessionKey) -> [u8; HANDSHAKE_LEN] {
        let nanos = |span: Duration| u64::try_from(span.as_nanos()).unwrap_or(u64::MAX).to_le_bytes();
        let mut body = [0; BODY_LEN];
        body[0..4].copy_from_slice(&WELCOME_MAGIC);
        body[4..6].copy_from_slice(&VERSION.to_le_bytes());
        body[6] = self.axes;
        body[7] = u8::from(self.turns);
        body[8..16].copy_from_slice(&self.session.to_le_bytes());
        body[16..20].copy_from_slice(&self.place.0.to_le_bytes());
        body[20..24].copy_from_slice(&self.peers.to_le_bytes());
        body[24..40].copy_from_slice(&self.client_nonce);
        body[40..56].copy_from_slice(&self.server_nonce);
        body[56..64].copy_from_slice(&nanos(self.tick));
        body[64..72].copy_from_slice(&nanos(self.update));
        finish(key, &body)
    }

    /// Reads a welcome and checks the tag.
    ///
    /// # Errors
    ///
    /// [`HandshakeError`] for the first fault, in this order: first four bytes, version, length, tag, reserved bytes and ranges (1 to 3 axes, a place below
    /// the number of peers, periods above zero). Never panics.
    pub fn decode(datagram: &[u8], key: &SessionKey) -> Result<Self, HandshakeError> {
        let (body, tag) = open(datagram, WELCOME_MAGIC)?;
        // The tag is checked before any field is read: a welcome without the right tag says nothing.
        verify(key, body, tag)?;
        let welcome = Self {
            axes: body[6],
            turns: body[7] == 1,
            session: u64::from_le_bytes(part(body, 8)),
            place: Place(u32::from_le_bytes(part(body, 16))),
            peers: u32::from_le_bytes(part(body, 20)),
            client_nonce: part(body, 24),
            server_nonce: part(body, 40),
            tick: Duration::from_nanos(u64::from_le_bytes(part(body, 56))),
            update: Duration::from_nanos(u64::from_le_bytes(part(body, 64))),
        };
        let sound = body[7] <= 1 && (1..=3).contains(&welcome.axes) && welcome.place.0 < welcome.peers;
        if sound && !welcome.tick.is_zero() && !welcome.update.is_zero() { Ok(welcome) } else { Err(HandshakeError::Reserved) }
    }
}
