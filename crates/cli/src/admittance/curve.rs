//! One curve: the scene as it stands, or with what `--curve` changes.

use cohaptic_answers::admittance::Curve;
use cohaptic_scene::Scene;
use cohaptic_stability::{Admittance, AdmittanceError, AnalysisError, Limits, MeanSquare, QUICK_UNKNOWNS, Watch, has_chance, mean_square_watched};

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

impl Subject {
    /// The curve at as many of the frequencies as there is time for.
    pub(super) fn curve(self, frequencies: &[f64], watch: &dyn Watch) -> Result<Curve, Failure> {
        let Self { variant, scene, admittance, chance } = self;
        let response = admittance.response_watched(frequencies, watch).map_err(|error| Failure::Input(error.to_string()))?;
        let fit = admittance.fit_low_frequency();
        let (name, overrides, mass) = (variant.name, variant.overrides, admittance.object_mass());
        Ok(Curve { name, overrides, title: scene.title, admittance, response, fit, chance, mass })
    }
}
