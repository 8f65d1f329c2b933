//! Limit of a queue.

use alloc::string::String;
use alloc::string::ToString as _;
use cohaptic_units::print::{Counted, Span};
use core::time::Duration;

use crate::parameters::Form;
use cohaptic_units::Bytes;

/// Limit of the packets waiting in a queue. A packet in transmission does not count.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum QueueLimit {
    /// Largest number of waiting packets. With 0, a packet behind another packet in transmission is dropped.
    Packets(u64),
    /// Largest number of bytes of all waiting packets, framing not counted.
    Bytes(Bytes),
    /// Longest wait. A packet with a later turn at the present rate is dropped.
    Time(Duration),
}

/// State of a queue, as far as a limit depends on it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Waiting {
    pub(crate) packets: u64,
    /// Bytes of the waiting packets. Wider than [`Bytes`]: a sum of [`Bytes`] would saturate and then be wrong after a departure.
    pub(crate) bytes: u128,
    /// Time until the turn of another packet.
    pub(crate) time: Duration,
}

impl QueueLimit {
    /// Returns whether another packet of `size` may wait too.
    pub(crate) fn admits(self, waiting: Waiting, size: Bytes) -> bool {
        // The new packet counts too, but not the packet in transmission.
        self.holds(Waiting { packets: waiting.packets.saturating_add(1), bytes: waiting.bytes + u128::from(size.get()), time: waiting.time })
    }

    /// Returns whether the queue is within the limit. `time` of `waiting` is the wait of the newest packet.
    pub(crate) fn holds(self, waiting: Waiting) -> bool {
        match self {
            Self::Packets(limit) => waiting.packets <= limit,
            Self::Bytes(limit) => waiting.bytes <= u128::from(limit.get()),
            Self::Time(limit) => waiting.time <= limit,
        }
    }
}

/// Form of a limit in files.
pub(crate) const LIMIT: Form = Form::Like(&["100 packets", "64kB", "50ms", "unlimited"]);

/// Returns a limit in words.
pub(super) fn words_of_limit(limit: Option<QueueLimit>) -> String {
    match limit {
        None => "unlimited".into(),
        Some(QueueLimit::Packets(packets)) => Counted(packets, "packet").to_string(),
        Some(QueueLimit::Bytes(bytes)) => bytes.to_string(),
        Some(QueueLimit::Time(wait)) => Span(wait).to_string(),
    }
}

#[cfg(test)]
pub(crate) mod strategies {
    use proptest::prelude::*;

    use super::*;

    /// Returns any limit, or none: a number of packets, a number of bytes, or a time below `wait` \[ns\].
    pub(crate) fn limits(wait: u64) -> impl Strategy<Value = Option<QueueLimit>> {
        prop_oneof![
            Just(None),
            (0_u64..9).prop_map(|packets| Some(QueueLimit::Packets(packets))),
            (0_u64..900).prop_map(|bytes| Some(QueueLimit::Bytes(Bytes::new(bytes)))),
            (0..wait).prop_map(|nanos| Some(QueueLimit::Time(Duration::from_nanos(nanos)))),
        ]
    }
}
