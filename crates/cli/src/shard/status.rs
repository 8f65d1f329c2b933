//! `--status`: reports the done pieces of shared work, the workers, and the expected end of the remaining pieces.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cohaptic_answers::page::Origin;
use cohaptic_answers::shards::{Status, Worker, status_document, status_words};
use cohaptic_campaign::{Missing, Shard, is_log};
use cohaptic_files::Holder;

use super::{Names, Piece, owner};
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::output::{self, NO_FILES};

/// Reads the workers of a folder from their logs, sorted by shard. A worker with a lease that is not stale counts as alive.
fn workers(folder: &Path) -> Result<Vec<Worker>, Failure> {
    let unreadable = |error| Failure::File { verb: "read", path: folder.to_path_buf(), error };
    let leases = cohaptic_files::leases(folder, &owner(), |name| Shard::of_lease(name).is_some()).map_err(unreadable)?;
    let name = |holder: Holder| holder.owner.as_ref().filter(|_| !holder.is_stale()).map(cohaptic_files::Owner::name);
    let alive: Vec<String> = leases.into_iter().filter_map(|(_, holder)| name(holder)).collect();
    let mut logs = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let Some(name) = path.file_name().and_then(|name| name.to_str()).filter(|name| is_log(name)) else { continue };
        let lives = alive.iter().any(|owner| cohaptic_campaign::worker_log(owner) == name);
        // A log that vanishes before the read belongs to work just completed by another process.
        let text = fs::read_to_string(&path).unwrap_or_default();
        logs.insert(name.to_owned(), Worker::read(&text, lives));
    }
    let mut workers: Vec<Worker> = logs.into_values().flatten().collect();
    workers.sort_by_key(|worker| worker.shard.lease());
    Ok(workers)
}

/// Returns the paths of the logs of workers in a folder. Empty if the folder cannot be read.
pub(crate) fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| entry.file_name().to_str().is_some_and(is_log)).map(|entry| entry.path()).collect()
}

/// Returns the failure of a merge with missing pieces. The message names the shards to do.
pub(crate) fn missing(folder: &Path, missing: &Missing) -> Failure {
    // Workers of different divisions may have left logs. The finest division names the shards.
    let shards = workers(folder).ok().and_then(|workers| workers.iter().map(|worker| worker.shard.count()).max());
    Failure::System(format!(
        "{} is not complete: {}.\nRun them with --shard, or all that is missing with --out and without --shard",
        output::path(folder),
        missing.words(shards)
    ))
}

/// Checks that all pieces are done.
///
/// # Errors
///
/// The failure of [`missing`] with the indices of the missing pieces.
pub(crate) fn all_done(folder: &Path, names: Names, pieces: &[Piece]) -> Result<(), Failure> {
    let undone: Vec<u64> = (0..).zip(pieces).filter(|(_, piece)| !piece.is_done).map(|(place, _)| place).collect();
    if undone.is_empty() { Ok(()) } else { Err(missing(folder, &Missing { piece: names.piece, count: pieces.len() as u64, pieces: undone })) }
}

/// Returns whether a folder has the merged result of work whose rows are removed at the end: the page `name` with this origin, and no rows or workers.
pub(crate) fn has_result(folder: &Path, pieces: &[Piece], name: &str, origin: &Origin<'_>) -> bool {
    let is_at_work = pieces.iter().any(|piece| piece.is_done) || !logs_in(folder).is_empty();
    !is_at_work && fs::read_to_string(folder.join(name)).is_ok_and(|page| origin.has_made(&page))
}

/// Prints the done pieces of a folder, and the workers. `is_merged`: the folder has the merged result, so that every piece is done.
pub(crate) fn show(json: bool, folder: &Path, names: Names, pieces: &[Piece], is_merged: bool) -> Result<ExitCode, Failure> {
    let pieces: Vec<Piece> = pieces.iter().map(|piece| Piece { is_done: piece.is_done || is_merged, ..*piece }).collect();
    let status = Status { folder: output::path(folder), names, pieces: &pieces, workers: workers(folder)?, is_merged };
    output::answer(json, DocumentSchema::STATUS, &status_document(&status), || status_words(&status), NO_FILES)?;
    Ok(ExitCode::SUCCESS)
}
