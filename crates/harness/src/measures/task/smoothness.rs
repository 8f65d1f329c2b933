//! Smoothness of the motion of each copy over a task: number of submovements, spectral arc length, and log dimensionless jerk.
//!
//! The speed of the copy is sampled every 10 ms of the task, at the first tick at or after each such instant. Arc length and jerk are those of Balasubramanian,
//! Melendez-Calderon, Roby-Brami & Burdet, *On the analysis of movement smoothness* (2015), with the parameters of the authors' code.

use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::{PERIOD_S, is_due};
use crate::TickRow;

/// Least rise before and least fall after a maximum of the speed that counts as a submovement [m/s].
const SUBMOVEMENT: f64 = 0.005;
/// Highest frequency of the arc length \[Hz\].
const HIGHEST: f64 = 10.0;
/// Least amplitude of the arc length, as a part of the largest amplitude.
const LEAST_AMPLITUDE: f64 = 0.05;

/// Speeds of all copies over the task.
#[derive(Clone, Debug)]
pub(super) struct Smoothness {
    /// Samples of the speed of each copy [m/s]. Eight bytes a sample: an hour of a peer takes 3 MB.
    speeds: Vec<Vec<f64>>,
    start: Instant,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::measures) enum Figure {
    Submovements,
    Sparc,
    Ldlj,
}

impl Smoothness {
    pub(super) fn new(scene: &Scene) -> Self {
        let start = scene.task.as_ref().map_or(Instant::ZERO, |task| task.start);
        Self { speeds: vec![Vec::new(); scene.peers.len()], start }
    }

    pub(super) fn on_tick(&mut self, row: &TickRow<'_>) {
        let speeds = &mut self.speeds[row.peer];
        // A tick longer than the time between samples gives several samples.
        while is_due(self.start, speeds.len(), row.at) {
            speeds.push(libm::sqrt(row.object.velocity.iter().map(|component| component * component).sum()));
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "fewer submovements than 2^53")]
    pub(super) fn value(&self, figure: Figure, peer: usize) -> Option<f64> {
        let speeds = self.speeds.get(peer)?;
        match figure {
            Figure::Submovements => (!speeds.is_empty()).then(|| submovements(speeds) as f64),
            Figure::Sparc => spectral_arc_length(speeds),
            Figure::Ldlj => log_dimensionless_jerk(speeds),
        }
    }
}

/// Returns the number of maxima after a rise and before a fall of at least [`SUBMOVEMENT`].
fn submovements(speeds: &[f64]) -> usize {
    let mut count = 0;
    // Lowest speed since the last counted maximum while the speed may rise, or highest speed since the rise.
    let (mut lowest, mut highest) = (f64::INFINITY, None::<f64>);
    for &speed in speeds {
        match highest {
            None => {
                lowest = lowest.min(speed);
                if speed - lowest >= SUBMOVEMENT {
                    highest = Some(speed);
                }
            }
            Some(high) if high - speed >= SUBMOVEMENT => {
                count += 1;
                (lowest, highest) = (speed, None);
            }
            Some(high) => highest = Some(high.max(speed)),
        }
    }
    count
}

/// Returns −ln(T³/v²·Σ(Δ²v/Δ²)²·Δ) with the largest speed v, T = nΔ and the second differences Δ²v. `None` for fewer than three samples, and for a motion
/// without jerk or speed.
#[expect(clippy::cast_precision_loss, reason = "fewer samples than 2^53")]
fn log_dimensionless_jerk(speeds: &[f64]) -> Option<f64> {
    let largest = speeds.iter().fold(0.0, |largest: f64, speed| largest.max(*speed));
    let duration = speeds.len() as f64 * PERIOD_S;
    let squares: f64 = speeds
        .windows(3)
        .map(|window| {
            let jerk = (window[2] - 2.0 * window[1] + window[0]) / (PERIOD_S * PERIOD_S);
            jerk * jerk
        })
        .sum();
    let jerk = duration * duration * duration / (largest * largest) * squares * PERIOD_S;
    (jerk > 0.0 && jerk.is_finite()).then(|| -libm::log(jerk))
}

/// Returns minus the length of the curve of the normalised amplitude spectrum over the frequency, both scaled to [0, 1]. `None` for a motion without speed, or
/// without a second frequency of enough amplitude.
#[expect(clippy::cast_precision_loss, reason = "fewer frequencies than 2^53")]
fn spectral_arc_length(speeds: &[f64]) -> Option<f64> {
    // Padded with zeros to 16 times the next power of two, so that the curve has enough points.
    let points = speeds.len().checked_next_power_of_two().filter(|points| *points <= MOST_SAMPLES)? << 4;
    let amplitudes = amplitudes(speeds, points);
    let largest = amplitudes.iter().fold(0.0, |largest: f64, amplitude| largest.max(*amplitude));
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let spacing = 1.0 / (PERIOD_S * points as f64);
    let in_band = amplitudes.iter().enumerate().take_while(|(place, _)| *place as f64 * spacing <= HIGHEST).map(|(_, amplitude)| amplitude / largest);
    let in_band: Vec<f64> = in_band.collect();
    let is_enough = |amplitude: &f64| *amplitude >= LEAST_AMPLITUDE;
    let (first, last) = (in_band.iter().position(is_enough)?, in_band.iter().rposition(is_enough)?);
    if first == last {
        return None;
    }
    let step = 1.0 / (last - first) as f64;
    let length = |pair: &[f64]| libm::sqrt(step * step + (pair[1] - pair[0]) * (pair[1] - pair[0]));
    Some(-in_band[first..=last].windows(2).map(length).sum::<f64>())
}

/// Most samples with a spectrum: above two hours of speeds, whose spectrum would take half a gigabyte.
const MOST_SAMPLES: usize = 1 << 20;

/// Returns the magnitudes of the first half of the discrete Fourier transform of `values`, padded with zeros to `points`, a power of two of at least 2.
#[expect(clippy::cast_precision_loss, reason = "fewer points than 2^53")]
fn amplitudes(values: &[f64], points: usize) -> Vec<f64> {
    let bits = points.trailing_zeros();
    // In bit-reversed order, in which the transform of Cooley & Tukey (1965) works in place.
    let mut parts = vec![(0.0_f64, 0.0_f64); points];
    for (place, value) in values.iter().enumerate() {
        parts[place.reverse_bits() >> (usize::BITS - bits)] = (*value, 0.0);
    }
    let mut half = 1;
    while half < points {
        // Rotations come from a table per stage, because a product of rotations would add up rounding errors.
        let turns: Vec<(f64, f64)> = (0..half)
            .map(|place| {
                let (sine, cosine) = libm::sincos(-core::f64::consts::PI * place as f64 / half as f64);
                (cosine, sine)
            })
            .collect();
        for block in parts.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for ((a, b), (cosine, sine)) in low.iter_mut().zip(high).zip(&turns) {
                let turned = (b.0 * cosine - b.1 * sine, b.0 * sine + b.1 * cosine);
                (*a, *b) = ((a.0 + turned.0, a.1 + turned.1), (a.0 - turned.0, a.1 - turned.1));
            }
        }
        half *= 2;
    }
    parts[..points / 2].iter().map(|(real, imaginary)| libm::hypot(*real, *imaginary)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Speed of a motion of minimum jerk over `distance` \[m\] in `duration` \[s\], `at` after its beginning \[s\].
    fn minimum_jerk(distance: f64, duration: f64, at: f64) -> f64 {
        let s = (at / duration).clamp(0.0, 1.0);
        distance / duration * 30.0 * s * s * (1.0 - s) * (1.0 - s)
    }

    fn sampled(count: u32, first: f64, speed: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..count).map(|place| speed(first + f64::from(place) * PERIOD_S)).collect()
    }

    fn close(value: Option<f64>, expected: f64) {
        let value = value.unwrap();
        assert!((value - expected).abs() < 1e-6, "{value}, expected {expected}");
    }

    /// Values of the authors' code: a bell curve, a motion of minimum jerk, and two such motions of 80 and 20 mm with a pause.
    #[test]
    fn smoothness_is_that_of_the_authors_code() {
        let bell = sampled(200, -1.0, |t| libm::exp(-5.0 * t * t));
        close(spectral_arc_length(&bell), -1.414_031_3);
        close(log_dimensionless_jerk(&bell), -5.816_357_4);
        let single = sampled(101, 0.0, |t| minimum_jerk(1.0, 1.0, t));
        close(spectral_arc_length(&single), -1.405_829_3);
        close(log_dimensionless_jerk(&single), -5.301_633_2);
        let pair = sampled(121, 0.0, |t| minimum_jerk(0.08, 0.5, t) + minimum_jerk(0.02, 0.5, t - 0.7));
        close(spectral_arc_length(&pair), -1.724_879_4);
        close(log_dimensionless_jerk(&pair), -7.958_138_5);
        assert_eq!((submovements(&pair), submovements(&single)), (2, 1));
    }

    /// A minimum jerk over a time T has the speed 1.875·D/T at its peak and the squared jerk 720·D²/T⁵ as its integral, so that the jerk without dimension is
    /// 720/1.875² = 204.8. The n samples count as the time n·Δ, which is one Δ too long. The sum of second differences leaves out half a Δ at either end, where
    /// the squared jerk is five times the mean.
    #[test]
    fn many_samples_of_a_minimum_jerk_come_to_the_closed_form() {
        let seconds = 1000.0;
        let dense = sampled(100_001, 0.0, |t| minimum_jerk(1.0, seconds, t));
        let closed_form = -libm::log(204.8);
        let (too_long, left_out) = (3.0 * libm::log1p(PERIOD_S / seconds), libm::log1p(-5.0 * PERIOD_S / seconds));
        let found = log_dimensionless_jerk(&dense).unwrap();
        assert!((found + too_long + left_out - closed_form).abs() < 1e-7, "{found}, expected {closed_form}");
    }

    #[test]
    fn a_ripple_below_the_threshold_is_no_submovement() {
        assert_eq!(submovements(&[0.0, 0.1, 0.096, 0.1, 0.0]), 1);
        assert_eq!(submovements(&[0.0, 0.1, 0.094, 0.1, 0.0]), 2);
        // A rise without a fall is no maximum.
        assert_eq!(submovements(&[0.0, 0.1]), 0);
        assert_eq!(submovements(&[]), 0);
    }

    #[test]
    fn a_motion_without_speed_has_no_smoothness() {
        for still in [vec![], vec![0.0], vec![0.0; 50]] {
            assert_eq!((spectral_arc_length(&still), log_dimensionless_jerk(&still)), (None, None));
        }
        // A straight line of speeds has no jerk.
        assert_eq!(log_dimensionless_jerk(&[0.25, 0.5, 0.75]), None);
    }

    /// Against the sum that defines the transform.
    #[test]
    #[expect(clippy::cast_precision_loss, reason = "a few points")]
    fn amplitudes_are_those_of_the_definition() {
        let values = [0.3, 1.0, -0.25, 0.5, 0.125];
        for (place, amplitude) in amplitudes(&values, 16).into_iter().enumerate() {
            let angle = |at: usize| -core::f64::consts::TAU * (place * at) as f64 / 16.0;
            let part = |of: fn(f64) -> f64| values.iter().enumerate().map(|(at, value)| value * of(angle(at))).sum::<f64>();
            assert!((amplitude - libm::hypot(part(libm::cos), part(libm::sin))).abs() < 1e-15);
        }
    }
}
