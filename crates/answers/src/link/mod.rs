//! The answers about a steady stream over a link: requested and achieved figures of the link, as a document and in words.

mod document;
mod picture;
mod words;

use cohaptic_measure::achieved::{Accumulator, Achieved};
use cohaptic_measure::asked::Asked;
use cohaptic_measure::comparison::{Comparison, Figure};
use cohaptic_measure::steady::SteadyStream;
use cohaptic_wan::{CrossCounts, PacketRecord};

pub use document::{Written, document};
pub use picture::{CrossSamples, LinkPicture};
pub use words::words;

/// Greatest number of packets in the figures. Each packet takes 127 bytes during the computation, half a gigabyte in all.
pub(crate) const MOST_MEASURED: u64 = 4_000_000;

/// Measures a link from the records of its packets. Packets beyond the first 4 million are only counted.
#[derive(Clone, Debug)]
pub struct Meter {
    accumulator: Accumulator,
    comparison: Comparison,
}

/// The figures of a link.
#[derive(Clone, PartialEq, Debug)]
pub struct Measured {
    /// The link as written by the user, in words of tc-netem or in keys of a scene.
    pub(crate) said: String,
    /// Figures requested of the link.
    pub(crate) asked: Asked,
    /// Figures achieved by the link.
    pub(crate) achieved: Achieved,
    /// Figures both requested and achieved, with their distance.
    pub(crate) figures: Vec<Figure>,
    /// Packets of the cross-traffic up to the last packet at the queue.
    pub(crate) cross_traffic: CrossCounts,
    /// Number of sent packets.
    pub(crate) sent: u64,
    /// Number of packets to send; larger than `sent` if the stream was interrupted.
    pub(crate) wanted: u64,
}

/// Returns the reason, in words, why a stream is too long; `None` if the stream can be sent. Half of the range of instants is reserved for delays.
#[must_use]
pub fn too_long(stream: &SteadyStream) -> Option<&'static str> {
    // `sent` saturates at the last instant, so a stream beyond the range is too long as well.
    let is_too_long = stream.sent(stream.packets).as_nanos() > u64::MAX / 2;
    is_too_long.then_some("the stream lasts longer than 292 years: expected fewer packets, or less time between them")
}

impl Default for Meter {
    fn default() -> Self {
        Self { accumulator: Accumulator::of_first(MOST_MEASURED), comparison: Comparison::default() }
    }
}

impl Meter {
    /// Adds a record. Records must come in the order of their instants.
    pub fn record(&mut self, record: &PacketRecord) {
        // Only a record out of order is refused, and the emulator never makes such a record.
        let _ = self.accumulator.record(record);
        // The accumulator has the same limit inside; the comparison needs the limit from here.
        if record.sequence < MOST_MEASURED {
            self.comparison.record(record);
        }
    }

    /// Returns the figures. `said`: the link in words or keys. `sent`, `wanted`: numbers of sent packets and of packets to send. `cross_traffic`: the counts of
    /// the link.
    #[must_use]
    pub fn finish(self, said: String, asked: Asked, [sent, wanted]: [u64; 2], cross_traffic: CrossCounts) -> Measured {
        let figures = self.comparison.figures(&asked);
        Measured { said, asked, achieved: self.accumulator.finish(), figures, cross_traffic, sent, wanted }
    }
}

impl Measured {
    /// Returns `true` if fewer packets were sent than planned.
    #[must_use]
    pub const fn is_interrupted(&self) -> bool {
        self.sent < self.wanted
    }
}
