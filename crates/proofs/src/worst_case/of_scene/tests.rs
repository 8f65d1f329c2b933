//! The worst case against the nominal analysis, against every short pattern, and against patterns that a scene's own links produce.

use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Combination, Structure, pairs, pieces};
use cohaptic_stability::{AnalysisError, Matrix, Method, PartKind, analyse, radius};

use super::channel::Channel;
use super::prepared::{Prepared, structure};
use super::*;
use crate::worst_case::automaton::Automaton;
use crate::worst_case::verified::Certificate;

const PAPER: &str = r#"
    scene        = { duration = "1s", count = 2 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "8ms" }
"#;

fn scene_of(text: &str, overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(text, "worst.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn scene(overrides: &[&str]) -> Scene {
    scene_of(PAPER, overrides)
}

fn patterns(losses_in_a_row: u32, delay: Option<(u64, u64)>, links: Links) -> Patterns {
    let delay = delay.map(|(least, most)| (Duration::from_millis(least), Duration::from_millis(most)));
    Patterns { losses_in_a_row, delay, links }
}

/// Returns the contacts of a scene that has a single combination of contacts.
fn linear(scene: &Scene) -> Combination {
    pairs(&pieces(scene, "the worst case").unwrap(), &mut false).unwrap().swap_remove(0).1
}

/// Returns the switched systems of a linear scene: of classes of equal peers, or of each peer if `reduced` is `false`.
fn prepared(scene: &Scene, patterns: &Patterns, reduced: bool) -> Prepared {
    let network = patterns.network(scene).unwrap();
    let contacts = linear(scene).contacts;
    let structure =
        if reduced { structure(scene, &network, &contacts, patterns).unwrap() } else { Structure::of_each(scene, &network, &contacts).unwrap() };
    Prepared::of(scene, &network, &structure, patterns).unwrap()
}

/// The largest radius of the parts for a sequence of symbols, in order of time.
fn radius_along(prepared: &Prepared, sequence: &[usize]) -> f64 {
    let of = |automaton: &Automaton| {
        let start = Matrix::identity(automaton.size());
        radius(&sequence.iter().fold(start, |product, symbol| automaton.matrices()[*symbol].times(&product)))
    };
    prepared.searches.iter().map(|search| of(&search.automaton)).chain(prepared.devices.iter().map(|device| device.radius.value)).fold(0.0, f64::max)
}

const VARIANTS: [&[&str]; 11] = [
    &[],
    &["link.delay=0s"],
    &["link.delay=3ms"],
    &["link.delay=24ms", "scene.count=3"],
    &["link.delay=21ms", "coordination.strategy=proportional-derivative"],
    &["scene.count=3", "peers=[{ name = \"peer1\", phase = 3 }, { name = \"peer2\", contact = \"none\" }]", "link.delay=20ms"],
    &["peer.compute-delay=1", "link.delay=13ms"],
    &["peers=[{ name = \"peer1\", clock = { offset = \"300us\" } }]", "link.delay=12345us"],
    &["peers=[{ name = \"peer1\", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 }, follows = { position = 0.0 } } }]"],
    &["coordination.strategy=local-lag", "coordination.local-lag.lag=5ms", "coordination.stiffness=300"],
    &["coordination.strategy=local-lag", "coordination.local-lag.lag=19ms", "coordination.stiffness=100", "peer.contact=none"],
];

#[test]
fn with_nothing_to_choose_it_is_the_nominal_radius() {
    for overrides in VARIANTS {
        let scene = scene(overrides);
        let nominal = analyse(&scene, Method::Reduced).unwrap();
        for links in [Links::Together, Links::Each] {
            let found = worst_case(&scene, &patterns(0, None, links), &Effort { accuracy: 1e-6, products: 10_000 }).unwrap();
            let close = (found.lower - nominal.radius.value).abs() < 1e-9 && found.upper - found.lower <= 1e-6;
            assert!(close && found.notes == nominal.notes, "{overrides:?}: {} {found:?}", nominal.radius.value);
            assert_eq!(found.worst().sequence.is_empty(), found.worst().period == 0);
        }
        // Each peer by itself, with every sample received.
        let each = prepared(&scene, &patterns(1, None, Links::Each), true);
        assert!((radius_along(&each, &[0]) - nominal.radius.value).abs() < 1e-9, "{overrides:?}");
    }
}

/// A link that loses every third of its samples, as the nominal analysis has it: three frames in one matrix, without any held sample among the states.
#[test]
fn a_pattern_of_a_scene_has_the_radius_of_that_sequence() {
    for overrides in VARIANTS {
        let chosen = prepared(&scene(overrides), &patterns(1, None, Links::Together), true);
        let all: Vec<&str> = overrides.iter().copied().chain(["link.loss={ packets = [0], every = 3 }"]).collect();
        let nominal = analyse(&scene(&all), Method::Reduced).unwrap();
        let found = radius_along(&chosen, &[0, 0, 1]);
        assert!((found - nominal.radius.value).abs() < 1e-8, "{overrides:?}: {found} {}", nominal.radius.value);
    }
    // One direction alone: the first channel is from the first peer's link, or the other.
    let one = "link = { delay = \"24ms\" }\nlinks = [{ from = \"peer1\", to = \"peer2\", delay = \"24ms\", loss = { packets = [1], every = 2 } }]";
    let nominal = analyse(&scene_of(&PAPER.replace("link         = { delay = \"8ms\" }", one), &[]), Method::Reduced).unwrap();
    let each = prepared(&scene(&["link.delay=24ms"]), &patterns(1, None, Links::Each), true);
    let place = each.channels.iter().position(|channel| (channel.links[0].from, channel.links[0].to) == (0, 1)).unwrap();
    let found = radius_along(&each, &[0, if place == 0 { 2 } else { 1 }]);
    assert!((found - nominal.radius.value).abs() < 1e-8, "{found} {}", nominal.radius.value);
}

/// Returns the symbols of every closed walk of at most `longest` steps that begins with its smallest symbol.
fn cycles(automaton: &Automaton, longest: usize) -> Vec<Vec<usize>> {
    fn follow(automaton: &Automaton, (root, node): (usize, usize), path: &mut Vec<usize>, longest: usize, found: &mut Vec<Vec<usize>>) {
        if node == root && !path.is_empty() {
            found.push(path.clone());
        }
        if path.len() < longest {
            for edge in automaton.pattern().edges().iter().filter(|edge| edge.from == node) {
                if path.first().is_some_and(|first| edge.symbol < *first) {
                    continue;
                }
                path.push(edge.symbol);
                follow(automaton, (root, edge.to), path, longest, found);
                path.pop();
            }
        }
    }
    let mut found = Vec::new();
    for root in 0..automaton.pattern().nodes() {
        follow(automaton, (root, root), &mut Vec::new(), longest, &mut found);
    }
    found.sort_unstable();
    found.dedup();
    found
}

#[test]
fn every_pattern_of_up_to_eight_frames_is_between_the_bounds() {
    let cases = [
        (patterns(2, None, Links::Together), 8),
        (patterns(1, None, Links::Each), 8),
        (patterns(1, Some((6, 9)), Links::Together), 4),
        (patterns(0, Some((7, 8)), Links::Each), 8),
    ];
    for (patterns, longest) in cases {
        let scene = scene(&[]);
        let found = worst_case(&scene, &patterns, &Effort { accuracy: 1e-3, products: 20_000 }).unwrap();
        let prepared = prepared(&scene, &patterns, true);
        let cycles = cycles(&prepared.searches[0].automaton, longest);
        assert!(cycles.len() > 40, "{}", cycles.len());
        let length = |cycle: &Vec<usize>| f64::from(u32::try_from(cycle.len()).unwrap());
        let fastest = cycles.iter().map(|cycle| radius_along(&prepared, cycle).powf(1.0 / length(cycle))).fold(0.0, f64::max);
        assert!(fastest <= found.upper + 1e-9, "{fastest} {found:?}");
        assert!(found.lower <= fastest + 1e-9 || found.worst().period > longest, "{fastest} {found:?}");
        // Patterns that short come near the worst.
        assert!(fastest > found.lower - 0.02, "{fastest} {found:?}");
    }
}

/// All samples late by the same: the nominal radius at that delay, also where delays reach into the next frame.
#[test]
fn a_delay_that_does_not_change_has_the_nominal_radius() {
    for (links, count, least, most) in [(Links::Together, 3, 20, 26), (Links::Each, 2, 23, 25)] {
        let count = format!("scene.count={count}");
        let prepared = prepared(&scene(&[&count]), &patterns(1, Some((least, most)), links), true);
        let pattern = prepared.searches[0].automaton.pattern();
        let loops = pattern.edges().iter().filter(|edge| edge.from == edge.to);
        let radii: Vec<f64> = loops.map(|edge| radius_along(&prepared, &[edge.symbol])).collect();
        let link = prepared.channels[0].links[0];
        assert_eq!((link.age, link.oldest), (2, 3));
        for delay in least..=most {
            let nominal = analyse(&scene(&[&count, &format!("link.delay={delay}ms")]), Method::Reduced).unwrap().radius.value;
            assert!(radii.iter().any(|own| (own - nominal).abs() < 1e-9), "{delay}: {nominal} {radii:?}");
        }
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn losing_together_the_parts_are_the_whole() {
    for overrides in
        [&["scene.count=3"][..], &["scene.count=3", "link.delay=24ms"], &["scene.count=3", "peers=[{ name = \"peer1\", contact = \"none\" }]"]]
    {
        let scene = scene(overrides);
        let patterns = patterns(2, None, Links::Together);
        let (parts, whole) = (prepared(&scene, &patterns, true), prepared(&scene, &patterns, false));
        assert!(parts.searches.len() == 2 && whole.searches.len() == 1);
        for cycle in cycles(&parts.searches[0].automaton, 6) {
            let (one, other) = (radius_along(&parts, &cycle), radius_along(&whole, &cycle));
            assert!((one - other).abs() < 1e-8 * one.max(1.0), "{overrides:?} {cycle:?}: {one} {other}");
        }
        let bounds = worst_case(&scene, &patterns, &Effort::default()).unwrap();
        let automaton = &whole.searches[0].automaton;
        let direct = automaton.worst_case(&Effort { accuracy: 1e-3, products: 3_000 });
        assert!(direct.lower <= bounds.upper && bounds.lower <= direct.upper, "{bounds:?} {direct:?}");
        // What was found is proved, whoever found it.
        let certificate = direct.certificate.unwrap();
        assert_eq!(Certificate::new(automaton, certificate.rate(), certificate.shapes().to_vec()).as_ref(), Ok(&certificate));
        assert!(bounds.lower <= certificate.rate() && bounds.certificate.is_some_and(|rate| rate >= bounds.lower && bounds.upper <= rate));
    }
}

/// The parts have the same size at any number of equal peers, and are the whole.
#[test]
fn losing_together_any_number_of_equal_peers_costs_the_same() {
    let patterns = patterns(2, None, Links::Together);
    let sizes = |count: usize| {
        let parts = prepared(&scene(&[&format!("scene.count={count}"), "coordination.stiffness=300"]), &patterns, true);
        parts.searches.iter().map(|search| (search.automaton.size(), search.automaton.matrices().len())).collect::<Vec<_>>()
    };
    assert!(sizes(3).len() == 2 && [10, 50, 200].iter().all(|count| sizes(*count) == sizes(3)));
    let ten = scene(&["scene.count=10", "coordination.stiffness=300"]);
    let (parts, whole) = (prepared(&ten, &patterns, true), prepared(&ten, &patterns, false));
    for cycle in [&[0, 1][..], &[0, 0, 1], &[0, 1, 1]] {
        let (one, other) = (radius_along(&parts, cycle), radius_along(&whole, cycle));
        assert!((one - other).abs() < 1e-8 * one.max(1.0), "{cycle:?}: {one} {other}");
    }
    let many = worst_case(&scene(&["scene.count=200", "coordination.stiffness=300"]), &patterns, &Effort::default()).unwrap();
    assert!(many.verdict() != WorstVerdict::Undecided && many.upper - many.lower < 0.01 * many.lower, "{many:?}");
}

/// For three peers, each kind of frame by itself says how near the bound for equal peers is.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn each_link_on_its_own_is_bounded_as_by_all_kinds_of_frame() {
    for (overrides, patterns, most) in [
        (&["scene.count=3"][..], patterns(1, None, Links::Each), 0.06),
        (&["scene.count=3", "coordination.stiffness=300", "link.delay=3ms"], patterns(1, None, Links::Each), 0.08),
        (&["scene.count=3", "coordination.stiffness=300"], patterns(0, Some((7, 8)), Links::Each), 0.08),
    ] {
        let scene = scene(overrides);
        let effort = Effort { accuracy: 1e-2, products: 2_000 };
        let exact = worst_case(&scene, &patterns, &effort).unwrap();
        let network = patterns.network(&scene).unwrap();
        let combination = linear(&scene);
        let bounds = each::bounds(&scene, &network, &combination, &patterns, (&effort, &Unwatched)).unwrap().unwrap();
        let bound = &bounds[0];
        assert!(bound.lower <= exact.upper && exact.lower <= bound.upper, "{overrides:?}: {bound:?} {exact:?}");
        assert!(bound.upper < exact.lower + most && bound.upper < 1.0, "{overrides:?}: {bound:?} {exact:?}");
    }
}

/// The bound for more than three peers costs as much for any number of them.
#[test]
fn each_link_on_its_own_is_bounded_at_any_number_of_equal_peers() {
    for (overrides, patterns) in [
        (&["scene.count=10", "coordination.stiffness=300"][..], patterns(2, None, Links::Each)),
        (&["scene.count=50", "coordination.stiffness=100"], patterns(1, None, Links::Each)),
        (&["scene.count=200", "object.split-mass=false", "coordination.stiffness=300"], patterns(1, None, Links::Each)),
        (&["scene.count=5", "coordination.stiffness=300"], patterns(0, Some((6, 8)), Links::Each)),
    ] {
        let scene = scene(overrides);
        let found = worst_case(&scene, &patterns, &Effort::default()).unwrap();
        let together = worst_case(&scene, &Patterns { links: Links::Together, ..patterns }, &Effort::default()).unwrap();
        assert_eq!((found.verdict(), found.lower.to_bits()), (WorstVerdict::Stable, together.lower.to_bits()), "{overrides:?}: {found:?}");
        assert!(found.lower < found.upper && found.notes.last().is_some_and(|note| note.ends_with("stay open")), "{found:?}");
    }
}

/// The second moment under losses of all links together, each frame by itself with that probability: the radius of the mean of A ⊗ A.
fn mean_square(prepared: &Prepared, chance: f64) -> f64 {
    let of = |automaton: &Automaton| {
        let (size, [received, lost]) = (automaton.size(), [0, 1].map(|symbol: usize| &automaton.matrices()[symbol]));
        let pair = |of: &Matrix, row: usize, column: usize| of[(row / size, column / size)] * of[(row % size, column % size)];
        let mean = |row, column| (1.0 - chance) * pair(received, row, column) + chance * pair(lost, row, column);
        radius(&Matrix::from_fn(size * size, size * size, mean))
    };
    prepared.searches.iter().map(|search| of(&search.automaton)).fold(0.0, f64::max)
}

/// At 24 ms one sample in twenty may be lost for ever, in the mean square; four of seven, in a row and over and over, may not.
#[test]
fn a_loss_can_destabilise_a_scene_that_is_stable_in_the_mean_square() {
    let scene = scene(&["scene.count=3", "link.delay=24ms"]);
    let patterns = patterns(5, None, Links::Together);
    let prepared = prepared(&scene, &patterns, true);
    let nominal = analyse(&scene, Method::Reduced).unwrap().radius.value;
    assert!((mean_square(&prepared, 0.0) - nominal * nominal).abs() < 1e-9);
    assert!(mean_square(&prepared, 0.05) < 1.0);
    let found = worst_case(&scene, &patterns, &Effort::default()).unwrap();
    assert_eq!((found.verdict(), found.worst().kind), (WorstVerdict::Unstable, PartKind::Apart { peer: 0 }));
    assert_eq!(found.worst().sequence, "3 times received, 4 times lost, and again");
}

/// Different peers and links make parts of two dozen states. The bounds of such parts meet within few products, too.
#[test]
fn bounds_of_shipped_scenes_of_many_states_meet() {
    for (text, most) in [
        (include_str!("../../../../../scenarios/network/phases.toml"), 10_000),
        (include_str!("../../../../../scenarios/counterexamples/stability-tests.toml"), 10_000),
        (include_str!("../../../../../scenarios/network/shared-access-line.toml"), 1_000),
    ] {
        let scene = Scene::parse(text, "shipped.toml".as_ref(), &[]).unwrap();
        let found = worst_case(&scene, &patterns(1, None, Links::Together), &Effort::default()).unwrap();
        assert!(!found.is_open() && found.upper < 1.002 * found.lower && found.products() < most, "{} {found:?}", scene.title);
    }
}

/// The paper's stiffest setting is unstable at 24 ms if every sample arrives, and stable if every second or only every third one does: what is not heard
/// cannot be answered too late. That helps against no pattern that may also lose nothing.
#[test]
fn a_loss_can_stabilise_a_scene_that_is_unstable() {
    let scene = scene(&["scene.count=3", "link.delay=24ms", "coordination.stiffness=2100"]);
    let patterns = patterns(2, None, Links::Together);
    let prepared = prepared(&scene, &patterns, true);
    assert!(analyse(&scene, Method::Reduced).unwrap().radius.value > 1.004);
    assert!(radius_along(&prepared, &[0, 1]) < 0.983 && radius_along(&prepared, &[0, 1, 1]) < 0.947);
    let found = worst_case(&scene, &patterns, &Effort::default()).unwrap();
    assert!(found.verdict() == WorstVerdict::Unstable && found.lower > 1.016, "{found:?}");
}

#[test]
fn what_cannot_be_looked_at_is_refused() {
    let refused = |overrides: &[&str], patterns: Patterns| worst_case(&scene(overrides), &patterns, &Effort::default()).unwrap_err();
    let millis = Duration::from_millis;
    assert_eq!(refused(&[], patterns(0, Some((9, 8)), Links::Each)), SceneWorstCaseError::Delays { least: millis(9), most: millis(8) });
    let error = refused(&[], patterns(0, Some((1, 9)), Links::Together));
    assert_eq!(error, SceneWorstCaseError::Overtaking { least: millis(1), most: millis(9), update: millis(8) });
    assert_eq!(
        error.to_string(),
        "delays from 1ms to 9ms with a sample every 8ms: expected an interval shorter than the time between two samples, so that no sample overtakes another"
    );
    let drift = refused(&["peers=[{ name = \"peer1\", clock = { drift = 0.1 } }]"], patterns(1, None, Links::Together));
    assert!(matches!(drift, SceneWorstCaseError::Frame { .. }), "{drift}");
    let pattern = refused(&["link.loss={ packets = [0], every = 3 }"], patterns(1, None, Links::Together));
    assert_eq!(pattern, SceneWorstCaseError::Pattern { from: "peer2".to_owned(), to: "peer1".to_owned() });
    let unlike = "peers=[{ name = \"peer1\", contact = \"none\" }]";
    let many = refused(&["scene.count=4", unlike], patterns(1, None, Links::Each));
    assert_eq!(many, SceneWorstCaseError::TooMany { links: 12, symbols: Some(4096), most: 64 });
    let beyond = refused(&["scene.count=1000", unlike], patterns(1, None, Links::Each));
    assert!(beyond.to_string().starts_with("more than 10^38 kinds of frame with 999000 links"), "{beyond}");
    // Nine ticks to arrive at, on each of two links.
    let wide = refused(&[], patterns(1, Some((0, 7)), Links::Each));
    assert_eq!(wide, SceneWorstCaseError::TooMany { links: 2, symbols: Some(81), most: 64 });
    let long = refused(&["scene.count=3", unlike], patterns(2, None, Links::Each));
    assert_eq!(long, SceneWorstCaseError::TooLarge { edges: 15_625, nodes: 729, dimension: 18 });
    assert!(matches!(refused(&[], patterns(u32::MAX, None, Links::Together)), SceneWorstCaseError::Automaton(_)));
    let queue = refused(&["link.rate=1kbit", "link.queue={ limit = \"unlimited\" }"], patterns(1, None, Links::Together));
    assert!(matches!(queue, SceneWorstCaseError::Analysis(AnalysisError::Overloaded { .. })), "{queue}");
    // With an interval of delays it does not matter what the links do.
    let replaced = scene(&["link.loss={ packets = [0], every = 3 }"]);
    let found = worst_case(&replaced, &patterns(1, Some((8, 8)), Links::Together), &Effort::default()).unwrap();
    assert_eq!(found.lower.to_bits(), worst_case(&scene(&[]), &patterns(1, None, Links::Together), &Effort::default()).unwrap().lower.to_bits());
    assert_eq!(found.notes, ["what the links of the scene do is replaced by the interval of delays"]);
}

#[test]
fn a_pattern_is_said_in_words() {
    let said = |patterns: Patterns, cycle: &[usize]| {
        let prepared = prepared(&scene(&[]), &patterns, true);
        let name = |channel: &Channel| format!("{} to {}", channel.links[0].from, channel.links[0].to);
        words::sequence(cycle, &prepared.channels, patterns.delay.map(|(least, _)| least), name)
    };
    let together = patterns(2, None, Links::Together);
    assert_eq!(said(together, &[0]), "received, and again");
    assert_eq!(said(together, &[1, 0, 1]), "received, lost, lost, and again");
    assert_eq!(said(together, &[1, 0, 0, 0]), "3 times received, lost, and again");
    assert_eq!(said(together, &[]), "");
    let each = patterns(1, None, Links::Each);
    assert_eq!(said(each, &[3, 0, 1, 2]), "all received, lost 0 to 1, lost 1 to 0, all lost, and again");
    let delayed = patterns(1, Some((6, 7)), Links::Together);
    assert_eq!(said(delayed, &[0, 1, 2]), "received after 6ms, received after 7ms, lost, and again");
}
