//! `task.csv` and `task-events.csv`: what a task asked for and saw at each judged instant, and its events.

use std::path::{Path, PathBuf};

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::file::{RecordError, RecordFile, push_f64, push_seconds, push_whole};
use crate::task::{Event, Judge, Seen, TaskRow, has_diverged};
use crate::{Summary, TickRow};

/// Writes the columns `t,goal,gx,error_m,inside` of `task.csv`, with `gy` and `gz` after `gx` for further axes and `error_rad` after `error_m` for targets with
/// orientations, and `t,peer,event,goal` of `task-events.csv`.
///
/// Targets are counted from 1, in the order of reaching. `inside` is 1 or 0, and empty for a task without a radius. `peer` is empty for an event of all judged
/// peers together.
#[derive(Debug)]
pub(crate) struct TaskRecord {
    judge: Judge,
    files: Files,
}

/// Files of a task.
#[derive(Debug)]
struct Files {
    names: Vec<String>,
    axes: usize,
    rows: RecordFile,
    events: RecordFile,
    line: Vec<u8>,
}

impl TaskRecord {
    /// Begins the files; `None` for a scene without a task.
    pub(crate) fn create(folder: &Path, scene: &Scene) -> Result<Option<Self>, RecordError> {
        let Some(judge) = Judge::of(scene) else { return Ok(None) };
        let axes = scene.axes.count();
        let mut rows = RecordFile::create(folder.join("task.csv"))?;
        rows.write(b"t,goal,gx")?;
        for column in [",gy", ",gz"].into_iter().take(axes - 1) {
            rows.write(column.as_bytes())?;
        }
        let turns = scene.task.as_ref().and_then(|task| task.kind.reach()).is_some_and(|reach| reach.angle.is_finite());
        rows.write(if turns { b",error_m,error_rad,inside\n".as_slice() } else { b",error_m,inside\n" })?;
        let mut events = RecordFile::create(folder.join("task-events.csv"))?;
        events.write(b"t,peer,event,goal\n")?;
        let names = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        Ok(Some(Self { judge, files: Files { names, axes, rows, events, line: Vec::new() } }))
    }

    pub(crate) fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), RecordError> {
        let Self { judge, files } = self;
        let mut written = Ok(());
        judge.on_tick(row, &mut |at, row| {
            files.take(at, row, &mut written);
        });
        written
    }

    /// Writes the last rows and gives both files their names.
    pub(crate) fn finish(self, summary: &Summary) -> Result<[PathBuf; 2], RecordError> {
        let Self { judge, mut files } = self;
        let mut written = Ok(());
        judge.finish(has_diverged(summary), summary.duration, &mut |at, row| {
            files.take(at, row, &mut written);
        });
        written?;
        Ok([files.rows.finish()?, files.events.finish()?])
    }
}

impl Files {
    /// Writes a row, unless a row before could not be written. `written` keeps the first error.
    fn take(&mut self, at: Instant, row: TaskRow, written: &mut Result<(), RecordError>) {
        if written.is_ok() {
            *written = match row {
                TaskRow::Judged(seen) => self.write_judged(at, seen),
                TaskRow::Event(event) => self.write_event(at, event),
            };
        }
    }

    fn write_judged(&mut self, at: Instant, Seen { goal, target, error, turn, is_inside }: Seen) -> Result<(), RecordError> {
        let Self { axes, rows, line, .. } = self;
        line.clear();
        push_seconds(line, at);
        line.push(b',');
        push_whole(line, goal as u64 + 1);
        for value in target.position[..*axes].iter().chain([&error]).chain(&turn) {
            line.push(b',');
            push_f64(line, *value);
        }
        line.extend_from_slice(match is_inside {
            None => b",\n".as_slice(),
            Some(false) => b",0\n",
            Some(true) => b",1\n",
        });
        rows.write(line)
    }

    fn write_event(&mut self, at: Instant, event: Event) -> Result<(), RecordError> {
        let (peer, word, goal) = match event {
            Event::Entered { peer, goal } => (Some(peer), "entered", goal),
            Event::Left { peer, goal } => (Some(peer), "left", goal),
            Event::Reached { peer, goal } => (peer, "reached", goal),
            Event::Ended { peer, outcome, goal } => (peer, outcome.name(), goal),
        };
        let Self { names, events, line, .. } = self;
        line.clear();
        push_seconds(line, at);
        line.push(b',');
        line.extend_from_slice(peer.map_or("", |peer| names[peer].as_str()).as_bytes());
        line.push(b',');
        line.extend_from_slice(word.as_bytes());
        line.push(b',');
        push_whole(line, goal as u64 + 1);
        line.push(b'\n');
        events.write(line)
    }
}
