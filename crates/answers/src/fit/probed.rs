//! Statements of the file of another program about its measurements, and the assumptions of the reader.

use cohaptic_measure::fit::readers::{Delays, Direction, LeftOut, Program};
use cohaptic_measure::fit::{Measurements, MeasurementsError};
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::milliseconds::milliseconds;

/// Origin of measured delays.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct Probed {
    program: Program,
    direction: Direction,
    #[serde(flatten)]
    left_out: LeftOut,
    /// Share of the round trip that is the delay; `None` for measurements of one way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) share: Option<f64>,
    notes: Vec<String>,
    /// Time that the reader added to every delay \[s\], minus or plus the assumed offset of the server's clock. Said by the answer about the clocks.
    #[serde(skip)]
    pub(super) added_s: Option<f64>,
}

/// Why measurements of another program are not taken as delays.
#[derive(Debug, thiserror::Error)]
pub(super) enum ProbedError {
    /// A round trip is no delay of one way.
    #[error("split: the file has round trips, of which no share is known to be the delay of one way: expected even for half, or a share such as 60%")]
    NoShare,
    /// A delay of one way needs no share.
    #[error("split: these are delays of one way: expected no share of a round trip")]
    OneWay,
    #[error("split: {0}")]
    Share(#[from] MeasurementsError),
}

impl Probed {
    /// Takes the delays of one way. `split`: share of the round trip.
    pub(super) fn of(delays: Delays, split: Option<f64>) -> Result<(Measurements, Self), ProbedError> {
        let Delays { program, direction, measurements, left_out, offset_s, notes } = delays;
        let measurements = match (direction, split) {
            (Direction::Rtt, Some(share)) => measurements.share_of_round_trip(share)?,
            (Direction::Rtt, None) => return Err(ProbedError::NoShare),
            (Direction::Up | Direction::Down, Some(_)) => return Err(ProbedError::OneWay),
            (Direction::Up | Direction::Down, None) => measurements,
        };
        // The server's clock is ahead by the offset: delays up contain it, and delays down lack it.
        let added_s = offset_s.map(|offset_s| if direction == Direction::Up { -offset_s } else { offset_s });
        Ok((measurements, Self { program, direction, left_out, share: split, notes, added_s }))
    }

    /// Returns whether one clock measured both ends of the delays.
    pub(super) fn has_one_clock(&self) -> bool {
        self.direction == Direction::Rtt
    }

    /// Returns the lines of text about the origin.
    pub(super) fn describe(&self) -> Vec<String> {
        let way = match self.direction {
            Direction::Up => "the way up, from client to server",
            Direction::Down => "the way down, from server to client",
            Direction::Rtt => "round trips",
        };
        let mut lines = vec![format!("measured by {}: {way}", self.program.name())];
        let LeftOut { either_way, other_way, copies } = self.left_out;
        for (packets, why) in [
            (either_way, "lost on a way that the file does not name"),
            (other_way, "lost on the other way, which hides the delay or kept the packet from being sent"),
            (copies, "answered again"),
        ] {
            if packets > 0 {
                lines.push(format!("not counted: {} {why}", Counted(packets, "packet")));
            }
        }
        if let Some(share) = self.share {
            lines.push(format!("assumed: the delay is {:.4} % of the round trip; the loss is that of both ways together", share * 100.0));
        }
        lines.extend(self.notes.iter().cloned());
        lines
    }
}

/// Returns the line of text about an assumed offset of the server's clock, which added `added_s` to every delay.
pub(super) fn describe_assumed(added_s: f64) -> String {
    format!("assumed: the least delays of both ways are equal, so {} was added to every delay for the clock of the server", milliseconds(added_s))
}
