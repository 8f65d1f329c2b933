//! What a steady stream over one link answers: the figures that the link was asked for and those that it achieved, as a document and in words.

mod document;
mod words;

use cohaptic_measure::achieved::{Accumulator, Achieved};
use cohaptic_measure::asked::Asked;
use cohaptic_measure::comparison::{Comparison, Figure};
use cohaptic_measure::steady::SteadyStream;
use cohaptic_wan::PacketRecord;

pub use document::{Written, document};
pub use words::words;

/// The most packets that figures are of. Each takes 127 bytes while figures are worked out: half a gigabyte of these.
pub const MOST_MEASURED: u64 = 4_000_000;

/// Measures a link from the records of its packets, one by one. Records beyond [`MOST_MEASURED`] packets are counted only.
#[derive(Clone, Debug)]
pub struct Meter {
    accumulator: Accumulator,
    comparison: Comparison,
}

/// The figures of a link.
#[derive(Clone, PartialEq, Debug)]
pub struct Measured {
    /// The link as it was said, in words of tc-netem or in keys of a scene.
    pub said: String,
    /// The figures that the link was asked for.
    pub asked: Asked,
    /// The figures that the link achieved.
    pub achieved: Achieved,
    /// The figures that both have, with their distance.
    pub figures: Vec<Figure>,
    /// Packets that were sent.
    pub sent: u64,
    /// Packets that were to be sent; more than were sent if the stream was interrupted.
    pub wanted: u64,
}

/// Returns why a stream cannot be sent over a link, in words; `None` if it can: half of all time is left for delays.
#[must_use]
pub fn too_long(stream: &SteadyStream) -> Option<&'static str> {
    let is_too_long = stream.sent(stream.packets).as_nanos() > u64::MAX / 2;
    is_too_long.then_some("the stream lasts longer than 292 years: expected fewer packets, or less time between them")
}

impl Default for Meter {
    fn default() -> Self {
        Self { accumulator: Accumulator::of_first(MOST_MEASURED), comparison: Comparison::default() }
    }
}

impl Meter {
    /// Takes a record. Records come in the order in which things happen.
    pub fn record(&mut self, record: &PacketRecord) {
        // The only refusal is that of a record out of order.
        let _ = self.accumulator.record(record);
        if record.sequence < MOST_MEASURED {
            self.comparison.record(record);
        }
    }

    /// Returns the figures. `said`: the link in words or keys. `sent`, `wanted`: packets that were sent, and that were to be sent.
    #[must_use]
    pub fn finish(self, said: String, asked: Asked, [sent, wanted]: [u64; 2]) -> Measured {
        let figures = self.comparison.figures(&asked);
        Measured { said, asked, achieved: self.accumulator.finish(), figures, sent, wanted }
    }
}

impl Measured {
    /// Whether fewer packets were sent than were to be sent.
    #[must_use]
    pub const fn is_interrupted(&self) -> bool {
        self.sent < self.wanted
    }
}
