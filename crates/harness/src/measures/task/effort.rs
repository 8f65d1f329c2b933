//! Forces and work of the hands over a task: effort, work given and taken, motion force and internal force, and the share of the load.
//!
//! For two people along one axis, motion force and internal force are those of Groten, Feth et al. (2009). For more people the forces of each sign are added
//! first, and for more axes norms are taken.

use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::TickRow;

/// Sums over the ticks of a task.
#[derive(Clone, Debug)]
pub(super) struct Effort {
    axes: usize,
    peers: Vec<OfPeer>,
    /// Latest instant of the task with a row, which is not in the sums over instants yet.
    now: Option<Instant>,
    /// Σ over instants of the motion force \[N\].
    motion: f64,
    /// Σ over instants of the internal force \[N\].
    internal: f64,
    /// Number of instants in both sums.
    instants: u64,
    /// Number of instants with a sum of forces that has a direction.
    loaded: u64,
}

/// Sums of one peer.
#[derive(Clone, Copy, Debug)]
struct OfPeer {
    /// Control tick \[s\].
    tick: f64,
    /// Coupling force and position of the device at the latest tick of the task; `None` before the first.
    latest: Option<([f64; 3], [f64; 3])>,
    /// Σ of the squared norms of the force \[N²\].
    squares: f64,
    /// Positive work \[J\].
    given: f64,
    /// Negative work \[J\], as a negative number.
    taken: f64,
    /// Σ of the shares of the load.
    share: f64,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::measures) enum Figure {
    Motion,
    Internal,
    Effort,
    Given,
    Taken,
    Share,
}

impl Effort {
    pub(super) fn new(scene: &Scene) -> Self {
        let of_peer = |tick: Duration| OfPeer { tick: tick.as_secs_f64(), latest: None, squares: 0.0, given: 0.0, taken: 0.0, share: 0.0 };
        Self {
            axes: scene.axes.count(),
            peers: scene.peers.iter().map(|peer| of_peer(peer.clock.tick)).collect(),
            now: None,
            motion: 0.0,
            internal: 0.0,
            instants: 0,
            loaded: 0,
        }
    }

    /// Takes a row of any time. `is_under_way`: the instant of the row belongs to the task.
    pub(super) fn on_tick(&mut self, row: &TickRow<'_>, is_under_way: bool) {
        if let Some(at) = self.now
            && at < row.at
        {
            self.now = None;
            self.add_instant();
        }
        if !is_under_way {
            return;
        }
        self.now = Some(row.at);
        let first_of_three = |values: &[f64]| std::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
        let (force, position): ([f64; 3], [f64; 3]) = (first_of_three(row.coupling_force), first_of_three(row.device.position));
        let peer = &mut self.peers[row.peer];
        // The force of a tick is held until the next tick, over which the device moves.
        if let Some((held, before)) = peer.latest.replace((force, position)) {
            let work: f64 = (0..self.axes).map(|axis| held[axis] * (position[axis] - before[axis])).sum();
            if work > 0.0 { peer.given += work } else { peer.taken += work }
        }
        peer.squares += force.iter().map(|component| component * component).sum::<f64>();
    }

    #[expect(clippy::cast_precision_loss, reason = "fewer instants than 2^53")]
    pub(super) fn value(&self, figure: Figure, peer: Option<usize>) -> Option<f64> {
        // The latest instant has no later row that would have added it.
        let mut whole = self.clone();
        if whole.now.take().is_some() {
            whole.add_instant();
        }
        let of_peer = || whole.peers.get(peer?).filter(|peer| peer.latest.is_some());
        let mean = |sum: f64, count: u64| (count > 0).then(|| sum / count as f64);
        match figure {
            Figure::Motion => mean(whole.motion, whole.instants),
            Figure::Internal => mean(whole.internal, whole.instants),
            Figure::Effort => of_peer().map(|peer| peer.squares * peer.tick),
            Figure::Given => of_peer().map(|peer| peer.given),
            // Zero without a sign where no work was negative.
            Figure::Taken => of_peer().map(|peer| 0.0 - peer.taken.abs()),
            Figure::Share => of_peer().and_then(|peer| mean(peer.share, whole.loaded)),
        }
    }

    /// Adds the latest forces of all peers to the sums over instants.
    fn add_instant(&mut self) {
        let forces: Vec<[f64; 3]> = self.peers.iter().map(|peer| peer.latest.map_or([0.0; 3], |(force, _)| force)).collect();
        let Split { motion, internal } = split(&forces);
        self.motion += motion;
        self.internal += internal;
        self.instants += 1;
        if let Some(shares) = shares(&forces) {
            self.loaded += 1;
            self.peers.iter_mut().zip(shares).for_each(|(peer, share)| peer.share += share);
        }
    }
}

/// Parts of the forces of several people on one object.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Split {
    /// Norm of the sum of all forces \[N\].
    motion: f64,
    /// Norm over axes of the smaller one of the sums of positive and of negative forces \[N\].
    internal: f64,
}

fn split(forces: &[[f64; 3]]) -> Split {
    let (mut motion, mut internal) = (0.0, 0.0);
    for axis in 0..3 {
        let positive: f64 = forces.iter().map(|force| force[axis].max(0.0)).sum();
        let negative: f64 = forces.iter().map(|force| (-force[axis]).max(0.0)).sum();
        motion += (positive - negative) * (positive - negative);
        internal += positive.min(negative) * positive.min(negative);
    }
    Split { motion: libm::sqrt(motion), internal: libm::sqrt(internal) }
}

/// Returns the part of each force in the direction of the sum of all forces, over the sum of such parts. `None` if the sum of all forces is zero or not finite.
fn shares(forces: &[[f64; 3]]) -> Option<Vec<f64>> {
    let sum: [f64; 3] = std::array::from_fn(|axis| forces.iter().map(|force| force[axis]).sum());
    let along = |force: &[f64; 3]| (0..3).map(|axis| force[axis] * sum[axis]).sum::<f64>().max(0.0);
    let parts: Vec<f64> = forces.iter().map(along).collect();
    let total: f64 = parts.iter().sum();
    (total > 0.0 && total.is_finite()).then(|| parts.iter().map(|part| part / total).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along_x<const N: usize>(forces: [f64; N]) -> Vec<[f64; 3]> {
        forces.iter().map(|force| [*force, 0.0, 0.0]).collect()
    }

    #[test]
    fn forces_that_cancel_are_internal() {
        assert_eq!(split(&along_x([3.0, -1.0])), Split { motion: 2.0, internal: 1.0 });
        assert_eq!(split(&along_x([2.0, 1.0, -0.5])), Split { motion: 2.5, internal: 0.5 });
        assert_eq!(split(&[[3.0, 0.0, 4.0], [-3.0, 0.0, -4.0]]), Split { motion: 0.0, internal: 5.0 });
    }

    #[test]
    fn who_pulls_against_the_sum_bears_no_load() {
        assert_eq!(shares(&along_x([3.0, -1.0])), Some(vec![1.0, 0.0]));
        let shared = shares(&along_x([-2.0, -1.0])).unwrap();
        assert!((shared[0] - 2.0 / 3.0).abs() < 1e-15 && (shared[1] - 1.0 / 3.0).abs() < 1e-15, "{shared:?}");
        assert_eq!(shares(&along_x([1.0, -1.0])), None);
    }
}
