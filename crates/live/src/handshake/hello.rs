//! Hello: the datagram of a peer that asks for a seat.
//!
//! ```text
//! offset  size  field
//!      0     4  "CHPH"
//!      4     2  version, 1
//!      6     2  zero
//!      8     8  session
//!     16     4  place of the seat that the peer asks for
//!     20     4  zero
//!     24    16  nonce of the client
//!     40     8  fingerprint of the scene, or zero
//!     48     8  label of the device, ASCII, padded by zeros
//!     56    16  zero, so that the answer is not longer
//!     72    16  tag under the session key
//! ```

use super::{BODY_LEN, HANDSHAKE_LEN, HandshakeError, VERSION, finish, open, part, verify};
use crate::{Label, Nonce, Place, SessionKey};

/// First four bytes of a hello.
pub(crate) const HELLO_MAGIC: [u8; 4] = *b"CHPH";

/// Request of a peer for a seat.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Hello {
    /// Number of the session.
    pub session: u64,
    /// Place of the requested seat.
    pub place: Place,
    /// Nonce of the client, drawn by the peer for a single joining.
    pub client_nonce: Nonce,
    /// Fingerprint of the peer's scene, or 0 if the peer does not tell the scene.
    pub scene: u64,
    /// Label of the peer's device.
    pub label: Label,
}

impl Hello {
    /// Returns the datagram, tagged under `key`.
    #[must_use]
    pub fn encode(&self, key: &SessionKey) -> [u8; HANDSHAKE_LEN] {
        let mut body = [0; BODY_LEN];
        body[0..4].copy_from_slice(&HELLO_MAGIC);
        body[4..6].copy_from_slice(&VERSION.to_le_bytes());
        // Bytes 6 to 7, 20 to 23 and 56 to 71 stay zero: the format reserves these bytes.
        body[8..16].copy_from_slice(&self.session.to_le_bytes());
        body[16..20].copy_from_slice(&self.place.0.to_le_bytes());
        body[24..40].copy_from_slice(&self.client_nonce);
        body[40..48].copy_from_slice(&self.scene.to_le_bytes());
        body[48..56].copy_from_slice(&self.label.bytes());
        finish(key, &body)
    }

    /// Reads a hello without checking the tag, so that cheap checks of the content can come first. Fails if first bytes, version, length or reserved bytes are
    /// wrong. The caller then checks the tag with [`UncheckedHello::verify`].
    pub(crate) fn decode(datagram: &[u8]) -> Result<UncheckedHello<'_>, HandshakeError> {
        let (body, tag) = open(datagram, HELLO_MAGIC)?;
        if body[6..8] != [0; 2] || body[20..24] != [0; 4] || body[56..72] != [0; 16] {
            return Err(HandshakeError::Reserved);
        }
        let hello = Self {
            session: u64::from_le_bytes(part(body, 8)),
            place: Place(u32::from_le_bytes(part(body, 16))),
            client_nonce: part(body, 24),
            scene: u64::from_le_bytes(part(body, 40)),
            label: Label::from_bytes(part(body, 48)).ok_or(HandshakeError::Reserved)?,
        };
        Ok(UncheckedHello { hello, body, tag })
    }
}

/// Hello before the check of the tag: the content may be forged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UncheckedHello<'a> {
    pub(crate) hello: Hello,
    body: &'a [u8; BODY_LEN],
    tag: &'a crate::seal::Tag,
}

impl UncheckedHello<'_> {
    /// Checks the tag. Fails with [`HandshakeError::Forged`] if the tag is not the tag of the hello under `key`.
    pub(crate) fn verify(&self, key: &SessionKey) -> Result<(), HandshakeError> {
        verify(key, self.body, self.tag)
    }
}
