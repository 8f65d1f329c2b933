//! Lag of each copy: the delay of the copy after the followed motion, and the deviation that remains apart from the lag.
//!
//! The target of a task that tracks is followed; in other tasks, the copy of the first peer. The position of each copy is sampled every 10 ms of the task, at
//! the first tick at or after each such instant.

use std::time::Duration;

use cohaptic_scene::{Scene, TaskKind, Track};
use cohaptic_units::Instant;

use super::{PERIOD, PERIOD_S, is_due};
use crate::TickRow;

/// Largest lag, in samples: one second.
const MOST: usize = 100;

/// Positions of all copies over the task.
#[derive(Clone, Debug)]
pub(super) struct Following {
    /// Motion of the target; `None` if the copies follow the first copy.
    track: Option<Track>,
    /// Positions of each copy \[m\]. An hour of a peer takes 9 MB, and twice this with a target.
    copies: Vec<Vec<[f64; 3]>>,
    /// Positions of the target at the ticks of these samples \[m\]. Empty without a moving target.
    targets: Vec<Vec<[f64; 3]>>,
    start: Instant,
    /// Samples of the warm-up, for which a target is followed but not measured.
    warm_up: usize,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::measures) enum Figure {
    Lag,
    Residual,
}

impl Following {
    pub(super) fn new(scene: &Scene) -> Self {
        let task = scene.task.as_ref();
        let track = task.and_then(|task| match &task.kind {
            TaskKind::Track(track) => Some(track.clone()),
            TaskKind::Reach(_) | TaskKind::Hold(_) | TaskKind::Path(_) | TaskKind::Carry(_) => None,
        });
        let warm_up = track.as_ref().map_or(Duration::ZERO, |track| track.warm_up).as_nanos().div_ceil(PERIOD.as_nanos());
        Self {
            copies: vec![Vec::new(); scene.peers.len()],
            targets: vec![Vec::new(); if track.is_some() { scene.peers.len() } else { 0 }],
            start: task.map_or(Instant::ZERO, |task| task.start),
            warm_up: usize::try_from(warm_up).unwrap_or(usize::MAX),
            track,
        }
    }

    pub(super) fn on_tick(&mut self, row: &TickRow<'_>) {
        let copies = &mut self.copies[row.peer];
        // A tick longer than the time between samples gives several samples.
        while is_due(self.start, copies.len(), row.at) {
            copies.push(std::array::from_fn(|axis| row.object.position.get(axis).copied().unwrap_or(0.0)));
            if let Some(track) = &self.track {
                self.targets[row.peer].push(track.target(row.at.saturating_duration_since(self.start)));
            }
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "at most a hundred samples")]
    pub(super) fn value(&self, figure: Figure, peer: usize) -> Option<f64> {
        let followed = if self.track.is_some() { self.targets.get(peer) } else { self.copies.first() };
        let (lag, residual) = shift(self.copies.get(peer)?, followed?, self.warm_up)?;
        Some(match figure {
            Figure::Lag => lag as f64 * PERIOD_S,
            Figure::Residual => residual,
        })
    }
}

/// Returns the number of samples, at most [`MOST`], by which `followed` must be shifted to later instants for the least root mean square distance from `copy`,
/// and this distance \[m\]. Among equal shifts the least counts. All shifts are compared over the same samples of `copy`: the samples from `warm_up` and
/// from [`MOST`] on. `None` without such samples.
#[expect(clippy::cast_precision_loss, reason = "fewer samples than 2^53")]
fn shift(copy: &[[f64; 3]], followed: &[[f64; 3]], warm_up: usize) -> Option<(usize, f64)> {
    let (first, end) = (warm_up.max(MOST), copy.len().min(followed.len()));
    let squared = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>();
    let distance = |lag: usize| {
        let squares: f64 = copy[first..end].iter().zip(&followed[first - lag..end - lag]).map(squared).sum();
        libm::sqrt(squares / (end - first) as f64)
    };
    if first >= end {
        return None;
    }
    (0..=MOST).map(|lag| (lag, distance(lag))).reduce(|least, other| if other.1 < least.1 { other } else { least })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::StateRow;

    /// Samples of a motion along two axes, `late` \[s\] later.
    fn motion(late: f64) -> Vec<[f64; 3]> {
        let at = |t: f64| [0.02 * libm::sin(1.3 * t), 0.01 * libm::cos(3.1 * t), 0.0];
        (0..400).map(|place| at(f64::from(place) * PERIOD_S - late)).collect()
    }

    #[test]
    fn a_shifted_motion_has_its_shift_and_no_residual() {
        let (lag, residual) = shift(&motion(0.05), &motion(0.0), 0).unwrap();
        assert!(lag == 5 && residual < 1e-12, "{lag} {residual}");
        assert_eq!(shift(&motion(0.0), &motion(0.0), 0), Some((0, 0.0)));
        let still = [[0.1; 3]; 200];
        assert_eq!(shift(&still, &still, 0), Some((0, 0.0)));
        let (lag, residual) = shift(&motion(1.0), &motion(0.0), 150).unwrap();
        assert!(lag == MOST && residual < 1e-12, "{lag} {residual}");
    }

    /// An offset is no lag: the root mean square distance from the shifted motion is the offset.
    #[test]
    fn what_is_left_is_the_residual() {
        let offset: Vec<[f64; 3]> = motion(0.2).iter().map(|[x, y, _]| [*x, *y, 0.003]).collect();
        let (lag, residual) = shift(&offset, &motion(0.0), 0).unwrap();
        assert!(lag == 20 && (residual - 0.003).abs() < 1e-12, "{lag} {residual}");
    }

    /// Figures of a peer whose copy is at `position`, a function of the time since the beginning of the scene \[s\] and of the peer.
    fn figures(task: &str, millis: u64, peer: usize, position: impl Fn(f64, usize) -> f64) -> (f64, f64) {
        let text = format!(
            "scene = {{ duration = \"10s\", count = 2 }}
             object = {{ mass = 1 }}
             coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"{millis}ms\" }}
             peer = {{ device = {{ mass = 1 }}, coupling = {{ stiffness = 1 }}, tick = \"{millis}ms\" }}
             task = {{ {task} }}"
        );
        let scene = Scene::parse(&text, "test.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"));
        let mut following = Following::new(&scene);
        let start = scene.task.as_ref().unwrap().start;
        for at in (0..10_000).step_by(usize::try_from(millis).unwrap()).map(|milli| Instant::from_nanos(1_000_000 * milli)).filter(|at| *at >= start)
        {
            for peer in 0..2 {
                let state = StateRow { position: &[position(at.as_secs_f64(), peer)], velocity: &[0.0] };
                let [coupling_force, coordination_force] = [&[0.0][..]; 2];
                following.on_tick(&TickRow { at, peer, device: state, object: state, target: state, coupling_force, coordination_force, turn: None });
            }
        }
        (following.value(Figure::Lag, peer).unwrap(), following.value(Figure::Residual, peer).unwrap())
    }

    /// A target that moves from the start of the task on is followed by 0.15 s, after a warm-up in which nobody follows the target.
    #[test]
    fn a_target_is_followed_after_the_warm_up() {
        let task = r#"kind = "track", sines = [{ amplitude = 0.02, frequency = 0.3 }], start = "700ms", warm-up = "3s""#;
        for tick in [1, 2] {
            let follows = |t: f64, _| if t < 3.7 { 0.5 } else { 0.02 * (std::f64::consts::TAU * 0.3 * (t - 0.7 - 0.15)).sin() };
            let (lag, residual) = figures(task, tick, 1, follows);
            assert!((lag - 0.15).abs() < 1e-12 && residual < 1e-12, "{lag} {residual}");
        }
    }

    /// Without a target the first copy is followed. A tick of 20 ms is longer than the time between two samples.
    #[test]
    fn the_first_copy_is_followed_at_any_tick() {
        for tick in [1, 10, 20] {
            let moves = |t: f64, peer: usize| (3.0 * (t - if peer == 0 { 0.0 } else { 0.4 })).sin();
            let (lag, residual) = figures(r#"kind = "hold", target = 0, radius = 2"#, tick, 1, moves);
            assert!((lag - 0.4).abs() < 1e-12 && residual < 1e-12, "{tick} ms: {lag} {residual}");
        }
    }

    #[test]
    fn a_task_of_a_second_has_no_lag() {
        assert_eq!(shift(&motion(0.0)[..MOST], &motion(0.0), 0), None);
        assert_eq!(shift(&motion(0.0), &motion(0.0), 400), None);
        assert!(shift(&motion(0.0), &motion(0.0), 399).is_some());
    }
}
