//! UDP sockets that know when each datagram came in, take and send many at once, and count whatever is lost.
//!
//! ```text
//!   network ─▶ socket buffer of the kernel ─▶ receive ─▶ Datagram { from, bytes, ecn, at }
//!                     │ full: kernel_drops        │ longer than asked: oversized
//!   network ◀─ send buffer of the kernel ◀─ flush ◀─ queue
//!                     │ full: kept, up to a bound      │ beyond it: dropped, counted
//! ```
//!
//! A datagram came in when the kernel saw it, not when the program got round to reading it: [`Datagram::at`].

mod counts;
mod endpoint;
mod outbox;

pub use counts::{EndpointCounts, SendFailures};
pub use endpoint::{BindError, Datagram, EndpointConfig, ReceiveBuffers, UdpEndpoint};
/// The two bits of a datagram's IP header that say whether its ends understand congestion marks, and whether it carries one (RFC 3168).
pub use quinn_udp::EcnCodepoint as Ecn;
