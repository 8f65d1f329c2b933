//! What admittances answer: the document, the words and the table of curves.

mod document;
mod words;

use cohaptic_stability::{Admittance, AnalysisError, FrequencyResponse, LowFrequencyFit, MeanSquare, Verdict, ideal};
use cohaptic_units::print::csv_field;

use crate::{AdmittanceWords, admittance_words};
pub use document::document;
pub use words::words;

/// The admittance in one scene.
#[derive(Clone, Debug)]
pub struct Curve {
    /// In the legend; of the scene as it stands "as it stands".
    pub name: String,
    /// What differs from the scene as it stands.
    pub overrides: Vec<String>,
    /// The title of the scene.
    pub title: String,
    /// The admittance.
    pub admittance: Admittance,
    /// Its values at the frequencies that were asked for.
    pub response: FrequencyResponse,
    /// What a slow hand feels.
    pub fit: LowFrequencyFit,
    /// Where links leave something to chance: the second moment of the scene, or why it cannot be followed.
    pub chance: Option<Result<MeanSquare, AnalysisError>>,
    /// What the whole object alone would be felt as: see [`Admittance::object_mass`].
    pub mass: f64,
}

impl Curve {
    /// Returns the words: the motion over the push, what the whole object alone is, and the units of both.
    fn words(&self) -> AdmittanceWords {
        admittance_words(&self.admittance)
    }

    /// Returns what the whole object alone would be at each frequency \[dB\].
    fn ideal_db(&self, hz: f64) -> f64 {
        20.0 * ideal(self.mass, hz).norm().log10()
    }

    /// Returns what the numbers leave out.
    fn notes(&self) -> Vec<String> {
        let mut notes = self.admittance.notes().to_vec();
        if let Some(chance) = &self.chance {
            notes.push("the admittance is that with every delay its mean and nothing lost".to_owned());
            if let Err(error) = chance {
                notes.push(format!("the verdict is nominal: {error}"));
            }
        }
        notes
    }

    /// Returns what the numbers must not be taken for, if there is a reason to.
    fn warning(&self) -> Option<&'static str> {
        match self.admittance.verdict() {
            Verdict::Stable => match &self.chance {
                Some(Ok(moment)) if moment.verdict() == Verdict::Unstable => Some(
                    "the scene is unstable in the mean square: these numbers are those with nothing left to chance, and around them the motion grows without end",
                ),
                _ => None,
            },
            Verdict::Marginal | Verdict::Overflow => {
                Some("the scene cannot be told from an unstable one: whether it has a steady state is open, and only that could be measured")
            }
            Verdict::Unstable => {
                Some("the scene is unstable and has no steady state: these numbers are what the formula says, and nothing that could be measured")
            }
        }
    }
}

/// Returns `admittance.csv`: one row a curve and frequency. Numbers have the fewest digits that read back the same.
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
