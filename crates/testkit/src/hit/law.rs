//! Laws given in words.

use cohaptic_wan::random::Draws;

use super::words::{Action, Hit, Kind, Which};
use super::{PacketLaw, SentPacket, Verdict};

/// Law given in words.
#[derive(Clone, Debug)]
pub(crate) struct WordsLaw {
    hit: Hit,
    /// Number of packets so far of the kind of the hit.
    met: u64,
}

impl WordsLaw {
    pub(crate) const fn new(hit: Hit) -> Self {
        Self { hit, met: 0 }
    }

    fn is_meant(&mut self, packet: &SentPacket<'_>) -> bool {
        match &self.hit.which {
            Which::Numbers(numbers) => numbers.iter().any(|range| range.contains(&packet.number)),
            // Every packet of the kind counts, whether hit or not.
            Which::Nth { nth, kind, with } => {
                if !is_of(packet, *kind) || !holds(packet.bytes, with) {
                    return false;
                }
                self.met += 1;
                nth.is_none_or(|nth| nth == self.met)
            }
        }
    }
}

impl PacketLaw for WordsLaw {
    fn judge(&mut self, packet: &SentPacket<'_>, draws: &mut Draws) -> Verdict {
        if !self.is_meant(packet) {
            return Verdict::Pass;
        }
        match self.hit.action {
            Action::Drop => Verdict::Drop,
            Action::Delay(time) => Verdict::Delay(time),
            Action::Duplicate(time) => Verdict::Duplicate(time),
            // Any number will do: the bit is taken modulo the number of bits of the packet.
            Action::Corrupt => Verdict::Corrupt(draws.next_word()),
            Action::Behind(count) => Verdict::Behind(count),
        }
    }
}

fn is_of(packet: &SentPacket<'_>, kind: Kind) -> bool {
    match kind {
        Kind::Packet => true,
        #[cfg(feature = "tcp")]
        Kind::Segment => packet.tcp().is_some_and(|segment| !segment.payload.is_empty()),
        Kind::Retransmission => packet.is_retransmission,
        #[cfg(feature = "tcp")]
        Kind::Flag(flag) => packet.tcp().is_some_and(|segment| segment.flags.has(flag)),
    }
}

/// Returns whether `bytes` occur in `all`.
fn holds(all: &[u8], bytes: &[u8]) -> bool {
    bytes.is_empty() || all.windows(bytes.len()).any(|window| window == bytes)
}
