//! QUIC over emulated links: unmodified endpoints of [quinn](https://docs.rs/quinn) in virtual time.
//!
//! An [`endpoint`] has a virtual socket in place of a real socket, and a runtime with the clock of the test bed. Handshake, loss recovery, congestion control
//! and migration are quinn's own.
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
//! With the configurations of this module no random number comes from the system, and [`Testbed::run_twice`](crate::Testbed::run_twice) compares every byte.
//! With other configurations lengths and times are still equal in two runs, provided that the key of the certificate gives signatures of fixed length (Ed25519
//! or RSA; ECDSA signatures vary by some bytes). The bytes are not equal then: call [`Testbed::without_digests`](crate::Testbed::without_digests), or use the
//! parts: [`crypto_provider`] and [`TestTime`] fit into any configuration of rustls. On links that damage packets, times also depend on the bytes, because the
//! meaning of a damaged header depends on the bytes. Make configurations inside the program: the configuration of a client remembers the servers of earlier
//! connections.
//!
//! # Which clocks are read
//!
//! Quinn asks its runtime for the time, and the time source of its server for the time of tokens. Both are virtual, and so is the time provider of the TLS
//! configurations of this module. Other clocks are read only by features that are not built here (`qlog`, `lock_tracking`), and by rustls outside of these
//! configurations: there the validity of certificates is checked against the date of today, and `Ticketer`s change their keys by the date. No such clock
//! influences when a packet is sent.
//!
//! # What differs from a real socket
//!
//! - Every datagram is sent alone (no segmentation offload) and never fragmented, so that quinn searches for the MTU of the path.
//! - A datagram that the host cannot send is lost without an error, as with `quinn-udp`. This happens if no host has the receiver's address, or if the host has
//!   given up the sender's address.
//! - A packet sent as ECT(1) arrives as ECT(0), because links distinguish only "capable" and "marked". Quinn sends ECT(0).
//! - An endpoint at `[::]` receives over IPv6 only.
//! - A run begins on the first of January 2027, as far as certificates and tokens are concerned.
//! - When a host crashes, its endpoints end without a message to their peers. The peers notice by timeouts. Spawn the tasks that use an endpoint on its host.

mod certificate;
mod config;
mod provider;
mod runtime;
mod socket;
mod time;

use std::io;
use std::panic::Location;
use std::sync::Arc;

// Re-exported, so that a program needs no dependency on quinn of its own.
pub use ::quinn::*;

pub use certificate::{CERTIFICATE, PRIVATE_KEY, SERVER_NAME};
pub use config::{client_config, endpoint_config, server_config, tls_client_config, tls_server_config};
pub use provider::crypto_provider;
pub use time::TestTime;

use crate::host::Host;
use crate::resolve::ToSocketAddrs;
use runtime::OnHost;
use socket::VirtualSocket;

/// Creates an endpoint on a host. The tasks of the endpoint live on that host.
///
/// Two settings come from the test bed, whatever the configurations say: the seed of quinn's generator, and the time of day for the tokens of a server.
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

/// Creates an endpoint that accepts connections, with the configurations of this module.
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

/// Creates an endpoint at `0.0.0.0:0` that connects, with the configurations of this module. The name of servers with [`CERTIFICATE`] is [`SERVER_NAME`].
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
