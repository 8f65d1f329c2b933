//! The CSV files of the data set LENS.
//!
//! Measurements by IRTT have the columns `timestamp,rtt,uplink,downlink`, in nanoseconds since 1970 and in milliseconds. −1 says on which way the packet was
//! lost: in `uplink`, in `downlink`, or in `rtt` where that is not known. The other delays of such a row are 0, which is no delay. Measurements by ping have
//! the columns `timestamp,rtt`, in seconds since 1970, when the answer came, and in milliseconds.

use cohaptic_wan::delay_table::{A_DELAY, Attoseconds, cells, delay};

use super::probes::{self, Outcome, Places, Probe};
use super::{Delays, Direction, LeftOut, Program, ReaderError, ping};
use crate::fit::{Measurement, Measurements};

/// Returns the lines with content, each with its number, counted from 1.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'))
}

/// Returns whether a text begins with the columns of LENS.
pub(super) fn is_lens(text: &str) -> bool {
    let names = lines(text).next().map(|(_, header)| names(header)).unwrap_or_default();
    ["timestamp", "rtt"].iter().all(|name| names.iter().any(|column| column == name))
}

fn names(header: &str) -> Vec<String> {
    cells(header).iter().map(|name| name.to_ascii_lowercase()).collect()
}

/// Milliseconds, as an exponent of ten of a second.
const MILLI: i32 = -3;

/// Places in the CSV: the lines of the rows.
struct Lines(Vec<usize>);

impl Places for Lines {
    fn sent(&self, probe: usize) -> String {
        format!("line {}, column timestamp", self.0[probe])
    }

    fn delay(&self, probe: usize, direction: Direction) -> String {
        let column = match direction {
            Direction::Up => "uplink",
            Direction::Down => "downlink",
            Direction::Rtt => "rtt",
        };
        format!("line {}, column {column}", self.0[probe])
    }
}

/// Columns by their index.
struct Columns {
    timestamp: usize,
    rtt: usize,
    /// Columns `uplink` and `downlink`; `None` for measurements by ping.
    ways: Option<[usize; 2]>,
}

impl Columns {
    fn of(line: usize, header: &str) -> Result<Self, ReaderError> {
        let names = names(header);
        let place = |name: &str| names.iter().position(|column| column == name);
        let found = || {
            ReaderError::found(format!("line {line}"), format!("the columns {}", names.join(",")), "timestamp,rtt, or timestamp,rtt,uplink,downlink")
        };
        let ways = match (place("uplink"), place("downlink")) {
            (Some(up), Some(down)) => Some([up, down]),
            (None, None) => None,
            (Some(_), None) | (None, Some(_)) => return Err(found()),
        };
        Ok(Self { timestamp: place("timestamp").ok_or_else(found)?, rtt: place("rtt").ok_or_else(found)?, ways })
    }
}

/// Reads the CSV.
pub(super) fn read(text: &str, direction: Option<Direction>) -> Result<Delays, ReaderError> {
    let mut lines = lines(text);
    let (line, header) = lines.next().unwrap_or((1, ""));
    let columns = Columns::of(line, header)?;
    match columns.ways {
        Some(ways) => both_ways(lines, &columns, ways, direction),
        None => round_trips(lines, &columns),
    }
}

/// Reads a cell as a time of the unit 10^`unit` s.
fn time(line: usize, cells: &[String], place: usize, unit: i32) -> Result<Attoseconds, ReaderError> {
    let text = cells.get(place).map_or("", String::as_str);
    Attoseconds::parse(text, unit)
        .ok_or_else(|| ReaderError::found(format!("line {line}, column timestamp"), format!("\"{text}\""), "a decimal number"))
}

/// Reads a cell as a delay; `None` for a lost packet.
fn milliseconds(line: usize, cells: &[String], place: usize, name: &str) -> Result<Option<Attoseconds>, ReaderError> {
    let text = cells.get(place).map_or("", String::as_str);
    delay(text, MILLI).ok_or_else(|| ReaderError::found(format!("line {line}, column {name}"), format!("\"{text}\""), A_DELAY))
}

/// Reads measurements by IRTT.
fn both_ways<'a>(
    lines: impl Iterator<Item = (usize, &'a str)>,
    columns: &Columns,
    [up, down]: [usize; 2],
    direction: Option<Direction>,
) -> Result<Delays, ReaderError> {
    let (mut probes, mut numbers) = (Vec::new(), Vec::new());
    for (line, text) in lines {
        let cells = cells(text);
        let sent = time(line, &cells, columns.timestamp, -9)?;
        let read = |place, name| milliseconds(line, &cells, place, name);
        // A lost row has −1 in one column and 0 in the others, so the column without a delay decides before the zeros are read.
        let outcome = match (read(columns.rtt, "rtt")?, read(up, "uplink")?, read(down, "downlink")?) {
            (None, ..) => Outcome::Lost,
            (Some(_), None, _) => Outcome::LostUp,
            (Some(_), Some(_), None) => Outcome::LostDown,
            (rtt, up, down) => Outcome::Answered { up, down, rtt },
        };
        probes.push(Probe { sent, outcome });
        numbers.push(line);
    }
    probes::take(Program::Lens, &probes, direction, &Lines(numbers))
}

/// Reads measurements by ping. A row has the instant of the answer, so a packet was sent one round trip earlier.
fn round_trips<'a>(lines: impl Iterator<Item = (usize, &'a str)>, columns: &Columns) -> Result<Delays, ReaderError> {
    let mut first = None;
    let mut packets: Vec<Measurement> = Vec::new();
    for (line, text) in lines {
        let cells = cells(text);
        let at = time(line, &cells, columns.timestamp, 0)?;
        let delay_s = milliseconds(line, &cells, columns.rtt, "rtt")?.map(Attoseconds::seconds);
        // Instants count from the first row, because `f64` resolves seconds since 1970 only to a quarter of a microsecond.
        let at_s = at.seconds_since(*first.get_or_insert(at));
        let at_s =
            at_s.ok_or_else(|| ReaderError::found(format!("line {line}, column timestamp"), "a time out of range", "within 10^20 s of the first"))?;
        // A lost packet has no round trip to subtract, and keeps the instant of its row.
        packets.push(Measurement { sent_s: at_s - delay_s.unwrap_or(0.0), delay_s });
    }
    // Answers can overtake each other, so rows in the order of answers need not be in the order of sending.
    packets.sort_by(|one, other| one.sent_s.total_cmp(&other.sent_s));
    let ticks = packets.iter().map(|packet| ping::tick_of(packet.delay_s.unwrap_or(0.0))).collect();
    Ok(Delays {
        program: Program::Lens,
        direction: Direction::Rtt,
        measurements: Measurements::in_order(packets).rounded_each(ticks),
        left_out: LeftOut::default(),
        offset_s: None,
        notes: vec!["the file has no numbers of packets, so a lost packet shows only where a row says so".to_owned()],
    })
}
