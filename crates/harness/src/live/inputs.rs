//! What came into a session from outside.

use std::collections::BTreeMap;

use cohaptic_peer::State;
use cohaptic_scene::LinkKeys;
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use crate::observer::StateRow;

/// The first line of a record of inputs.
pub const HEADER: &str = "at_ns,input,peer,to,value";

/// Something that came into a session, and when it counts.
#[derive(Clone, Copy, Debug)]
pub struct InputRow<'a> {
    /// The instant; never before that of the row before it.
    pub at: Instant,
    /// What.
    pub what: Input<'a>,
}

/// What came in. Peers are named by their place in [`Scene::peers`](cohaptic_scene::Scene::peers).
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
    /// The last whole line is no row that closes the record.
    #[error(
        "it is cut short: its last whole line, {line}, at {at} of the session, does not close it. Expected {at_ns},closed,,,{rows} behind it, which \
         earlier versions did not write",
        at_ns = .at.as_nanos(),
        rows = .line - 1
    )]
    NotClosed {
        /// The last line that is whole.
        line: usize,
        /// Its instant.
        at: Instant,
    },
    /// Lines are missing before the last one, which says how many there were.
    #[error("it is not whole: the last line says that {said} rows stand before it, and there are {found}")]
    Rows {
        /// The number of rows that the last line says.
        said: u64,
        /// The number of rows that there are.
        found: u64,
    },
    /// A row stands behind one that is later, or behind the end.
    #[error(
        "line {line}: a row at {at} behind one at {before}: expected rows in the order of time, and none behind the end but that which closes it"
    )]
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
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Without the changes of links, as for a session whose links are others.
    #[must_use]
    pub fn without_links(&self) -> Self {
        let is_link = |what: &Recorded| matches!(what, Recorded::Link { .. });
        Self { rows: self.rows.iter().filter(|(_, what)| !is_link(what)).cloned().collect() }
    }

    /// When the last one came; `None` if none did.
    #[must_use]
    pub fn last_instant(&self) -> Option<Instant> {
        self.rows.last().map(|(at, _)| *at)
    }

    /// The peer whose device, or pointer, could be read most often; `None` if none could.
    #[must_use]
    pub fn busiest_device(&self) -> Option<usize> {
        let mut read = BTreeMap::new();
        for (_, what) in &self.rows {
            if let Recorded::Device { peer, state: Some(_) } = what {
                *read.entry(*peer).or_insert(0_usize) += 1;
            }
        }
        // Of equally many the first.
        read.into_iter().rev().max_by_key(|(_, count)| *count).map(|(peer, _)| peer)
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
