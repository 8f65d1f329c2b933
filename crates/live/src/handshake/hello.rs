//! A peer asks for its seat.
//!
//! ```text
//! offset  size  field
//!      0     4  "CHPH"
//!      4     2  version, 1
//!      6     2  zero
//!      8     8  session
//!     16     4  place that the peer wants
//!     20     4  zero
//!     24    16  nonce of the client
//!     40    32  zero, so that the answer is not longer
//!     72    16  tag under the session key
//! ```

use super::{BODY_LEN, HANDSHAKE_LEN, HandshakeError, VERSION, finish, open, part, verify};
use crate::{Nonce, Place, SessionKey};

/// The first four bytes of a hello.
pub const HELLO_MAGIC: [u8; 4] = *b"CHPH";

/// A peer asks for its seat.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Hello {
    /// The session.
    pub session: u64,
    /// The seat it wants.
    pub place: Place,
    /// Drawn by the peer for this joining.
    pub client_nonce: Nonce,
}

impl Hello {
    /// The datagram.
    #[must_use]
    pub fn encode(&self, key: &SessionKey) -> [u8; HANDSHAKE_LEN] {
        let mut body = [0; BODY_LEN];
        body[0..4].copy_from_slice(&HELLO_MAGIC);
        body[4..6].copy_from_slice(&VERSION.to_le_bytes());
        body[8..16].copy_from_slice(&self.session.to_le_bytes());
        body[16..20].copy_from_slice(&self.place.0.to_le_bytes());
        body[24..40].copy_from_slice(&self.client_nonce);
        finish(key, &body)
    }

    /// Reads a hello, and then checks its tag with [`UncheckedHello::verify`].
    pub(crate) fn decode(datagram: &[u8]) -> Result<UncheckedHello<'_>, HandshakeError> {
        let (body, tag) = open(datagram, HELLO_MAGIC)?;
        if body[6..8] != [0; 2] || body[20..24] != [0; 4] || body[40..72] != [0; 32] {
            return Err(HandshakeError::Reserved);
        }
        let hello =
            Self { session: u64::from_le_bytes(part(body, 8)), place: Place(u32::from_le_bytes(part(body, 16))), client_nonce: part(body, 24) };
        Ok(UncheckedHello { hello, body, tag })
    }
}

/// A hello whose tag has not been looked at: what it says may be a lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UncheckedHello<'a> {
    pub(crate) hello: Hello,
    body: &'a [u8; BODY_LEN],
    tag: &'a crate::seal::Tag,
}

impl UncheckedHello<'_> {
    pub(crate) fn verify(&self, key: &SessionKey) -> Result<(), HandshakeError> {
        verify(key, self.body, self.tag)
    }
}
