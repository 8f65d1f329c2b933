//! A shard that is done, as a JSON document and in words.

use cohaptic_campaign::Shard;
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::Names;
use crate::document;

/// A shard that is done.
#[derive(Clone, PartialEq, Debug)]
pub struct Done {
    /// The shard.
    pub shard: Shard,
    /// The folder, as it was named.
    pub folder: String,
    /// What the work is cut into, and what a piece of it is made of.
    pub names: Names,
    /// Pieces of the shard.
    pub pieces: u64,
    /// Units in all pieces of the shard.
    pub units: u64,
    /// How many units were computed this time.
    pub computed: u64,
    /// The time of this call \[s\].
    pub wall_s: f64,
}

/// The answer of `--shard` with `--json`.
pub fn done_document(done: &Done) -> impl Serialize {
    document! {
        shard: done.shard.to_string(),
        out: done.folder.as_str(),
        piece: done.names.piece,
        unit: done.names.unit,
        pieces: done.pieces,
        units: done.units,
        units_computed: done.computed,
        wall_s: done.wall_s,
    }
}

/// A shard that is done, in words.
#[must_use]
pub fn done_words(done: &Done) -> String {
    let Done { shard, folder, names, pieces, units, computed, wall_s } = done;
    if *pieces == 0 {
        return format!("shard {shard} in {folder}: there are fewer {}s than shards, and none is this one's\n", names.piece);
    }
    let there = if computed < units { format!(", {} there already", units - computed) } else { String::new() };
    let (pieces, units) = (Counted(*pieces, names.piece), Counted(*units, names.unit));
    format!("shard {shard} in {folder}: {pieces} of {units}, {computed} computed in {wall_s:.3} s{there}\n")
}
