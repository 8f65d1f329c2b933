//! The packets of the running firmware: 16 bytes out cause 16 bytes in.
//!
//! A packet is `<`, 14 bytes of payload, `>`. Numbers are sixteen bits in two's complement, four bytes each, least significant nibble first, and each
//! nibble travels as its value plus [`nibbles::BASE`]. So no byte of a number can be `<` or `>`, and a stream that lost its place can find it again:
//! see [`Framer`].

mod command;
mod framer;
pub mod nibbles;
mod report;

pub use command::{Command, CommandParts, DecodeCommandError, Leds};
pub use framer::{Frame, Framer};
pub use report::{Buttons, DecodeReportError, Report};

/// The length of a packet, both ways \[bytes\].
pub const PACKET: usize = 16;
/// The first byte of a packet.
pub const START: u8 = b'<';
/// The last byte of a packet.
pub const END: u8 = b'>';
