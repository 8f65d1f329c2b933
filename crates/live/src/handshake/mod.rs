//! The datagrams of a session beside samples. A [`Hello`] from the peer and a [`Welcome`] from the session precede the samples in sessions with a key.
//! [`Taken`] tells a program that another program has its seat, with a key and without.
//!
//! Hello and welcome are 88 bytes long. An answer no longer than its request amplifies nothing for a sender with a false address. Both datagrams end with a tag
//! under the session key. Their first four bytes differ, so that neither datagram passes for the other. A hello alone changes nothing in the session.

pub(crate) mod hello;
mod taken;
mod welcome;

pub use hello::Hello;
pub use taken::{Notice, Taken};
pub use welcome::Welcome;

use crate::SessionKey;
use crate::seal::{TAG_LEN, Tag, session_tag, verify_session_tag};

/// Version of the protocol, in hellos and welcomes.
pub(crate) const VERSION: u16 = 1;
/// Length of a hello and of a welcome \[byte\].
pub const HANDSHAKE_LEN: usize = BODY_LEN + TAG_LEN;

/// Length of a hello or a welcome without the tag \[byte\].
const BODY_LEN: usize = 72;

/// Fault of a hello or a welcome.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HandshakeError {
    /// The datagram begins with other bytes than a hello or a welcome does.
    #[error("it is not a datagram of the handshake")]
    Magic,
    /// The datagram has another version of the protocol.
    #[error("version {found} of the protocol; expected {VERSION}")]
    Version {
        /// Version in the datagram.
        found: u16,
    },
    /// The datagram is not [`HANDSHAKE_LEN`] bytes long.
    #[error("{found} bytes; expected {HANDSHAKE_LEN}")]
    Length {
        /// Length of the datagram \[byte\].
        found: usize,
    },
    /// A byte that must be zero is not zero, or a number is out of range.
    #[error("a reserved byte is not zero or a number is out of its range")]
    Reserved,
    /// The tag is wrong: the datagram was made with another key, or changed.
    #[error("it was made with another key or changed on the way")]
    Forged,
}

/// Checks first bytes, version and length, in this order. Returns body and tag; the tag is not checked here.
fn open(datagram: &[u8], magic: [u8; 4]) -> Result<(&[u8; BODY_LEN], &Tag), HandshakeError> {
    let Some(start) = datagram.first_chunk::<6>() else { return Err(HandshakeError::Length { found: datagram.len() }) };
    if start[..4] != magic {
        return Err(HandshakeError::Magic);
    }
    // The version is checked before the length: another version may have another length, and the version is the better explanation.
    let version = u16::from_le_bytes([start[4], start[5]]);
    if version != VERSION {
        return Err(HandshakeError::Version { found: version });
    }
    // After this last check the length is right, so that body and tag are fixed parts of the datagram.
    let datagram: &[u8; HANDSHAKE_LEN] = datagram.try_into().map_err(|_| HandshakeError::Length { found: datagram.len() })?;
    let body = datagram.first_chunk().expect("a body is shorter");
    let tag = datagram.last_chunk().expect("a tag is shorter");
    Ok((body, tag))
}

/// Checks the tag of a body.
fn verify(key: &SessionKey, body: &[u8; BODY_LEN], tag: &Tag) -> Result<(), HandshakeError> {
    if verify_session_tag(key, body, tag) { Ok(()) } else { Err(HandshakeError::Forged) }
}

/// Returns the datagram: the body, and the tag of the body under `key`.
fn finish(key: &SessionKey, body: &[u8; BODY_LEN]) -> [u8; HANDSHAKE_LEN] {
    let mut datagram = [0; HANDSHAKE_LEN];
    datagram[..BODY_LEN].copy_from_slice(body);
    datagram[BODY_LEN..].copy_from_slice(&session_tag(key, body));
    datagram
}

/// Returns the `N` bytes of a body from index `start` on. Callers pass a start of at most `BODY_LEN - N`.
fn part<const N: usize>(body: &[u8; BODY_LEN], start: usize) -> [u8; N] {
    let mut part = [0; N];
    part.copy_from_slice(&body[start..start + N]);
    part
}
