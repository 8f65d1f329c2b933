//! Live sessions: a scene driven by the wall clock, with some of the peers in other programs.
//!
//! Use this crate if you host a session with peers in other programs, or write such a peer in Rust. It needs Linux.
//!
//! [`Session`] is such a session, with its sockets and its clock. [`AdmissionControl`] decides which datagrams from outside reach the scene, and makes the
//! datagrams to programs outside. It does no input or output and reads no clock. [`client`] is the side of a peer, for programs in Rust, and [`handshake`] has
//! the datagrams beside samples. [`join`] is a whole peer at another computer than the session. The protocol is written byte by byte in
//! `docs/live-protocol.md`.
//!
//! The crate does not encrypt: with a [`SessionKey`] strangers cannot send samples, but can still read samples. Read [`AdmissionControl`] first.
//!
//! ```
//! use std::time::Duration;
//!
//! use cohaptic_live::client::Joining;
//! use cohaptic_live::{Admission, AdmissionControl, AdmissionConfig, Place, Seat, SessionKey, SystemEntropy};
//! use cohaptic_peer::{State, wire};
//! use cohaptic_units::Instant;
//!
//! let key = SessionKey::from_bytes([7; 32]);
//! let seats = vec![Seat { place: Place(1), name: "right".to_owned(), tick: Duration::from_millis(1) }];
//! let config = AdmissionConfig { key: Some(key.clone()), ..AdmissionConfig::new(42, 1, 2, Duration::from_millis(8), seats) };
//! let mut admission = AdmissionControl::new(config, &mut SystemEntropy)?;
//!
//! // The other program asks, and is told what the session is like.
//! let from = "127.0.0.1:9000".parse().expect("an address");
//! let joining = Joining::draw(42, Place(1), &key, &mut SystemEntropy)?;
//! let Admission::Reply { bytes: welcome, .. } = admission.handle_datagram(Instant::ZERO, from, &joining.hello()) else { panic!("welcome") };
//! let joined = joining.handle_welcome(&welcome)?;
//!
//! // Its first sample joins.
//! let sample = wire::Sample { session: 42, sender: 1, sequence: 0, sent: Instant::ZERO, state: State { position: [0.02], velocity: [0.0] } };
//! let mut plain = [0; wire::MAX_LEN];
//! let len = sample.encode(1, &mut plain);
//! let mut sealed = [0; cohaptic_live::MAX_DATAGRAM];
//! let sealed_len = joined.seal(&plain[..len], &mut sealed).expect("a sample");
//! let decision = admission.handle_datagram(Instant::ZERO, from, &sealed[..sealed_len]);
//! assert!(matches!(decision, Admission::Sample { place: Place(1), joined: true, .. }));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod admission;
pub mod client;
mod entropy;
#[cfg(feature = "falcon")]
pub mod falcons;
pub mod handshake;
#[cfg(feature = "inverse3")]
pub mod inverse3s;
pub mod join;
mod key;
mod label;
mod place;
pub mod pointers;
#[cfg(any(feature = "falcon", feature = "inverse3"))]
mod scene_hand;
mod seal;
mod session;
mod stale;

pub use admission::{
    Admission, AdmissionConfig, AdmissionConfigError, AdmissionControl, AdmissionStats, Admitted, Limits, OtherScene, Refusal, Seat, SeatStatus,
};
pub use entropy::{Entropy, EntropyError, SystemEntropy};
pub use key::{KeyFileError, SessionKey};
pub use label::Label;
pub use place::Place;
pub use seal::{MAX_DATAGRAM, Nonce};
pub use session::{
    Conductor, Connection, EndedPacket, LinkChange, LinkStatus, Motion, PeerStatus, Recorded, Report, Session, SessionConfig, SessionError,
    SocketCounts, Status,
};
pub use stale::stale_after;
