//! Client side of [admission](crate::AdmissionControl), for peers written in Rust: makes and checks datagrams, and leaves sockets and clocks to the caller.
//!
//! A [`Client`] does everything that `docs/live-protocol.md` asks of a program. A client says hello until a welcome comes, seals sent samples and opens
//! received samples, tells new samples from late samples, and begins anew when no new sample has come for a second. [`Joining`] and [`Joined`] only make and
//! check the datagrams.

mod conversation;
mod joining;

pub(crate) use conversation::SILENCE;
pub use conversation::{Client, ClientConfig, Heard, SessionInfo};
pub use joining::{Joined, Joining, OpenError, WelcomeError};
