//! How far a linear scene may be off when every tick adds a small error: Σⱼ |Aʲ|·d.
//!
//! Where the state errs by at most |d| a tick, entry by entry, and A is the matrix of a tick, e⁺ = A·e + d: so |e| ≤ (I + |A| + |A²| + …)·|d| at all times. The
//! matrix is that of the stability analysis, so the bound is made of what rounding does in one tick and of the scene, and of nothing that the run has shown.

use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::{Matrix, Monodromy, StateKind, monodromy};

use crate::hard::ROUNDING;

/// The gain of a stable scene that samples at every tick, all ticks together.
#[derive(Debug)]
pub(crate) struct Gain {
    monodromy: Monodromy,
    /// The sum of |Aʲ| as far as it was added up.
    sum: Matrix,
    /// The sum of the largest row sums of all Aʲ that were not.
    rest: f64,
}

/// What one tick does to one peer, at most.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PerTick {
    /// The position of the device \[m\].
    pub(crate) device_position: f64,
    /// Its velocity [m/s].
    pub(crate) device_velocity: f64,
    /// The position of the copy \[m\].
    pub(crate) copy_position: f64,
    /// Its velocity [m/s].
    pub(crate) copy_velocity: f64,
}

impl Gain {
    /// That of a scene which repeats every `tick`.
    pub(crate) fn of(scene: &Scene, tick: Duration) -> Self {
        let monodromy = monodromy(scene).unwrap();
        assert_eq!(monodromy.frame, tick, "the scene samples at every tick");
        let size = monodromy.matrix.rows();
        let (mut power, mut sum, mut norms) = (Matrix::identity(size), Matrix::zeros(size, size), 0.0);
        loop {
            let largest = |matrix: &Matrix| (0..size).map(|row| matrix.row(row).iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max);
            let norm = largest(&power);
            if norm < 1e-6 {
                // With n powers added and q = ‖Aⁿ‖, those left are at most (q + q² + …) times the sum of the norms of the first n.
                return Self { monodromy, sum, rest: norms * norm / (1.0 - norm) };
            }
            norms += norm;
            sum = Matrix::from_fn(size, size, |row, column| sum[(row, column)] + power[(row, column)].abs());
            power = power.times(&monodromy.matrix);
        }
    }

    /// The state at the beginning, where no sample was sent yet: the norm of Aⁿ times the largest initial number bounds what is left of it after n ticks.
    pub(crate) fn left_after(&self, ticks: usize) -> f64 {
        let mut power = self.monodromy.matrix.clone();
        let mut all = Matrix::identity(power.rows());
        let mut left = ticks;
        while left > 0 {
            if left % 2 == 1 {
                all = all.times(&power);
            }
            power = power.times(&power);
            left /= 2;
        }
        (0..all.rows()).map(|row| all.row(row).iter().map(|entry| entry.abs()).sum::<f64>()).fold(0.0, f64::max)
    }

    /// What velocities are multiplied by to be lengths \[s\].
    pub(crate) fn time(&self) -> f64 {
        self.monodromy.time
    }

    /// How far the position of each peer's copy, relative to the first one's if nothing ties the scene to the ground, may be off at any time \[m\].
    pub(crate) fn of_errors(&self, per_tick: &[PerTick]) -> Vec<f64> {
        let Monodromy { states, time, relative, error, .. } = &self.monodromy;
        let made: Vec<f64> = states
            .iter()
            .map(|state| {
                let PerTick { device_position, device_velocity, copy_position, copy_velocity } = per_tick[state.peer];
                // What is relative errs with what it is relative to.
                let reference = |axis: usize| relative[state.peer][axis].map_or(0.0, |copy| per_tick[copy].copy_position);
                match state.kind {
                    StateKind::DevicePosition { axis } => device_position + reference(axis),
                    StateKind::DeviceVelocity { .. } => device_velocity * time,
                    StateKind::ObjectPosition { axis } => copy_position + reference(axis),
                    StateKind::ObjectVelocity { .. } => copy_velocity * time,
                    // A sample is what was sent, but relative to what has moved on.
                    StateKind::SamplePosition { axis, .. } => reference(axis),
                    StateKind::SampleVelocity { .. } => 0.0,
                    kind => panic!("a scene with a {kind} is not one of these"),
                }
            })
            .collect();
        // The entries of the matrix are off by `error` in a row: an n-th power by about n times that, which is nothing against the bound.
        assert!(*error < 1e-9);
        let size = made.iter().fold(0.0, |size: f64, entry| size.max(*entry));
        let reached = self.sum.times_column(&made);
        let mut off = vec![0.0; per_tick.len()];
        for (state, reached) in states.iter().zip(&reached) {
            if let StateKind::ObjectPosition { .. } = state.kind {
                off[state.peer] = (reached + self.rest * size) * (1.0 + 1e3 * ROUNDING + 1e-6);
            }
        }
        off
    }
}
