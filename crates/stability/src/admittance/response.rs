//! Points of a frequency response, with the magnitude and the phase of a Bode plot.

use std::f64::consts::TAU;

use num_complex::Complex64;

/// An admittance at one frequency.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AdmittancePoint {
    /// The frequency \[Hz\].
    pub hz: f64,
    /// Velocity over force [m/(N·s)]; infinite or NaN at a pole.
    pub value: Complex64,
    /// Bound of the value's rounding error, to first order [m/(N·s)].
    pub error: f64,
}

impl AdmittancePoint {
    /// Returns the magnitude 20·log10 |v/F|, relative to 1 m/(N·s) \[dB\].
    #[must_use]
    pub fn magnitude_db(&self) -> f64 {
        20.0 * libm::log10(self.value.norm())
    }

    /// Returns the principal phase, above −180 and at most 180 \[degrees\]. Negative if the velocity lags the force.
    #[must_use]
    pub fn phase_deg(&self) -> f64 {
        self.value.arg().to_degrees()
    }
}

/// An admittance at several frequencies, in the order in which the frequencies were given.
#[derive(Clone, PartialEq, Debug)]
pub struct FrequencyResponse {
    /// One point per frequency.
    pub points: Vec<AdmittancePoint>,
}

impl FrequencyResponse {
    /// Returns the magnitude of each point \[dB\]: see [`AdmittancePoint::magnitude_db`].
    #[must_use]
    pub fn magnitudes_db(&self) -> Vec<f64> {
        self.points.iter().map(AdmittancePoint::magnitude_db).collect()
    }

    /// Returns the phase of each point without jumps \[degrees\]. The first phase is principal; each later phase is moved by whole turns to within half a turn
    /// of the last finite phase before. If the points are in order and dense enough, the phases are those of a continuous curve.
    #[must_use]
    pub fn phases_deg(&self) -> Vec<f64> {
        let mut before: Option<f64> = None;
        let unwrapped = |point: &AdmittancePoint| {
            let phase = point.phase_deg();
            let phase = before.map_or(phase, |before| phase + 360.0 * ((before - phase) / 360.0).round());
            if phase.is_finite() {
                before = Some(phase);
            }
            phase
        };
        self.points.iter().map(unwrapped).collect()
    }
}

/// Returns the admittance 1/(jωm) of a free mass \[kg\] at a frequency \[Hz\]. An ideal network would render an undamped object with this admittance.
#[must_use]
pub fn ideal(mass: f64, hz: f64) -> Complex64 {
    Complex64::new(0.0, -1.0 / (TAU * hz * mass))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_have_no_jumps() {
        let turned = |degrees: f64| Complex64::from_polar(0.1, degrees.to_radians());
        let points =
            [-100.0, -170.0, -190.0, -350.0, -380.0, f64::NAN, -400.0].map(|degrees| AdmittancePoint { hz: 1.0, value: turned(degrees), error: 0.0 });
        let phases = FrequencyResponse { points: points.to_vec() }.phases_deg();
        for (phase, expected) in phases.iter().zip([-100.0, -170.0, -190.0, -350.0, -380.0, f64::NAN, -400.0]) {
            assert!((phase - expected).abs() < 1e-9 || expected.is_nan() && phase.is_nan(), "{phases:?}");
        }
        assert!(points.iter().all(|point| point.value.re.is_nan() || (point.magnitude_db() + 20.0).abs() < 1e-12));
    }

    /// 20·log10(1/(2π·0.01·0.45)) = 30.97 dB.
    #[test]
    fn an_ideal_mass_lags_by_a_quarter_of_a_turn() {
        let point = AdmittancePoint { hz: 0.01, value: ideal(0.45, 0.01), error: 0.0 };
        assert!((point.magnitude_db() - 30.97).abs() < 0.005 && (point.phase_deg() + 90.0).abs() < 1e-12, "{point:?}");
    }
}
