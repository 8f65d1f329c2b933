//! Tags and the keys they are made with: HMAC-SHA256 (RFC 2104, FIPS 180-4), cut to its first 16 bytes.
//!
//! ```text
//! sealed sample = sample ‖ client nonce (16) ‖ tag (16)
//! key of a way  = HMAC(session key, "cohaptic 1 to door" or "… to peer" ‖ session ‖ place ‖ client nonce ‖ server nonce)
//! tag           = first 16 bytes of HMAC(key of the way, everything before the tag)
//! ```
//!
//! The nonce of the client travels with every sample, so that the session need not remember requests: see [`crate::admission`].

use core::fmt;

use cohaptic_peer::wire;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use zeroize::Zeroizing;

use crate::{Place, SessionKey};

/// The length of a nonce \[byte\].
pub const NONCE_LEN: usize = 16;
/// The length of a tag \[byte\].
pub const TAG_LEN: usize = 16;
/// By how much a sealed sample is longer than the sample in it \[byte\].
pub const SEAL_LEN: usize = NONCE_LEN + TAG_LEN;
/// The length of the largest datagram of a session \[byte\]. A buffer to receive into must be longer, or a longer datagram would pass for one of
/// this length.
pub const MAX_DATAGRAM: usize = wire::MAX_LEN + SEAL_LEN;

/// Bytes that are used once: for one joining.
pub type Nonce = [u8; NONCE_LEN];
pub(crate) type Tag = [u8; TAG_LEN];

const TO_DOOR: &[u8] = b"cohaptic 1 to door";
const TO_PEER: &[u8] = b"cohaptic 1 to peer";

/// The secret with which the samples of one joining are tagged, on one way: HMAC that has taken in its key, which is two fifths of the work for a
/// sample of one axis. It is overwritten when it is dropped.
pub(crate) struct WayKey(Hmac<Sha256>);

impl fmt::Debug for WayKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("WayKey(secret)")
    }
}

/// Both ways of one joining.
#[derive(Debug)]
pub(crate) struct JoiningKeys {
    pub(crate) to_door: WayKey,
    pub(crate) to_peer: WayKey,
    pub(crate) client_nonce: Nonce,
}

impl JoiningKeys {
    /// The keys of the joining that these two nonces are of.
    pub(crate) fn derive(key: &SessionKey, session: u64, place: Place, client_nonce: Nonce, server_nonce: Nonce) -> Self {
        let way = |label| WayKey::derive(label, key, session, place, &client_nonce, &server_nonce);
        Self { to_door: way(TO_DOOR), to_peer: way(TO_PEER), client_nonce }
    }

    /// The keys of the joining that this sample is of, if it was sealed under them with that nonce of the server.
    pub(crate) fn of_sample(key: &SessionKey, session: u64, place: Place, sealed: Sealed<'_>, server_nonce: &Nonce) -> Option<Self> {
        // Half the work is enough for a sample that is forged.
        let way = |label| WayKey::derive(label, key, session, place, sealed.client_nonce, server_nonce);
        let to_door = way(TO_DOOR);
        to_door.verify(sealed.body, sealed.tag).then(|| Self { to_door, to_peer: way(TO_PEER), client_nonce: *sealed.client_nonce })
    }
}

impl WayKey {
    fn derive(label: &[u8], key: &SessionKey, session: u64, place: Place, client_nonce: &Nonce, server_nonce: &Nonce) -> Self {
        Self(begin(&way_secret(label, key, session, place, client_nonce, server_nonce)[..]))
    }

    /// Writes `sample`, the nonce and the tag, and gives the length; `None` if `sample` is longer than a sample can be.
    pub(crate) fn seal(&self, client_nonce: &Nonce, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<usize> {
        if sample.len() > wire::MAX_LEN {
            return None;
        }
        let body = sample.len() + NONCE_LEN;
        out[..sample.len()].copy_from_slice(sample);
        out[sample.len()..body].copy_from_slice(client_nonce);
        let mut state = self.0.clone();
        state.update(&out[..body]);
        let tag = cut(&state.finalize().into_bytes().into());
        out[body..body + TAG_LEN].copy_from_slice(&tag);
        Some(body + TAG_LEN)
    }

    /// Whether `tag` is that of `body`, in a time that does not depend on where they differ.
    pub(crate) fn verify(&self, body: &[u8], tag: &Tag) -> bool {
        verify(self.0.clone(), body, tag)
    }
}

/// A sealed sample, taken apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sealed<'a> {
    pub(crate) sample: &'a [u8],
    pub(crate) client_nonce: &'a Nonce,
    /// The sample and the nonce: what the tag is of.
    pub(crate) body: &'a [u8],
    pub(crate) tag: &'a Tag,
}

impl<'a> Sealed<'a> {
    /// `None` if it is shorter than a seal alone.
    pub(crate) fn split(datagram: &'a [u8]) -> Option<Self> {
        let (body, tag) = datagram.split_last_chunk::<TAG_LEN>()?;
        let (sample, client_nonce) = body.split_last_chunk::<NONCE_LEN>()?;
        Some(Self { sample, client_nonce, body, tag })
    }
}

/// The tag of `body` under the session key itself: for the handshake.
pub(crate) fn session_tag(key: &SessionKey, body: &[u8]) -> Tag {
    cut(&mac(key.as_bytes(), &[body]))
}

/// Whether `tag` is that of `body` under the session key itself.
pub(crate) fn verify_session_tag(key: &SessionKey, body: &[u8], tag: &Tag) -> bool {
    verify(begin(key.as_bytes()), body, tag)
}

/// 16 bytes that only the holder of `secret` can tell beforehand, different for each input.
pub(crate) fn nonce_of(secret: &[u8; 32], parts: &[&[u8]]) -> Nonce {
    cut(&mac(secret, parts))
}

fn way_secret(label: &[u8], key: &SessionKey, session: u64, place: Place, client_nonce: &Nonce, server_nonce: &Nonce) -> Zeroizing<[u8; 32]> {
    mac(key.as_bytes(), &[label, &session.to_le_bytes(), &place.0.to_le_bytes(), client_nonce, server_nonce])
}

fn begin(key: &[u8]) -> Hmac<Sha256> {
    Hmac::new_from_slice(key).expect("HMAC takes keys of any length")
}

fn mac(key: &[u8], parts: &[&[u8]]) -> Zeroizing<[u8; 32]> {
    let mut state = begin(key);
    for part in parts {
        state.update(part);
    }
    Zeroizing::new(state.finalize().into_bytes().into())
}

fn verify(mut state: Hmac<Sha256>, body: &[u8], tag: &Tag) -> bool {
    state.update(body);
    state.verify_truncated_left(tag).is_ok()
}

fn cut(whole: &[u8; 32]) -> Tag {
    let mut tag = [0; TAG_LEN];
    tag.copy_from_slice(&whole[..TAG_LEN]);
    tag
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `docs/examples/live-protocol.txt` has the same keys; they were computed by another program.
    #[test]
    fn the_keys_of_both_ways_are_those_of_the_page() {
        let counting = |from: u8| std::array::from_fn(|place| from + u8::try_from(place).unwrap());
        let key = SessionKey::from_bytes(std::array::from_fn(|place| u8::try_from(place).unwrap()));
        let examples = include_str!("../../../docs/examples/live-protocol.txt");
        for (title, label) in [("key to the session", TO_DOOR), ("key to the peer", TO_PEER)] {
            let secret = way_secret(label, &key, 0x0123_4567_89ab_cdef, Place(1), &counting(0x40), &counting(0x80));
            let hex: Vec<_> = secret.iter().map(|byte| format!("{byte:02x}")).collect();
            let block = format!("[{title}]\n0000  {}\n0010  {}\n", hex[..16].join(" "), hex[16..].join(" "));
            assert!(examples.contains(&block), "{block}");
        }
    }

    /// RFC 4231, test case 2.
    #[test]
    fn hmac_is_that_of_the_rfc() {
        let expected = [0x5b, 0xdc, 0xc1, 0x46, 0xbf, 0x60, 0x75, 0x4e, 0x6a, 0x04, 0x24, 0x26, 0x08, 0x95, 0x75, 0xc7];
        assert_eq!(cut(&mac(b"Jefe", &[b"what do ya want ", b"for nothing?"])), expected);
    }
}
