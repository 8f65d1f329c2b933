//! UDP sockets that record the arrival of each datagram, receive and send many datagrams at once, and count every loss.
//!
//! ```text
//!   network ─▶ socket buffer of the kernel ─▶ receive ─▶ Datagram { from, bytes, ecn, at }
//!                     │ full: kernel_drops        │ longer than asked: oversized
//!   network ◀─ send buffer of the kernel ◀─ flush ◀─ queue
//!                     │ full: kept, up to a bound      │ beyond it: dropped, counted
//! ```
//!
//! A datagram arrives when the kernel sees the datagram, not when the program reads the datagram: [`Datagram::at`].

mod counts;
mod endpoint;
mod outbox;

pub use counts::{EndpointCounts, SendFailures};
pub use endpoint::{BindError, Datagram, EndpointConfig, ReceiveBuffers, UdpEndpoint};
/// Two bits of a datagram's IP header (RFC 3168). The bits say whether the ends understand congestion marks, and whether the datagram carries a mark.
pub use quinn_udp::EcnCodepoint as Ecn;
