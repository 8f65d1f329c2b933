//! The other side of [admission](crate::AdmissionControl), for programs in Rust: it makes and checks datagrams, and leaves sockets and clocks to its user.
//!
//! A [`Client`] does all that `docs/live-protocol.md` asks of a program: it says hello until it is answered, seals and opens, tells new samples from
//! late ones, and begins anew when it has heard nothing new for a second. [`Joining`] and [`Joined`] are the datagrams alone.

mod conversation;
mod joining;

pub use conversation::{Client, ClientConfig, HELLO_EVERY, Heard, SILENCE, SessionInfo};
pub use joining::{Joined, Joining, OpenError, WelcomeError};
