//! Live control over HTTP: what a run in wall time counts, and changes of its links, for programs and for people.
//!
//! You need it if a program in real time shows its counters and takes changes of its links over HTTP.
//!
//! ```text
//!   real-time side ── publish ──► Board ──► server thread ──► page, JSON, events, Prometheus text
//!          ▲                                      │
//!          └────────── LinkEditor ◄───────────────┘
//! ```
//!
//! This crate knows nothing of haptics, of scenes or of what the links carry. The real-time side publishes a [`Snapshot`] on a [`Board`] now and
//! then and never waits for anybody; changes go through a [`LinkEditor`]. [`serve()`] answers on a thread of its own, on loopback, and every request
//! must show a [`Token`]. The routes are in `docs/live-control.md`.
//! ```
//! use std::sync::Arc;
//!
//! use cohaptic_control::{Board, Description, Kind, LinkEditor, ServerConfig, Snapshot, serve};
//!
//! /// A run whose links have no keys.
//! struct NoLinks;
//!
//! impl LinkEditor for NoLinks {
//!     fn keys(&self, _: usize) -> Vec<(String, String)> {
//!         Vec::new()
//!     }
//!
//!     fn change(&mut self, _: &[usize], _: &[(String, String)]) -> Result<(), String> {
//!         Err("there is no link".to_owned())
//!     }
//! }
//!
//! let description = Description { kind: Kind::Relay, title: "a test".to_owned(), links: vec![], peers: vec![], clocks: vec![], measures: vec![], body: None };
//! let board = Arc::new(Board::new(description));
//! let server = serve(ServerConfig::new(([127, 0, 0, 1], 0).into()), Arc::clone(&board), Box::new(NoLinks))?;
//! assert!(board.publish(Arc::new(Snapshot::default())).is_ok());
//! assert!(server.url().starts_with("http://127.0.0.1:"));
//! server.stop();
//! # Ok::<(), cohaptic_control::ServeError>(())
//! ```

mod board;
#[cfg(fuzzing)]
pub mod fuzzing;
mod http;
mod metrics;
mod server;
mod snapshot;
mod stage;
mod ticket;
mod token;
mod typed;
mod views;

pub use board::{Board, Latest, LinkEditor};
pub use server::{ServeError, Server, ServerConfig, serve, serve_stage};
pub use snapshot::{Body, Description, Kind, LinkName, MeasureLabel, PeerName};
pub use snapshot::{LinkCounters, PeerView, Presence, Quantiles, Snapshot, TurnView};
pub use stage::{Role, Stage, StageFile};
pub use token::{Token, TokenError};
