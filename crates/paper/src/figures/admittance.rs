//! Admittances: the paper's Figure 5, and the viscosity that follows from them.

use cohaptic_stability::{Admittance, AdmittancePoint, Verdict, ideal};
use rayon::prelude::*;

use crate::Watch;
use crate::case::{Case, Strategy};
use crate::{Options, PaperError};

/// The admittance of one peer's device.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Curve {
    pub(crate) case: Case,
    pub(crate) is_stable: bool,
    /// At each frequency [dB].
    pub(crate) decibels: Vec<f64>,
    /// At each frequency [degrees].
    pub(crate) phases: Vec<f64>,
    /// How far it is from that of the ideal mass: |ln(Y/Y0)| at each frequency.
    pub(crate) distances: Vec<f64>,
}

/// The viscosity that a slow hand meets, and what the law says of it.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Fit {
    pub(crate) case: Case,
    pub(crate) is_stable: bool,
    /// [N·s/m]
    pub(crate) viscosity: f64,
    /// b = bH + σ·KT·(Td + (M−1)·Tc/2).
    pub(crate) law: f64,
    /// The same with the part of the damping, δ of scenarios/README.md.
    pub(crate) law_with_damping: f64,
}

#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Responses {
    /// [Hz]
    pub(crate) frequencies: Vec<f64>,
    pub(crate) curves: Vec<Curve>,
    pub(crate) fits: Vec<Fit>,
}

/// The mass of the object [kg].
pub(crate) const MASS: f64 = 0.45;

impl Responses {
    pub(crate) fn compute(options: Options, watch: &dyn Watch) -> Result<Self, PaperError> {
        let count: u32 = if options.quick { 49 } else { 241 };
        // From 0.01 Hz to 40 Hz, as far as the paper's figure goes.
        let frequencies: Vec<f64> = (0..count).map(|k| 0.01 * libm::pow(4000.0, f64::from(k) / f64::from(count - 1))).collect();
        let curves = curves().into_par_iter().map(|case| curve(case, &frequencies)).collect::<Result<_, _>>()?;
        let fits = sweep().into_par_iter().map(|case| if watch.stops() { Err(PaperError::Stopped) } else { fit(case) }).collect::<Result<_, _>>()?;
        watch.one_more();
        Ok(Self { frequencies, curves, fits })
    }

    pub(crate) fn curve(&self, strategy: Strategy, peers: usize, touching: usize) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.case == Case { touching, ..Case::paper(strategy, peers) })
    }

    /// The ideal mass at each frequency [dB].
    pub(crate) fn ideal(&self) -> Vec<f64> {
        self.frequencies.iter().map(|hz| 20.0 * libm::log10(ideal(MASS, *hz).norm())).collect()
    }
}

/// One touches, then all touch; two peers, then three, four and five with either strategy.
fn curves() -> Vec<Case> {
    let mut all = Vec::new();
    for one in [true, false] {
        let mut push = |strategy, peers| all.push(Case { touching: if one { 1 } else { peers }, ..Case::paper(strategy, peers) });
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
    let distance = |point: &AdmittancePoint| {
        let ratio = point.value / ideal(MASS, point.hz);
        libm::hypot(libm::log(ratio.norm()), libm::atan2(ratio.im, ratio.re))
    };
    let distances = response.points.iter().map(distance).collect();
    Ok(Curve { case, is_stable, decibels: response.magnitudes_db(), phases: response.phases_deg(), distances })
}

/// The variations over which the viscosity is looked at: peers, delays, gains, which peers touch.
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

/// b = bH + σ·KT·(Td + (M−1)·Tc/2), σ = N for AP and N(N−1) for PD; bH of each device that touches.
fn fit(case: Case) -> Result<Fit, PaperError> {
    let admittance = Admittance::of(&case.scene()?, 0)?;
    let number = |count: usize| crate::region::share(count, 1);
    let (tick, ticks) = (1e-3, 8.0);
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
