//! Run of a trial: a part of `cohaptic play` with the scene of the condition. The trial ends with the outcome of the task, or with the first fault.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Instant as Clock;

use cohaptic_control::Board;
use cohaptic_files::write_whole;
use cohaptic_live::{Conductor, LinkChange, Motion, Recorded, Report, Session, SessionConfig, Status};
use cohaptic_scene::{Scene, scene_content_of_text};
use cohaptic_study::{Fault, TrialScene};

use super::lab::Lab;
use crate::arguments::RealTimeArguments;
use crate::failure::Failure;
use crate::interrupt;
use crate::live::onlookers;
use crate::realtime::Look;

/// Result of a trial.
pub(super) struct Ended {
    pub(super) report: Report,
    /// Faults of the trial; empty for a valid trial.
    pub(super) faults: Vec<Fault>,
}

/// Runs a trial, and records its scene and its inputs in the folder `staged`.
pub(super) fn run(real_time: &RealTimeArguments, lab: &Arc<Lab>, board: &Arc<Board>, trial: &TrialScene, staged: &Path) -> Result<Ended, Failure> {
    let TrialScene { text, scene, hands } = trial;
    let file = staged.join("scene.toml");
    write_whole(&file, |file| file.write_all(text.as_bytes())).map_err(|error| Failure::File { verb: "write", path: file, error })?;
    let config = SessionConfig {
        pacing: real_time.pace.pacing(),
        wishes: real_time.pace.wishes(),
        tolerance: real_time.pace.tolerance(),
        out: Some(staged.to_path_buf()),
        recorded: Recorded::Inputs,
        content: scene_content_of_text(text, &lab.study.scene_file, &[])?,
        ..SessionConfig::new(SocketAddr::from(([127, 0, 0, 1], 0)))
    };
    let device = |peer: usize| hands.iter().position(|hand| *hand == peer).map(|seat| lab.hands[seat].begin(Clock::now()));
    let session = Session::open(scene, config, device).map_err(crate::live::refused)?;
    let pairs = onlookers::pairs(scene);
    board.begin(onlookers::description(scene, &pairs));
    lab.begin_trial(trial);
    let mut conductor = TrialConductor { lab: Arc::clone(lab), look: Look::on(board), axes: axes(scene), faults: Vec::new() };
    let running = thread::Builder::new().name("study".to_owned()).spawn(move || {
        let report = session.run(&mut conductor);
        (report, conductor.faults)
    });
    let running = running.map_err(|error| Failure::System(format!("the system gives the session no thread: {error}")))?;
    let (report, mut faults) = running.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    let report = report.map_err(crate::live::refused)?;
    if !report.validity.is_valid() {
        faults.push(Fault::LateTicks);
    }
    Ok(Ended { report, faults })
}

fn axes(scene: &Scene) -> usize {
    scene.axes.count()
}

/// Conductor of a trial: shows the motion, and ends a trial that cannot be valid any more.
struct TrialConductor {
    lab: Arc<Lab>,
    look: Look,
    axes: usize,
    faults: Vec<Fault>,
}

impl Conductor for TrialConductor {
    fn keep_going(&mut self) -> bool {
        let now = Clock::now();
        // A session that has ended asks no more, so that each fault is found once.
        self.faults.extend(self.lab.hands.iter().filter_map(|hand| hand.fault(now)));
        self.faults.is_empty() && !self.lab.ends_trial() && !interrupt::requested()
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        // The condition alone sets the links.
        None
    }

    fn show(&mut self, status: Status) {
        self.look.publish(onlookers::snapshot(&status, self.axes));
    }

    fn show_motion(&mut self, mut motion: Motion) {
        // Packets on their way would tell people the condition.
        motion.packets.clear();
        self.lab.frames.publish(motion);
    }

    fn wants_motion(&self) -> bool {
        true
    }
}
