//! A curve of `cohaptic admittance`: from the scene file and the overrides of a `--curve` to the response of a peer.
//!
//! [`subjects`] reads and linearises every scene before any curve is computed, so that a wrong argument ends the command early.

use cohaptic_answers::admittance::Curve;
use cohaptic_scene::Scene;
use cohaptic_stability::{Admittance, AdmittanceError, AnalysisError, Limits, MeanSquare, QUICK_UNKNOWNS, Watch, has_chance, mean_square_watched};

use crate::arguments::AdmittanceArguments;
use crate::failure::{self, Failure, not_analysed};
use crate::input;
use crate::variants::Variant;

/// A linearised scene with a peer, ready for the computation of the peer's admittance at any frequency.
pub(super) struct Subject {
    variant: Variant,
    scene: Scene,
    pub(super) admittance: Admittance,
    /// Mean-square analysis of the scene; `None` if nothing in the scene's network is random.
    chance: Option<Result<MeanSquare, AnalysisError>>,
}

/// Returns the subject of the scene without changes, then a subject per `--curve`, in the order of the command line.
pub(super) fn subjects(arguments: &AdmittanceArguments, watch: &dyn Watch) -> Result<Vec<Subject>, Failure> {
    Variant::all(&arguments.curve, &[])?.into_iter().map(|variant| Subject::new(arguments, variant, watch)).collect()
}

impl Subject {
    fn new(arguments: &AdmittanceArguments, variant: Variant, watch: &dyn Watch) -> Result<Self, Failure> {
        let file = &arguments.scene.scene;
        // The overrides of the curve come after `--set`: the last override of a key wins.
        let overrides = variant.on_top_of(&arguments.scene.overrides.set);
        let scene = input::with(file, |text, file| Scene::parse(text, file, &overrides));
        let scene = scene.map_err(|error| failure::of_variant(error, variant.option, &variant.overrides))?;
        let peer = place_of(&arguments.peer, &scene, &variant)?;
        let ended = || Failure::Interrupted("the analysis was stopped before its first point".to_owned());
        let [axis, seen] = [arguments.axis, arguments.seen].map(|axis| axis.map(Into::into));
        // Only a stopped analysis is an interruption. Every other error is a property of the scene, and the message names the scene's file.
        let admittance = Admittance::between_watched(&scene, peer, axis, seen, watch).map_err(|error| match error {
            AdmittanceError::Analysis(AnalysisError::Stopped) => ended(),
            error @ (AdmittanceError::NoSuchPeer { .. }
            | AdmittanceError::NoSuchAxis { .. }
            | AdmittanceError::DoesNotTurn { .. }
            | AdmittanceError::Uncoupled { .. }
            | AdmittanceError::Frequency { .. }
            | AdmittanceError::Analysis(_)
            | _) => not_analysed(file, &error),
        })?;
        let chance = has_chance(&scene).then(|| mean_square_watched(&scene, &Limits { watch, ..Limits::of_unknowns(QUICK_UNKNOWNS) }));
        // Other errors of the mean-square analysis stay in `chance`: the answer reports them beside the curve, which is valid without the analysis.
        if chance == Some(Err(AnalysisError::Stopped)) {
            return Err(ended());
        }
        Ok(Self { variant, scene, admittance, chance })
    }
}

/// Largest number of peers in an error message.
const MOST_NAMED: usize = 20;

/// Returns the index of the peer of `--peer`. The error lists the peers of the scene.
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
    /// Computes the response at `frequencies` \[Hz\], in their order. If `watch` stops the analysis, the curve has the points finished so far.
    pub(super) fn curve(self, frequencies: &[f64], watch: &dyn Watch) -> Result<Curve, Failure> {
        let Self { variant, scene, admittance, chance } = self;
        let response = admittance.response_watched(frequencies, watch).map_err(|error| Failure::Input(error.to_string()))?;
        let fit = admittance.fit_low_frequency();
        let (name, overrides, mass) = (variant.name, variant.overrides, admittance.object_mass());
        let law = scene.coordination.strategy.name().to_owned();
        Ok(Curve { name, law, overrides, title: scene.title, admittance, response, fit, chance, mass })
    }
}
