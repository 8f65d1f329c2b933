//! The copies in motion, as a picture that moves.

use std::path::Path;
use std::time::Duration;

use cohaptic_harness::TickRow;
use cohaptic_picture::{Motion, MotionRun};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::Run;
use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::file::write_file;

/// Between two frames: 20 a second, and straight ways between them.
const STEP: Duration = Duration::from_millis(50);
const STEP_S: f64 = 0.05;

/// Where the copies are at each frame.
pub(super) struct Places {
    peers: usize,
    /// By frame, then peer; a place that is not known yet is that of the frame before.
    frames: Vec<Vec<[f64; 2]>>,
    /// The next frame of each peer.
    next: Vec<usize>,
}

impl Places {
    pub(super) fn new(peers: usize) -> Self {
        Self { peers, frames: Vec::new(), next: vec![0; peers] }
    }

    fn due(frame: usize) -> Instant {
        Instant::ZERO.saturating_add(STEP.saturating_mul(u32::try_from(frame).unwrap_or(u32::MAX)))
    }

    /// Whether a frame of some peer is due.
    pub(super) fn wants(&self, at: Instant) -> bool {
        self.next.iter().any(|frame| Self::due(*frame) <= at)
    }

    /// Takes the first tick of each peer at or after each frame.
    pub(super) fn add(&mut self, row: &TickRow<'_>) {
        let place = [0, 1].map(|axis| row.object.position.get(axis).copied().unwrap_or(0.0));
        while Self::due(self.next[row.peer]) <= row.at {
            let frame = self.next[row.peer];
            if frame == self.frames.len() {
                let before = self.frames.last().cloned().unwrap_or_else(|| vec![place; self.peers]);
                self.frames.push(before);
            }
            self.frames[frame][row.peer] = place;
            self.next[row.peer] += 1;
        }
    }
}

/// Draws one run, or two beside each other.
pub(super) fn draw(file: &Path, arguments: &RunArguments, scene: &Scene, runs: [Option<&Run>; 2]) -> Result<(), Failure> {
    let names: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
    let against = arguments.against.iter().map(|set| set.split_once('=').map_or(set.as_str(), |(_, value)| value));
    let titles = [scene.coordination.strategy.name().to_owned(), against.collect::<Vec<_>>().join(", ")];
    let shown = runs.into_iter().zip(titles).filter_map(|(run, title)| {
        let places = run?.places.as_ref()?;
        Some(MotionRun { title, names: names.clone(), frames: places.frames.clone() })
    });
    write_file(file, Motion::new(scene.title.as_str(), STEP_S, shown.collect()).svg())
}
