//! How much may wait.

use alloc::string::String;
use alloc::string::ToString as _;
use cohaptic_units::print::{Counted, Span};
use core::time::Duration;

use crate::parameters::Form;
use cohaptic_units::Bytes;

/// The size that may wait in a queue. A packet being sent does not count.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum QueueLimit {
    /// At most this number of packets waits; with 0, a packet that finds the line busy is dropped.
    Packets(u64),
    /// The packets that wait hold at most this number of bytes together, framing not counted.
    Bytes(Bytes),
    /// No packet waits longer than this: one whose turn would come later, at the present rate, is dropped.
    Time(Duration),
}

/// What waits, as a limit sees it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Waiting {
    pub(crate) packets: u64,
    /// Wider than [`Bytes`], whose sum would saturate and then count wrongly.
    pub(crate) bytes: u128,
    /// How long the newest packet would wait for its turn.
    pub(crate) time: Duration,
}

impl QueueLimit {
    /// Whether another packet of that size may wait too.
    pub(crate) fn admits(self, waiting: Waiting, size: Bytes) -> bool {
        match self {
            Self::Packets(limit) => waiting.packets < limit,
            Self::Bytes(limit) => waiting.bytes + u128::from(size.get()) <= u128::from(limit.get()),
            Self::Time(limit) => waiting.time <= limit,
        }
    }
}

/// How much may wait.
pub(crate) const LIMIT: Form = Form::Like(&["100 packets", "64kB", "50ms", "unlimited"]);

/// A limit in words.
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

    /// Any limit, or none: of some packets, some bytes, or a wait below that \[ns\].
    pub(crate) fn limits(wait: u64) -> impl Strategy<Value = Option<QueueLimit>> {
        prop_oneof![
            Just(None),
            (0_u64..9).prop_map(|packets| Some(QueueLimit::Packets(packets))),
            (0_u64..900).prop_map(|bytes| Some(QueueLimit::Bytes(Bytes::new(bytes)))),
            (0..wait).prop_map(|nanos| Some(QueueLimit::Time(Duration::from_nanos(nanos)))),
        ]
    }
}
