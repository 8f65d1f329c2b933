//! A segment with its addresses, and the packet that it is on the wire.

mod checksum;
mod encode;
mod flags;
mod options;
mod parse;
mod reply;

use alloc::borrow::Cow;
use core::net::SocketAddr;

pub use flags::Flags;
pub(crate) use options::TIMESTAMPS_LENGTH;
pub use options::{Options, SackBlocks};
pub use parse::ParseError;

/// The two bits of the IP header that tell of congestion (RFC 3168, section 5).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, Debug)]
pub enum Ecn {
    /// The transport does not use it.
    #[default]
    NotCapable,
    /// ECT(1).
    Capable1,
    /// ECT(0).
    Capable0,
    /// A router marked the packet instead of dropping it.
    Congestion,
}

impl Ecn {
    pub(crate) const fn bits(self) -> u8 {
        match self {
            Self::NotCapable => 0,
            Self::Capable1 => 1,
            Self::Capable0 => 2,
            Self::Congestion => 3,
        }
    }

    pub(crate) const fn from_bits(bits: u8) -> Self {
        match bits & 3 {
            1 => Self::Capable1,
            2 => Self::Capable0,
            3 => Self::Congestion,
            _ => Self::NotCapable,
        }
    }
}

/// A TCP segment, and of its IP header what matters to a connection.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Segment<'a> {
    /// Where it comes from.
    pub source: SocketAddr,
    /// Where it goes. Of the same version as `source`.
    pub destination: SocketAddr,
    /// The sequence number of the first octet, or of the SYN.
    pub sequence: u32,
    /// The next octet that the sender expects. Counts with [`Flags::ACK`].
    pub acknowledgement: u32,
    /// The flags.
    pub flags: Flags,
    /// The receive window \[byte\], not yet scaled.
    pub window: u16,
    /// The options.
    pub options: Options,
    /// The mark of the IP header.
    pub ecn: Ecn,
    /// Time to live, or hop limit.
    pub ttl: u8,
    /// The data.
    pub payload: Cow<'a, [u8]>,
}

impl Segment<'_> {
    /// The sequence numbers that it occupies: octets of data, and one each for SYN and FIN.
    #[must_use]
    pub fn sequence_length(&self) -> usize {
        self.payload.len() + usize::from(self.flags.has(Flags::SYN)) + usize::from(self.flags.has(Flags::FIN))
    }

    /// The length of the whole IP packet \[byte\].
    #[must_use]
    pub fn packet_length(&self) -> usize {
        let ip = if self.source.is_ipv4() { encode::IPV4_HEADER } else { encode::IPV6_HEADER };
        ip + encode::TCP_HEADER + self.options.length() + self.payload.len()
    }

    /// The segment with data of its own.
    #[must_use]
    pub fn into_owned(self) -> Segment<'static> {
        Segment { payload: Cow::Owned(self.payload.into_owned()), ..self }
    }
}
