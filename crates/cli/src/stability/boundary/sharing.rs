//! Shards of a boundary: the values that are looked at first. Those between them follow from the radii there, and are looked at by the merge.

use std::sync::{Mutex, PoisonError};

use cohaptic_campaign::Shard;
use cohaptic_stability::{Boundary, BoundaryError};

use super::{Order, cells, row};
use crate::analysis_watch::CellWatch;
use crate::arguments::BoundaryArguments;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::shard::{Done, Names, Piece, Worker, owner};
use crate::stability::rows_file::{Kept, RowsFile};

pub(super) const NAMES: Names = Names { piece: "sample", unit: "value" };

/// The samples, and whether each is known.
fn samples(order: &Order, kept: Kept<'_>) -> Result<Vec<(f64, bool)>, Failure> {
    let mut known: Vec<u64> = cells(&kept.read()?.0).into_iter().map(|(value, _)| value.to_bits()).collect();
    known.sort_unstable();
    let values = Boundary::first_values(&order.range, order.options);
    Ok(values.into_iter().map(|value| (value, known.binary_search(&value.to_bits()).is_ok())).collect())
}

/// The samples as pieces of the work.
pub(super) fn pieces(order: &Order, kept: Kept<'_>) -> Result<Vec<Piece>, Failure> {
    Ok(samples(order, kept)?.into_iter().map(|(_, is_done)| Piece { units: 1, is_done }).collect())
}

/// Looks at the samples of a shard.
pub(super) fn shard<'a>(order: &Order, arguments: &BoundaryArguments, shard: Shard, kept: Kept<'a>) -> Result<Done<'a>, Failure> {
    // Rows of other work are refused before anything is written.
    kept.read()?;
    std::fs::create_dir_all(kept.folder).map_err(|error| Failure::File { verb: "create", path: kept.folder.to_path_buf(), error })?;
    let owner = owner();
    let worker = Worker::begin(kept.folder, shard, &owner)?;
    let done = look(order, arguments, shard, kept, &owner.name(), &worker);
    worker.end(done, |failure| failure)
}

fn look<'a>(order: &Order, arguments: &BoundaryArguments, shard: Shard, kept: Kept<'a>, name: &str, worker: &Worker) -> Result<Done<'a>, Failure> {
    let mine: Vec<(usize, (f64, bool))> = (0..).zip(samples(order, kept)?).filter(|(place, _)| shard.has(*place as u64)).collect();
    let wanted: Vec<(usize, f64)> = mine.iter().filter(|(_, (_, is_done))| !is_done).map(|(place, (value, _))| (*place, *value)).collect();
    let (file, _) = kept.open(Some(name))?;
    let file: Mutex<(RowsFile, Option<Failure>)> = Mutex::new((file, None));
    let failed = || file.lock().unwrap_or_else(PoisonError::into_inner).1.is_some();
    let progress = Progress::new(wanted.len() as u64, "{bar:30} {percent:>3} %  {pos}/{len} values, {eta} left{msg}");
    progress.tick();
    let stops = || !worker.goes_on() || failed();
    let watch = CellWatch::new(&progress, "value", &stops);
    let values: Vec<f64> = wanted.iter().map(|(_, value)| *value).collect();
    let looked = Boundary::look_at(
        &order.family,
        &values,
        |place, cell| {
            let (number, value) = wanted[place];
            let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
            match file.0.add(number, &row(value, &cell)) {
                Ok(()) => worker.kept(number as u64, 1),
                Err(failure) => file.1 = Some(failure),
            }
            progress.one_more();
        },
        &watch,
    );
    progress.clear();
    if let Some(failure) = file.into_inner().unwrap_or_else(PoisonError::into_inner).1 {
        return Err(failure);
    }
    let computed = looked.map_err(|error| super::failure(arguments, &order.range, BoundaryError::Radius(error)))?;
    if computed < wanted.len() {
        let done = mine.len() - wanted.len() + computed;
        let kept = format!("{done} of {} looked at, and kept in {}", output::are(mine.len(), "sample"), output::path(kept.folder));
        return Err(Failure::Interrupted(format!("shard {shard}: {kept}; the same command goes on from there")));
    }
    let (pieces, computed) = (mine.len() as u64, computed as u64);
    Ok(Done { shard, folder: kept.folder, names: NAMES, pieces, units: pieces, computed, wall_s: worker.wall_s() })
}
