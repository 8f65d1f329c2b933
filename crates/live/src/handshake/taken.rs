//! Notice that a seat is taken: the session's answer to a sample that was refused because another program has the seat.
//!
//! ```text
//! offset  size  field
//!      0     4  "CHPS"
//!      4     2  version, 1
//!      6     2  zero
//!      8     8  session
//!     16     4  place of the seat
//!     20     4  zero
//!     24    16  nonce of the client, as in the refused sample; only with a key
//!     40    16  tag under the session key; only with a key
//! ```
//!
//! A notice is shorter than every sample, 24 bytes to at least 64 and, with a key, 56 to at least 96. So the answer to a sample from a
//! false address amplifies nothing, with a key and without.

use super::VERSION;
use crate::seal::{NONCE_LEN, TAG_LEN, session_tag, verify_session_tag};
use crate::{Nonce, Place, SessionKey};

/// First four bytes of a notice.
const TAKEN_MAGIC: [u8; 4] = *b"CHPS";
/// Length of a notice in a session without a key \[byte\].
const PLAIN_LEN: usize = 24;
/// Length of a notice without the tag in a session with a key \[byte\].
const BODY_LEN: usize = PLAIN_LEN + NONCE_LEN;

/// Notice of the session that another program has the seat.
#[derive(Clone, Copy, Debug)]
pub struct Taken<'a> {
    /// Number of the session.
    pub session: u64,
    /// Place of the seat.
    pub place: Place,
    /// Session key, and nonce of the client in the refused sample. With the nonce a notice counts for a single joining. `None` in a session without a key.
    pub seal: Option<(&'a SessionKey, Nonce)>,
}

/// Bytes of a notice.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Notice {
    buffer: [u8; BODY_LEN + TAG_LEN],
    len: usize,
}

impl Notice {
    /// Returns the datagram.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.buffer[..self.len]
    }
}

impl Taken<'_> {
    /// Returns the datagram, tagged if there is a key.
    #[must_use]
    pub fn encode(&self) -> Notice {
        let (body, len) = self.body();
        let mut buffer = [0; BODY_LEN + TAG_LEN];
        buffer[..BODY_LEN].copy_from_slice(&body);
        let Some((key, _)) = self.seal else { return Notice { buffer, len } };
        buffer[BODY_LEN..].copy_from_slice(&session_tag(key, &body));
        Notice { buffer, len: len + TAG_LEN }
    }

    /// Returns whether `datagram` is this notice, with the right tag. Never panics.
    #[must_use]
    pub fn is(&self, datagram: &[u8]) -> bool {
        let (body, len) = self.body();
        match self.seal {
            None => *datagram == body[..len],
            // The body is compared first, because only a datagram that claims to be this notice is worth a hash.
            Some((key, _)) => datagram.split_last_chunk().is_some_and(|(found, tag)| *found == body && verify_session_tag(key, found, tag)),
        }
    }

    /// Returns the bytes before the tag, and the number of bytes in use.
    fn body(&self) -> ([u8; BODY_LEN], usize) {
        let mut body = [0; BODY_LEN];
        body[0..4].copy_from_slice(&TAKEN_MAGIC);
        body[4..6].copy_from_slice(&VERSION.to_le_bytes());
        body[8..16].copy_from_slice(&self.session.to_le_bytes());
        body[16..20].copy_from_slice(&self.place.0.to_le_bytes());
        let Some((_, nonce)) = self.seal else { return (body, PLAIN_LEN) };
        body[PLAIN_LEN..].copy_from_slice(&nonce);
        (body, BODY_LEN)
    }
}
