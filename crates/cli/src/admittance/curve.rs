//! One curve: the scene as it stands, or with what `--curve` changes.

use cohaptic_answers::{AdmittanceWords, admittance_words};
use cohaptic_scene::Scene;
use cohaptic_stability::{
    Admittance, AdmittanceError, AnalysisError, FrequencyResponse, Limits, LowFrequencyFit, MeanSquare, QUICK_UNKNOWNS, Verdict, Watch, has_chance,
    ideal, mean_square_watched,
};

use crate::arguments::AdmittanceArguments;
use crate::failure::{self, Failure, not_analysed};
use crate::input;
use crate::variants::Variant;

/// A scene of which the admittance is asked for.
pub(super) struct Subject {
    variant: Variant,
    scene: Scene,
    pub(super) admittance: Admittance,
    chance: Option<Result<MeanSquare, AnalysisError>>,
}

/// The admittance in one scene.
pub(super) struct Curve {
    /// In the legend; of the scene as it stands "as it stands".
    pub(super) name: String,
    /// What differs from the scene as it stands.
    pub(super) overrides: Vec<String>,
    pub(super) title: String,
    pub(super) admittance: Admittance,
    pub(super) response: FrequencyResponse,
    pub(super) fit: LowFrequencyFit,
    /// Where links leave something to chance: the second moment of the scene, or why it cannot be followed.
    pub(super) chance: Option<Result<MeanSquare, AnalysisError>>,
    /// What the whole object alone would be felt as: see [`Admittance::object_mass`].
    pub(super) mass: f64,
}

/// The scene as it stands, then that of every `--curve`.
pub(super) fn subjects(arguments: &AdmittanceArguments, watch: &dyn Watch) -> Result<Vec<Subject>, Failure> {
    Variant::all(&arguments.curve, &[])?.into_iter().map(|variant| Subject::new(arguments, variant, watch)).collect()
}

impl Subject {
    fn new(arguments: &AdmittanceArguments, variant: Variant, watch: &dyn Watch) -> Result<Self, Failure> {
        let file = &arguments.scene.scene;
        let overrides = variant.on_top_of(&arguments.scene.overrides.set);
        let scene = input::with(file, |text, file| Scene::parse(text, file, &overrides));
        let scene = scene.map_err(|error| failure::of_variant(error, variant.option, &variant.overrides))?;
        let peer = place_of(&arguments.peer, &scene, &variant)?;
        let ended = || Failure::Interrupted("the analysis was ended before its first point".to_owned());
        let [axis, seen] = [arguments.axis, arguments.seen].map(|axis| axis.map(Into::into));
        let admittance = Admittance::between_watched(&scene, peer, axis, seen, watch).map_err(|error| match error {
            AdmittanceError::Analysis(AnalysisError::Stopped) => ended(),
            error @ (AdmittanceError::NoSuchPeer { .. }
            | AdmittanceError::NoSuchAxis { .. }
            | AdmittanceError::DoesNotTurn { .. }
            | AdmittanceError::Uncoupled { .. }
            | AdmittanceError::Frequency { .. }
            | AdmittanceError::Analysis(_)) => not_analysed(file, &error),
        })?;
        let chance = has_chance(&scene).then(|| mean_square_watched(&scene, &Limits { watch, ..Limits::of_unknowns(QUICK_UNKNOWNS) }));
        if chance == Some(Err(AnalysisError::Stopped)) {
            return Err(ended());
        }
        Ok(Self { variant, scene, admittance, chance })
    }
}

/// A message names this many peers at most.
const MOST_NAMED: usize = 20;

fn place_of(wanted: &str, scene: &Scene, variant: &Variant) -> Result<usize, Failure> {
    scene.peers.iter().position(|peer| peer.name == wanted).ok_or_else(|| {
        let names: Vec<&str> = scene.peers.iter().take(MOST_NAMED).map(|peer| peer.name.as_str()).collect();
        let more = scene.peers.len().saturating_sub(MOST_NAMED);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        let place = if variant.overrides.is_empty() { String::new() } else { format!(" with {} {}", variant.option, variant.name) };
        Failure::Input(format!("--peer {wanted}: no such peer{place}: expected one of {}{more}", names.join(", ")))
    })
}

impl Curve {
    /// At as many of the frequencies as there is time for.
    pub(super) fn of(Subject { variant, scene, admittance, chance }: Subject, frequencies: &[f64], watch: &dyn Watch) -> Result<Self, Failure> {
        let response = admittance.response_watched(frequencies, watch).map_err(|error| Failure::Input(error.to_string()))?;
        let fit = admittance.fit_low_frequency();
        let (name, overrides, mass) = (variant.name, variant.overrides, admittance.object_mass());
        Ok(Self { name, overrides, title: scene.title, admittance, response, fit, chance, mass })
    }

    /// In words: the motion over the push, what the whole object alone is, and the units of both.
    pub(super) fn words(&self) -> AdmittanceWords {
        admittance_words(&self.admittance)
    }

    /// What the whole object alone would be at each frequency \[dB\].
    pub(super) fn ideal_db(&self, hz: f64) -> f64 {
        20.0 * ideal(self.mass, hz).norm().log10()
    }

    /// What the numbers leave out.
    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = self.admittance.notes().to_vec();
        if let Some(chance) = &self.chance {
            notes.push("the admittance is that with every delay its mean and nothing lost".to_owned());
            if let Err(error) = chance {
                notes.push(format!("the verdict is nominal: {error}"));
            }
        }
        notes
    }

    /// What the numbers must not be taken for, if there is a reason to.
    pub(super) fn warning(&self) -> Option<&'static str> {
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
