//! QUIC over emulated links: endpoints of [quinn](https://docs.rs/quinn), as they are, in virtual time.
//!
//! An [`endpoint`] has a virtual socket in place of a real one, and a runtime whose clock is that of the test bed. All the rest is quinn's: its handshake, its
//! loss recovery, its congestion control, its migration.
//!
//! ```
//! use cohaptic_testkit::{Testbed, quinn};
//!
//! let bed = Testbed::new(["client", "server"]).links("delay 20ms loss 5%");
//! let answer = bed.run_twice(|bed| async move {
//!     let server = quinn::server(&bed.host("server"), "0.0.0.0:443").unwrap();
//!     bed.host("server").spawn(async move {
//!         let connection = server.accept().await.unwrap().await.unwrap();
//!         let (mut answer, mut question) = connection.accept_bi().await.unwrap();
//!         let asked = question.read_to_end(100).await.unwrap();
//!         answer.write_all(&asked).await.unwrap();
//!         answer.finish().unwrap();
//!         connection.closed().await;
//!     });
//!     let client = quinn::client(&bed.host("client")).unwrap();
//!     let connection = client.connect("10.0.0.2:443".parse().unwrap(), quinn::SERVER_NAME).unwrap().await.unwrap();
//!     let (mut question, mut answer) = connection.open_bi().await.unwrap();
//!     question.write_all(b"how are you").await.unwrap();
//!     question.finish().unwrap();
//!     answer.read_to_end(100).await.unwrap()
//! });
//! assert_eq!(answer, b"how are you");
//! ```
//!
//! # Randomness, and where it shows
//!
//! | what | where it comes from | what it changes |
//! | --- | --- | --- |
//! | quinn's generator: gaps in packet numbers, padding, reserved parameters of random length, the spin bit, challenges, when keys are renewed | a seed that [`endpoint`] draws from the test bed | **lengths and times**, and bytes |
//! | connection ids, the key of stateless resets | [`endpoint_config`] | bytes |
//! | the first connection id of a client | [`client_config`] | bytes |
//! | the key of tokens | [`server_config`] | bytes |
//! | TLS: randoms, key shares, tickets | [`crypto_provider`] | bytes |
//! | TLS: signatures | an Ed25519 key, whose signatures are always 64 bytes long and never random | nothing |
//!
//! With the configurations of this module nothing is left to the system, and [`Testbed::run_twice`](crate::Testbed::run_twice) compares every byte. With
//! configurations of your own, lengths and times are the same twice still, provided that the certificate's key gives signatures of fixed length (Ed25519 or RSA; those of
//! ECDSA vary by some bytes), but not the bytes: say [`Testbed::without_digests`](crate::Testbed::without_digests). Or take the pieces:
//! [`crypto_provider`] and [`TestTime`] go into any configuration of rustls. On links that damage packets, times depend on the bytes too: what a damaged header
//! says is up to them. Make configurations inside the program: a client's remembers the servers that it has met.
//!
//! # Which clocks are read
//!
//! Quinn asks its runtime for the time, and its server's time source for that of tokens; both are virtual, as is the time provider of the TLS configurations of
//! this module. The rest are features that are not built here (`qlog`, `lock_tracking`), and rustls outside of those configurations: the validity of certificates is
//! checked against the day's date then, and `Ticketer`s change their keys by it. None of this has a part in when a packet is sent.
//!
//! # What differs from a real socket
//!
//! - A datagram is sent alone (no segmentation offload), and never fragmented, so that quinn searches the path's MTU.
//! - Datagrams that the host cannot send are lost without an error, as `quinn-udp` does it: to an address that no host has, or from one that it has no longer.
//! - A packet sent as ECT(1) arrives as ECT(0): links know capable and marked, no more. Quinn sends ECT(0).
//! - An endpoint at `[::]` hears IPv6 only.
//! - The day is the first of 2027 when the run begins, for certificates and tokens.
//! - When a host crashes, its endpoints are gone without a word, and their peers find out by their timeouts. Spawn what uses them on that host.

mod certificate;
mod config;
mod provider;
mod runtime;
mod socket;
mod time;

use std::io;
use std::panic::Location;
use std::sync::Arc;

// So that a program needs no dependency on quinn of its own.
pub use ::quinn::*;

pub use certificate::{CERTIFICATE, PRIVATE_KEY, SERVER_NAME};
pub use config::{client_config, endpoint_config, server_config, tls_client_config, tls_server_config};
pub use provider::crypto_provider;
pub use time::TestTime;

use crate::host::Host;
use crate::resolve::ToSocketAddrs;
use runtime::OnHost;
use socket::VirtualSocket;

/// An endpoint on a host. Its tasks live on that host.
///
/// Two things are the test bed's whatever the configurations say: the seed of quinn's generator, and the time of day for the tokens of a server.
///
/// # Errors
///
/// As [`Host::bind`].
///
/// # Panics
///
/// Outside the run.
#[track_caller]
pub fn endpoint(host: &Host, address: impl ToSocketAddrs, mut config: EndpointConfig, server: Option<ServerConfig>) -> io::Result<Endpoint> {
    let socket = VirtualSocket::new(host, address)?;
    let seed = host.shared().with(|core| core.entropy(Some(host.node())).bytes());
    config.rng_seed(Some(seed));
    let server = server.map(|mut server| {
        server.time_source(Arc::new(TestTime));
        server
    });
    let runtime = OnHost::new(host, Location::caller());
    Endpoint::new_with_abstract_socket(config, server, Arc::new(socket), Arc::new(runtime))
}

/// An endpoint that accepts connections, with the configurations of this module.
///
/// # Errors
///
/// As [`endpoint`].
///
/// # Panics
///
/// As [`endpoint`].
#[track_caller]
pub fn server(host: &Host, address: impl ToSocketAddrs) -> io::Result<Endpoint> {
    endpoint(host, address, endpoint_config(), Some(server_config()))
}

/// An endpoint at `0.0.0.0:0` that connects, with the configurations of this module. Servers that have [`CERTIFICATE`] are called [`SERVER_NAME`].
///
/// # Errors
///
/// As [`endpoint`].
///
/// # Panics
///
/// As [`endpoint`].
#[track_caller]
pub fn client(host: &Host) -> io::Result<Endpoint> {
    let mut client = endpoint(host, "0.0.0.0:0", endpoint_config(), None)?;
    client.set_default_client_config(client_config());
    Ok(client)
}
