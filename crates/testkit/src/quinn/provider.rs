//! Cryptography of TLS with random numbers from the test bed.
//!
//! Ciphers, hashes and signatures come from *ring*. The key exchange of *ring* always draws from the system, so the key exchange comes from `x25519-dalek`.

use std::sync::Arc;

use ::quinn::rustls::crypto::{ActiveKeyExchange, CryptoProvider, GetRandomFailed, SecureRandom, SharedSecret, SupportedKxGroup, ring};
use ::quinn::rustls::ffdhe_groups::FfdheGroup;
use ::quinn::rustls::{Error, NamedGroup, PeerMisbehaved};
use x25519_dalek::{X25519_BASEPOINT_BYTES, x25519};

use crate::context;
use crate::current;

/// Length of a key of X25519, secret or public \[byte\].
const KEY: usize = 32;

/// Returns cryptography for [`rustls`](::quinn::rustls) with random numbers from the running test bed. Handshakes have the same bytes in every run of the same
/// seed. The seed is enough to decrypt a connection, so use this provider in tests only.
#[must_use]
pub fn crypto_provider() -> Arc<CryptoProvider> {
    Arc::new(CryptoProvider { kx_groups: vec![&Curve], secure_random: &FromTestbed, ..ring::default_provider() })
}

/// Source of random numbers of the running test bed of this thread.
#[derive(Debug)]
struct FromTestbed;

impl SecureRandom for FromTestbed {
    fn fill(&self, buffer: &mut [u8]) -> Result<(), GetRandomFailed> {
        context::shared().ok_or(GetRandomFailed)?.with(|core| core.entropy(current::host()).fill(buffer));
        Ok(())
    }
}

/// Key exchange X25519 (RFC 7748).
#[derive(Debug)]
struct Curve;

impl SupportedKxGroup for Curve {
    fn start(&self) -> Result<Box<dyn ActiveKeyExchange>, Error> {
        let mut secret = [0; KEY];
        FromTestbed.fill(&mut secret)?;
        Ok(Box::new(Exchange { secret, public: x25519(secret, X25519_BASEPOINT_BYTES) }))
    }

    fn ffdhe_group(&self) -> Option<FfdheGroup<'static>> {
        None
    }

    fn name(&self) -> NamedGroup {
        NamedGroup::X25519
    }
}

/// One side of a key exchange.
struct Exchange {
    secret: [u8; KEY],
    public: [u8; KEY],
}

impl ActiveKeyExchange for Exchange {
    fn complete(self: Box<Self>, peer: &[u8]) -> Result<SharedSecret, Error> {
        let peer = peer.try_into().map_err(|_| PeerMisbehaved::InvalidKeyShare)?;
        let shared = x25519(self.secret, peer);
        // The peer has sent a point of small order, which must be refused (RFC 8446, 7.4.2).
        if shared == [0; KEY] {
            return Err(PeerMisbehaved::InvalidKeyShare.into());
        }
        Ok(shared.as_slice().into())
    }

    fn pub_key(&self) -> &[u8] {
        &self.public
    }

    fn group(&self) -> NamedGroup {
        NamedGroup::X25519
    }
}
