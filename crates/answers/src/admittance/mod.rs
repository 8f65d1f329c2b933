//! The answers about admittances: document, words and table of the curves.

mod document;
mod page;
mod words;

use cohaptic_stability::{Admittance, AnalysisError, FrequencyResponse, LowFrequencyFit, MeanSquare, Verdict, ideal};
use cohaptic_units::print::csv_field;

use crate::{AdmittanceWords, admittance_words, legend_name};
pub use document::document;
pub use page::html;
pub use words::words;

/// The admittance of a scene or of a variant.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in documents: the overrides, or "as it stands" for the scene as it stands.
    pub name: String,
    /// Name of the coordination law, such as `average-position`.
    pub law: String,
    /// Overrides of the variant, on top of the scene.
    pub overrides: Vec<String>,
    /// Title of the scene.
    pub title: String,
    /// The admittance.
    pub admittance: Admittance,
    /// Values of the admittance at the requested frequencies.
    pub response: FrequencyResponse,
    /// Stiffness, viscosity and inertia felt by a slow hand.
    pub fit: LowFrequencyFit,
    /// Second moment of a scene with random links, or the reason why the second moment cannot be followed; `None` if the links have no random parts.
    pub chance: Option<Result<MeanSquare, AnalysisError>>,
    /// Inertia of the whole object alone: see [`Admittance::object_mass`].
    pub mass: f64,
}

impl Curve {
    /// Returns the name of the curve in a legend: law and overrides.
    #[must_use]
    pub fn legend(&self) -> String {
        legend_name(&self.law, &self.overrides)
    }

    /// Returns the names and units of the admittance.
    fn words(&self) -> AdmittanceWords {
        admittance_words(&self.admittance)
    }

    /// Returns the magnitude of the admittance of the whole object alone at a frequency \[dB\].
    fn ideal_db(&self, hz: f64) -> f64 {
        // 20 dB per power of ten, because the admittance is a ratio of amplitudes.
        20.0 * ideal(self.mass, hz).norm().log10()
    }

    /// Returns notes on simplifications behind the numbers.
    fn notes(&self) -> Vec<String> {
        let mut notes = self.admittance.notes().to_vec();
        if let Some(chance) = &self.chance {
            notes.push("the admittance is that with every delay at its mean and no losses".to_owned());
            if let Err(error) = chance {
                notes.push(format!("the verdict is nominal: {error}"));
            }
        }
        notes
    }

    /// Returns a warning if the scene has no steady state or might have none; `None` for a stable scene.
    fn warning(&self) -> Option<&'static str> {
        match self.admittance.verdict() {
            // A scene can be stable with every delay at the mean, and unstable in the mean square.
            Verdict::Stable => match &self.chance {
                Some(Ok(moment)) if moment.verdict() == Verdict::Unstable => Some(
                    "the scene is unstable in the mean square: these numbers hold for delays at their mean without losses, and the motion around them grows without end",
                ),
                _ => None,
            },
            Verdict::Marginal | Verdict::Overflow => Some(
                "the analysis cannot tell the scene from an unstable one. These numbers can be measured only if the scene has a steady state, which is not known",
            ),
            Verdict::Unstable => {
                Some("the scene is unstable and has no steady state: the formula gives these numbers, and nobody could measure them")
            }
        }
    }
}

/// Returns `admittance.csv`: a row per curve and frequency. Numbers have the fewest digits that read back as the same `f64`.
#[must_use]
pub fn csv(curves: &[Curve]) -> String {
    let mut text = "curve,hz,magnitude_db,phase_deg,ideal_db\n".to_owned();
    for curve in curves {
        let name = csv_field(&curve.name);
        for point in &curve.response.points {
            let (magnitude, phase, ideal) = (point.magnitude_db(), point.phase_deg(), curve.ideal_db(point.hz));
            text.push_str(&format!("{name},{:?},{magnitude:?},{phase:?},{ideal:?}\n", point.hz));
        }
    }
    text
}
