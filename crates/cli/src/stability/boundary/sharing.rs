//! Divides the search for a boundary among shards. Each block of the range is searched completely and without regard to the other blocks; the merge checks
//! what depends on two neighbouring blocks.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use cohaptic_campaign::Shard;
use cohaptic_stability::{Boundary, BoundaryBlock, BoundaryError};

use super::{Order, cells, row};
use crate::analysis_watch::CellWatch;
use crate::arguments::BoundaryArguments;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::shard::{Done, Names, Piece, Worker, owner};
use crate::stability::rows_file::{Kept, Row, RowsFile};

pub(super) const NAMES: Names = Names { piece: "block", unit: "sample" };

/// Returns every block with whether the rows hold all values of the block.
fn blocks(order: &Order, rows: &[Row]) -> Vec<(BoundaryBlock, bool)> {
    let known = cells(rows);
    let blocks = Boundary::blocks(&order.range, order.options).into_iter();
    blocks
        .map(|block| {
            let is_known = block.is_known(&order.range, order.options, &known);
            (block, is_known)
        })
        .collect()
}

/// Returns the number of first samples that count for a block. The last sample is left out, because the next block begins with the same sample.
fn units(block: &BoundaryBlock) -> u64 {
    block.first_values().len() as u64 - 1
}

/// Returns the blocks as pieces of work, for the status and the merge.
pub(super) fn pieces(order: &Order, kept: Kept<'_>) -> Result<Vec<Piece>, Failure> {
    Ok(blocks(order, &kept.read()?.0).into_iter().map(|(block, is_done)| Piece { units: units(&block), is_done }).collect())
}

/// Searches the blocks of a shard, as a worker of the folder.
pub(super) fn shard(order: &Order, arguments: &BoundaryArguments, shard: Shard, kept: Kept<'_>) -> Result<Done, Failure> {
    // A folder with rows of another computation is refused before the shard writes anything.
    kept.read()?;
    std::fs::create_dir_all(kept.folder).map_err(|error| Failure::File { verb: "create", path: kept.folder.to_path_buf(), error })?;
    let owner = owner();
    let worker = Worker::begin(kept.folder, shard, &owner)?;
    let done = search(order, arguments, shard, kept, &owner.name(), &worker);
    worker.end(done, |failure| failure)
}

fn search(order: &Order, arguments: &BoundaryArguments, shard: Shard, kept: Kept<'_>, name: &str, worker: &Worker) -> Result<Done, Failure> {
    let (file, rows) = kept.open(Some(name))?;
    let mine: Vec<(u64, (BoundaryBlock, bool))> = (0..).zip(blocks(order, &rows)).filter(|(place, _)| shard.has(*place)).collect();
    let (pieces, all) = (mine.len() as u64, mine.iter().map(|(_, (block, _))| units(block)).sum());
    let (places, wanted): (Vec<u64>, Vec<BoundaryBlock>) =
        mine.into_iter().filter(|(_, (_, is_done))| !is_done).map(|(place, (block, _))| (place, block)).unzip();
    // Threads of the search add rows under the lock. The first failure to write stops the search, and is returned below.
    let file: Mutex<(RowsFile, Option<Failure>)> = Mutex::new((file, None));
    let failed = || file.lock().unwrap_or_else(PoisonError::into_inner).1.is_some();
    let progress = Progress::new(wanted.len() as u64, "{bar:30} {percent:>3} %  {pos}/{len} blocks, {eta} left{msg}");
    progress.tick();
    let stops = || !worker.goes_on() || failed();
    let watch = CellWatch::new(&progress, "value", &stops);
    let (looked_at, computed, whole) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
    let searched = Boundary::search_blocks(
        &order.family,
        order.options,
        &wanted,
        &cells(&rows),
        |value, cell| {
            // The number is unique in this worker's file only. Rows are recognised by their value, so that equal numbers of two workers do no harm.
            let number = rows.len() + usize::try_from(looked_at.fetch_add(1, Ordering::Relaxed)).unwrap_or_default();
            let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
            if let Err(failure) = file.0.add(number, &row(value, &cell)) {
                file.1 = Some(failure);
            }
        },
        |place| {
            let units = units(&wanted[place]);
            worker.kept(places[place], units);
            computed.fetch_add(units, Ordering::Relaxed);
            whole.fetch_add(1, Ordering::Relaxed);
            progress.one_more();
        },
        &watch,
    );
    progress.clear();
    if let Some(failure) = file.into_inner().unwrap_or_else(PoisonError::into_inner).1 {
        return Err(failure);
    }
    searched.map_err(|error| super::failure(arguments, &order.range, BoundaryError::Radius(error)))?;
    let (computed, whole) = (computed.into_inner(), whole.into_inner());
    if whole < wanted.len() as u64 {
        let done = pieces - wanted.len() as u64 + whole;
        let kept = format!("{done} of its {pieces} blocks are whole, and what was looked at is kept in {}", output::path(kept.folder));
        return Err(Failure::Interrupted(format!("shard {shard}: {kept}; repeat the command to go on from there")));
    }
    Ok(Done { shard, folder: output::path(kept.folder), names: NAMES, pieces, units: all, computed, wall_s: worker.wall_s() })
}
