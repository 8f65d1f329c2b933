//! Packets of the running firmware. A packet of 16 bytes to the device causes a report of 16 bytes.
//!
//! A packet is `<`, 14 bytes of payload, and `>`. A number has sixteen bits in two's complement and four bytes, the least significant nibble first; each
//! nibble is sent as its value plus [`nibbles::BASE`]. No byte of a number can therefore be `<` or `>`, and a receiver that has lost its place in the stream
//! can find it again: see [`Framer`].

mod command;
mod framer;
pub mod nibbles;
mod report;

pub use command::{Command, CommandParts, DecodeCommandError, Leds};
pub use framer::{Frame, Framer};
pub use report::{Buttons, DecodeReportError, Report};

/// Length of a packet in either direction \[bytes\].
pub const PACKET: usize = 16;
/// First byte of a packet.
pub(crate) const START: u8 = b'<';
/// Last byte of a packet.
pub(crate) const END: u8 = b'>';
