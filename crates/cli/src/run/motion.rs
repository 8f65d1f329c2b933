//! Animated picture of a run (`--motion`): the copies of the object and the devices of the peers at 20 frames per second.

use std::path::Path;
use std::time::Duration;

use cohaptic_harness::TickRow;
use cohaptic_picture::{Motion, MotionHand, MotionRun};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::Run;
use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::file::write_file;

/// Interval between two frames. The picture moves copies along straight lines between frames.
const STEP: Duration = Duration::from_millis(50);
const STEP_S: f64 = 0.05;

/// Positions of the copies and of the devices, per frame. Filled by the ticks of a run.
pub(super) struct Places {
    peers: usize,
    /// Positions, indexed by frame, then by peer. Until the peer's tick for a frame, the position equals the position of the frame before.
    frames: Vec<Vec<Place>>,
    /// Index of the next frame without a position of the peer, indexed by peer.
    next: Vec<usize>,
}

/// Positions of a peer along the first two axes \[m\].
#[derive(Clone, Copy)]
struct Place {
    copy: [f64; 2],
    device: [f64; 2],
}

impl Places {
    pub(super) fn new(peers: usize) -> Self {
        Self { peers, frames: Vec::new(), next: vec![0; peers] }
    }

    fn due(frame: usize) -> Instant {
        Instant::ZERO.saturating_add(STEP.saturating_mul(u32::try_from(frame).unwrap_or(u32::MAX)))
    }

    /// Returns whether a frame of some peer is due.
    pub(super) fn wants(&self, at: Instant) -> bool {
        self.next.iter().any(|frame| Self::due(*frame) <= at)
    }

    /// Stores the positions of the tick in all due frames of the peer: each frame gets the first tick at or after the instant of the frame.
    pub(super) fn add(&mut self, row: &TickRow<'_>) {
        let [copy, device] = [row.object, row.device].map(|state| [0, 1].map(|axis| state.position.get(axis).copied().unwrap_or(0.0)));
        let place = Place { copy, device };
        while Self::due(self.next[row.peer]) <= row.at {
            let frame = self.next[row.peer];
            // The first peer that reaches a frame adds the frame. The remaining peers keep the positions of the frame before until their own ticks, so no entry
            // is ever missing.
            if frame == self.frames.len() {
                let before = self.frames.last().cloned().unwrap_or_else(|| vec![place; self.peers]);
                self.frames.push(before);
            }
            self.frames[frame][row.peer] = place;
            self.next[row.peer] += 1;
        }
    }

    /// Converts the positions into the frames of a picture. The devices of the peers `held` are drawn as hands.
    fn run(&self, title: String, names: Vec<String>, held: &[usize]) -> MotionRun {
        let hand = |copy: usize| MotionHand { copy, frames: self.frames.iter().map(|places| places[copy].device).collect() };
        let frames = self.frames.iter().map(|places| places.iter().map(|place| place.copy).collect()).collect();
        MotionRun { title, names, frames, hands: held.iter().copied().map(hand).collect() }
    }
}

/// Draws one run, or two runs beside each other, and writes the picture into `file`.
pub(super) fn draw(file: &Path, arguments: &RunArguments, scene: &Scene, runs: [Option<&Run>; 2]) -> Result<(), Failure> {
    let names: Vec<String> = scene.peers.iter().map(|peer| peer.name.clone()).collect();
    let held: Vec<usize> = (0..scene.peers.len()).filter(|peer| scene.peers[*peer].hand.is_some()).collect();
    let against = arguments.against.iter().map(|set| set.split_once('=').map_or(set.as_str(), |(_, value)| value));
    let titles = [scene.coordination.strategy.name().to_owned(), against.collect::<Vec<_>>().join(", ")];
    let shown = runs.into_iter().zip(titles).filter_map(|(run, title)| Some(run?.places.as_ref()?.run(title, names.clone(), &held)));
    let links = scene.used_links();
    let note = match &links[..] {
        [] => String::new(),
        [(link, _)] => format!("Each link between two peers: {}", link.words()),
        links => format!("{} kinds of links between the peers", links.len()),
    };
    write_file(file, Motion::new(scene.title.as_str(), note, STEP_S, shown.collect()).svg())
}
