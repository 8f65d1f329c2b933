//! JSON document and text of a finished shard.

use cohaptic_campaign::Shard;
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::Names;
use crate::document;

/// A finished shard.
#[derive(Clone, PartialEq, Debug)]
pub struct Done {
    /// The shard.
    pub shard: Shard,
    /// Path of the folder as given by the user.
    pub folder: String,
    /// Names of the pieces and units.
    pub names: Names,
    /// Number of pieces of the shard.
    pub pieces: u64,
    /// Number of units in all pieces of the shard.
    pub units: u64,
    /// Number of units computed by this call.
    pub computed: u64,
    /// Wall time of this call \[s\].
    pub wall_s: f64,
}

/// Returns the answer of `--shard` with `--json`.
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

/// Returns the text about a finished shard.
#[must_use]
pub fn done_words(done: &Done) -> String {
    let Done { shard, folder, names, pieces, units, computed, wall_s } = done;
    // With fewer pieces than shards, some shards are empty, and a speed would have no meaning.
    if *pieces == 0 {
        return format!("shard {shard} in {folder}: there are fewer {}s than shards, so this shard has nothing to do\n", names.piece);
    }
    let there = if computed < units { format!(", {} there already", units - computed) } else { String::new() };
    let (pieces, units) = (Counted(*pieces, names.piece), Counted(*units, names.unit));
    format!("shard {shard} in {folder}: {pieces} of {units}, {computed} computed in {wall_s:.3} s{there}\n")
}
