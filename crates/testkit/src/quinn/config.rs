//! Configurations that take neither random numbers nor the time of day from the system.

use std::sync::Arc;

use ::quinn::crypto::rustls::{QuicClientConfig, QuicServerConfig};
use ::quinn::rustls::client::Resumption;
use ::quinn::rustls::pki_types::pem::PemObject;
use ::quinn::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use ::quinn::rustls::version::TLS13;
use ::quinn::rustls::{ClientConfig as TlsClient, RootCertStore, ServerConfig as TlsServer};
use ::quinn::{ClientConfig, ConnectionId, ConnectionIdGenerator, EndpointConfig, ServerConfig};
use ring::{hkdf, hmac};

use super::certificate::{CERTIFICATE, PRIVATE_KEY};
use super::provider::crypto_provider;
use super::time::TestTime;
use crate::context;
use crate::current;

/// Length of the connection ids of an endpoint, quinn's default \[byte\].
const ID_LENGTH: usize = 8;

/// Length of the first connection id, which a client chooses for its server: the greatest length \[byte\].
const FIRST_ID_LENGTH: usize = 20;

/// Draws random bytes from the running test bed.
fn draw<const N: usize>() -> [u8; N] {
    let running = context::expect_running("the numbers of an endpoint can be drawn");
    running.shared.with(|core| core.entropy(current::host()).bytes())
}

/// Generator of connection ids from the random numbers of the test bed.
struct Ids;

impl ConnectionIdGenerator for Ids {
    fn generate_cid(&mut self) -> ConnectionId {
        ConnectionId::new(&draw::<ID_LENGTH>())
    }

    fn cid_len(&self) -> usize {
        ID_LENGTH
    }

    fn cid_lifetime(&self) -> Option<std::time::Duration> {
        None
    }
}

/// Returns the configuration of an endpoint, with quinn's defaults. Connection ids and the key of resets are drawn from the test bed.
///
/// # Panics
///
/// Outside the run.
#[must_use]
pub fn endpoint_config() -> EndpointConfig {
    let mut config = EndpointConfig::new(Arc::new(hmac::Key::new(hmac::HMAC_SHA256, &draw::<64>())));
    config.cid_generator(|| Box::new(Ids));
    config
}

/// Returns the configuration of a server, with quinn's defaults and [`CERTIFICATE`].
///
/// # Panics
///
/// Outside the run.
#[must_use]
pub fn server_config() -> ServerConfig {
    let tls = QuicServerConfig::try_from(tls_server_config()).expect("the provider has the cipher suite that QUIC begins with");
    let token_key = hkdf::Salt::new(hkdf::HKDF_SHA256, &[]).extract(&draw::<64>());
    let mut config = ServerConfig::new(Arc::new(tls), Arc::new(token_key));
    config.time_source(Arc::new(TestTime));
    config
}

/// Returns the configuration of a client that trusts [`CERTIFICATE`], with quinn's defaults. The configuration can be made anywhere, but connects only inside
/// the run.
#[must_use]
#[expect(clippy::missing_panics_doc, reason = "only constants are unwrapped")]
pub fn client_config() -> ClientConfig {
    let tls = QuicClientConfig::try_from(tls_client_config()).expect("the provider has the cipher suite that QUIC begins with");
    let mut config = ClientConfig::new(Arc::new(tls));
    config.initial_dst_cid_provider(Arc::new(|| ConnectionId::new(&draw::<FIRST_ID_LENGTH>())));
    config
}

/// Returns the TLS configuration of [`server_config`], for changes such as protocols (ALPN).
#[must_use]
#[expect(clippy::missing_panics_doc, reason = "only constants are unwrapped")]
pub fn tls_server_config() -> TlsServer {
    let key = PrivateKeyDer::from_pem_slice(PRIVATE_KEY.as_bytes()).expect("the constant is a key in PEM");
    TlsServer::builder_with_details(crypto_provider(), Arc::new(TestTime))
        .with_protocol_versions(&[&TLS13])
        .expect("the provider has suites of TLS 1.3")
        .with_no_client_auth()
        .with_single_cert(vec![certificate()], key)
        .expect("the key belongs to the certificate")
}

/// Returns the TLS configuration of [`client_config`]. The configuration resumes no session: in a program that runs twice, the second run must not begin with
/// sessions of the first run.
#[must_use]
#[expect(clippy::missing_panics_doc, reason = "only constants are unwrapped")]
pub fn tls_client_config() -> TlsClient {
    let mut roots = RootCertStore::empty();
    roots.add(certificate()).expect("the constant is a valid certificate");
    let mut tls = TlsClient::builder_with_details(crypto_provider(), Arc::new(TestTime))
        .with_protocol_versions(&[&TLS13])
        .expect("the provider has suites of TLS 1.3")
        .with_root_certificates(roots)
        .with_no_client_auth();
    tls.resumption = Resumption::disabled();
    tls
}

fn certificate() -> CertificateDer<'static> {
    CertificateDer::from_pem_slice(CERTIFICATE.as_bytes()).expect("the constant is a certificate in PEM")
}
