//! Live control over HTTP: shows the counters of a run in wall time, and changes the run's links.
//!
//! Use this crate if your real-time program should show its counters and take changes of its links over HTTP.
//!
//! ```text
//!   real-time side ── publish ──► Board ──► server thread ──► page, JSON, events, Prometheus text
//!          ▲                                      │
//!          └────────── LinkEditor ◄───────────────┘
//! ```
//!
//! The real-time side publishes a [`Snapshot`] on a [`Board`] from time to time and never waits. Changes go through a [`LinkEditor`]. [`serve()`] answers
//! on a thread of its own, by default on loopback only, and every request must show a [`Token`]. The routes are in `docs/live-control.md`.
//!
//! This crate does not know haptics, scenes, or the contents of packets.
//!
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
mod token;
mod typed;
mod views;

pub use board::{Board, Latest, LinkEditor};
pub use server::{ServeError, Server, ServerConfig, serve, serve_stage, serve_study};
pub use snapshot::{Body, Description, Kind, LinkName, MeasureLabel, PeerName};
pub use snapshot::{JoinedView, LinkCounters, PeerView, Presence, Quantiles, Snapshot, TurnView};
pub use stage::{Hands, Role, Stage, StageFile, Study};
pub use token::{Guests, Token, TokenError};
