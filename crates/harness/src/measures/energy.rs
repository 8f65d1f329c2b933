//! Energy that the coordination injects into the copies.
//!
//! Over a step a copy moves by d under held forces, so the work of each force is exact: the held part F of the coordination force does the work −F·d. A law
//! with own damping β takes energy between ticks too. All damping, bO + β, takes f·d − ½·m·(v₁² − v₀²) in a step, with f the sum of the held forces, and β
//! takes its share β/(bO + β):
//!
//! ```text
//! W = Σᵢ Σₖ (−F·d − β/(bO + β)·(f·d − ½·m·Δv²))
//! ```
//!
//! A rotating object adds the same for its turns, with the held part T of the coordination torque, the sum τ of the held torques and the integral Θ of ω, all
//! in body axes. The loss about one axis includes the work of the gyroscopic term, (Jⱼ − Jₖ)·∫ωxωyωz dt, by Simpson's rule. The sum of this term over all three
//! axes is zero.
//!
//! ```text
//! W += −T·Θ − Σᵢ β/(bR + β)·(τ·Θ − ½·J·Δω² + (Jⱼ − Jₖ)·∫ωxωyωz dt)ᵢ
//! ```
//!
//! If only a server has the object, F of the server is −Σ FC of its clients. Each client adds −FC·dH, with dH the motion of its device, because the step rows
//! of a client describe its device.

use std::time::Duration;

use cohaptic_peer::rotation::Spin;
use cohaptic_scene::{Measure, Scene};

use super::{Accumulator, Asked, Rows};
use crate::{InstantRow, StepRow, TurnStepRow};

/// Injected energy W \[J\] so far.
#[derive(Clone, Debug)]
pub(super) struct Energy {
    peers: Vec<PeerEnergy>,
    /// Σ over all peers \[J\], added in the order of the steps.
    injected: f64,
    /// Largest `injected` after an instant so far \[J\], at least 0.
    peak: f64,
}

/// Injected energy W of one copy.
#[derive(Clone, Debug)]
struct PeerEnergy {
    /// Mass of the copy \[kg\].
    mass: f64,
    /// Damping bO of the object [N·s/m].
    damping: f64,
    /// Inertia J and damping bR of the copy's turns; `None` if the object does not turn.
    spin: Option<Spin>,
    /// Energy so far \[J\]; `None` before the first step. A peer in another process never makes a step.
    injected: Option<f64>,
}

impl PeerEnergy {
    fn new(scene: &Scene, place: usize) -> Self {
        Self { mass: scene.copy_config(place).mass, damping: scene.object.damping, spin: scene.copy_spin(), injected: None }
    }

    /// Returns the energy that the coordination injects into the copy in a step \[J\].
    #[inline(always)]
    fn of_step(&self, row: &StepRow<'_>) -> f64 {
        let mut energy = 0.0;
        // Share of the law's own damping in all damping: β/(bO + β).
        let share = if row.own_damping > 0.0 { row.own_damping / (self.damping + row.own_damping) } else { 0.0 };
        let positions = row.before.position.iter().zip(row.after.position);
        let velocities = row.before.velocity.iter().zip(row.after.velocity);
        let forces = row.coordination_force.iter().zip(row.held_force);
        // The forces are held over the whole step, so force times displacement is the exact work.
        for (((from, to), (before, after)), (coordination_force, held_force)) in positions.zip(velocities).zip(forces) {
            let moved = to - from;
            energy -= coordination_force * moved;
            // Without own damping the second term is zero, and β/(bO + β) could be 0/0.
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

/// Returns the energy that the coordination injects into the turn of a copy in a step \[J\].
#[inline(never)]
fn of_turn(turn: &TurnStepRow, spin: &Spin) -> f64 {
    let TurnStepRow { before, after, travel, held_torque, coordination_torque, own_damping, .. } = turn;
    let mut energy = 0.0;
    // Work of the held coordination torque, −T·Θ.
    for (torque, travel) in coordination_torque.iter().zip(travel) {
        energy -= torque * travel;
    }
    if own_damping.iter().any(|own| *own > 0.0) {
        let seconds = turn.span.as_secs_f64();
        let product = |rate: &[f64; 3]| rate[0] * rate[1] * rate[2];
        // Simpson's rule needs the rate in the middle, which follows from both ends and the mean rate.
        let middle: [f64; 3] = std::array::from_fn(|axis| (6.0 * travel[axis] / seconds - before[axis] - after[axis]) / 4.0);
        let gyroscopic = seconds / 6.0 * (product(before) + 4.0 * product(&middle) + product(after));
        for axis in (0..3).filter(|axis| own_damping[*axis] > 0.0) {
            // The gyroscopic term of an axis contains the moments of inertia about the two axes that follow in cyclic order.
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

    /// Updates the peak after all steps of an instant, because these are simultaneous: a sum over some of them has no meaning.
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
