//! What came into a session from outside.

use std::path::Path;

use cohaptic_peer::State;
use cohaptic_scene::{LinkKeys, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use super::recorded::is_about_the_scene;
use super::rows::{HEADER, read_row};
use crate::observer::StateRow;

/// Something that came into a session, and when it counts.
#[derive(Clone, Copy, Debug)]
pub struct InputRow<'a> {
    /// The instant; never before that of the row before it.
    pub at: Instant,
    /// What.
    pub what: Input<'a>,
}

/// What came in. Peers are named by their place in [`Scene::peers`].
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// A sample from the process of a peer, as it came.
    Sample {
        /// The peer.
        peer: usize,
        /// Its bytes.
        datagram: &'a [u8],
    },
    /// What the device in somebody's hand showed at a tick.
    Device {
        /// The peer.
        peer: usize,
        /// `None`: it could not be read.
        state: Option<StateRow<'a>>,
    },
    /// A link was changed.
    Link {
        /// The sender.
        from: usize,
        /// The receiver.
        to: usize,
        /// All keys that the link has from now on.
        keys: &'a LinkKeys,
    },
    /// Somebody ended the session, after everything at this instant. One that ran to the end of its scene has no such row.
    End,
}

/// The recorded inputs of a session.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Inputs {
    pub(crate) rows: Vec<(Instant, Recorded)>,
}

/// An input that was read from a record.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Recorded {
    Sample { peer: usize, datagram: Vec<u8> },
    Device { peer: usize, state: Option<State<3>> },
    Link { from: usize, to: usize, keys: LinkKeys, model: Box<LinkModel> },
    End,
}

/// Why a text is no record of the inputs of a scene. Lines are counted from 1, the header being line 1.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum InputsError {
    /// The first line is not the header.
    #[error("line 1: found \"{found}\", expected the header \"{HEADER}\"")]
    Header {
        /// The first line, or the beginning of it.
        found: String,
    },
    /// A row cannot be read.
    #[error("line {line}, column {column}: found \"{found}\", expected {expected}")]
    Cell {
        /// The line.
        line: usize,
        /// The name of the column.
        column: &'static str,
        /// What stands there, or the beginning of it.
        found: String,
        /// What would have been right.
        expected: String,
    },
    /// A row stands behind one that is later, or behind the end.
    #[error("line {line}: a row at {at} behind one at {before}: expected rows in the order of time, and none behind the end")]
    Order {
        /// The line.
        line: usize,
        /// Its instant.
        at: Instant,
        /// That of the row before it.
        before: Instant,
    },
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

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether nothing came in.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// The beginning of a text that is too long for a message.
pub(super) fn shorten(text: &str) -> String {
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
