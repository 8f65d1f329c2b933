//! The answers about work shared by several processes: document and words of a finished shard, and of the status of all shards.

mod done;
mod status;
mod worker;

pub use done::{Done, done_document, done_words};
pub use status::{Status, status_document, status_words};
pub use worker::Worker;

/// Names of the pieces and units of the work: parts and runs of a campaign, for example.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Names {
    /// Name of a piece in the singular, such as `part`.
    pub piece: &'static str,
    /// Name of a unit in the singular, such as `run`.
    pub unit: &'static str,
}

/// State of a piece of the work.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Piece {
    /// Number of units in the piece.
    pub units: u64,
    /// `true` if the units are done.
    pub is_done: bool,
}
