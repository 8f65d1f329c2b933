//! What shared work answers, each of whose processes does a shard of it: the document and the words of a shard that is done, and of the status of all.

mod done;
mod status;
mod worker;

pub use done::{Done, done_document, done_words};
pub use status::{Status, status_document, status_words};
pub use worker::Worker;

/// What the work is cut into, such as parts, and what these are made of, such as runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Names {
    /// A piece, such as `part`.
    pub piece: &'static str,
    /// A unit, such as `run`.
    pub unit: &'static str,
}

/// A piece of the work.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Piece {
    /// Units in it.
    pub units: u64,
    /// Whether they are done.
    pub is_done: bool,
}
