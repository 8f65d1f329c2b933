//! A packet as a law sees it.

#[cfg(feature = "tcp")]
use cohaptic_tcp::Segment;
use cohaptic_units::Instant;
use cohaptic_wan::Path;

/// A packet that is offered to its link.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SentPacket<'a> {
    /// From which host to which, by their places.
    pub path: Path,
    /// The name of the sender.
    pub from: &'a str,
    /// The name of the receiver.
    pub to: &'a str,
    /// Its number on this path, from 0, as the trace has it.
    pub number: u64,
    /// When it is offered.
    pub at: Instant,
    /// What it carries: a datagram without headers, or of TCP the whole IP packet.
    pub bytes: &'a [u8],
    /// Whether it was sent before: a segment of TCP some of whose sequence numbers were, or another packet with the same bytes as one before on this path.
    pub is_retransmission: bool,
    #[cfg(feature = "tcp")]
    pub(crate) segment: Option<&'a Segment<'a>>,
}

#[cfg(feature = "tcp")]
impl<'a> SentPacket<'a> {
    /// The segment of TCP, if that is what the bytes are: an IP packet with right lengths and checksums.
    #[must_use]
    pub const fn tcp(&self) -> Option<&'a Segment<'a>> {
        self.segment
    }
}
