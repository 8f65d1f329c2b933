//! Inputs of a session from outside: samples, readings of devices, changes of links, the end.

use std::collections::BTreeMap;

use cohaptic_peer::State;
use cohaptic_scene::LinkKeys;
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

/// First line of a record of inputs.
pub(crate) const HEADER: &str = "at_ns,input,peer,to,value";

/// Recorded inputs of a session, in the order of time.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Inputs {
    pub(crate) rows: Vec<(Instant, Recorded)>,
}

/// Input read from a record. Variants correspond to those of [`Input`](crate::rows::Input).
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Recorded {
    Sample { peer: usize, datagram: Vec<u8> },
    Device { peer: usize, state: Option<State<3>> },
    Link { from: usize, to: usize, keys: LinkKeys, model: Box<LinkModel> },
    End,
}

/// Reason why a text is no valid record of the inputs of a scene. Lines are counted from 1; line 1 is the header.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputsError {
    /// The first line is not the header.
    #[error("line 1: found \"{found}\", expected the header \"{HEADER}\"")]
    Header {
        /// First line, shortened if long.
        found: String,
    },
    /// A cell of a row cannot be read.
    #[error("line {line}, column {column}: found \"{found}\", expected {expected}")]
    Cell {
        /// Number of the line.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// Text of the cell, shortened if long.
        found: String,
        /// Description of valid text.
        expected: String,
    },
    /// The last whole line does not close the record.
    #[error(
        "it is cut short: its last whole line, {line}, at {at} of the session, does not close it. Expected {at_ns},closed,,,{rows} behind it, which \
         earlier versions did not write",
        at_ns = .at.as_nanos(),
        rows = .line - 1
    )]
    NotClosed {
        /// Number of the last whole line.
        line: usize,
        /// Instant of that line.
        at: Instant,
    },
    /// Lines are missing: the last line gives a larger number of rows.
    #[error("it is not complete: the last line says that {said} rows stand before it, and there are {found}")]
    Rows {
        /// Number of rows in the last line.
        said: u64,
        /// Number of rows found.
        found: u64,
    },
    /// A row follows a row with a later instant, or follows the end.
    #[error(
        "line {line}: a row at {at} behind one at {before}: expected rows in the order of time, and none behind the end but that which closes it"
    )]
    Order {
        /// Number of the line.
        line: usize,
        /// Instant of the row.
        at: Instant,
        /// Instant of the previous row.
        before: Instant,
    },
}

impl Inputs {
    /// Returns the number of inputs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Returns the inputs without changes of links, for a session with different links.
    #[must_use]
    pub fn without_links(&self) -> Self {
        let is_link = |what: &Recorded| matches!(what, Recorded::Link { .. });
        Self { rows: self.rows.iter().filter(|(_, what)| !is_link(what)).cloned().collect() }
    }

    /// Returns the instant of the last input; `None` if there are no inputs.
    #[must_use]
    pub fn last_instant(&self) -> Option<Instant> {
        self.rows.last().map(|(at, _)| *at)
    }

    /// Returns the peer with the most readings of a device or pointer; `None` if there are no readings.
    #[must_use]
    pub fn busiest_device(&self) -> Option<usize> {
        let mut read = BTreeMap::new();
        for (_, what) in &self.rows {
            if let Recorded::Device { peer, state: Some(_) } = what {
                *read.entry(*peer).or_insert(0_usize) += 1;
            }
        }
        // `max_by_key` returns the last of equal counts, which after `rev` is the first peer.
        read.into_iter().rev().max_by_key(|(_, count)| *count).map(|(peer, _)| peer)
    }

    /// Returns whether there are no inputs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

/// Shortens a text to 80 characters and an ellipsis, for messages.
pub(super) fn shorten(text: &str) -> String {
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
