//! The cryptography of TLS with random numbers from the test bed.
//!
//! Ciphers, hashes and signatures are those of *ring*. Its key exchange draws from the system and cannot be told otherwise, so that one is `x25519-dalek`'s.

use std::sync::Arc;

use ::quinn::rustls::crypto::{ActiveKeyExchange, CryptoProvider, GetRandomFailed, SecureRandom, SharedSecret, SupportedKxGroup, ring};
use ::quinn::rustls::ffdhe_groups::FfdheGroup;
use ::quinn::rustls::{Error, NamedGroup, PeerMisbehaved};
use x25519_dalek::{X25519_BASEPOINT_BYTES, x25519};

use crate::context;
use crate::current;

/// The length of a key of X25519, secret or public \[byte\].
const KEY: usize = 32;

/// Cryptography for [`rustls`](::quinn::rustls) that draws its random numbers from the running test bed: handshakes have the same bytes in every run of the same
/// seed. The seed is enough to read along, so it is good for tests alone.
#[must_use]
pub fn crypto_provider() -> Arc<CryptoProvider> {
    Arc::new(CryptoProvider { kx_groups: vec![&Curve], secure_random: &FromTestbed, ..ring::default_provider() })
}

/// Random numbers of the test bed that runs on this thread.
#[derive(Debug)]
struct FromTestbed;

impl SecureRandom for FromTestbed {
    fn fill(&self, buffer: &mut [u8]) -> Result<(), GetRandomFailed> {
        context::shared().ok_or(GetRandomFailed)?.with(|core| core.entropy(current::host()).fill(buffer));
        Ok(())
    }
}

/// X25519 (RFC 7748).
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
        // A point of small order: RFC 8446, 7.4.2, has it refused.
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
