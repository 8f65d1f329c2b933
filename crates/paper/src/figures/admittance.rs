//! Admittances for the paper's Figure 5, and the viscosities derived from admittances.

use cohaptic_stability::{Admittance, AdmittancePoint, Verdict, ideal};
use rayon::prelude::*;

use crate::Watch;
use crate::case::{Case, Strategy};
use crate::{Options, PaperError};

/// Admittance of the first peer's device. Lists are indexed like [`Responses::frequencies`].
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Curve {
    pub(crate) case: Case,
    pub(crate) is_stable: bool,
    /// Magnitude \[dB re 1 m/(N·s)\].
    pub(crate) decibels: Vec<f64>,
    /// Phase \[degrees\].
    pub(crate) phases: Vec<f64>,
    /// Distance |ln(Y/Y0)| from the admittance Y0 of the ideal mass.
    pub(crate) distances: Vec<f64>,
}

/// Viscosity felt by a slow hand, computed and by the formula.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Fit {
    pub(crate) case: Case,
    pub(crate) is_stable: bool,
    /// Viscosity from the admittance at low frequency \[N·s/m\].
    pub(crate) viscosity: f64,
    /// Viscosity by the formula b = bH + σ·KT·(Td + (M−1)·Tc/2) \[N·s/m\].
    pub(crate) law: f64,
    /// Viscosity by the formula with the part of the damping, δ in scenarios/README.md \[N·s/m\].
    pub(crate) law_with_damping: f64,
}

/// All computed admittances and viscosities.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Responses {
    /// Frequencies of the curves \[Hz\].
    pub(crate) frequencies: Vec<f64>,
    pub(crate) curves: Vec<Curve>,
    pub(crate) fits: Vec<Fit>,
}

/// Mass of the object \[kg\].
pub(crate) const MASS: f64 = 0.45;

impl Responses {
    pub(crate) fn compute(options: Options, watch: &dyn Watch) -> Result<Self, PaperError> {
        let count: u32 = if options.quick { 49 } else { 241 };
        // The range of the paper's figure, 0.01 Hz to 40 Hz, in logarithmic steps.
        let frequencies: Vec<f64> = (0..count).map(|k| 0.01 * libm::pow(4000.0, f64::from(k) / f64::from(count - 1))).collect();
        let curves = curves().into_par_iter().map(|case| curve(case, &frequencies)).collect::<Result<_, _>>()?;
        let fits = sweep().into_par_iter().map(|case| if watch.stops() { Err(PaperError::Stopped) } else { fit(case) }).collect::<Result<_, _>>()?;
        watch.one_more();
        Ok(Self { frequencies, curves, fits })
    }

    pub(crate) fn curve(&self, strategy: Strategy, peers: usize, touching: usize) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.case == Case { touching, ..Case::paper(strategy, peers) })
    }

    /// Returns the magnitude of the ideal mass's admittance at each frequency \[dB\].
    pub(crate) fn ideal(&self) -> Vec<f64> {
        self.frequencies.iter().map(|hz| 20.0 * libm::log10(ideal(MASS, *hz).norm())).collect()
    }
}

/// Returns the cases of the curves, first with one peer touching, then with all: N = 2 with AP, and N = 3, 4 and 5 with both strategies.
fn curves() -> Vec<Case> {
    let mut all = Vec::new();
    for one in [true, false] {
        let mut push = |strategy, peers| all.push(Case { touching: if one { 1 } else { peers }, ..Case::paper(strategy, peers) });
        // With two peers the strategies are the same.
        push(Strategy::Ap, 2);
        for peers in 3..=5 {
            for strategy in Strategy::BOTH {
                push(strategy, peers);
            }
        }
    }
    all
}

fn curve(case: Case, frequencies: &[f64]) -> Result<Curve, PaperError> {
    let admittance = Admittance::of(&case.scene()?, 0)?;
    let response = admittance.response(frequencies)?;
    let is_stable = admittance.verdict() == Verdict::Stable;
    // |ln z| of a complex ratio z has the real part ln|z| and the imaginary part arg z.
    let distance = |point: &AdmittancePoint| {
        let ratio = point.value / ideal(MASS, point.hz);
        libm::hypot(libm::log(ratio.norm()), libm::atan2(ratio.im, ratio.re))
    };
    let distances = response.points.iter().map(distance).collect();
    Ok(Curve { case, is_stable, decibels: response.magnitudes_db(), phases: response.phases_deg(), distances })
}

/// Returns the cases for the viscosity: numbers of peers, delays, gains, and one peer or all peers touching. AP and PD alternate.
fn sweep() -> Vec<Case> {
    let mut all = Vec::new();
    for peers in [2, 3, 4, 5, 8, 16] {
        for delay_us in [8000, 16_000, 24_000] {
            for stiffness in [100.0, 300.0, 1000.0] {
                for touching in [1, peers] {
                    all.extend(Strategy::BOTH.map(|strategy| Case { delay_us, stiffness, touching, ..Case::paper(strategy, peers) }));
                }
            }
        }
    }
    all
}

/// Computes the viscosity and the formula b = bH + σ·KT·(Td + (M−1)·Tc/2), with σ = N for AP and N(N−1) for PD, and bH the damping of all touching devices.
fn fit(case: Case) -> Result<Fit, PaperError> {
    let admittance = Admittance::of(&case.scene()?, 0)?;
    let number = |count: usize| crate::region::share(count, 1);
    let (tick, ticks) = (1e-3, 8.0);
    // Mean age of a received position: the delay, and on average (M−1)/2 ticks since the last update.
    let age = f64::from(case.delay_us) * 1e-6 + 0.5 * (ticks - 1.0) * tick;
    let n = number(case.peers);
    let gain = if case.strategy == Strategy::Ap { 1.0 } else { n - 1.0 };
    let devices = 5.0 * number(case.touching);
    let delta = gain * case.damping * tick * tick / (MASS / n) * (ticks * ticks - 1.0) / 12.0;
    Ok(Fit {
        case,
        is_stable: admittance.verdict() == Verdict::Stable,
        viscosity: admittance.fit_low_frequency().viscosity.value,
        law: devices + n * gain * case.stiffness * age,
        law_with_damping: devices + n * gain * case.stiffness * (age + delta),
    })
}
