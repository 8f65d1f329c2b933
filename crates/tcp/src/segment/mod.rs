//! Segments with addresses, and the reading and writing of IP packets.

mod checksum;
mod encode;
mod flags;
mod options;
mod parse;
mod payload;
mod reply;

use core::net::SocketAddr;

pub use cohaptic_units::Ecn;
pub use flags::Flags;
pub(crate) use options::TIMESTAMPS_LENGTH;
pub use options::{Options, SackBlocks};
pub use parse::ParseError;
pub use payload::Payload;

/// TCP segment, with the fields of the IP header that a connection uses.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Segment<'a> {
    /// Address and port of the sender.
    pub source: SocketAddr,
    /// Address and port of the receiver. The IP version must be the version of `source`.
    pub destination: SocketAddr,
    /// Sequence number of the SYN, or of the first octet of the data. Without SYN and data, the next sequence number of the sender.
    pub sequence: u32,
    /// Sequence number of the next octet that the sender expects. Valid only with [`Flags::ACK`].
    pub acknowledgement: u32,
    /// Flags of the TCP header.
    pub flags: Flags,
    /// Receive window as in the header: on a SYN in bytes, otherwise in units of 2 to the power of the window scale.
    pub window: u16,
    /// Options of the TCP header.
    pub options: Options,
    /// ECN bits of the IP header.
    pub ecn: Ecn,
    /// Time to live (IPv4) or hop limit (IPv6).
    pub ttl: u8,
    /// Data of the segment.
    pub payload: Payload<'a>,
}

impl Segment<'_> {
    /// Returns the number of sequence numbers of the segment: one per octet of data, one for SYN and one for FIN.
    #[must_use]
    pub fn sequence_length(&self) -> usize {
        self.payload.len() + usize::from(self.flags.has(Flags::SYN)) + usize::from(self.flags.has(Flags::FIN))
    }

    /// Returns the length of the whole IP packet \[byte\].
    #[must_use]
    pub fn packet_length(&self) -> usize {
        let ip = if self.source.is_ipv4() { encode::IPV4_HEADER } else { encode::IPV6_HEADER };
        ip + encode::TCP_HEADER + self.options.length() + self.payload.len()
    }

    /// Returns the segment with owned data. Borrowed data is copied.
    #[must_use]
    pub fn into_owned(self) -> Segment<'static> {
        Segment { payload: self.payload.into_owned(), ..self }
    }
}
