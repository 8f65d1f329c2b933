//! Live control over HTTP: what a run in wall time counts, and changes of its links, for programs and for people.
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

mod board;
mod http;
mod metrics;
mod server;
mod snapshot;
mod token;
mod typed;
mod views;

pub use board::{Board, Latest, LinkEditor};
pub use server::{ServeError, Server, ServerConfig, serve};
pub use snapshot::{Description, Kind, LinkName, PeerName};
pub use snapshot::{LinkCounters, PeerView, Presence, Quantiles, Snapshot};
pub use token::{Token, TokenError};
