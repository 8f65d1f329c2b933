//! Reads files of other programs: what they measured, or how they describe a link.
//!
//! Input is the bytes of a file; output is a [`Content`]: delays to fit, or a link as it is recorded. The file shows which program wrote it, so nobody has to
//! say so:
//!
//! | program | file | shown by |
//! | --- | --- | --- |
//! | IRTT | JSON of `irtt client -o` | the key `round_trips` |
//! | LENS | CSV | the columns `timestamp` and `rtt` |
//! | ping | what `ping` or `ping -D` prints | a line with `icmp_seq=` or `seq=`, and `time=` |
//! | iperf3 | JSON of `iperf3 -J` | the key `intervals` |
//! | CellReplay | text of whole numbers | a first line of numbers alone |
//! | netem-trace | JSON | one key, the name of a configuration |
//!
//! Every other text is left to [`cohaptic_wan::delay_table`]. A file that a program did not write as its format says is refused at its place: the line, the
//! column or the path in the JSON, with what was found and what was expected. No bytes make a reader panic.

mod cellreplay;
mod iperf3;
mod irtt;
mod json;
mod lens;
mod netem_trace;
mod ping;
mod probes;
mod recording;

use serde::Serialize;

use super::Measurements;
pub use recording::{Rate, Recording};

/// Program that wrote a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Program {
    /// `irtt client`.
    Irtt,
    /// The data set LENS of measurements through satellites.
    Lens,
    /// `ping`, of iputils, BSD or BusyBox.
    Ping,
    /// `iperf3`.
    Iperf3,
    /// CellReplay.
    CellReplay,
    /// The library netem-trace.
    NetemTrace,
}

impl Program {
    /// Returns the name of the program.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Irtt => "IRTT",
            Self::Lens => "LENS",
            Self::Ping => "ping",
            Self::Iperf3 => "iperf3",
            Self::CellReplay => "CellReplay",
            Self::NetemTrace => "netem-trace",
        }
    }
}

/// Way of the packets whose delays are taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From the client to the server.
    Up,
    /// From the server to the client.
    Down,
    /// There and back.
    Rtt,
}

/// Content of a file.
#[derive(Clone, PartialEq, Debug)]
pub enum Content {
    /// Measured delays.
    Delays(Delays),
    /// A link as it is recorded or described, without an estimate.
    Link(Recording),
}

/// Measured delays, and what their file says about them.
#[derive(Clone, PartialEq, Debug)]
pub struct Delays {
    /// Program that measured.
    pub program: Program,
    /// Way of the packets.
    pub direction: Direction,
    /// The measured packets. If `offset` is present, the delays are without this offset.
    pub measurements: Measurements,
    /// Numbers of packets that are not counted, for each reason.
    pub left_out: LeftOut,
    /// Offset of the server's clock that is assumed \[s\]: with this offset the least delays of both ways are equal. `None` for a round trip, which one clock
    /// measures.
    pub offset_s: Option<f64>,
    /// Assumptions of the reader, in sentences without a full stop.
    pub notes: Vec<String>,
}

/// Numbers of packets that are not counted.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct LeftOut {
    /// Packets lost on a way that the file does not name.
    pub either_way: usize,
    /// Packets whose loss on the other way hides their delay, or which were never sent on this way.
    pub other_way: usize,
    /// Second and later answers to a packet.
    pub copies: usize,
}

/// Error of a reader: the place in the file, and what was found and expected there.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct ReaderError {
    place: String,
    problem: String,
}

impl ReaderError {
    fn new(place: impl std::fmt::Display, problem: impl std::fmt::Display) -> Self {
        Self { place: place.to_string(), problem: problem.to_string() }
    }

    /// Returns the error for a text that is not what was expected.
    fn found(place: impl std::fmt::Display, found: impl std::fmt::Display, expected: impl std::fmt::Display) -> Self {
        // Long texts would hide the place.
        let found: String = found.to_string().chars().take(80).collect();
        Self::new(place, format!("found {found}, expected {expected}"))
    }
}

/// Most packets of a file. A short text can name more packets than memory holds, since gaps in the numbers of packets are lost packets.
const MOST_PACKETS: usize = 1 << 24;

/// Reads the file of another program. `direction`: the way of the packets, of programs that measure both ways. Returns `None` for any other text, such as a
/// table of delays.
///
/// # Errors
///
/// [`ReaderError`] with the place, for a file of a program which is not as the format of the program says, and for a `direction` that the file lacks.
pub fn read(text: &str, direction: Option<Direction>) -> Result<Option<Content>, ReaderError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let content = match text.trim_start().chars().next() {
        Some('{') => json::read(text, direction)?,
        Some(_) if lens::is_lens(text) => Content::Delays(lens::read(text, direction)?),
        Some(_) if ping::is_ping(text) => Content::Delays(ping::read(text)?),
        // After ping, since a line of `ping -D` begins with a bracket.
        Some('[') => json::read(text, direction)?,
        Some(_) if cellreplay::is_cellreplay(text) => Content::Link(cellreplay::read(text)?),
        Some(_) | None => return Ok(None),
    };
    if let Some(direction @ (Direction::Up | Direction::Down)) = direction {
        let has_both_ways = matches!(&content, Content::Delays(delays) if delays.direction == direction);
        if !has_both_ways {
            return Err(ReaderError::new("direction", "expected a file with both ways, of IRTT or LENS: this one has not"));
        }
    }
    Ok(Some(content))
}

#[cfg(test)]
mod tests;
