//! Proofs of servers and of topologies against single scenes, whose radii are computed another way: by pushing real peers through a frame, and of a topology by
//! a frame of all peers together, which knows nothing of eigenvalues of graphs.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Autonomous, Contacts, Lifted, Node, NominalNetwork, Structure, alone};
use cohaptic_stability::{Family, Graph, KeyRange, Matrix, Method, Unwatched, Verdict, analyse, bounded_radius, eigenvalues, monodromy};

use super::server::Server;
use super::*;
use crate::paper_scene::PAPER;

const SERVER: &str = "coordination.strategy=\"client-server\"";
const OBJECT: &str = "coordination.client-server.returns=\"object\"";
const LOSS: &str = "link.loss={ packets = [1], every = 3 }";
const SOFT: &str = "peer.coupling.stiffness=150";
const ARM: &str = "peers=[{ name = \"peer2\", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } } }]";
const ARMS: &str = "peer.hand={ arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } }";
const LOOSE: &str = "peers=[{ name = \"peer1\", contact = \"none\" }]";
const LOOSE_CLIENT: &str = "peers=[{ name = \"peer3\", contact = \"none\" }]";
const PD: &str = "coordination.strategy=\"proportional-derivative\"";

fn owned(set: &[&str]) -> Vec<String> {
    set.iter().map(|text| (*text).to_owned()).collect()
}

/// Path under which scenes are parsed. Files of weights are in the same directory.
fn file() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene.toml")
}

fn scene(set: &[&str]) -> Scene {
    Scene::parse(PAPER, &file(), &owned(set)).unwrap_or_else(|error| panic!("{set:?}: {error}"))
}

fn graph(weights: &str) -> String {
    format!("topology={{ kind = \"graph\", file = \"weights/{weights}.csv\" }}")
}

fn family(set: &[&str], keys: &[&str]) -> Family {
    let keys = keys.iter().map(|key| KeyRange::parse(key).unwrap()).collect();
    Family::new(PAPER, &file(), &owned(set), keys).unwrap_or_else(|error| panic!("{set:?}: {error}"))
}

/// Returns the verdict on one scene, computed in another way than by a proof.
fn verdict(scene: &Scene) -> Verdict {
    let Some(topology) = &scene.topology else { return analyse(scene, Method::Full).unwrap().verdict() };
    let network = NominalNetwork::of(&scene.without_topology()).unwrap();
    let peers = scene.peers.len();
    let contacts = Contacts { touching: vec![true; peers], at_wall: false, absent: vec![false; peers] };
    let structure = Structure::of_each(scene, &network, &contacts).unwrap();
    let nodes = structure.nodes(scene);
    // Each peer follows the mean of its neighbours, weighted as in the topology. All peers move together in one matrix, so no eigenvalue of the graph is used.
    let weights = Matrix::from_fn(peers, peers, |to, from| topology.weight(to, from) / topology.degree(to));
    let all = Lifted { weights: &weights, ..structure.quotient(scene, &nodes) };
    let frame = all.frame(&mut Autonomous);
    bounded_radius(&frame.monodromy(), frame.error).verdict()
}

/// Returns entry `number` of a sequence from 0 to 1 that is spread by steps of an irrational number.
#[expect(clippy::cast_precision_loss, reason = "small counts")]
fn spread(number: usize, irrational: f64) -> f64 {
    ((number + 1) as f64 * irrational).fract()
}

fn between([low, high]: [f64; 2], share: f64) -> f64 {
    (low + share * (high - low)).clamp(low, high)
}

fn agrees(guarantee: Guarantee, verdict: Verdict) -> bool {
    match guarantee {
        Guarantee::Stable => matches!(verdict, Verdict::Stable | Verdict::Marginal),
        Guarantee::Unstable => matches!(verdict, Verdict::Unstable | Verdict::Marginal),
        Guarantee::Undecided => true,
    }
}

/// Frames of a server and its clients have the eigenvalues, each as often, of what real peers do, but for zeros.
#[test]
fn frames_of_a_server_have_the_eigenvalues_of_real_peers() {
    let loose_both = "peers=[{ name = \"peer3\", contact = \"none\" }, { name = \"peer4\", contact = \"none\" }]";
    let kinds = "peers=[{ name = \"peer3\", device = { mass = 0.3 } }, { name = \"peer5\", device = { mass = 0.3 } }]";
    let clocks =
        "peers=[{ name = \"peer2\", tick = \"2ms\" }, { name = \"peer3\", clock = { offset = \"3.4ms\" } }, { name = \"peer4\", phase = 3 }]";
    for set in [
        &[][..],
        &[OBJECT],
        &["link.delay=0ms"],
        &["link.delay=0ms", OBJECT],
        &["link.delay=13.3ms", "scene.count=4"],
        &["link.delay=31ms", OBJECT, "scene.count=5"],
        &[LOSS, "scene.count=4"],
        &[LOSS, OBJECT, "link.delay=11ms"],
        &[ARM, "peer.compute-delay=1"],
        &[ARMS, OBJECT, "peer.compute-delay=1", "link.delay=9.7ms"],
        &[LOOSE],
        &[LOOSE, OBJECT],
        &[LOOSE_CLIENT, "scene.count=4"],
        &[loose_both, "scene.count=5", OBJECT],
        &[kinds, "scene.count=6", "object.damping=2"],
        &[clocks, "scene.count=4"],
        &[clocks, "scene.count=4", OBJECT],
        &["coordination.client-server.server=\"peer2\"", "scene.count=4"],
        &["links=[{ from = \"peer1\", to = \"peer3\", delay = \"21ms\" }]", "scene.count=4"],
        &["links=[{ from = \"peer3\", to = \"peer1\", loss = 1.0 }]", OBJECT],
    ] {
        let scene = scene(&[&[SERVER], set].concat());
        let expected = monodromy(&scene).unwrap();
        let found = server_eigenvalues(&scene);
        let expected = sorted(&[(expected.matrix, 1)]);
        assert_eq!(found.len(), expected.len(), "{set:?}: {found:?} {expected:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found.0 - expected.0).hypot(found.1 - expected.1) < 1e-7, "{set:?}: {found:?} is not {expected:?}");
        }
    }
}

/// Returns the eigenvalues of matrices without those near zero, with the eigenvalues of each matrix as often as the matrix counts.
fn sorted(matrices: &[(Matrix, usize)]) -> Vec<(f64, f64)> {
    let of = |(matrix, copies): &(Matrix, usize)| {
        let values = eigenvalues(matrix).into_iter().map(|value| (value.re, value.im)).filter(|(re, im)| re.hypot(*im) > 0.02);
        let values: Vec<(f64, f64)> = values.collect();
        std::iter::repeat_n(values, *copies).flatten().collect::<Vec<_>>()
    };
    let mut values: Vec<(f64, f64)> = matrices.iter().flat_map(of).collect();
    // Sorting by rounded real parts keeps conjugate pairs in one order despite rounding.
    let digits = |value: f64| (value * 1e6).round();
    values.sort_by(|one, other| digits(one.0).total_cmp(&digits(other.0)).then(one.1.total_cmp(&other.1)));
    values
}

fn server_eigenvalues(scene: &Scene) -> Vec<(f64, f64)> {
    let network = NominalNetwork::of(scene).unwrap();
    let touching = scene.peers.iter().map(|peer| peer.contact == cohaptic_peer::Contact::Grasp).collect();
    let contacts = Contacts { touching, at_wall: false, absent: vec![false; scene.peers.len()] };
    let (structure, server) = Server::structure(&[scene], &network, &contacts).unwrap().unwrap();
    let nodes = server.nodes(&structure, scene);
    let time = structure.time(scene, &nodes);
    let frame = |nodes: &[Node], apart| {
        let product = server.frame(&structure, &[nodes.to_vec()], apart, time).unwrap().steps.product();
        assert!(product.radius.largest() < 1e-7, "{}", product.radius.largest());
        product.mean
    };
    let mut parts = vec![(frame(&nodes, None), 1)];
    for (class, members) in structure.classes.iter().enumerate() {
        // A class of n members has n − 1 copies of its differences, and a loose device counts once per member.
        if Server::has_differences(&structure, class) {
            parts.push((frame(&nodes[class..=class], Some(class)), members.len() - 1));
        }
        if let Some((part, _)) = alone(&structure, scene, class, 1) {
            parts.push((Matrix::from_fn(1, 1, |_, _| part.radius.value), part.copies));
        }
    }
    sorted(&parts)
}

/// On lines: verdicts are those of single scenes, at the ends of stretches and within, and most of each line is decided; crossings are among the rest.
#[test]
fn lines_are_judged_as_single_scenes_are() {
    let (ring, dense_ring) = ("topology={ kind = \"ring\", neighbours = 2 }", "topology={ kind = \"ring\", neighbours = 4 }");
    let (star, cube, uneven) = ("topology={ kind = \"star\" }", &*graph("cube"), &*graph("uneven"));
    let mut crossings = 0;
    for (set, key) in [
        (&[SERVER][..], "peer.coupling.stiffness=1..2000"),
        (&[SERVER, OBJECT, "scene.count=4"], "peer.coupling.stiffness=1..20000"),
        (&[SERVER, LOOSE, "link.delay=13ms", SOFT], "peer.coupling.damping=0..60"),
        (&[SERVER, LOOSE_CLIENT, "scene.count=4", "object.damping=1"], "peer.coupling.stiffness=1..2000"),
        (&[SERVER, ARM, "peer.compute-delay=1"], "peer.coupling.stiffness=50..2000"),
        (&[SERVER, LOSS, SOFT], "peer.device.mass=0.02..1"),
        (&[SERVER, "scene.count=2", "peer.coupling.stiffness=300"], "object.mass=0.02..4"),
        (&[SERVER, SOFT], "link.delay=0ms..60ms"),
        (&["scene.count=5", ring], "coordination.stiffness=100..6000"),
        (&["scene.count=6", dense_ring, PD], "coordination.stiffness=50..2000"),
        (&["scene.count=5", ring, "coordination.stiffness=1500"], "link.delay=0ms..40ms"),
        (&["scene.count=5", star], "coordination.stiffness=100..4000"),
        (&["scene.count=8", cube], "coordination.stiffness=100..4000"),
        (&["scene.count=8", cube, PD], "coordination.stiffness=20..4000"),
        (&["scene.count=5", uneven], "coordination.stiffness=100..4000"),
    ] {
        let family = family(set, &[key]);
        let range = &family.keys()[0];
        let length = range.high - range.low;
        let line = ProvenLine::prove(&family, length / 512.0, &Unwatched).unwrap_or_else(|error| panic!("{set:?}: {error}"));
        // A prover that decides nothing would agree with every scene, so most of the line must be decided.
        let open: f64 = line.stretches.iter().filter(|one| one.guarantee == Guarantee::Undecided).map(|one| one.high - one.low).sum();
        assert!(open < 0.15 * length, "{set:?} {key}: {:?}", line.stretches);
        crossings += line.stretches.windows(3).filter(|three| three[0].guarantee != three[2].guarantee).count();
        for stretch in &line.stretches {
            // Both ends too: a stretch decided beyond its boundary shows there first.
            for share in [0.0, 0.13, 0.5, 0.77, 1.0] {
                let value = between([stretch.low, stretch.high], share);
                let verdict = verdict(&family.scene(&[value]).unwrap());
                assert!(agrees(stretch.guarantee, verdict), "{set:?} {key}: {stretch:?}, and {verdict:?} at {value}");
            }
        }
    }
    assert!(crossings >= 8, "{crossings}");
}

/// In maps: no box that is proven stable holds an unstable scene, and none that is proven unstable a stable one, at points spread over the map and around its
/// boundary.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn boxes_hold_no_scene_of_the_other_kind() {
    let (ring, star, uneven) = ("topology={ kind = \"ring\", neighbours = 2 }", "topology={ kind = \"star\" }", &*graph("uneven"));
    let gains = ["coordination.stiffness=100..5000", "coordination.damping=0..60"];
    for (set, keys) in [
        (&[SERVER][..], ["peer.coupling.stiffness=1..400", "peer.coupling.damping=0..8"]),
        (&[SERVER, OBJECT, "link.delay=13ms", "scene.count=4"], ["peer.coupling.stiffness=1..3000", "object.mass=0.1..2"]),
        (&[SERVER, ARM, LOSS], ["peer.coupling.stiffness=1..1000", "peer.coupling.damping=0..8"]),
        (&[SERVER, LOOSE, LOSS], ["peer.coupling.stiffness=1..400", "link.delay=0ms..20ms"]),
        (&["scene.count=5", ring], gains),
        (&["scene.count=5", star], gains),
        (&["scene.count=5", uneven], gains),
    ] {
        let family = family(set, &keys);
        let region = ProvenRegion::prove(&family, 5, None, &Unwatched).unwrap_or_else(|error| panic!("{set:?}: {error}"));
        let mut found = [0, 0];
        for number in 0..120 {
            let [x, y] = [0, 1].map(|key| {
                let range = &family.keys()[key];
                between([range.low, range.high], spread(number, [0.618_033_988_749_894_9, 0.754_877_666_246_692_8][key]))
            });
            let holds = |one: &&ProvenBox| (one.x[0]..=one.x[1]).contains(&x) && (one.y[0]..=one.y[1]).contains(&y);
            for one in region.boxes.iter().filter(holds) {
                let verdict = verdict(&family.scene(&[x, y]).unwrap());
                assert!(agrees(one.guarantee, verdict), "{set:?} {keys:?}: {one:?}, and {verdict:?} at {x}, {y}");
                found[0] += usize::from(one.guarantee == Guarantee::Stable);
                found[1] += usize::from(one.guarantee == Guarantee::Unstable);
            }
        }
        // Enough points of both kinds must lie in decided boxes, or the agreement above says nothing.
        assert!(found[0] + found[1] >= 60 && found[0] >= 8 && found[1] >= 8, "{set:?} {keys:?}: {found:?}");
    }
}

/// A graph with a repeated eigenvalue has as many parts as different ones, and a proof of it holds for all peers together.
#[test]
fn repeated_eigenvalues_of_a_graph_are_one_part() {
    let scene = scene(&["scene.count=8", &graph("cube")]);
    let spectrum = Graph::from(&**scene.topology.as_ref().unwrap()).enclosed_spectrum(&scene.without_topology()).unwrap();
    assert_eq!((spectrum.others.len(), spectrum.degree), (3, Some(3.0)), "-1, -1/3 three times, 1/3 three times: {spectrum:?}");
    let nearly = Scene::parse(PAPER, &file(), &owned(&[&graph("nearly-regular"), PD])).unwrap();
    assert_eq!(analyse(&nearly, Method::Reduced).unwrap().verdict(), Verdict::Stable, "row sums that differ by a rounding are analysed as if equal");
}

/// A question without a proof, or without a certificate, is refused before the search begins, with a question that could be asked instead.
#[test]
fn what_is_not_followed_is_refused_by_name() {
    let ring = "topology={ kind = \"ring\", neighbours = 2 }";
    let (gain, damping) = ("coordination.stiffness=100..200", "coordination.damping=1..2");
    let (coupling, mass) = ("peer.coupling.stiffness=10..20", "object.mass=0.4..0.5");
    let line = |set: &[&str], key: &str| {
        let family = Family::new(PAPER, &file(), &owned(set), vec![KeyRange::parse(key).unwrap()]);
        family.map_or_else(|error| error.to_string(), |family| ProvenLine::prove(&family, 1.0, &Unwatched).unwrap_err().to_string())
    };
    let wall = "object.enclosure={ min = -0.1, max = 0.1, stiffness = 500.0, damping = 1.0 }";
    for (message, words) in [
        (line(&[SERVER, wall], coupling), "expected a scene without object.enclosure"),
        (line(&[SERVER, "link.loss=5%"], coupling), "leave something to chance"),
        (line(&[ring, "scene.count=5", LOOSE], gain), "peer2 or a link of it is not like the others"),
        (line(&[ring, "scene.count=5", wall], gain), "expected contact"),
        (line(&["topology={ kind = \"star\" }", "scene.count=5", PD], gain), "or a graph in which all hear as much"),
        (line(&[&graph("nearly-regular"), PD], gain), "or a graph in which all hear as much"),
    ] {
        assert!(message.contains(words), "{words}: {message}");
    }
    for (set, keys, what) in
        [(&[SERVER][..], [coupling, mass], "client-server coordination"), (&[ring, "scene.count=5"], [gain, damping], "a [topology]")]
    {
        let family = family(set, &keys);
        let every = ProvenRegion::prove(&family, 2, Some((2, None)), &Unwatched).unwrap_err().to_string();
        assert!(every.starts_with(what) && every.contains("expected no --every-number"), "{every}");
    }
    let every = |set: &[&str]| prove_every_number(&scene(set), 2, None, &Unwatched).unwrap_err().to_string();
    assert!(every(&[SERVER]).contains("without --graph, --every-number") && every(&[ring, "scene.count=5"]).contains("this scene has a [topology]"));
}
