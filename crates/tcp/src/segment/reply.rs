//! The answer to segments of no connection.

use alloc::borrow::Cow;

use super::{Ecn, Flags, Options, Segment};

impl Segment<'_> {
    /// The RST that answers this segment where no connection and no listener takes it (RFC 9293, section 3.10.7.1), with that `ttl`.
    ///
    /// `None` for a RST, which nothing answers.
    #[must_use]
    pub fn refusal(&self, ttl: u8) -> Option<Segment<'static>> {
        if self.flags.has(Flags::RST) {
            return None;
        }
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
            payload: Cow::Borrowed(&[]),
        })
    }
}
