//! Streams: the treatment of the bytes of TCP in one direction of a connection, for a relay that ends TCP on both sides.

pub(crate) mod keys;
mod read;
mod words;

use core::fmt;
use core::num::NonZeroU64;
use core::time::Duration;

use cohaptic_units::{Bytes, Probability};
use cohaptic_wan::{Bottleneck, Impairments, LinkConfig, LinkModel, Loss, Order, Outages, Service};

pub(crate) use read::read_stream;
pub use read::stream_of_keys;
pub use words::{FaultWords, first_fault, split_faults};

/// Treatment of the bytes of one direction: the line that all connections of a proxy share, the bound on held bytes, and the faults of single connections.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct StreamConfig {
    /// Delay with its jitter, and rate, in order. All other stages are those of the ideal link.
    line: LinkConfig,
    /// Bytes of one connection that the relay holds at most in this direction; `None`: see [`StreamConfig::window`].
    pub buffer: Option<Bytes>,
    /// Faults of single connections.
    pub faults: Faults,
}

/// Faults of single connections in one direction. `None`: the fault is not configured.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Faults {
    /// Age at which the connection is closed in both directions.
    pub close_after: Option<Hit<Duration>>,
    /// Age at which the connection is reset at both ends.
    pub reset_after: Option<Hit<Duration>>,
    /// Span during which nothing reaches the receiver.
    pub stall: Option<Hit<Stall>>,
    /// Pieces into which the bytes are cut.
    pub slice: Option<Hit<Slice>>,
    /// Bytes after which the connection is closed in both directions. Bytes beyond the number are lost.
    pub cut_after: Option<Hit<Bytes>>,
    /// Time by which the end of the stream reaches the receiver later than the last byte could.
    pub slow_close: Option<Hit<Duration>>,
}

/// Fault with the share of connections that have the fault.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit<T> {
    /// Fault.
    pub fault: T,
    /// Chance of each connection to have the fault.
    pub share: Probability,
}

/// Span of a connection's life during which nothing reaches the receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stall {
    /// Age of the connection at the beginning.
    pub after: Duration,
    /// Length of the span; `None`: until the connection ends.
    pub length: Option<Duration>,
}

/// Pieces into which bytes are cut, each written by itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Slice {
    /// Mean size of a piece \[bytes\].
    pub size: NonZeroU64,
    /// Greatest deviation from the mean, uniformly distributed \[bytes\]. Below `size`.
    pub variation: u64,
    /// Least time between two pieces.
    pub gap: Duration,
}

impl StreamConfig {
    /// Bytes that may wait before the line by default, in addition to the bytes on their way.
    pub const WAITING: u64 = 65_536;
    /// Bytes of one connection held by default without a rate: the largest receive window of Linux up to 6.17 (`tcp_rmem`), 6 MiB.
    pub const WITHOUT_RATE: u64 = 6 << 20;

    /// Returns a stream with the delay and the rate of `model`, without faults.
    ///
    /// # Errors
    ///
    /// The key of the first part of `model` that needs packets, with the reason and the way out.
    pub fn new(model: &LinkModel) -> Result<Self, Refused> {
        let Some(config) = model.as_fixed() else {
            return Err(match model {
                LinkModel::Modulated(_) => Refused("modulated"),
                LinkModel::Replay(_) => Refused("replay"),
                LinkModel::Fixed(_) | LinkModel::Kernel(_) => Refused("netem-profile"),
            });
        };
        refused(config).map_or(Ok(()), Err)?;
        // Bytes of a stream cannot overtake each other, whatever the order of the link.
        Ok(Self { line: LinkConfig { order: Order::InOrder, ..config.clone() }, ..Self::default() })
    }

    /// Returns the configuration of the line, which carries the pieces of all connections in order.
    #[must_use]
    pub const fn line(&self) -> &LinkConfig {
        &self.line
    }

    /// Returns the number of bytes that the relay holds of one connection in this direction, at most: `buffer`, or by default 65,536 bytes more than the line
    /// carries at its rate during its mean delay, or 6 MiB without a rate.
    #[must_use]
    pub fn window(&self) -> u64 {
        if let Some(buffer) = self.buffer {
            return buffer.get();
        }
        match self.line.bottleneck.as_ref().map(|bottleneck| &bottleneck.service) {
            Some(Service::Rate(rate)) => {
                // In billionths of a bit.
                let on_the_way = rate.bits_sent(self.line.delay.mean()) / 8_000_000_000;
                u64::try_from(on_the_way).unwrap_or(u64::MAX).saturating_add(Self::WAITING)
            }
            Some(Service::Recorded(_)) | None => Self::WITHOUT_RATE,
        }
    }
}

/// Refusal of a part of a link, by its key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Refused(pub &'static str);

impl fmt::Display for Refused {
    /// Writes the key, the reason, and the way out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reason = match self.0 {
            "limit" | "queue" | "overhead" | "cells" | "token-bucket" => {
                "a relay of TCP drops nothing from a queue, but lets the sender wait: expected buffer = \"64kB\", which bounds the bytes of a connection"
            }
            "outage" => "an outage drops packets, and a relay of TCP sees none: expected stall, which holds the bytes of a connection",
            "modulated" | "spike" => "a relay of TCP has one delay and one rate at a time: expected delay, jitter, rate and faults such as stall",
            _ => {
                "a relay of TCP passes bytes and sees no packets that could be lost, marked, copied, damaged or put out of order: expected delay, jitter, \
                 rate and faults such as stall. To impair the packets below TCP, use cohaptic exec or cohaptic router"
            }
        };
        write!(f, "{}: {reason}", self.0)
    }
}

/// Returns the first part of a link that a stream cannot have.
fn refused(config: &LinkConfig) -> Option<Refused> {
    // Every field is named, so that the compiler asks for a decision here about each new stage of links.
    let LinkConfig {
        mtu,
        outages,
        loss,
        marks_instead_of_loss,
        duplication,
        corruption,
        limit,
        token_bucket,
        bottleneck,
        cross_traffic,
        slots,
        reorder,
        trace,
        delay: _,
        listed,
        order: _,
        layout: _,
    } = config;
    let plain = |bottleneck: &Bottleneck| matches!(bottleneck.service, Service::Rate(rate) if *bottleneck == Bottleneck::at_rate(rate));
    let recorded = |bottleneck: &Bottleneck| matches!(bottleneck.service, Service::Recorded(_));
    let refusals = [
        (*loss != Loss::None || *marks_instead_of_loss, Refused("loss")),
        (!duplication.is_never(), Refused("duplicate")),
        (corruption.is_some(), Refused("corrupt")),
        (reorder.is_some(), Refused("reorder")),
        (mtu.is_some(), Refused("mtu")),
        (limit.is_some(), Refused("limit")),
        (bottleneck.as_ref().is_some_and(recorded) || trace.is_some(), Refused("trace")),
        (bottleneck.as_ref().is_some_and(|bottleneck| !plain(bottleneck)), Refused("queue")),
        (token_bucket.is_some(), Refused("token-bucket")),
        (cross_traffic.is_some(), Refused("cross-traffic")),
        (slots.is_some(), Refused("slots")),
        (*outages != Outages::default(), Refused("outage")),
        (*listed != Impairments::default(), Refused("spike")),
    ];
    refusals.into_iter().find_map(|(is_there, refused)| is_there.then_some(refused))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link_from_keys;

    fn stream(keys: &[&str]) -> Result<StreamConfig, Refused> {
        StreamConfig::new(&link_from_keys(&keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap())
    }

    #[test]
    fn delay_jitter_and_rate_make_a_line_in_order() {
        let stream = stream(&["delay=20ms", "jitter=5ms", "rate=10Mbit", "order=allow-reordering"]).unwrap();
        assert_eq!(stream.line().order, Order::InOrder);
        assert_eq!(stream.line().delay.mean(), Duration::from_millis(20));
        // 10 Mbit/s for 20 ms are 25,000 bytes.
        assert_eq!(stream.window(), 25_000 + 65_536);
        assert_eq!(StreamConfig { buffer: Some(Bytes::new(9)), ..stream }.window(), 9);
    }

    #[test]
    fn parts_that_need_packets_are_refused_by_their_key() {
        for (key, text) in [
            ("loss", "loss=1%"),
            ("duplicate", "duplicate=1%"),
            ("corrupt", "corrupt=1%"),
            ("reorder", "reorder=1%"),
            ("mtu", "mtu=1500B"),
            ("limit", "limit=1000 packets"),
            ("token-bucket", "token-bucket={ rate = \"1Mbit\", burst = \"10kB\" }"),
            ("netem-profile", "netem=delay 2ms loss 1%"),
        ] {
            let profile = if key == "netem-profile" { "netem-profile=kernel-6.6" } else { "delay=1ms" };
            let keys = if key == "netem-profile" { vec![text, profile] } else { vec![profile, text] };
            assert_eq!(stream(&keys).unwrap_err().0, key);
        }
        assert_eq!(stream(&["rate=1Mbit", "queue={ limit = \"9 packets\" }"]).unwrap_err().0, "queue");
        assert_eq!(stream(&["rate=1Mbit", "overhead=28B"]).unwrap_err().0, "queue");
    }
}
