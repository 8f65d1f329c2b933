//! The energy that the coordination injects into the copies.
//!
//! Over a step a copy moves by d under forces that are held, so their work is exact: −F·d is what the held part F of the coordination force does. A law that damps the
//! copy by β takes energy between ticks too. All damping, bO + β, takes f·d − ½·m·(v₁² − v₀²) in a step, with f the sum of the held forces, and β takes its
//! share β/(bO + β) of it:
//!
//! ```text
//! W = Σᵢ Σₖ (−F·d − β/(bO + β)·(f·d − ½·m·Δv²))
//! ```
//!
//! Where a server alone has the object, F of the server is −Σ FC of its clients, and each client adds −FC·dH, with dH the motion of its device: the rows of its steps
//! are those of that device.

use std::time::Duration;

use cohaptic_scene::{Measure, Scene};

use super::{Accumulator, Asked, Rows};
use crate::{InstantRow, StepRow};

/// W so far.
#[derive(Clone, Debug)]
pub(super) struct Energy {
    peers: Vec<PeerEnergy>,
    /// Σ over peers, in the order of steps.
    injected: f64,
    peak: f64,
    /// Whether the object turns: the work of torques is not counted, so W has no value.
    turns: bool,
}

/// W of one copy.
#[derive(Clone, Debug)]
struct PeerEnergy {
    mass: f64,
    /// bO [N·s/m].
    damping: f64,
    /// `None` before its first step: a peer in another process never makes one.
    injected: Option<f64>,
}

impl PeerEnergy {
    fn new(scene: &Scene, place: usize) -> Self {
        Self { mass: scene.copy_config(place).mass, damping: scene.object.damping, injected: None }
    }

    /// What the coordination injects into the copy in a step \[J\].
    #[inline]
    fn of_step(&self, row: &StepRow<'_>) -> f64 {
        let mut energy = 0.0;
        let share = if row.own_damping > 0.0 { row.own_damping / (self.damping + row.own_damping) } else { 0.0 };
        for axis in 0..row.held_force.len() {
            let moved = row.after.position[axis] - row.before.position[axis];
            energy -= row.coordination_force[axis] * moved;
            if share > 0.0 {
                let (before, after) = (row.before.velocity[axis], row.after.velocity[axis]);
                energy -= share * (row.held_force[axis] * moved - 0.5 * self.mass * (after * after - before * before));
            }
        }
        energy
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    AtEnd,
    Peak,
}

impl Accumulator for Energy {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] =
        &[(Measure::Energy, Figure::AtEnd), (Measure::EnergyPeak, Figure::Peak), (Measure::PeerEnergy, Figure::AtEnd)];
    const ROWS: Rows = Rows { steps: true, instants: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        let peers = (0..asked.scene.peers.len()).map(|place| PeerEnergy::new(asked.scene, place)).collect();
        Self { peers, injected: 0.0, peak: 0.0, turns: asked.scene.rotation.is_some() }
    }

    fn on_step(&mut self, row: &StepRow<'_>) {
        let peer = &mut self.peers[row.peer];
        let energy = peer.of_step(row);
        *peer.injected.get_or_insert(0.0) += energy;
        self.injected += energy;
    }

    /// Steps of one instant are simultaneous: W between two of them is nothing that ever was.
    fn on_instant(&mut self, _row: &InstantRow) {
        self.peak = self.peak.max(self.injected);
    }

    fn value(&self, figure: Figure, peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        if self.turns {
            return None;
        }
        match (figure, peer) {
            (Figure::Peak, _) => Some(self.peak),
            (Figure::AtEnd, Some(peer)) => self.peers.get(peer)?.injected,
            (Figure::AtEnd, None) => Some(self.injected),
        }
    }
}
