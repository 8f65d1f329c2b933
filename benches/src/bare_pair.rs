//! The least that a verdict on equal peers takes: both blocks of one frame over arrays of fixed size, written by hand for this one kind of scene.
//!
//! Equal peers of one axis that grasp, average-position coordination, all samples a whole number of frames on the way, and one at least. No classes, no
//! timetable, no units but metres and ticks, no bound of errors.

use cohaptic_peer::{Gains, Plant};
use cohaptic_scene::Scene;
use cohaptic_stability::{DelayedLoop, Kernel, Matrix, radius_small};

/// What does not change with the gains.
#[derive(Clone, Copy, Debug)]
pub struct BarePair {
    device: Step,
    object: Step,
    ticks: u32,
    tick: f64,
    /// −1/(N−1)
    difference: f64,
}

/// A body's step, with velocities multiplied by the tick.
#[derive(Clone, Copy, Debug)]
struct Step {
    e: [[f64; 2]; 2],
    g: [f64; 2],
}

impl Step {
    fn advance(&self, x: &mut f64, v: &mut f64, force: f64) {
        let (x0, v0) = (*x, *v);
        *x = x0 + self.e[0][0] * x0 + self.e[0][1] * v0 + self.g[0] * force;
        *v = v0 + self.e[1][0] * x0 + self.e[1][1] * v0 + self.g[1] * force;
    }
}

/// Rows of a frame over C unknowns: the device's position and velocity, the copy's, and what the copy sent as the frame began.
struct Frame<const C: usize> {
    rows: [[f64; C]; 4],
    sent: [f64; C],
}

impl BarePair {
    /// For a scene of that kind, whatever its gains.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let spec = &scene.peers[0];
        let tick = spec.clock.tick.as_secs_f64();
        let step = |mass, damping| {
            let (e, g) = Plant { mass, damping, stiffness: 0.0 }.step(spec.clock.tick, scene.integrator).coefficients();
            Step { e: [[e[0][0], e[0][1] / tick], [e[1][0] * tick, e[1][1]]], g: [g[0], g[1] * tick] }
        };
        Self {
            device: step(spec.device.mass, spec.device.damping),
            object: step(scene.copy_mass(), scene.object.damping),
            ticks: (scene.coordination.update.as_nanos() / spec.clock.tick.as_nanos()) as u32,
            tick,
            difference: -1.0 / (scene.peers.len() as f64 - 1.0),
        }
    }

    /// The larger of both radii for samples that take one frame, Td = Tn.
    #[must_use]
    pub fn radius(&self, coordination: Gains, coupling: Gains) -> f64 {
        let (position, velocity) = self.shares(coordination);
        // Everybody alike, relative to the copy: xh − x, vh, v, and the sample held less what it would be at rest at x.
        let start = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4], [0.0, 0.0, 1.0, 0.0]];
        let Frame { rows: [xh, vh, x, v], sent } = self.frame(start, [0.0, 0.0, 0.0, 1.0], coordination, coupling);
        let mut together = [less(xh, 1.0, x), vh, v, less(sent, position, x)];
        // One against the others: nothing is left out.
        let mut start = [[0.0; 5]; 4];
        for (row, entries) in start.iter_mut().enumerate() {
            entries[row] = 1.0;
        }
        let Frame { rows: [xh, vh, x, v], sent } = self.frame(start, [0.0, 0.0, 0.0, 0.0, self.difference], coordination, coupling);
        debug_assert!(position + velocity > 0.99, "shares are of a whole");
        radius_small(&mut together).max(radius_small(&mut [xh, vh, x, v, sent]))
    }

    /// Both blocks as loops with a delay, for samples that take a number of frames, at least 1.
    ///
    /// # Panics
    ///
    /// Never: the matrices are of one size.
    #[must_use]
    pub fn loops(&self, frames: u32, coordination: Gains, coupling: Gains) -> [DelayedLoop; 2] {
        let (_, velocity) = self.shares(coordination);
        let mut start = [[0.0; 5]; 4];
        for (row, entries) in start.iter_mut().enumerate() {
            entries[row] = 1.0;
        }
        let Frame { rows, sent } = self.frame(start, [0.0, 0.0, 0.0, 0.0, 1.0], coordination, coupling);
        let now = Matrix::from_fn(4, 4, |row, column| rows[row][column]);
        let back = Matrix::from_fn(4, 4, |row, column| self.difference * rows[row][4] * sent[column]);
        let apart = DelayedLoop::new(now, vec![(Kernel::Delay(frames), back)]);
        // Relative to the copy the states are u = xh − x, vh, v and y, how far the copy moved in the frame before. What arrives, less what it would be at
        // rest at x, is velocity·v of D frames ago less position·(x − x of D frames ago), and the latter is y + (y of 1 … D − 1 frames ago).
        let (position, _) = self.shares(coordination);
        let held = |row: usize| rows[row][4];
        let relative = |row: usize| match row {
            0 => [rows[0][0] - rows[2][0], rows[0][1] - rows[2][1], rows[0][3] - rows[2][3], held(0) - held(2)],
            1 => [rows[1][0], rows[1][1], rows[1][3], held(1)],
            2 => [rows[3][0], rows[3][1], rows[3][3], held(3)],
            _ => [rows[2][0], rows[2][1], rows[2][3], held(2)],
        };
        let now = Matrix::from_fn(4, 4, |row, column| {
            let [u, vh, v, held] = relative(row);
            [u, vh, v, -position * held][column]
        });
        let only = |place: usize, factor: f64| Matrix::from_fn(4, 4, |row, column| if column == place { factor * relative(row)[3] } else { 0.0 });
        let terms = vec![(Kernel::Delay(frames), only(2, velocity)), (Kernel::Sum(frames - 1), only(3, -position))];
        [apart, DelayedLoop::new(now, terms)].map(|made| made.expect("four by four"))
    }

    /// How much of a sample is position and how much is velocity.
    fn shares(&self, coordination: Gains) -> (f64, f64) {
        let unit = coordination.stiffness + coordination.damping / self.tick;
        (coordination.stiffness / unit, coordination.damping / self.tick / unit)
    }

    #[inline]
    fn frame<const C: usize>(&self, start: [[f64; C]; 4], held: [f64; C], coordination: Gains, coupling: Gains) -> Frame<C> {
        let [mut xh, mut vh, mut x, mut v] = start;
        let unit = coordination.stiffness + coordination.damping / self.tick;
        let (position, velocity) = self.shares(coordination);
        let (own, coupled) = (coordination.damping / self.tick, coupling.damping / self.tick);
        let sent = core::array::from_fn(|column| position * x[column] + velocity * v[column]);
        for _ in 0..self.ticks {
            for column in 0..C {
                //= Rakhsha & Constantinescu 2015, eqs. (8) and (9)
                let force = coupling.stiffness * (xh[column] - x[column]) + coupled * (vh[column] - v[column]);
                let pull = unit * held[column] - coordination.stiffness * x[column] - own * v[column];
                self.object.advance(&mut x[column], &mut v[column], force + pull);
                self.device.advance(&mut xh[column], &mut vh[column], -force);
            }
        }
        Frame { rows: [xh, vh, x, v], sent }
    }
}

fn less<const C: usize>(row: [f64; C], factor: f64, other: [f64; C]) -> [f64; C] {
    core::array::from_fn(|column| row[column] - factor * other[column])
}

#[cfg(test)]
mod tests {
    use cohaptic_stability::{Method, analyse};

    use super::*;
    use crate::verdicts::equal;

    #[test]
    fn the_bare_pair_and_its_loops_and_the_program_agree() {
        for (peers, stiffness, coupling) in [(2, 1000.0, 3500.0), (3, 2500.0, 500.0), (8, 300.0, 6000.0), (1000, 4000.0, 1500.0)] {
            for frames in [1, 2, 5] {
                let overrides = [
                    format!("coordination.stiffness={stiffness}"),
                    format!("peer.coupling.stiffness={coupling}"),
                    format!("link.delay={}ms", 8 * frames),
                ];
                let scene = equal(peers, &overrides);
                let expected = analyse(&scene, Method::Reduced).unwrap().radius.value;
                let pair = BarePair::new(&scene);
                let (coordination, coupling) = (scene.coordination.gains, scene.peers[0].coupling);
                if frames == 1 {
                    let bare = pair.radius(coordination, coupling);
                    assert!((bare - expected).abs() < 1e-12 * expected.max(1.0), "{peers}: {bare} is not {expected}");
                }
                let [apart, together] = pair.loops(frames, coordination, coupling).map(|looped| looped.bounded_radius(0.0));
                let both = apart.or(together);
                assert!((both.value - expected).abs() < both.error + 1e-11 * expected, "{peers}, {frames}: {both:?} is not {expected}");
            }
        }
    }
}
