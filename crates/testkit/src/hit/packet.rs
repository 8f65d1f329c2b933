//! Packet in the form for laws.

#[cfg(feature = "tcp")]
use cohaptic_tcp::Segment;
use cohaptic_units::Instant;
use cohaptic_wan::Path;

/// Packet at the moment of the offer to its link.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SentPacket<'a> {
    /// Sending and receiving host, by index.
    pub path: Path,
    /// Name of the sender.
    pub from: &'a str,
    /// Name of the receiver.
    pub to: &'a str,
    /// Number of the packet on this path, from 0, equal to the number in the trace.
    pub number: u64,
    /// Instant at which the packet is offered.
    pub at: Instant,
    /// Content of the packet: for a datagram the payload without headers, for TCP the whole IP packet.
    pub bytes: &'a [u8],
    /// `true` if the packet was sent before: a segment of TCP with a sequence number that was sent before, or another packet with the same bytes as an
    /// earlier packet of this path.
    pub is_retransmission: bool,
    #[cfg(feature = "tcp")]
    pub(crate) segment: Option<&'a Segment<'a>>,
}

#[cfg(feature = "tcp")]
impl<'a> SentPacket<'a> {
    /// Returns the TCP segment, or `None` if the bytes are no IP packet of TCP with right lengths and checksums.
    #[must_use]
    pub const fn tcp(&self) -> Option<&'a Segment<'a>> {
        self.segment
    }
}
