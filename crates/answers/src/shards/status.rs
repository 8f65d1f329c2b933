//! JSON document and text of the status of shared work.

use std::fmt::Write as _;

use cohaptic_campaign::Missing;
use serde::Serialize;

use super::worker::State;
use super::{Names, Piece, Worker};
use crate::{document, figure};

/// Shared work with the workers.
#[derive(Clone, PartialEq, Debug)]
pub struct Status<'a> {
    /// Path of the folder as given by the user.
    pub folder: String,
    /// Names of the pieces and units.
    pub names: Names,
    /// States of the pieces, indexed by piece.
    pub pieces: &'a [Piece],
    /// Present and past workers of the folder, in the order of their shards.
    pub workers: Vec<Worker>,
    /// `true` if the folder has the merged result, so that nothing is left to merge.
    pub is_merged: bool,
}

impl Status<'_> {
    fn at_work(&self) -> impl Iterator<Item = &Worker> {
        self.workers.iter().filter(|worker| worker.state == State::Working)
    }

    /// Returns the number of unfinished units in a worker's shard.
    fn left(&self, worker: &Worker) -> u64 {
        (0..).zip(self.pieces).filter(|(place, piece)| !piece.is_done && worker.shard.has(*place)).map(|(_, piece)| piece.units).sum()
    }

    /// Returns the time until a worker is done \[s\]; `None` if the worker has not finished a piece yet.
    #[expect(clippy::cast_precision_loss, reason = "fewer units than 2^52")]
    fn ends_in(&self, worker: &Worker) -> Option<f64> {
        worker.units_per_s().map(|speed| self.left(worker) as f64 / speed)
    }

    /// Returns the time until a worker at work is done \[s\]; `None` for other workers.
    fn worker_ends_in(&self, worker: &Worker) -> Option<f64> {
        self.ends_in(worker).filter(|_| worker.state == State::Working)
    }

    /// Returns two pairs of numbers of pieces and units: of the whole work, and of the finished pieces.
    fn counts(&self) -> [(u64, u64); 2] {
        let of = |is_meant: &dyn Fn(&Piece) -> bool| {
            let meant: Vec<&Piece> = self.pieces.iter().filter(|piece| is_meant(piece)).collect();
            (meant.len() as u64, meant.iter().map(|piece| piece.units).sum::<u64>())
        };
        [of(&|_| true), of(&|piece| piece.is_done)]
    }

    /// Returns the unfinished pieces without a worker at work.
    fn unassigned(&self) -> Vec<u64> {
        // A piece belongs to a shard by number alone, so workers of different splits may share a piece.
        let undone = |place: &u64, piece: &Piece| !piece.is_done && !self.at_work().any(|worker| worker.shard.has(*place));
        (0..).zip(self.pieces).filter(|(place, piece)| undone(place, piece)).map(|(place, _)| place).collect()
    }

    /// Returns the time until all work is done \[s\]; `None` if the speed of a worker is unknown, or if pieces have no worker.
    fn end(&self) -> Option<f64> {
        let ends = self.at_work().map(|worker| self.ends_in(worker)).collect::<Option<Vec<f64>>>();
        // The slowest worker decides. Pieces without a worker would never be done.
        ends.filter(|_| self.unassigned().is_empty()).map(|ends| ends.into_iter().fold(0.0, f64::max))
    }
}

/// Returns the answer of `--status` with `--json`.
pub fn status_document(status: &Status<'_>) -> impl Serialize {
    let [all, done] = status.counts();
    document! {
        out: status.folder.as_str(),
        piece: status.names.piece,
        unit: status.names.unit,
        pieces: all.0,
        pieces_done: done.0,
        units: all.1,
        units_done: done.1,
        pieces_unassigned: status.unassigned().len(),
        ends_in_s: status.end(),
        workers: status.workers.iter().map(|worker| document! {
            shard: worker.shard.to_string(),
            host: worker.host.as_str(),
            process: worker.process,
            state: worker.state.word(),
            pieces: worker.pieces,
            units: worker.units,
            units_per_s: worker.units_per_s(),
            units_left: status.left(worker),
            ends_in_s: status.worker_ends_in(worker),
        }).collect::<Vec<_>>(),
    }
}

/// Greatest number of workers listed in the text. Further workers are only counted.
const MOST_WORKERS: usize = 100;

/// Returns the text about the status of shared work.
#[must_use]
pub fn status_words(status: &Status<'_>) -> String {
    let Status { folder, names: Names { piece, unit }, workers, .. } = status;
    let ([all, done], end, unassigned) = (status.counts(), status.end(), status.unassigned());
    let mut text = format!("{folder}: {} of {} {piece}s are done, {} of {} {unit}s\n", done.0, all.0, done.1, all.1);
    let mut rows = vec![["shard", "state", "process", "host", "done", "left", "per second", "ends in"].map(str::to_owned)];
    rows.extend(workers.iter().take(MOST_WORKERS).map(|worker| {
        let speed = worker.units_per_s().map_or_else(|| "-".to_owned(), |speed| figure(speed, 1));
        let end = status.worker_ends_in(worker).map_or_else(|| "-".to_owned(), span);
        let [done, left] = [worker.units, status.left(worker)].map(|units| units.to_string());
        [worker.shard.to_string(), worker.state.word().to_owned(), worker.process.to_string(), worker.host.clone(), done, left, speed, end]
    }));
    // The widths fit the longest cell of each column, in characters and not in bytes.
    let widths: Vec<usize> = (0..rows[0].len()).map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)).collect();
    if !workers.is_empty() {
        for row in rows {
            let cells: String = row.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}")).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{cells}");
        }
    }
    if let Some(more @ 1..) = workers.len().checked_sub(MOST_WORKERS) {
        let _ = writeln!(text, "  ... and {more} more");
    }
    if !unassigned.is_empty() {
        // The largest number of shards among the workers is most likely the split in use.
        let missing = Missing { piece, count: all.0, pieces: unassigned };
        let _ = writeln!(text, "nobody works on these: {}", missing.words(workers.iter().map(|worker| worker.shard.count()).max()));
    } else if status.is_merged {
        let _ = writeln!(text, "all is done and put together");
    } else if done.0 == all.0 {
        let _ = writeln!(text, "all is done: put it together with --merge");
    } else if let Some(end) = end {
        let _ = writeln!(text, "the rest is done in about {}", span(end));
    }
    text
}

/// Returns a time in words.
fn span(seconds: f64) -> String {
    match seconds {
        ..120.0 => format!("{seconds:.0} s"),
        ..7200.0 => format!("{:.0} min", seconds / 60.0),
        ..172_800.0 => format!("{:.1} h", seconds / 3600.0),
        _ => format!("{:.1} days", seconds / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_have_a_unit_that_fits() {
        assert_eq!([5.0, 119.4, 600.0, 9000.0, 864_000.0].map(span), ["5 s", "119 s", "10 min", "2.5 h", "10.0 days"]);
    }
}
