//! The two datagrams before the samples, in sessions with a key: a [`Hello`] is answered by a [`Welcome`].
//!
//! Both are 88 bytes: an answer that is no longer than its request amplifies nothing for a sender with a false address. They end
//! with a tag under the session key, and differ in their first four bytes, so that neither passes for the other. A hello alone changes nothing in the
//! session.

mod hello;
mod welcome;

pub use hello::{HELLO_MAGIC, Hello};
pub use welcome::{WELCOME_MAGIC, Welcome};

use crate::SessionKey;
use crate::seal::{TAG_LEN, Tag, session_tag, verify_session_tag};

/// The version of the protocol, in both datagrams.
pub const VERSION: u16 = 1;
/// The length of a hello and of a welcome \[byte\].
pub const HANDSHAKE_LEN: usize = BODY_LEN + TAG_LEN;

const BODY_LEN: usize = 72;

/// The fault of a hello or a welcome.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum HandshakeError {
    /// It begins with other bytes.
    #[error("it is no such datagram")]
    Magic,
    /// It is of another version.
    #[error("version {found} of the protocol; expected {VERSION}")]
    Version {
        /// The version it has.
        found: u16,
    },
    /// It has another length.
    #[error("{found} bytes; expected {HANDSHAKE_LEN}")]
    Length {
        /// The length it has.
        found: usize,
    },
    /// A byte that must be zero is not, or a number is out of its range.
    #[error("a reserved byte is not zero or a number is out of its range")]
    Reserved,
    /// Its tag is wrong: it was made with another key, or changed.
    #[error("it was made with another key or changed on the way")]
    Forged,
}

/// Checks what both have in common, and gives the body.
fn open(datagram: &[u8], magic: [u8; 4]) -> Result<(&[u8; BODY_LEN], &Tag), HandshakeError> {
    let Some(start) = datagram.first_chunk::<6>() else { return Err(HandshakeError::Length { found: datagram.len() }) };
    if start[..4] != magic {
        return Err(HandshakeError::Magic);
    }
    let version = u16::from_le_bytes([start[4], start[5]]);
    if version != VERSION {
        return Err(HandshakeError::Version { found: version });
    }
    let datagram: &[u8; HANDSHAKE_LEN] = datagram.try_into().map_err(|_| HandshakeError::Length { found: datagram.len() })?;
    let body = datagram.first_chunk().expect("a body is shorter");
    let tag = datagram.last_chunk().expect("a tag is shorter");
    Ok((body, tag))
}

fn verify(key: &SessionKey, body: &[u8; BODY_LEN], tag: &Tag) -> Result<(), HandshakeError> {
    if verify_session_tag(key, body, tag) { Ok(()) } else { Err(HandshakeError::Forged) }
}

fn finish(key: &SessionKey, body: &[u8; BODY_LEN]) -> [u8; HANDSHAKE_LEN] {
    let mut datagram = [0; HANDSHAKE_LEN];
    datagram[..BODY_LEN].copy_from_slice(body);
    datagram[BODY_LEN..].copy_from_slice(&session_tag(key, body));
    datagram
}

/// The bytes at a place of a body.
fn part<const N: usize>(body: &[u8; BODY_LEN], start: usize) -> [u8; N] {
    let mut part = [0; N];
    part.copy_from_slice(&body[start..start + N]);
    part
}
