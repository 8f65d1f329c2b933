use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use cohaptic_harness::explain::explain;
use cohaptic_picture::testing::faults;
use cohaptic_scene::Scene;

use super::*;
use crate::explanation_with_costs;

/// Two peers hold one object, and the first peer pushes it. No force depends on the distance between the copies.
const PUSHED: &str = r#"
    scene        = { duration = "1s", count = 2 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 0.0, damping = 0.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 0.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }

    [[peers]]
    name = "peer1"
    hand = { force = 1.5 }
"#;

/// The scene of docs/stability.md, whose radius is printed there, with a hand to move the object.
const THREE: &str = r#"
    scene        = { duration = "2s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }

    [[peers]]
    name = "peer1"
    hand = { force = 1.5 }
"#;

struct Unwatched;

impl MeasurementWatch for Unwatched {}

fn scene(text: &str, keys: &[&str]) -> Scene {
    let overrides: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
    Scene::parse(text, Path::new("scene.toml"), &overrides).unwrap_or_else(|error| panic!("{keys:?}: {error}"))
}

fn listed(text: &str, keys: &[&str]) -> Vec<Method> {
    let scene = scene(text, keys);
    let variant = |more: &[&str]| {
        let overrides: Vec<String> = keys.iter().chain(more).map(|key| (*key).to_owned()).collect();
        Scene::parse(text, Path::new("scene.toml"), &overrides).map_err(|error| error.to_string())
    };
    methods(&scene, &explain(&scene), &variant)
}

/// Measures with a clock which advances by a millisecond per reading, so that each round takes one millisecond.
fn measured(text: &str, keys: &[&str]) -> Measured {
    let ticks = Cell::new(0);
    let clock = || {
        ticks.set(ticks.get() + 1);
        Duration::from_millis(ticks.get())
    };
    let measured = measure(&listed(text, keys), &clock, &Unwatched);
    assert!(!measured.interrupted);
    measured
}

impl Measured {
    fn of(&self, kind: Kind) -> Vec<&MeasuredMethod> {
        self.methods.iter().filter(|method| method.kind == kind).collect()
    }

    fn errors(&self, kind: Kind) -> Vec<Option<f64>> {
        self.of(kind).iter().map(|method| method.error).collect()
    }
}

#[test]
fn all_engines_and_numbers_of_axes_have_the_same_answer_to_the_bit() {
    for keys in [
        &[][..],
        &["link.jitter=2ms", "link.loss=5%"],
        &["link.rate=1Mbit", "scene.axes=2", "peers.peer1.hand.force=[1.5, 1.0]"],
        &["peer.clock={ drift = \"20ppm\" }", "peer.contact={ push = \"+x\" }"],
    ] {
        // Analyses of drifting clocks take seconds, and are tested below.
        let runs: Vec<Method> = listed(THREE, keys).into_iter().filter(|method| method.kind != Kind::Analysis).collect();
        let measured = measure(&runs, &|| Duration::ZERO, &Unwatched);
        assert_eq!(measured.errors(Kind::Engine), [Some(0.0); 3], "{keys:?}");
        assert_eq!(measured.span, Duration::from_secs(2));
        // With more axes the samples are longer, and a line needs more time to send them.
        if !keys.contains(&"link.rate=1Mbit") {
            assert_eq!(measured.errors(Kind::Axes), [Some(0.0); 2], "{keys:?}");
        }
    }
}

/// The mass M = 0.1 kg + 0.45 kg/2 (a device, and the copy with its share of the object) moves under a constant force F by F·t²/2M. Semi-implicit Euler with
/// steps of h is ahead by F·h·t/2M: after n steps the position is (F/M)·h²·n(n+1)/2. The spring between device and copy is relaxed after a second, and moves
/// the copy by less than a hundredth of that.
#[test]
fn the_error_of_semi_implicit_euler_is_that_of_theory_and_in_proportion_to_the_step() {
    let measured = measured(PUSHED, &[]);
    let errors = measured.errors(Kind::Integrator);
    let [Some(exact), Some(one), Some(four), Some(sixteen), Some(rk4), Some(_)] = errors[..] else { panic!("{errors:?}") };
    assert_eq!(exact.to_bits(), 0.0_f64.to_bits());
    for (error, steps) in [(one, 1.0), (four, 4.0), (sixteen, 16.0)] {
        let theory = 1.5 * (1e-3 / steps) * 1.0 / (2.0 * 0.325);
        assert!((error / theory - 1.0).abs() < 0.01, "{steps} steps: {error} and not {theory}");
    }
    // The method of Runge and Kutta is exact for a constant force, and nearly exact for a force held for a millisecond.
    assert!(rk4 < 1e-9, "{rk4}");
    let reference = |method: &&MeasuredMethod| method.reference.as_deref() == Some("exact propagator");
    assert!(measured.of(Kind::Integrator).iter().all(reference));
}

#[test]
fn half_the_step_is_half_the_error() {
    let error = |steps: u32| {
        let steps = format!("simulation.substeps={steps}");
        let measured = measured(THREE, &["simulation.integrator=semi-implicit-euler", &steps]);
        let own = measured.of(Kind::Integrator).into_iter().find(|method| method.chosen).unwrap().clone();
        own.error.unwrap()
    };
    for steps in [8, 16, 32] {
        let ratio = error(steps) / error(2 * steps);
        assert!((ratio - 2.0).abs() < 0.05, "{steps} steps: {ratio}");
    }
}

#[test]
fn the_methods_of_analysis_agree_within_their_errors() {
    let measured = measured(THREE, &[]);
    let errors = measured.errors(Kind::Analysis);
    let [Some(reduced), Some(determinant), Some(full)] = errors[..] else { panic!("{errors:?}") };
    assert_eq!(full.to_bits(), 0.0_f64.to_bits());
    // Source: docs/stability.md, where the methods agree to 1e-10 on this radius.
    assert!(reduced < 1e-10 && determinant < 1e-10, "{errors:?}");
    let analyses = measured.of(Kind::Analysis);
    assert!(analyses.iter().all(|method| method.note.starts_with("radius 0.89648813856")), "{analyses:?}");
    assert_eq!(analyses.iter().map(|method| method.chosen).collect::<Vec<_>>(), [true, false, false]);
}

/// A watch which calls every analysis late at once.
struct Impatient;

impl MeasurementWatch for Impatient {
    fn is_late(&self) -> bool {
        true
    }
}

/// A frame of drifting clocks is 400 s long and has 50,000 samples.
#[test]
fn analyses_that_are_late_are_listed_without_figures() {
    let methods = listed(THREE, &["peer.clock={ drift = \"20ppm\" }"]);
    let measured = measure(&methods, &|| Duration::ZERO, &Impatient);
    assert!(!measured.interrupted);
    for method in measured.of(Kind::Analysis) {
        assert!(method.cost_ms.is_none() && method.error.is_none() && method.note.contains("too long to be measured here"), "{method:?}");
    }
    assert_eq!(measured.errors(Kind::Engine), [Some(0.0); 3]);
}

/// A round takes 1 ms for two simulated seconds.
#[test]
fn the_cost_is_the_time_of_a_round_by_the_clock_that_was_given() {
    let measured = measured(THREE, &[]);
    for method in &measured.methods {
        let expected = if method.kind == Kind::Analysis { Some(1.0) } else { Some(0.5) };
        assert_eq!(method.cost_ms, expected, "{method:?}");
    }
}

#[test]
fn a_method_that_does_not_apply_is_listed_with_the_reason() {
    let measured =
        measured(THREE, &["scene.axes=3", "peers.peer1.hand.force=[1.5, 0.0, 0.0]", "topology={ kind = \"ring\", neighbours = 2 }", "scene.count=4"]);
    let axes = measured.of(Kind::Axes);
    assert_eq!((axes[1].cost_ms, axes[1].error, axes[1].note.as_str()), (None, None, "the scene has three axes itself"));
    let analyses = measured.of(Kind::Analysis);
    assert!(analyses[0].cost_ms.is_some() && analyses[0].error == Some(0.0), "the first that applies is the reference: {analyses:?}");
    assert_eq!(analyses[0].reference.as_deref(), Some(analyses[0].name.as_str()));
    assert!(analyses[2].cost_ms.is_none() && analyses[2].error.is_none() && analyses[2].note.contains("method full"), "{analyses:?}");
}

#[test]
fn links_in_words_of_netem_can_be_drawn_in_two_ways() {
    assert!(measured(THREE, &["link.jitter=2ms"]).of(Kind::Sampling).is_empty());
    for (profile, chosen) in [("exact", [true, false]), ("kernel-6.6", [false, true])] {
        let link = format!("link={{ netem = \"delay 24ms 2ms\", netem-profile = \"{profile}\" }}");
        let measured = measured(THREE, &[&link]);
        let samplings = measured.of(Kind::Sampling);
        assert_eq!(samplings.iter().map(|method| method.chosen).collect::<Vec<_>>(), chosen);
        for method in samplings {
            assert!(method.cost_ms.is_some() && method.error.is_none() && method.note.contains("by chance"), "{method:?}");
        }
    }
}

#[test]
fn what_is_simulated_follows_from_the_scene_alone_and_is_no_longer_than_the_scene() {
    for (count, duration, span_s) in [(3, "2s", 2.0), (3, "24h", 60.0), (100, "1h", 0.39)] {
        let methods = listed(THREE, &[&format!("scene.count={count}"), &format!("scene.duration={duration}")]);
        let spans: Vec<Duration> = methods
            .iter()
            .filter_map(|method| match &method.work {
                Ok(Work::Run(run)) => Some(run.span()),
                Ok(Work::Analysis { .. }) | Err(_) => None,
            })
            .collect();
        assert!(spans.windows(2).all(|pair| pair[0] == pair[1]));
        // 600,000 events: three peers make 9,000 ticks along three axes and 750 packets per second; a hundred peers make 300,000 and 1,237,500.
        assert!((spans[0].as_secs_f64() / span_s - 1.0).abs() < 0.05, "{count} peers: {spans:?}");
    }
}

#[test]
fn methods_that_take_too_long_are_listed_without_figures() {
    // A thousand peers send 124,875,000 packets per second, hence 2,497,500 in 20 ms.
    let crowd = listed(THREE, &["scene.count=1000"]);
    let refused = |method: &&Method| method.kind == Kind::Engine && method.work.as_ref().is_err_and(|why| why.starts_with("too long"));
    assert_eq!(crowd.iter().filter(refused).count(), 2);
    // With a clock of four seconds per reading, the runs of the second method would begin after eight seconds.
    let ticks = Cell::new(0);
    let clock = || {
        ticks.set(ticks.get() + 4);
        Duration::from_secs(ticks.get())
    };
    let measured = measure(&listed(THREE, &[]), &clock, &Unwatched);
    let costs: Vec<bool> = measured.methods.iter().map(|method| method.cost_ms.is_some()).collect();
    assert_eq!(costs[..3], [true, false, false], "{costs:?}");
    assert!(measured.of(Kind::Axes).iter().all(|method| method.cost_ms.is_none() && method.note.starts_with("not measured")));
    assert!(measured.of(Kind::Analysis).iter().all(|method| method.cost_ms.is_some()));
}

#[test]
fn of_an_object_that_turns_the_row_says_that_turns_are_not_compared() {
    let measured = measured(THREE, &["scene.axes=3", "peers.peer1.hand.force=[1.5, 0.0, 0.0]", "object.inertia=[1e-4, 2e-4, 2e-4]"]);
    assert!(measured.of(Kind::Engine).iter().all(|method| method.error == Some(0.0) && method.note.contains("turns are not compared")));
}

/// A watch which stops the measurement after `most` methods have begun.
struct Until {
    begun: AtomicUsize,
    most: usize,
}

impl MeasurementWatch for Until {
    fn begins(&self, _method: &Method) {
        self.begun.fetch_add(1, Ordering::Relaxed);
    }

    fn stops(&self) -> bool {
        self.begun.load(Ordering::Relaxed) >= self.most
    }
}

#[test]
fn the_watch_ends_the_measurement_and_whole_kinds_are_kept() {
    let methods = listed(THREE, &[]);
    for (most, kept) in [(1, 0), (4, 3), (6, 5), (7, 5), (methods.len(), methods.len() - 3)] {
        let watch = Until { begun: AtomicUsize::new(0), most };
        let measured = measure(&methods, &|| Duration::ZERO, &watch);
        assert!(measured.interrupted, "{most}");
        assert_eq!(measured.methods.len(), kept, "{most}");
    }
}

#[test]
fn the_picture_has_a_panel_for_each_kind_with_an_error_and_zero_at_the_foot() {
    let measured = measured(THREE, &[]);
    let svg = cost_picture("Three users", &measured).svg();
    assert_eq!(faults(&svg), [""; 0]);
    for text in ["engine of runs", "number of axes", "integrator", "analysis of stability", "ms a simulated second", "Three users"] {
        assert!(svg.contains(text), "no {text} in {svg}");
    }
    assert!(!svg.contains("sampling"));
    let nothing = Measured { methods: Vec::new(), ..measured };
    assert_eq!(faults(&cost_picture("Nothing", &nothing).svg()), [""; 0]);
}

#[test]
fn errors_have_three_digits() {
    assert_eq!([None, Some(0.0), Some(1.2345e-7)].map(error_in_words), ["–", "0", "1.23e-7"]);
}

#[test]
fn the_document_has_the_measured_costs_only_where_there_are_any() {
    let scene = scene(THREE, &[]);
    let found = explain(&scene);
    let value = |measured: Option<&Measured>| serde_json::to_value(explanation_with_costs(&scene, &found, measured)).unwrap();
    let without = value(None);
    assert!(without["models"].is_array() && without.get("cost_measured").is_none());
    let measured = measured(THREE, &[]);
    let with = value(Some(&measured));
    assert_eq!(with["models"], without["models"]);
    assert_eq!((with["cost_span_s"].as_f64(), with["interrupted"].as_bool()), (Some(2.0), Some(false)));
    let methods = with["cost_measured"].as_array().unwrap();
    assert_eq!(methods.len(), measured.methods.len());
    assert_eq!((methods[0]["kind"].as_str(), methods[0]["error"].as_f64(), methods[0]["chosen"].as_bool()), (Some("engine"), Some(0.0), Some(true)));
}
