//! The traffic that both ways carry: when each peer sends, and how long each link takes, in whole nanoseconds.

use std::time::Duration;

use cohaptic_units::Instant;

/// How many nodes there are; each sends to each other one.
pub(crate) const NODES: usize = 4;

/// A mesh whose nodes send at their own instants.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Traffic {
    /// How often each node sends.
    pub(crate) period: Duration,
    /// When each sends first; ascending, less than a period.
    pub(crate) offsets: [Duration; NODES],
    /// How long the link takes, by sender and receiver.
    pub(crate) delays: [[Duration; NODES]; NODES],
    /// How often each sends in all.
    pub(crate) rounds: u32,
}

/// A packet that has arrived.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Arrival {
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// From the instant at which the sample was taken.
    pub(crate) delay: Duration,
}

impl Traffic {
    /// Links of 4 to 12 ms, no two alike and none a whole number of microseconds: 8 ms times the fractions of multiples of the golden ratio.
    pub(crate) fn new(period: Duration, offset: Duration, rounds: u32) -> Self {
        const GOLDEN_NANOS: u64 = 4_944_271;
        let link = |from: usize, to: usize| Duration::from_nanos(4_000_000 + (from * NODES + to + 1) as u64 * GOLDEN_NANOS % 8_000_000);
        let mut place = 0;
        let offsets = [(); NODES].map(|()| {
            place += 1;
            offset * (place - 1)
        });
        Self { period, offsets, delays: std::array::from_fn(|from| std::array::from_fn(|to| link(from, to))), rounds }
    }

    /// When a node sends for the time of that number.
    pub(crate) fn instant(&self, node: usize, number: u32) -> Instant {
        Instant::ZERO + self.offsets[node] + self.period * number
    }

    /// The sendings in order: instant and node.
    pub(crate) fn sendings(&self) -> impl Iterator<Item = (Instant, usize)> + '_ {
        (0..self.rounds).flat_map(move |number| (0..NODES).map(move |node| (self.instant(node, number), node)))
    }

    pub(crate) fn packets(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "four nodes")]
        let pairs = (NODES * (NODES - 1)) as f64;
        f64::from(self.rounds) * pairs
    }
}

/// How far the delays seen are from the true ones.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Errors {
    seen: u64,
    sum: i128,
    worst: u64,
}

impl Errors {
    /// Takes in what has arrived.
    pub(crate) fn add(&mut self, traffic: &Traffic, arrival: Arrival) {
        let nanos = |span: Duration| i128::try_from(span.as_nanos()).unwrap_or(i128::MAX);
        let error = nanos(arrival.delay) - nanos(traffic.delays[arrival.from][arrival.to]);
        self.seen += 1;
        self.sum += error;
        self.worst = self.worst.max(u64::try_from(error.unsigned_abs()).unwrap_or(u64::MAX));
    }

    /// How many packets arrived.
    #[cfg(test)]
    pub(crate) fn seen(&self) -> u64 {
        self.seen
    }

    /// |mean delay seen − mean true delay| \[s\].
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 nanoseconds")]
    pub(crate) fn of_mean(&self) -> f64 {
        self.sum.unsigned_abs() as f64 / self.seen.max(1) as f64 / 1e9
    }

    /// The largest |delay seen − true delay| of a packet \[s\].
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 nanoseconds")]
    pub(crate) fn worst(&self) -> f64 {
        self.worst as f64 / 1e9
    }
}
