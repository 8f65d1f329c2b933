//! Proofs of waves compared with single scenes, whose matrices come from real peers that are pushed through a frame.

use cohaptic_scene::{FromScene, Scene};
use cohaptic_stability::frames::{Contacts, Node, NominalNetwork, Trust, alone, full_along};
use cohaptic_stability::{Family, KeyRange, Matrix, Method, Unwatched, Verdict, analyse, eigenvalues};

use super::corners::Point;
use super::waves::{Part, Waves, with_shares};
use super::*;
use crate::paper_scene::PAPER;

const WAVE: &str = "coordination.strategy=\"wave\"";
const HOLD: &str = "coordination.wave.on-loss=\"hold\"";
const LOSS: &str = "link.loss={ packets = [1], every = 3 }";
const LOOSE: &str = "peers=[{ name = \"peer1\", contact = \"none\" }]";
const KINDS: &str = "peers=[{ name = \"peer1\", device = { mass = 0.3 } }, { name = \"peer2\", device = { mass = 0.3 } }]";
const ARM: &str = "peers=[{ name = \"peer2\", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } } }]";

fn owned(set: &[&str]) -> Vec<String> {
    std::iter::once(&WAVE).chain(set).map(|text| (*text).to_owned()).collect()
}

fn scene(set: &[&str]) -> Scene {
    Scene::parse(PAPER, "waves.toml".as_ref(), &owned(set)).unwrap_or_else(|error| panic!("{set:?}: {error}"))
}

fn family(set: &[&str], keys: &[&str]) -> Family {
    let keys = keys.iter().map(|key| KeyRange::parse(key).unwrap()).collect();
    Family::new(PAPER, "waves.toml".as_ref(), &owned(set), keys).unwrap_or_else(|error| panic!("{set:?}: {error}"))
}

/// Returns the eigenvalues of matrices without those near zero, with the eigenvalues of each matrix as often as the matrix counts.
fn sorted(matrices: &[(Matrix, usize)]) -> Vec<(f64, f64)> {
    let of = |(matrix, copies): &(Matrix, usize)| {
        let values: Vec<(f64, f64)> =
            eigenvalues(matrix).into_iter().map(|value| (value.re, value.im)).filter(|(re, im)| re.hypot(*im) > 0.05).collect();
        std::iter::repeat_n(values, *copies).flatten().collect::<Vec<_>>()
    };
    let mut values: Vec<(f64, f64)> = matrices.iter().flat_map(of).collect();
    let digits = |value: f64| (value * 1e5).round();
    values.sort_by(|one, other| digits(one.0).total_cmp(&digits(other.0)).then(one.1.total_cmp(&other.1)));
    values
}

fn contacts(scene: &Scene) -> Contacts {
    let touching = scene.peers.iter().map(|peer| peer.contact == cohaptic_peer::Contact::Grasp).collect();
    Contacts { touching, at_wall: false, absent: vec![false; scene.peers.len()] }
}

fn of_parts(scene: &Scene) -> Vec<(f64, f64)> {
    let (network, contacts) = (NominalNetwork::of(scene).unwrap(), contacts(scene));
    let (structure, waves) = Waves::structure(&[scene], &network, &contacts).unwrap().unwrap();
    let nodes = Waves::nodes(&structure, scene);
    let time = structure.time(scene, &nodes);
    let frame = |nodes: &[Node], weights: Matrix, apart| {
        let points = [Point { nodes: nodes.to_vec(), weights }];
        let product = waves.frame(&Part::of(&structure, apart), &points, &[nodes.to_vec()], time).unwrap().steps.product();
        assert!(product.radius.largest() < 1e-7, "{}", product.radius.largest());
        product.mean
    };
    let mut parts = vec![(frame(&nodes, with_shares(&structure.weights, &Part::of(&structure, None).shares()), None), 1)];
    for (class, members) in structure.classes.iter().enumerate() {
        if members.len() > 1 {
            let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
            parts.push((frame(&nodes[class..=class], weight, Some(class)), members.len() - 1));
        }
        if let Some((part, _)) = alone(&structure, scene, class, 1) {
            parts.push((Matrix::from_fn(1, 1, |_, _| part.radius.value), part.copies));
        }
    }
    sorted(&parts)
}

/// Frames of waves have the eigenvalues, each as often, of what bodies feel of real peers, but for zeros.
#[test]
fn frames_of_waves_have_the_eigenvalues_of_real_peers() {
    for set in [
        &[][..],
        &["scene.count=2"],
        &["scene.count=2", LOOSE, "link.delay=13.3ms"],
        &["scene.count=3", LOOSE],
        &["link.delay=0ms"],
        &["link.delay=13.3ms", "scene.count=4"],
        &["scene.count=4", KINDS],
        &["scene.count=5", KINDS, "object.damping=2", "link.delay=31ms"],
        &[LOSS],
        &[LOSS, HOLD, "link.delay=11ms", "scene.count=4"],
        &["scene.count=2", LOSS],
        &[ARM, "scene.count=4"],
        &["coordination.wave.impedance=3", "peer.phase=3"],
        &["coordination.update=\"1ms\"", "link.delay=4ms"],
        &["scene.count=4", "peers=[{ name = \"peer1\", contact = \"none\" }, { name = \"peer2\", device = { mass = 0.3 } }]"],
    ] {
        let scene = scene(set);
        let network = NominalNetwork::of(&scene).unwrap();
        let whole = full_along(1, &scene, &network, &contacts(&scene), Trust::Linear, &Unwatched, &FromScene).unwrap();
        let (matrix, _) = whole.felt();
        let expected = sorted(&[(matrix, 1)]);
        let found = of_parts(&scene);
        assert_eq!(found.len(), expected.len(), "{set:?}: {found:?} {expected:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found.0 - expected.0).hypot(found.1 - expected.1) < 1e-6, "{set:?}: {found:?} is not {expected:?}");
        }
    }
}

fn agrees(guarantee: Guarantee, verdict: Verdict) -> bool {
    match guarantee {
        Guarantee::Stable => matches!(verdict, Verdict::Stable | Verdict::Marginal),
        Guarantee::Unstable => matches!(verdict, Verdict::Unstable | Verdict::Marginal),
        Guarantee::Undecided => true,
    }
}

fn between([low, high]: [f64; 2], share: f64) -> f64 {
    (low + share * (high - low)).clamp(low, high)
}

/// On lines: verdicts are those of single scenes, at the ends of stretches and within, and most of each line is decided.
#[test]
fn lines_of_waves_are_judged_as_single_scenes_are() {
    let mut unstable = 0;
    for (set, key) in [
        (&[][..], "peer.device.damping=0.5..20"),
        (&["scene.count=4", KINDS], "object.mass=0.1..1"),
        (&[LOOSE, "link.delay=13ms"], "peer.coupling.damping=0.5..20"),
        (&["scene.count=2", "coordination.wave.impedance=5"], "link.delay=1ms..30ms"),
        (&[LOSS, HOLD, "scene.count=4"], "object.mass=0.1..1"),
        (&[], "peer.coupling.stiffness=500..400000"),
    ] {
        let family = family(set, &[key]);
        let range = &family.keys()[0];
        let length = range.high - range.low;
        let line = ProvenLine::prove(&family, length / 256.0, &Unwatched).unwrap_or_else(|error| panic!("{set:?}: {error}"));
        let open: f64 = line.stretches.iter().filter(|one| one.guarantee == Guarantee::Undecided).map(|one| one.high - one.low).sum();
        assert!(open < 0.15 * length, "{set:?} {key}: {:?}", line.stretches);
        unstable += line.stretches.iter().filter(|one| one.guarantee == Guarantee::Unstable).count();
        for stretch in &line.stretches {
            for share in [0.0, 0.13, 0.5, 0.77, 1.0] {
                let value = between([stretch.low, stretch.high], share);
                let verdict = analyse(&family.scene(&[value]).unwrap(), Method::Full).unwrap().verdict();
                assert!(agrees(stretch.guarantee, verdict), "{set:?} {key}: {stretch:?}, and {verdict:?} at {value}");
            }
        }
    }
    assert!(unstable > 0);
}

/// Every number: single scenes say the same, two peers and classes of others among them; scenes that proofs do not follow are refused by name.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn every_number_of_copies_tied_by_waves_is_judged_as_single_scenes_are() {
    let soft = "peer.coupling.stiffness=250000";
    for set in [
        &[][..],
        &["object.split-mass=false"],
        &[LOOSE],
        &["scene.count=4", KINDS, "link.delay=13ms"],
        &["scene.count=5", KINDS, "peer.contact=\"none\"", "object.damping=2"],
        &[soft],
        &[LOSS, HOLD],
    ] {
        let found = prove_every_number(&scene(set), 2, None, &Unwatched).unwrap_or_else(|error| panic!("{set:?}: {error}"));
        let decided = found.spans.iter().filter(|span| span.guarantee != Guarantee::Undecided);
        assert!(decided.clone().count() > 0, "{set:?} {found:?}");
        for span in decided {
            for number in [span.from, span.from + 1, span.to.unwrap_or(12)].into_iter().filter(|number| *number <= span.to.unwrap_or(12).min(12)) {
                let count = format!("scene.count={number}");
                let set: Vec<&str> = set.iter().copied().filter(|text| !text.starts_with("scene.count")).chain([&*count]).collect();
                let verdict = analyse(&scene(&set), Method::Full).unwrap().verdict();
                assert!(agrees(span.guarantee, verdict), "{set:?}: {span:?}, and {verdict:?} for {number}");
            }
        }
    }
    let wall = "object.enclosure={ min = -0.1, max = 0.1, stiffness = 500.0, damping = 1.0 }";
    let far = "links=[{ from = \"peer1\", to = \"peer3\", delay = \"21ms\" }]";
    let unequal = "waves are followed over equal links";
    for (set, words, of_numbers) in [
        (&[wall][..], "with wave coordination walls are left out", None),
        (&["scene.count=4", far], unequal, Some("no two peers are equal")),
        (&["scene.count=4", "peers=[{ name = \"peer2\", phase = 3 }]"], unequal, None),
    ] {
        let refused = prove_every_number(&scene(set), 2, None, &Unwatched).unwrap_err().to_string();
        assert!(refused.contains(of_numbers.unwrap_or(words)), "{refused}");
        let of_line = ProvenLine::prove(&family(set, &["object.mass=0.4..0.5"]), 1.0, &Unwatched).unwrap_err().to_string();
        assert!(of_line.contains(words), "{of_line}");
    }
}
