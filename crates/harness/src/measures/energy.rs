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
//! Where the object turns, there is the same of its turns, with the held part T of the coordination torque, the sum τ of the held torques and the integral Θ of ω, all
//! in body axes. The loss about one axis has what the gyroscopic term brings to it, (Jⱼ − Jₖ)·∫ωxωyωz dt, by Simpson's rule; over all three axes that is nothing.
//!
//! ```text
//! W += −T·Θ − Σᵢ β/(bR + β)·(τ·Θ − ½·J·Δω² + (Jⱼ − Jₖ)·∫ωxωyωz dt)ᵢ
//! ```
//!
//! Where a server alone has the object, F of the server is −Σ FC of its clients, and each client adds −FC·dH, with dH the motion of its device: the rows of its steps
//! are those of that device.

use std::time::Duration;

use cohaptic_peer::rotation::Spin;
use cohaptic_scene::{Measure, Scene};

use super::{Accumulator, Asked, Rows};
use crate::{InstantRow, StepRow, TurnStepRow};

/// W so far.
#[derive(Clone, Debug)]
pub(super) struct Energy {
    peers: Vec<PeerEnergy>,
    /// Σ over peers, in the order of steps.
    injected: f64,
    peak: f64,
}

/// W of one copy.
#[derive(Clone, Debug)]
struct PeerEnergy {
    mass: f64,
    /// bO [N·s/m].
    damping: f64,
    /// J and bR, if the object turns.
    spin: Option<Spin>,
    /// `None` before its first step: a peer in another process never makes one.
    injected: Option<f64>,
}

impl PeerEnergy {
    fn new(scene: &Scene, place: usize) -> Self {
        Self { mass: scene.copy_config(place).mass, damping: scene.object.damping, spin: scene.copy_spin(), injected: None }
    }

    /// What the coordination injects into the copy in a step \[J\].
    #[inline(always)]
    fn of_step(&self, row: &StepRow<'_>) -> f64 {
        let mut energy = 0.0;
        let share = if row.own_damping > 0.0 { row.own_damping / (self.damping + row.own_damping) } else { 0.0 };
        let positions = row.before.position.iter().zip(row.after.position);
        let velocities = row.before.velocity.iter().zip(row.after.velocity);
        let forces = row.coordination_force.iter().zip(row.held_force);
        for (((from, to), (before, after)), (coordination_force, held_force)) in positions.zip(velocities).zip(forces) {
            let moved = to - from;
            energy -= coordination_force * moved;
            if share > 0.0 {
                energy -= share * (held_force * moved - 0.5 * self.mass * (after * after - before * before));
            }
        }
        match (&row.turn, &self.spin) {
            (Some(turn), Some(spin)) => energy + of_turn(turn, spin),
            _ => energy,
        }
    }
}

/// What the coordination injects into the turn of a copy in a step \[J\].
#[inline(never)]
fn of_turn(turn: &TurnStepRow, spin: &Spin) -> f64 {
    let TurnStepRow { before, after, travel, held_torque, coordination_torque, own_damping, .. } = turn;
    let mut energy = 0.0;
    for (torque, travel) in coordination_torque.iter().zip(travel) {
        energy -= torque * travel;
    }
    if own_damping.iter().any(|own| *own > 0.0) {
        let seconds = turn.span.as_secs_f64();
        let product = |rate: &[f64; 3]| rate[0] * rate[1] * rate[2];
        // Simpson's rule over a step whose mean angular velocity is known.
        let middle: [f64; 3] = std::array::from_fn(|axis| (6.0 * travel[axis] / seconds - before[axis] - after[axis]) / 4.0);
        let gyroscopic = seconds / 6.0 * (product(before) + 4.0 * product(&middle) + product(after));
        for axis in (0..3).filter(|axis| own_damping[*axis] > 0.0) {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            let share = own_damping[axis] / (spin.damping[axis] + own_damping[axis]);
            let work = held_torque[axis] * travel[axis] + (spin.inertia[next] - spin.inertia[last]) * gyroscopic;
            energy -= share * (work - 0.5 * spin.inertia[axis] * (after[axis] * after[axis] - before[axis] * before[axis]));
        }
    }
    energy
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
        Self { peers, injected: 0.0, peak: 0.0 }
    }

    #[inline(always)]
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
        match (figure, peer) {
            (Figure::Peak, _) => Some(self.peak),
            (Figure::AtEnd, Some(peer)) => self.peers.get(peer)?.injected,
            (Figure::AtEnd, None) => Some(self.injected),
        }
    }
}
