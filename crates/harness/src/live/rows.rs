//! Inputs as lines of text.
//!
//! ```text
//! at_ns,input,peer,to,value
//! 0,program,,,0.1.0
//! 8000000,sample,left,,43485054010001000…
//! 9000000,device,hand,,0.01 -0.5
//! 9000000,link,left,hand,"{ delay = ""40ms"", loss = 0.1 }"
//! 12000000,end,,,
//! ```
//!
//! A sample is written in hexadecimal. A device, or the pointer that pulls one, shows position and velocity on each axis in turn (`x vx y vy`), with digits that read back as the same numbers,
//! or `none`. A link has all its keys, as a TOML table. The rows before these say [with which scene](super::RecordedScene) they were recorded.

use std::fmt;
use std::path::Path;

use cohaptic_peer::State;
use cohaptic_scene::{LinkKeys, PeerKind, Scene};
use cohaptic_units::Instant;
use cohaptic_units::print::csv_quoted;

use super::inputs::{HEADER, Input, InputRow, Inputs, InputsError, Recorded, shorten};
use super::recorded::is_about_the_scene;
use crate::record::parts;

/// A row as a line, without the newline.
#[derive(Clone, Copy, Debug)]
pub struct InputLine<'a> {
    /// The row.
    pub row: &'a InputRow<'a>,
    /// The names of the peers.
    pub names: &'a [String],
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

impl Inputs {
    /// Reads what [`crate::record::InputRecorder`] wrote for the same scene. `keys`: those of any link of the scene, from [`cohaptic_scene::link_keys`].
    ///
    /// # Errors
    ///
    /// [`InputsError`] for anything else.
    pub fn read(text: &str, scene: &Scene, keys: &LinkKeys) -> Result<Self, InputsError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text.lines();
        let header = lines.next().unwrap_or_default();
        if header != HEADER {
            return Err(InputsError::Header { found: shorten(header) });
        }
        let folder = scene.file.parent().unwrap_or_else(|| Path::new(""));
        let mut rows: Vec<(Instant, Recorded)> = Vec::new();
        // What they say of their scene is for [`RecordedScene`](super::RecordedScene).
        for (line, row) in (2..).zip(lines).skip_while(|(_, row)| is_about_the_scene(row)) {
            let (at, what) = read_row(line, row, scene, keys, folder)?;
            if let Some((before, last)) = rows.last()
                && (at < *before || *last == Recorded::End)
            {
                return Err(InputsError::Order { line, at, before: *before });
            }
            rows.push((at, what));
        }
        Ok(Self { rows })
    }
}

/// The four cells before the value, and that.
struct Cells<'a> {
    line: usize,
    cells: [&'a str; 5],
}

const COLUMNS: [&str; 5] = ["at_ns", "input", "peer", "to", "value"];

fn read_row(line: usize, row: &str, scene: &Scene, keys: &LinkKeys, folder: &Path) -> Result<(Instant, Recorded), InputsError> {
    let mut cells = [""; 5];
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
        "device" => Recorded::Device { peer: cells.peer(2, scene, &["falcon", "pointer"])?, state: cells.state(scene.axes.count())? },
        "link" => {
            let (from, to) = (cells.peer(2, scene, &[])?, cells.peer(3, scene, &[])?);
            if from == to {
                return Err(cells.refused(3, "another peer than the sender"));
            }
            let (keys, model) = cells.link(keys, folder)?;
            Recorded::Link { from, to, keys, model: Box::new(model) }
        }
        "end" => Recorded::End,
        _ => return Err(cells.refused(1, "sample, device, link or end")),
    };
    Ok((at, what))
}

impl Cells<'_> {
    fn refused(&self, column: usize, expected: impl Into<String>) -> InputsError {
        InputsError::Cell { line: self.line, column: COLUMNS[column], found: shorten(self.cells[column]), expected: expected.into() }
    }

    fn instant(&self) -> Result<Instant, InputsError> {
        // Rust reads "+1" too, which no writer of this format writes.
        let plain = self.cells[0].bytes().all(|byte| byte.is_ascii_digit());
        let nanos = self.cells[0].parse().ok().filter(|_| plain);
        nanos.map(Instant::from_nanos).ok_or_else(|| self.refused(0, "a whole number of nanoseconds from 0 to 2^64 - 1"))
    }

    /// A peer of one of those kinds, or of any if there are none.
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
        let numbers: Vec<f64> = self.cells[4].split(' ').filter_map(|number| number.parse().ok()).filter(|number: &f64| number.is_finite()).collect();
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
