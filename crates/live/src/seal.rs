//! Tags of datagrams, and the keys of tags. All tags and keys are HMAC-SHA256 (RFC 2104, FIPS 180-4); a tag is the first 16 bytes.
//!
//! ```text
//! sealed sample = sample ‖ client nonce (16) ‖ tag (16)
//! key of a way  = HMAC(session key, "cohaptic 1 to door" or "… to peer" ‖ session ‖ place ‖ client nonce ‖ server nonce)
//! tag           = first 16 bytes of HMAC(key of the way, everything before the tag)
//! ```
//!
//! The client's nonce travels with every sample, so that the session can derive the keys again and need not remember hellos: see [`crate::admission`].

use core::fmt;

use cohaptic_peer::wire;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use zeroize::Zeroizing;

use crate::{Place, SessionKey};

/// Length of a nonce \[byte\].
pub(crate) const NONCE_LEN: usize = 16;
/// Length of a tag \[byte\].
pub(crate) const TAG_LEN: usize = 16;
/// Length of a seal: nonce and tag \[byte\].
pub(crate) const SEAL_LEN: usize = NONCE_LEN + TAG_LEN;
/// Length of the longest datagram of a session \[byte\]. A buffer for receiving must be longer: the system would cut a longer datagram to this length, and the
/// datagram would pass for valid.
pub const MAX_DATAGRAM: usize = wire::MAX_LEN + SEAL_LEN;

/// Random bytes for a single joining.
pub type Nonce = [u8; NONCE_LEN];
/// First bytes of an HMAC: a proof that a holder of the key made the datagram.
pub(crate) type Tag = [u8; TAG_LEN];

/// Label of the key for samples to the session. Different labels give different keys, so that a sample cannot be sent back to the sender.
const TO_DOOR: &[u8] = b"cohaptic 1 to door";
/// Label of the key for samples to the peer.
const TO_PEER: &[u8] = b"cohaptic 1 to peer";

/// Key for the tags of a joining's samples in one direction. Kept as an HMAC state that has absorbed the key already: the key need not be hashed again for
/// every sample. The state is overwritten when dropped.
pub(crate) struct WayKey(Hmac<Sha256>);

impl fmt::Debug for WayKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("WayKey(secret)")
    }
}

/// Keys of a joining, for both directions, and the client's nonce, carried by every sample.
#[derive(Debug)]
pub(crate) struct JoiningKeys {
    pub(crate) to_door: WayKey,
    pub(crate) to_peer: WayKey,
    pub(crate) client_nonce: Nonce,
}

impl JoiningKeys {
    /// Returns the keys of a joining at the seat of the peer at `place`, with the two nonces.
    pub(crate) fn derive(key: &SessionKey, session: u64, place: Place, client_nonce: Nonce, server_nonce: Nonce) -> Self {
        let way = |label| WayKey::derive(label, key, session, place, &client_nonce, &server_nonce);
        Self { to_door: way(TO_DOOR), to_peer: way(TO_PEER), client_nonce }
    }

    /// Returns the keys of the joining of `sealed`, with `server_nonce` as nonce of the server. Returns `None` if the tag does not fit these keys.
    pub(crate) fn of_sample(key: &SessionKey, session: u64, place: Place, sealed: Sealed<'_>, server_nonce: &Nonce) -> Option<Self> {
        // The key of the other direction is derived only after the tag has been verified, so that a forged sample costs one derivation, not two.
        let way = |label| WayKey::derive(label, key, session, place, sealed.client_nonce, server_nonce);
        let to_door = way(TO_DOOR);
        to_door.verify(sealed.body, sealed.tag).then(|| Self { to_door, to_peer: way(TO_PEER), client_nonce: *sealed.client_nonce })
    }
}

impl WayKey {
    /// Returns the key of the direction named by `label`.
    fn derive(label: &[u8], key: &SessionKey, session: u64, place: Place, client_nonce: &Nonce, server_nonce: &Nonce) -> Self {
        Self(begin(&way_secret(label, key, session, place, client_nonce, server_nonce)[..]))
    }

    /// Writes `sample`, the client's nonce and the tag to `out`, and returns the length of the three. Returns `None` if `sample` is longer than
    /// [`wire::MAX_LEN`].
    pub(crate) fn seal(&self, client_nonce: &Nonce, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<usize> {
        if sample.len() > wire::MAX_LEN {
            return None;
        }
        // `body + TAG_LEN` is at most `MAX_DATAGRAM`, because `sample` is at most `wire::MAX_LEN` long.
        let body = sample.len() + NONCE_LEN;
        out[..sample.len()].copy_from_slice(sample);
        out[sample.len()..body].copy_from_slice(client_nonce);
        let mut state = self.0.clone();
        state.update(&out[..body]);
        let tag = cut(&state.finalize().into_bytes().into());
        out[body..body + TAG_LEN].copy_from_slice(&tag);
        Some(body + TAG_LEN)
    }

    /// Returns whether `tag` is the tag of `body`. The time taken does not depend on the position of the first difference.
    pub(crate) fn verify(&self, body: &[u8], tag: &Tag) -> bool {
        verify(self.0.clone(), body, tag)
    }
}

/// Parts of a sealed sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sealed<'a> {
    pub(crate) sample: &'a [u8],
    pub(crate) client_nonce: &'a Nonce,
    /// Sample and nonce together: the tagged bytes.
    pub(crate) body: &'a [u8],
    pub(crate) tag: &'a Tag,
}

impl<'a> Sealed<'a> {
    /// Splits a datagram into sample, nonce and tag. Returns `None` if the datagram is shorter than a seal. The sample can be empty.
    pub(crate) fn split(datagram: &'a [u8]) -> Option<Self> {
        let (body, tag) = datagram.split_last_chunk::<TAG_LEN>()?;
        let (sample, client_nonce) = body.split_last_chunk::<NONCE_LEN>()?;
        Some(Self { sample, client_nonce, body, tag })
    }
}

/// Returns the tag of `body` under the session key itself, as in hellos and welcomes.
pub(crate) fn session_tag(key: &SessionKey, body: &[u8]) -> Tag {
    cut(&mac(key.as_bytes(), &[body]))
}

/// Returns whether `tag` is the tag of `body` under the session key itself.
pub(crate) fn verify_session_tag(key: &SessionKey, body: &[u8], tag: &Tag) -> bool {
    verify(begin(key.as_bytes()), body, tag)
}

/// Returns 16 bytes that differ from input to input. Only a holder of `secret` can predict the bytes.
pub(crate) fn nonce_of(secret: &[u8; 32], parts: &[&[u8]]) -> Nonce {
    cut(&mac(secret, parts))
}

/// Returns the secret of one direction. All parts but the label have a fixed length, and both labels have the same length, so that different inputs never give
/// the same bytes.
fn way_secret(label: &[u8], key: &SessionKey, session: u64, place: Place, client_nonce: &Nonce, server_nonce: &Nonce) -> Zeroizing<[u8; 32]> {
    mac(key.as_bytes(), &[label, &session.to_le_bytes(), &place.0.to_le_bytes(), client_nonce, server_nonce])
}

/// Returns an HMAC state after absorbing `key`.
fn begin(key: &[u8]) -> Hmac<Sha256> {
    Hmac::new_from_slice(key).expect("HMAC takes keys of any length")
}

/// Returns the HMAC of the concatenated `parts`.
fn mac(key: &[u8], parts: &[&[u8]]) -> Zeroizing<[u8; 32]> {
    let mut state = begin(key);
    for part in parts {
        state.update(part);
    }
    Zeroizing::new(state.finalize().into_bytes().into())
}

/// Compares the first bytes of the HMAC of `body` with `tag`, in constant time.
fn verify(mut state: Hmac<Sha256>, body: &[u8], tag: &Tag) -> bool {
    state.update(body);
    state.verify_truncated_left(tag).is_ok()
}

/// Returns the first bytes of an HMAC as a tag.
fn cut(whole: &[u8; 32]) -> Tag {
    let mut tag = [0; TAG_LEN];
    tag.copy_from_slice(&whole[..TAG_LEN]);
    tag
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares the keys of both directions with `docs/examples/live-protocol.txt`, whose keys another program computed.
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

    /// The expected value is RFC 4231, test case 2.
    #[test]
    fn hmac_is_that_of_the_rfc() {
        let expected = [0x5b, 0xdc, 0xc1, 0x46, 0xbf, 0x60, 0x75, 0x4e, 0x6a, 0x04, 0x24, 0x26, 0x08, 0x95, 0x75, 0xc7];
        assert_eq!(cut(&mac(b"Jefe", &[b"what do ya want ", b"for nothing?"])), expected);
    }
}
