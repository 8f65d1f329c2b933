//! Inputs as lines of text.
//!
//! ```text
//! at_ns,input,peer,to,value
//! 0,program,,,0.1.0
//! 8000000,sample,left,,43485054010001000…
//! 9000000,device,hand,,0.01 -0.5
//! 9000000,link,left,hand,"{ delay = ""40ms"", loss = 0.1 }"
//! 12000000,end,,,
//! 12000000,closed,,,5
//! ```
//!
//! The last row closes the record with the number of rows before it and the instant of the last of these rows. A file without this row was cut short.
//!
//! A sample is written in hexadecimal. A device or pointer has position and velocity along each axis in turn (`x vx y vy`), with enough digits to read the same
//! numbers back, or `none`. A link has all its keys, as a TOML table. The first rows name [the recorded scene](super::RecordedScene).

use std::fmt;
use std::path::Path;

use cohaptic_peer::State;
use cohaptic_scene::{LinkKeys, PeerKind, Scene};
use cohaptic_units::Instant;
use cohaptic_units::print::csv_quoted;

use super::inputs::{HEADER, Inputs, InputsError, Recorded, shorten};
use super::recorded::is_about_the_scene;
use crate::number_text::parts;
use crate::rows::{Input, InputRow};

/// An input as a line without the newline.
#[derive(Clone, Copy, Debug)]
pub struct InputLine<'a> {
    /// The row.
    pub(crate) row: &'a InputRow<'a>,
    /// Names of the peers, indexed by peer.
    pub(crate) names: &'a [String],
}

impl fmt::Display for InputLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let InputRow { at, what } = self.row;
        let name = |peer: usize| self.names.get(peer).map_or("", String::as_str);
        write!(f, "{},", at.as_nanos())?;
        match what {
            Input::Sample { peer, datagram } => {
                write!(f, "sample,{},,", name(*peer))?;
                datagram.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
            }
            Input::Device { peer, state } => {
                write!(f, "device,{},,", name(*peer))?;
                let Some(state) = state else { return f.write_str("none") };
                let mut before = "";
                for value in state.position.iter().zip(state.velocity).flat_map(|(x, v)| [x, v]) {
                    let mut buffer = zmij::Buffer::new();
                    let (mantissa, exponent) = parts(&mut buffer, *value);
                    write!(f, "{before}{mantissa}{exponent}")?;
                    before = " ";
                }
                Ok(())
            }
            Input::Link { from, to, keys } => write!(f, "link,{},{},{}", name(*from), name(*to), csv_quoted(&keys.to_string())),
            Input::End => f.write_str("end,,,"),
        }
    }
}

/// The closing row of a record, as a line without the newline.
#[derive(Clone, Copy, Debug)]
pub struct ClosingLine {
    /// Instant of the last row before.
    pub(crate) at: Instant,
    /// Number of rows between the header and the closing row.
    pub(crate) rows: u64,
}

impl fmt::Display for ClosingLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{CLOSED},,,{}", self.at.as_nanos(), self.rows)
    }
}

/// Kind of the closing row.
const CLOSED: &str = "closed";

impl Inputs {
    /// Reads a record of [`crate::record::InputRecorder`] for the same scene. `keys`: keys of any link of the scene, from [`cohaptic_scene::link_keys`].
    ///
    /// # Errors
    ///
    /// [`InputsError`] for any different text, and for an incomplete record.
    pub fn read(text: &str, scene: &Scene, keys: &LinkKeys) -> Result<Self, InputsError> {
        let (inputs, missing) = Self::read_cut(text, scene, keys)?;
        missing.map_or(Ok(inputs), Err)
    }

    /// Reads a record as [`Inputs::read`] does, or an incomplete record, as left behind by a killed session. For an incomplete record the second value is the
    /// reason, and the inputs end the session at the last whole line.
    ///
    /// # Errors
    ///
    /// [`InputsError`] for whole lines without a valid row.
    pub fn read_cut(text: &str, scene: &Scene, keys: &LinkKeys) -> Result<(Self, Option<InputsError>), InputsError> {
        // Editors of some systems put a byte order mark before the first cell.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text.lines();
        let header = lines.next().unwrap_or_default();
        if header != HEADER {
            return Err(InputsError::Header { found: shorten(header) });
        }
        let folder = scene.file.parent().unwrap_or_else(|| Path::new(""));
        let mut rows: Vec<(Instant, Recorded)> = Vec::new();
        let mut closed: Option<u64> = None;
        let mut last_line = 1;
        let count = text.lines().count();
        for (line, row) in (2..).zip(lines) {
            let closing = closing(line, row);
            // A number without its last digits is still a number. A line without newline is therefore no row, except a closing row with a valid number.
            let is_whole = line < count || text.ends_with('\n');
            if !is_whole && !matches!(closing, Ok(Some(_))) {
                break;
            }
            let before = rows.last().map_or(Instant::ZERO, |(at, _)| *at);
            if let Some((at, said)) = closing? {
                if at < before || closed.is_some() {
                    return Err(InputsError::Order { line, at, before });
                }
                closed = Some(said);
                continue;
            }
            last_line = line;
            // [`RecordedScene`](super::RecordedScene) reads the rows about the scene.
            if rows.is_empty() && closed.is_none() && is_about_the_scene(row) {
                continue;
            }
            let (at, what) = read_row(line, row, scene, keys, folder)?;
            // Instants may be equal but never fall, and nothing follows the end of the session.
            if at < before || closed.is_some() || matches!(rows.last(), Some((_, Recorded::End))) {
                return Err(InputsError::Order { line, at, before });
            }
            rows.push((at, what));
        }
        let missing = match closed {
            Some(said) => {
                // The header is line 1 and no row.
                let found = last_line as u64 - 1;
                (said != found).then_some(InputsError::Rows { said, found })
            }
            // The session ends at the last row, so the rows so far can be replayed.
            None => {
                let at = rows.last().map_or(Instant::ZERO, |(at, _)| *at);
                if !matches!(rows.last(), Some((_, Recorded::End))) {
                    rows.push((at, Recorded::End));
                }
                Some(InputsError::NotClosed { line: last_line, at })
            }
        };
        Ok((Self { rows }, missing))
    }
}

/// Returns the instant and the number of rows of a closing row; `None` for any different row.
fn closing(line: usize, row: &str) -> Result<Option<(Instant, u64)>, InputsError> {
    let mut cells = row.splitn(5, ',');
    let mut cell = || cells.next().unwrap_or_default();
    let cells = Cells { line, cells: [cell(), cell(), cell(), cell(), cell()] };
    if cells.cells[1] != CLOSED {
        return Ok(None);
    }
    let rows = cells.whole_number(4).ok_or_else(|| cells.refused(4, "the number of rows before this one"))?;
    Ok(Some((cells.instant()?, rows)))
}

/// Cells of a row: four short cells and the value.
struct Cells<'a> {
    /// Number of the line, for messages.
    line: usize,
    cells: [&'a str; 5],
}

const COLUMNS: [&str; 5] = ["at_ns", "input", "peer", "to", "value"];

fn read_row(line: usize, row: &str, scene: &Scene, keys: &LinkKeys, folder: &Path) -> Result<(Instant, Recorded), InputsError> {
    let mut cells = [""; 5];
    // The value is the fifth cell and may contain commas itself, hence the limit of five parts.
    let mut rest = row.splitn(5, ',');
    for cell in &mut cells {
        *cell = rest.next().ok_or_else(|| InputsError::Cell {
            line,
            column: COLUMNS[4],
            found: shorten(row),
            expected: format!("five cells, {HEADER}"),
        })?;
    }
    let cells = Cells { line, cells };
    let at = cells.instant()?;
    let what = match cells.cells[1] {
        "sample" => Recorded::Sample { peer: cells.peer(2, scene, &["udp"])?, datagram: cells.bytes()? },
        "device" => Recorded::Device { peer: cells.peer(2, scene, &["falcon", "inverse3", "pointer"])?, state: cells.state(scene.axes.count())? },
        "link" => {
            let (from, to) = (cells.peer(2, scene, &[])?, cells.peer(3, scene, &[])?);
            // A peer has no link to itself.
            if from == to {
                return Err(cells.refused(3, "another peer than the sender"));
            }
            let (keys, model) = cells.link(keys, folder)?;
            Recorded::Link { from, to, keys, model: Box::new(model) }
        }
        "end" => Recorded::End,
        _ => return Err(cells.refused(1, "sample, device, link, end or closed")),
    };
    Ok((at, what))
}

impl Cells<'_> {
    fn refused(&self, column: usize, expected: impl Into<String>) -> InputsError {
        InputsError::Cell { line: self.line, column: COLUMNS[column], found: shorten(self.cells[column]), expected: expected.into() }
    }

    fn whole_number(&self, column: usize) -> Option<u64> {
        // `parse` accepts "+1" too, but no writer of this format writes a sign.
        let plain = self.cells[column].bytes().all(|byte| byte.is_ascii_digit());
        self.cells[column].parse().ok().filter(|_| plain)
    }

    fn instant(&self) -> Result<Instant, InputsError> {
        self.whole_number(0).map(Instant::from_nanos).ok_or_else(|| self.refused(0, "a whole number of nanoseconds from 0 to 2^64 - 1"))
    }

    /// Returns the peer named in a cell. `kinds` lists the allowed kinds of peers; an empty list allows all.
    fn peer(&self, column: usize, scene: &Scene, kinds: &[&str]) -> Result<usize, InputsError> {
        let named = scene.peer_index(self.cells[column]);
        let fits = |kind: &PeerKind| kinds.is_empty() || kinds.contains(&kind.name());
        named.filter(|place| fits(&scene.peers[*place].kind)).ok_or_else(|| {
            let kind = if kinds.is_empty() { String::new() } else { format!(" of kind \"{}\"", kinds.join("\" or \"")) };
            self.refused(column, format!("the name of a peer{kind} of the scene"))
        })
    }

    fn bytes(&self) -> Result<Vec<u8>, InputsError> {
        let digits = self.cells[4].as_bytes();
        let digit = |byte: &u8| char::from(*byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok());
        let pairs = digits.chunks(2).map(|pair| match pair {
            [high, low] => Some(16 * digit(high)? + digit(low)?),
            _ => None,
        });
        pairs.collect::<Option<_>>().ok_or_else(|| self.refused(4, "the bytes of a sample, two hexadecimal digits each"))
    }

    fn state(&self, axes: usize) -> Result<Option<State<3>>, InputsError> {
        if self.cells[4] == "none" {
            return Ok(None);
        }
        // `parse` accepts "inf" and "nan", which no device can give.
        let numbers: Vec<f64> = self.cells[4].split(' ').filter_map(|number| number.parse().ok()).filter(|number: &f64| number.is_finite()).collect();
        // Cells without a finite number were dropped above, so both counts must agree.
        if numbers.len() != 2 * axes || self.cells[4].split(' ').count() != numbers.len() {
            return Err(self.refused(4, format!("\"none\", or {} finite numbers, position and velocity on each axis", 2 * axes)));
        }
        let mut state = State::REST;
        for (axis, pair) in numbers.chunks_exact(2).enumerate() {
            (state.position[axis], state.velocity[axis]) = (pair[0], pair[1]);
        }
        Ok(Some(state))
    }

    fn link(&self, keys: &LinkKeys, folder: &Path) -> Result<(LinkKeys, cohaptic_wan::LinkModel), InputsError> {
        let cell = self.cells[4];
        let table = cell.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).map(|quoted| quoted.replace("\"\"", "\""));
        let keys = table.and_then(|table| keys.read(&table));
        let keys = keys.ok_or_else(|| self.refused(4, "a table of link keys in quotes, such as \"{ loss = 0.1 }\""))?;
        let model = keys.model(folder).map_err(|error| {
            let why = error.diagnostic().map_or_else(|| error.to_string(), |diagnostic| format!("{}: {}", diagnostic.key(), diagnostic.message()));
            self.refused(4, format!("keys of a link; {why}"))
        })?;
        Ok((keys, model))
    }
}
