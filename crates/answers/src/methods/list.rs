//! Lists the methods of a scene, without running them.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_harness::explain::Explanation;
use cohaptic_peer::Integrator;
use cohaptic_scene::{Axes, Scene};
use cohaptic_stability::Method as AnalysisMethod;
use cohaptic_units::{Instant, print::Span};

use super::{Kind, Method, Run, Work};

/// Engines of runs: name, option, model, and whether packets are watched. The last engine is the reference.
const ENGINES: [(&str, &str, Model, bool); 3] = [
    ("least that the scene needs", "", Model::Least, false),
    ("the same with packets watched", "--out DIR", Model::Least, true),
    ("everything the program has", "--general", Model::General, false),
];

/// Integrators: name, word, and steps per tick. The exact integrator comes first and is the reference.
const INTEGRATORS: [(&str, &str, u32); 6] = [
    ("exact propagator", "exact", 1),
    ("semi-implicit Euler, 1 step a tick", "semi-implicit-euler", 1),
    ("semi-implicit Euler, 4 steps a tick", "semi-implicit-euler", 4),
    ("semi-implicit Euler, 16 steps a tick", "semi-implicit-euler", 16),
    ("RK4, 1 step a tick", "rk4", 1),
    ("RK4, 4 steps a tick", "rk4", 4),
];

/// Profiles of netem: name and word. The exact profile comes first.
const PROFILES: [(&str, &str); 2] = [("exact laws", "exact"), ("tables and generator of Linux 6.6", "kernel-6.6")];

/// Methods of analysis. The last method shares the least code with the others, and is the reference.
const ANALYSES: [(&str, AnalysisMethod); 3] = [
    ("equal peers together", AnalysisMethod::Reduced),
    ("roots of a determinant", AnalysisMethod::Determinant),
    ("whole state pushed through the simulation", AnalysisMethod::Full),
];

/// Number of events in the simulated part of a scene (ticks along three axes, and packets): up to a tenth of a second of the slowest engine.
const EVENTS: f64 = 6e5;
/// Greatest number of events of a measured run that has an event per tick and packet: some seconds. The set-up of a link counts as two events.
const MOST_EVENTS: f64 = 2e6;
/// Shortest simulated span of a measured run.
const SHORTEST: Duration = Duration::from_millis(20);

/// Returns the methods selectable in the scene, kind by kind.
///
/// `variant` reads the scene again with overrides such as `link.netem-profile=exact`, or returns the reason, in words, why the scene refuses the overrides.
pub fn methods(scene: &Scene, explanation: &Explanation, variant: &dyn Fn(&[&str]) -> Result<Scene, String>) -> Vec<Method> {
    let span = span(scene, explanation);
    #[expect(clippy::cast_precision_loss, reason = "a number of links is far below 2^53")]
    let events = span.as_secs_f64() * events_a_second(explanation) + 2.0 * scene.link_count() as f64;
    let list = List { scene, span, events, variant };
    let mut methods = list.engines();
    methods.extend(list.axes());
    methods.extend(list.integrators());
    methods.extend(list.samplings());
    methods.extend(list.analyses());
    methods
}

/// Returns the simulated span. The span depends on the scene alone, so that the errors are the same on every machine.
fn span(scene: &Scene, explanation: &Explanation) -> Duration {
    let millis = (1e3 * EVENTS / events_a_second(explanation)).clamp(0.0, 1e12);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 0 and at most 1e12")]
    let span = Duration::from_millis(millis as u64);
    scene.duration.min(span.max(SHORTEST))
}

/// Returns the number of events (ticks along three axes, and packets) per simulated second.
fn events_a_second(explanation: &Explanation) -> f64 {
    3.0 * explanation.cost.peer_ticks_per_s + explanation.cost.packets_per_s
}

struct List<'a> {
    scene: &'a Scene,
    span: Duration,
    /// Number of events of a run which has an event per tick and packet.
    events: f64,
    variant: &'a dyn Fn(&[&str]) -> Result<Scene, String>,
}

impl List<'_> {
    fn engines(&self) -> Vec<Method> {
        let last = ENGINES.len() - 1;
        let method = |(place, (name, option, model, watches_packets)): (usize, (&str, &str, Model, bool))| Method {
            kind: Kind::Engine,
            name: name.to_owned(),
            option: option.to_owned(),
            chosen: place == 0,
            is_reference: place == last,
            work: self.run(self.scene.clone(), model, watches_packets),
        };
        ENGINES.into_iter().enumerate().map(method).collect()
    }

    fn axes(&self) -> Vec<Method> {
        let own = self.scene.axes.count();
        let own_name = format!("{own}, as the scene has");
        let method = |name: String, option: &str, chosen, work| Method {
            kind: Kind::Axes,
            name,
            option: option.to_owned(),
            chosen,
            is_reference: chosen,
            work,
        };
        let mut methods = vec![method(own_name, "", true, self.run(self.scene.clone(), Model::Least, false))];
        let work = if own == 3 {
            Err("the scene has three axes itself".to_owned())
        } else {
            self.run(Scene { axes: Axes::Three, ..self.scene.clone() }, Model::Least, false)
        };
        methods.push(method("3".to_owned(), "--set scene.axes=3", false, work));
        methods
    }

    fn integrators(&self) -> Vec<Method> {
        let method = |(name, word, steps): (&str, &str, u32)| {
            let integrator = match word {
                "exact" => Integrator::Exact,
                "rk4" => Integrator::RungeKutta4 { steps },
                _ => Integrator::SemiImplicitEuler { steps },
            };
            let option = match steps {
                1 => format!("--set simulation.integrator={word}"),
                _ => format!("--set simulation.integrator={word} --set simulation.substeps={steps}"),
            };
            let scene = Scene { integrator, ..self.scene.clone() };
            let is_reference = integrator == Integrator::Exact;
            let chosen = integrator == self.scene.integrator;
            Method { kind: Kind::Integrator, name: name.to_owned(), option, chosen, is_reference, work: self.run(scene, Model::Least, false) }
        };
        let mut methods: Vec<Method> = INTEGRATORS.into_iter().map(method).collect();
        if !methods.iter().any(|method| method.chosen) {
            // The scene's own number of steps is not in the list.
            let work = self.run(self.scene.clone(), Model::Least, false);
            let name = "as the scene has".to_owned();
            methods.push(Method { kind: Kind::Integrator, name, option: String::new(), chosen: true, is_reference: false, work });
        }
        methods
    }

    /// Returns the ways to draw the delays of the links. Only links written in words of netem have a choice; all other links follow their exact laws.
    fn samplings(&self) -> Vec<Method> {
        let variants = PROFILES.map(|(name, word)| {
            let key = format!("link.netem-profile={word}");
            ((self.variant)(&[&key]), name, key)
        });
        // A scene whose links are not in words of netem refuses the override.
        if variants.iter().any(|(scene, ..)| scene.is_err()) {
            return Vec::new();
        }
        let method = |(scene, name, key): (Result<Scene, String>, &str, String)| {
            let chosen = scene.as_ref().is_ok_and(|scene| scene.links == self.scene.links);
            let work = scene.and_then(|scene| self.run(scene, Model::Least, false));
            // The two profiles draw different random numbers, so positions differ by chance, and neither is a reference.
            Method { kind: Kind::Sampling, name: name.to_owned(), option: format!("--set {key}"), chosen, is_reference: false, work }
        };
        variants.into_iter().map(method).collect()
    }

    fn analyses(&self) -> Vec<Method> {
        let method = |(name, method): (&str, AnalysisMethod)| Method {
            kind: Kind::Analysis,
            name: name.to_owned(),
            option: format!("--method {}", method.word()),
            chosen: method == AnalysisMethod::default(),
            is_reference: method == AnalysisMethod::Full,
            work: Ok(Work::Analysis { scene: Box::new(self.scene.clone()), method }),
        };
        ANALYSES.into_iter().map(method).collect()
    }

    /// Returns a run of the beginning of a scene, or the reason, in words, why the run is too large.
    fn run(&self, mut scene: Scene, model: Model, watches_packets: bool) -> Result<Work, String> {
        // Every run is watched once, because positions are compared at ticks.
        if let Some(refused) = cohaptic_harness::too_large(&scene, model, true) {
            return Err(refused.reason);
        }
        if self.events > MOST_EVENTS && (model == Model::General || watches_packets) {
            return Err(format!("too long to be measured here: {:.1e} events even in {}", self.events, Span(self.span)));
        }
        scene.duration = self.span;
        // Changes after the span never happen in the run.
        scene.timeline.retain(|change| change.at - Instant::ZERO <= self.span);
        scene.expect = None;
        Ok(Work::Run(Run { scene: Box::new(scene), model, watches_packets, compared_axes: self.scene.axes.count() }))
    }
}
