//! Reset in answer to a segment that belongs to no connection.

use super::{Ecn, Flags, Options, Payload, Segment};

impl Segment<'_> {
    /// Returns the RST that answers this segment if neither a connection nor a listener accepts the segment (RFC 9293, section 3.10.7.1). The RST has the time
    /// to live `ttl`.
    ///
    /// Returns `None` if this segment is a RST, because a RST is never answered.
    #[must_use]
    pub fn refusal(&self, ttl: u8) -> Option<Segment<'static>> {
        if self.flags.has(Flags::RST) {
            return None;
        }
        // The numbers must be acceptable to the sender: its own acknowledgement number if there is one, or otherwise an acknowledgement of the whole segment.
        let (sequence, acknowledgement, flags) = if self.flags.has(Flags::ACK) {
            (self.acknowledgement, 0, Flags::RST)
        } else {
            let length = u32::try_from(self.sequence_length()).unwrap_or(0);
            (0, self.sequence.wrapping_add(length), Flags::RST | Flags::ACK)
        };
        Some(Segment {
            source: self.destination,
            destination: self.source,
            sequence,
            acknowledgement,
            flags,
            window: 0,
            options: Options::default(),
            ecn: Ecn::NotCapable,
            ttl,
            payload: Payload::default(),
        })
    }
}
