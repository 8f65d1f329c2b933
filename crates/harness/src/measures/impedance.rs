//! Impedance felt by the hand of a probe, at the frequency of its push.
//!
//! Force and velocity of the device, at its ticks in the second half of the scene, are fitted by c₀ + c·cos ωt + s·sin ωt with least squares. The phasors c −
//! j·s give Z = F/v, with the viscosity Re Z and the effective mass Im Z/ω.

use std::cmp::Ordering;
use std::time::Duration;

use cohaptic_peer::{Hand, Signal};
use cohaptic_scene::Measure;
use cohaptic_units::{Instant, RadPerSec};

use super::{Accumulator, Asked, Rows};
use crate::TickRow;

/// Impedance of the probe; `None` without a probe.
#[derive(Clone, Debug)]
pub(super) struct Impedance(Option<Probe>);

#[derive(Clone, Debug)]
struct Probe {
    /// Index of the probe's peer.
    peer: usize,
    /// Instant at which the second half of the scene begins.
    from: Instant,
    /// Angular frequency of the push \[rad/s\].
    omega: f64,
    /// Phase of the push \[rad\].
    phase: f64,
    /// Amplitude over its square \[1/N\], by component. The scalar product with a velocity is the velocity along the force, for a force of amplitude 1.
    direction: [f64; 3],
    fit: Fit,
}

impl Probe {
    fn new(asked: &Asked<'_>) -> Option<Self> {
        let peer = asked.settings.probe?;
        let Some(Hand::Force(Signal::Sine { amplitude, frequency, phase })) = &asked.scene.peers[peer].hand else { return None };
        // The velocity along the push is v·a/|a|, and the push has the amplitude |a|: division by |a|² gives both at once.
        let square: f64 = amplitude.iter().map(|amplitude| amplitude * amplitude).sum();
        let direction = amplitude.map(|amplitude| amplitude / square);
        // The first half of the scene lets the transient at the start of the push decay.
        let from = Instant::ZERO.saturating_add(asked.scene.duration / 2);
        Some(Self { peer, from, omega: RadPerSec::from(*frequency).0, phase: *phase, direction, fit: Fit::default() })
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Viscosity,
    Mass,
}

impl Accumulator for Impedance {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] = &[(Measure::Viscosity, Figure::Viscosity), (Measure::EffectiveMass, Figure::Mass)];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        Self(Probe::new(asked))
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        // Earlier ticks and other peers say nothing about the steady response of the probe.
        let Some(probe) = self.0.as_mut().filter(|probe| probe.peer == row.peer && probe.from <= row.at) else { return };
        let angle = probe.omega * row.at.as_secs_f64();
        let velocity = row.device.velocity.iter().zip(probe.direction).map(|(velocity, direction)| velocity * direction).sum();
        probe.fit.add([1.0, libm::cos(angle), libm::sin(angle)], [libm::sin(angle + probe.phase), velocity]);
    }

    fn value(&self, figure: Figure, _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        let probe = self.0.as_ref()?;
        let [[_, fc, fs], [_, vc, vs]] = probe.fit.solve()?;
        // Z = (fc − j·fs)/(vc − j·vs), expanded by the conjugate of the denominator.
        let square = vc * vc + vs * vs;
        Some(match figure {
            Figure::Viscosity => (fc * vc + fs * vs) / square,
            Figure::Mass => (fc * vs - fs * vc) / square / probe.omega,
        })
    }
}

/// Least-squares fit of two signals by three regressors.
#[derive(Clone, Default, Debug)]
struct Fit {
    /// Products of the regressors, summed: the matrix of the normal equations.
    normal: [[f64; 3]; 3],
    /// Products of each signal with the regressors, summed: the right-hand sides.
    right: [[f64; 3]; 2],
}

/// Ratio of a pivot to the sum of squares of its column below which regressors count as dependent: half of the scene is a small part of a period, or ticks are
/// multiples of half a period.
const DEPENDENT: f64 = 1e-9;

impl Fit {
    fn add(&mut self, regressors: [f64; 3], signals: [f64; 2]) {
        // Normal equations of least squares: Σ r·rᵀ on the left and Σ r·s on the right, summed tick by tick.
        for (row, one) in self.normal.iter_mut().zip(regressors) {
            for (sum, other) in row.iter_mut().zip(regressors) {
                *sum += one * other;
            }
        }
        for (sums, signal) in self.right.iter_mut().zip(signals) {
            for (sum, regressor) in sums.iter_mut().zip(regressors) {
                *sum += regressor * signal;
            }
        }
    }

    /// Returns the coefficients of both signals, by Gaussian elimination; `None` if they are not determined.
    fn solve(&self) -> Option<[[f64; 3]; 2]> {
        let (mut matrix, mut right) = (self.normal, self.right);
        for pivot in 0..3 {
            let row = matrix[pivot];
            // Anything but greater: without ticks both sides are zero, and a NaN must be refused too.
            if row[pivot].partial_cmp(&(DEPENDENT * self.normal[pivot][pivot])) != Some(Ordering::Greater) {
                return None;
            }
            for below in pivot + 1..3 {
                let factor = matrix[below][pivot] / row[pivot];
                for (entry, above) in matrix[below].iter_mut().zip(row) {
                    *entry -= factor * above;
                }
                for side in &mut right {
                    side[below] -= factor * side[pivot];
                }
            }
        }
        Some(right.map(|side| {
            // Back substitution from the last row.
            let last = side[2] / matrix[2][2];
            let middle = (side[1] - matrix[1][2] * last) / matrix[1][1];
            [(side[0] - matrix[0][1] * middle - matrix[0][2] * last) / matrix[0][0], middle, last]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fits signals made of the regressors, over half a period and over many periods.
    #[test]
    fn a_combination_of_the_regressors_is_found_again() {
        for (omega, ticks) in [(3.0, 1000_u32), (7.0, 500), (40.0, 3000)] {
            let mut fit = Fit::default();
            for tick in 0..ticks {
                let angle = omega * 1e-3 * f64::from(tick);
                let (c, s) = (libm::cos(angle), libm::sin(angle));
                fit.add([1.0, c, s], [2.0 - 3.0 * c + 0.5 * s, 1e-3 * c]);
            }
            let found = fit.solve().unwrap();
            for (found, expected) in found.iter().flatten().zip([2.0, -3.0, 0.5, 0.0, 1e-3, 0.0]) {
                assert!((found - expected).abs() < 1e-11, "{found} for {expected} at {omega} rad/s");
            }
        }
    }

    #[test]
    fn what_is_not_determined_has_no_value() {
        assert!(Fit::default().solve().is_none());
        // Ticks at multiples of half a period, at which the sine is zero.
        let mut fit = Fit::default();
        (0..100).for_each(|tick| fit.add([1.0, if tick % 2 == 0 { 1.0 } else { -1.0 }, 1e-13], [1.0, 1.0]));
        assert!(fit.solve().is_none());
    }
}
