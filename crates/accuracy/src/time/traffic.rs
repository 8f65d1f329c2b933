//! Traffic for both representations of time: instants of sending, and delays of links, in whole nanoseconds.

use std::time::Duration;

use cohaptic_units::Instant;

/// Number of nodes. Each node sends to all other nodes.
pub(crate) const NODES: usize = 4;

/// A mesh of nodes with different instants of sending.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Traffic {
    /// Period of the sendings of each node.
    pub(crate) period: Duration,
    /// First sending of each node; ascending, less than a period.
    pub(crate) offsets: [Duration; NODES],
    /// Delays of the links, indexed by sender and receiver.
    pub(crate) delays: [[Duration; NODES]; NODES],
    /// Number of sendings of each node.
    pub(crate) rounds: u32,
}

/// An arrived packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Arrival {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// Time since the instant of the sample.
    pub(crate) delay: Duration,
}

impl Traffic {
    /// Returns traffic over links of 4 to 12 ms, all different and none a whole number of microseconds: 4 ms plus 8 ms times the fractions of multiples of
    /// the golden ratio.
    pub(crate) fn new(period: Duration, offset: Duration, rounds: u32) -> Self {
        const GOLDEN_NANOS: u64 = 4_944_271;
        let link = |from: usize, to: usize| Duration::from_nanos(4_000_000 + (from * NODES + to + 1) as u64 * GOLDEN_NANOS % 8_000_000);
        let mut place = 0;
        let offsets = [(); NODES].map(|()| {
            place += 1;
            // Node k sends k offsets after the first node.
            offset * (place - 1)
        });
        Self { period, offsets, delays: std::array::from_fn(|from| std::array::from_fn(|to| link(from, to))), rounds }
    }

    /// Returns the instant of the sending `number` of a node.
    pub(crate) fn instant(&self, node: usize, number: u32) -> Instant {
        Instant::ZERO + self.offsets[node] + self.period * number
    }

    /// Returns instant and node of all sendings, in the order of time.
    pub(crate) fn sendings(&self) -> impl Iterator<Item = (Instant, usize)> + '_ {
        (0..self.rounds).flat_map(move |number| (0..NODES).map(move |node| (self.instant(node, number), node)))
    }

    /// Returns the number of packets in all.
    pub(crate) fn packets(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "four nodes")]
        let pairs = (NODES * (NODES - 1)) as f64;
        f64::from(self.rounds) * pairs
    }
}

/// Differences between observed and true delays.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Errors {
    /// Number of arrived packets.
    seen: u64,
    /// Sum of the differences \[ns\].
    sum: i128,
    /// Largest absolute difference \[ns\].
    worst: u64,
}

impl Errors {
    /// Takes in an arrival.
    pub(crate) fn add(&mut self, traffic: &Traffic, arrival: Arrival) {
        let nanos = |span: Duration| i128::try_from(span.as_nanos()).unwrap_or(i128::MAX);
        let error = nanos(arrival.delay) - nanos(traffic.delays[arrival.from][arrival.to]);
        self.seen += 1;
        self.sum += error;
        self.worst = self.worst.max(u64::try_from(error.unsigned_abs()).unwrap_or(u64::MAX));
    }

    /// Returns the number of arrived packets.
    #[cfg(test)]
    pub(crate) fn seen(&self) -> u64 {
        self.seen
    }

    /// Returns |mean observed delay − mean true delay| \[s\].
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 nanoseconds")]
    pub(crate) fn of_mean(&self) -> f64 {
        self.sum.unsigned_abs() as f64 / self.seen.max(1) as f64 / 1e9
    }

    /// Returns the largest |observed delay − true delay| of a packet \[s\].
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 nanoseconds")]
    pub(crate) fn worst(&self) -> f64 {
        self.worst as f64 / 1e9
    }
}
