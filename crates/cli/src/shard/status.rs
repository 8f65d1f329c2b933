//! `--status`: which pieces of shared work are done, by which workers, and when the rest will be.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use cohaptic_campaign::{Missing, Shard, is_log};
use cohaptic_files::Holder;

use super::{Names, owner};
use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;
use crate::output::{self, NO_FILES};

/// A piece of the work.
#[derive(Clone, Copy)]
pub(crate) struct Piece {
    pub(crate) units: u64,
    pub(crate) is_done: bool,
}

/// A worker, by its log and its lease.
struct Worker {
    shard: Shard,
    process: u32,
    host: String,
    state: State,
    /// How many pieces it did, and of how many units they are.
    pieces: u64,
    units: u64,
    /// When it did the last of them, or ended \[s after it began\].
    seconds: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    /// It renews its lease.
    Working,
    Done,
    Interrupted,
    Failed,
    /// It neither ended nor lives.
    Killed,
}

impl State {
    const fn word(self) -> &'static str {
        match self {
            Self::Working => "working",
            Self::Done => "done",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
            Self::Killed => "killed",
        }
    }
}

impl Worker {
    fn units_per_s(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "fewer units than 2^52")]
        (self.units > 0 && self.seconds > 0.0).then(|| self.units as f64 / self.seconds)
    }

    /// What a log says; `None` if it is not even begun.
    fn read(text: &str, lives: bool) -> Option<Self> {
        let mut lines = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
        let [_, shard, _, process, _, host] = *lines.next()?.split(' ').collect::<Vec<_>>() else { return None };
        let state = if lives { State::Working } else { State::Killed };
        let mut worker =
            Self { shard: shard.parse().ok()?, process: process.parse().ok()?, host: host.to_owned(), state, pieces: 0, units: 0, seconds: 0.0 };
        for line in lines {
            let words: Vec<&str> = line.split(' ').collect();
            let seconds = words.last().and_then(|word| word.parse().ok()).unwrap_or(worker.seconds);
            match *words {
                ["piece", _, units, _] => {
                    worker.pieces += 1;
                    worker.units += units.parse::<u64>().unwrap_or_default();
                }
                ["end", "done", _] => worker.state = State::Done,
                ["end", "interrupted", _] => worker.state = State::Interrupted,
                ["end", "failed", _] => worker.state = State::Failed,
                _ => continue,
            }
            worker.seconds = seconds;
        }
        Some(worker)
    }
}

/// The workers that ever were in a folder since its work is whole.
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
        // One that goes while it is read is of work that is whole.
        let text = fs::read_to_string(&path).unwrap_or_default();
        logs.insert(name.to_owned(), Worker::read(&text, lives));
    }
    let mut workers: Vec<Worker> = logs.into_values().flatten().collect();
    workers.sort_by_key(|worker| worker.shard.lease());
    Ok(workers)
}

/// The logs of workers in a folder.
pub(crate) fn logs_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|entry| entry.file_name().to_str().is_some_and(is_log)).map(|entry| entry.path()).collect()
}

/// That shards have not done all, with those that have not.
pub(crate) fn missing(folder: &Path, missing: &Missing) -> Failure {
    let shards = workers(folder).ok().and_then(|workers| workers.iter().map(|worker| worker.shard.count()).max());
    Failure::System(format!(
        "{} is not whole: {}.\nDo them with --shard, or all that is missing by the command with --out and without --shard",
        output::path(folder),
        missing.words(shards)
    ))
}

/// That all pieces are done.
pub(crate) fn all_done(folder: &Path, names: Names, pieces: &[Piece]) -> Result<(), Failure> {
    let undone: Vec<u64> = (0..).zip(pieces).filter(|(_, piece)| !piece.is_done).map(|(place, _)| place).collect();
    if undone.is_empty() { Ok(()) } else { Err(missing(folder, &Missing { piece: names.piece, count: pieces.len() as u64, pieces: undone })) }
}

/// More workers are counted and not named.
const MOST_WORKERS: usize = 100;

/// Says what is done in a folder.
pub(crate) fn show(json: bool, folder: &Path, names: Names, pieces: &[Piece]) -> Result<ExitCode, Failure> {
    let workers = workers(folder)?;
    let left = |worker: &Worker| -> u64 {
        (0..).zip(pieces).filter(|(place, piece)| !piece.is_done && worker.shard.has(*place)).map(|(_, piece)| piece.units).sum()
    };
    let is_at_work = |worker: &&Worker| worker.state == State::Working;
    #[expect(clippy::cast_precision_loss, reason = "fewer units than 2^52")]
    let ends_in = |worker: &Worker| worker.units_per_s().map(|speed| left(worker) as f64 / speed);
    let of = |is_meant: &dyn Fn(&Piece) -> bool| {
        let meant: Vec<&Piece> = pieces.iter().filter(|piece| is_meant(piece)).collect();
        (meant.len() as u64, meant.iter().map(|piece| piece.units).sum::<u64>())
    };
    let (all, done) = (of(&|_| true), of(&|piece| piece.is_done));
    let undone = |place: &u64, piece: &Piece| !piece.is_done && !workers.iter().filter(is_at_work).any(|worker| worker.shard.has(*place));
    let unassigned: Vec<u64> = (0..).zip(pieces).filter(|(place, piece)| undone(place, piece)).map(|(place, _)| place).collect();
    let at_work: Vec<Option<f64>> = workers.iter().filter(is_at_work).map(ends_in).collect();
    // Not known if anybody's end is not, or if pieces are no worker's.
    let end = at_work.iter().copied().collect::<Option<Vec<f64>>>().filter(|_| unassigned.is_empty());
    let end = end.map(|ends| ends.into_iter().fold(0.0, f64::max));
    let document = document! {
        out: output::path(folder),
        piece: names.piece,
        unit: names.unit,
        pieces: all.0,
        pieces_done: done.0,
        units: all.1,
        units_done: done.1,
        pieces_unassigned: unassigned.len(),
        ends_in_s: end,
        workers: workers.iter().map(|worker| document! {
            shard: worker.shard.to_string(),
            host: worker.host.as_str(),
            process: worker.process,
            state: worker.state.word(),
            pieces: worker.pieces,
            units: worker.units,
            units_per_s: worker.units_per_s(),
            units_left: left(worker),
            ends_in_s: ends_in(worker).filter(|_| worker.state == State::Working),
        }).collect::<Vec<_>>(),
    };
    let words = || {
        let Names { piece, unit } = names;
        let mut text = format!("{}: {} of {} {piece}s are done, {} of {} {unit}s\n", output::path(folder), done.0, all.0, done.1, all.1);
        let mut rows = vec![["shard", "state", "process", "host", "done", "left", "a second", "ends in"].map(str::to_owned)];
        rows.extend(workers.iter().take(MOST_WORKERS).map(|worker| {
            let speed = worker.units_per_s().map_or_else(|| "-".to_owned(), |speed| output::figure(speed, 1));
            let end = ends_in(worker).filter(|_| worker.state == State::Working).map_or_else(|| "-".to_owned(), span);
            let figures = [worker.units, left(worker)].map(|units| units.to_string());
            let [done, left] = figures;
            [worker.shard.to_string(), worker.state.word().to_owned(), worker.process.to_string(), worker.host.clone(), done, left, speed, end]
        }));
        let widths: Vec<usize> = (0..rows[0].len()).map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)).collect();
        if !workers.is_empty() {
            for row in rows {
                let cells: String = row.iter().zip(&widths).map(|(cell, width)| format!("  {cell:>width$}")).collect();
                // Writing to a string does not fail.
                let _ = writeln!(text, "{cells}");
            }
        }
        if let Some(more @ 1..) = workers.len().checked_sub(MOST_WORKERS) {
            let _ = writeln!(text, "  ... and {more} more");
        }
        if !unassigned.is_empty() {
            let missing = Missing { piece, count: all.0, pieces: unassigned };
            let _ = writeln!(text, "no worker does these: {}", missing.words(workers.iter().map(|worker| worker.shard.count()).max()));
        } else if done.0 == all.0 {
            let _ = writeln!(text, "all is done: --merge puts it together");
        } else if let Some(end) = end {
            let _ = writeln!(text, "the rest is done in about {}", span(end));
        }
        text
    };
    output::answer(json, DocumentSchema::STATUS, &document, words, NO_FILES)?;
    Ok(ExitCode::SUCCESS)
}

/// A span in words.
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
    fn a_log_says_what_its_worker_did_however_it_ended() {
        let whole = "shard 3/8 process 312 host node1\npiece 2 100 1.000\npiece 10 50 2.500\nend done 2.600\n";
        let read = |text: &str, lives| Worker::read(text, lives);
        let worker = read(whole, true).unwrap();
        assert_eq!((worker.shard.to_string(), worker.process, worker.host.as_str(), worker.state.word()), ("3/8".to_owned(), 312, "node1", "done"));
        assert_eq!((worker.pieces, worker.units, worker.seconds), (2, 150, 2.6));
        let torn = &whole[..whole.find("50 2.500").unwrap() + 4];
        for (lives, word) in [(true, "working"), (false, "killed")] {
            let worker = read(torn, lives).unwrap();
            assert_eq!((worker.state.word(), worker.pieces, worker.units_per_s()), (word, 1, Some(100.0)));
        }
        for (end, word) in [("interrupted", "interrupted"), ("failed", "failed")] {
            assert_eq!(read(&whole.replace("end done", &format!("end {end}")), false).unwrap().state.word(), word);
        }
        assert!(read("", true).is_none() && read("shard 3/8 process", true).is_none() && read("notes\n", true).is_none());
    }

    #[test]
    fn spans_have_a_unit_that_fits() {
        assert_eq!([5.0, 119.4, 600.0, 9000.0, 864_000.0].map(span), ["5 s", "119 s", "10 min", "2.5 h", "10.0 days"]);
    }
}
