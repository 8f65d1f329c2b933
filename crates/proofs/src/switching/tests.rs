//! Tests of proofs against followed motions, and of growing motions against fixed combinations of contacts.

use cohaptic_scene::Scene;
use cohaptic_stability::numerics::real;
use cohaptic_stability::{Matrix, Method, Unwatched, Verdict, analyse};

use super::contact_frame::{Contact, Kind};
use super::*;
use crate::inequality::{Inequality, Measured, Part, Row, Solution};

const PUSHED: &str = r#"
    scene        = { duration = "1s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, contact = { push = "+x" } }
    link         = { delay = "8ms" }
"#;
const WALLS: &str = "object.enclosure={ min = -0.02, max = 0.03, stiffness = 2000.0, damping = 20.0 }";
/// Two light fingers on either side of the object, drawn together by springs with little damping.
const GROWS: &[&str] = &[
    "scene.count=2",
    "object.mass=1.3",
    "coordination.stiffness=1500",
    "coordination.damping=20",
    "peer.coupling={ stiffness = 36000.0, damping = 18.0 }",
    "peer.device={ mass = 0.024, damping = 0.05 }",
    "peer.hand={ arm = { mass = 0.0, damping = 0.0, stiffness = 430.0 }, follows = { position = 0.0 } }",
    "link.delay=16ms",
    "peers=[{ name = \"peer1\" }, { name = \"peer2\", contact = { push = \"-x\" } }]",
];

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(PUSHED, "pushed.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
}

fn proven(overrides: &[&str]) -> Switching {
    prove_switching(&scene(overrides), &Unwatched).unwrap_or_else(|error| panic!("{overrides:?}: {error}"))
}

/// The frames and the inequality of a scene with one axis.
fn asked(scene: &Scene) -> (Vec<ContactFrame>, Inequality) {
    let pieces = pieces(scene, "a test").unwrap();
    let network = NominalNetwork::of(scene).unwrap();
    let along = Along::new(&pieces[0], 0);
    let structure = Structure::with_apart(&[scene], &network, &along.contacts, |one, other| along.pushes(one) != along.pushes(other)).unwrap();
    let structure = along.tied(structure);
    let nodes = walled(&along, structure.nodes(scene));
    let asked = Asked::of(&along, &structure, &nodes, &Unwatched).unwrap();
    let inequality = asked.inequality().unwrap();
    (asked.frames.into_iter().map(|(frame, _, _)| frame).collect(), inequality)
}

const STABLE: [&[&str]; 8] = [
    &[],
    &["coordination.strategy=proportional-derivative", "coordination.stiffness=300"],
    &["peer.contact=grasp", WALLS],
    &["peer.contact=none", WALLS, "coordination.stiffness=500", "object.damping=2"],
    &[
        "link.delay=24ms",
        "coordination.damping=20",
        "peers=[{ name = \"peer1\" }, { name = \"peer2\", contact = \"none\" }, { name = \"peer3\", contact = \"none\" }]",
    ],
    &["coordination.stiffness=300", "peers=[{ name = \"peer1\" }, { name = \"peer2\", contact = { push = \"-x\" } }, { name = \"peer3\" }]"],
    &["scene.count=2", "peers=[{ name = \"peer1\", phase = 3 }, { name = \"peer2\" }]", "coordination.stiffness=500"],
    &["scene.count=10", "coordination.stiffness=300"],
];

#[test]
fn scenes_that_are_proven() {
    for overrides in STABLE {
        let found = proven(overrides);
        assert_eq!((found.guarantee(), found.motions.len()), (Guarantee::Stable, 1), "{overrides:?}: {found:?}");
        assert!(found.motions[0].rate.is_some_and(|rate| rate > 0.3 && rate < 1.0), "{found:?}");
    }
}

/// The inequality of equal peers has the same size at any number of them.
#[test]
fn the_number_of_equal_peers_costs_nothing() {
    let size = |peers: &str| {
        let (_, asked) = asked(&scene(&[peers, "coordination.stiffness=300"]));
        asked.parts.iter().map(|part| (part.unknowns, part.rows.len())).collect::<Vec<_>>()
    };
    assert_eq!(size("scene.count=3"), size("scene.count=200"));
}

/// The depth beyond each end of a contact: below zero at a lower end, above it at an upper one.
fn beyond(contact: &Contact, depth: f64, gap: f64) -> f64 {
    match contact.kind {
        Kind::Push { .. } => (depth - gap).max(0.0),
        Kind::Wall => (depth - 0.03).max(0.0) + (depth + 0.02).min(0.0),
    }
}

/// The unknowns of a part in each frame of a motion, with contacts that open and close as they do.
fn motion(part: &Part, frame: &ContactFrame, beginning: f64) -> Vec<Vec<f64>> {
    let dot = |row: &[f64], values: &[f64]| row.iter().zip(values).map(|(by, value)| by * value).sum::<f64>();
    let some = |place: usize| 0.1 * libm::sin(1.0 + beginning * (1.0 + real(place)));
    let states: Vec<usize> = (0..frame.next.rows()).filter(|row| !frame.loose.contains(row)).chain(frame.next.rows()..frame.next.columns()).collect();
    let mut values: Vec<f64> = (0..frame.next.columns()).map(some).collect();
    let (mut reference, mut seen) = (0.01, Vec::new());
    for _ in 0..40 {
        values[frame.next.rows()..].fill(0.0);
        let mut pressed: Vec<Vec<f64>> = vec![Vec::new(); frame.contacts.len()];
        let deep = |place: usize, tick: usize, values: &[f64]| {
            let rows = &frame.contacts[place];
            let apart = if frame.reference.is_some() && rows.contact.kind == Kind::Wall { reference } else { 0.0 };
            // Any gap of a device is as good as another.
            beyond(&rows.contact, dot(&rows.depths[tick], values) + apart, 0.001 * real(place))
        };
        for place in &frame.order {
            let (rows, tick) = (&frame.contacts[*place], pressed[*place].len());
            let depth = deep(*place, tick, &values);
            let force = depth + dot(&rows.rates[tick], &values);
            values[rows.first + tick] = if depth > 0.0 {
                force.max(0.0)
            } else if depth < 0.0 {
                force.min(0.0)
            } else {
                0.0
            };
            pressed[*place].push(depth);
        }
        for (place, pressed) in pressed.iter_mut().enumerate() {
            pressed.push(deep(place, pressed.len(), &values));
        }
        seen.push(states.iter().map(|place| values[*place]).chain(pressed.concat()).collect::<Vec<f64>>());
        assert_eq!(seen[0].len(), part.unknowns);
        reference += frame.reference.as_ref().map_or(0.0, |row| dot(row, &values));
        let next: Vec<f64> = (0..frame.next.rows()).map(|row| dot(frame.next.row(row), &values)).collect();
        values[..next.len()].copy_from_slice(&next);
    }
    seen
}

fn value(row: &Row, unknowns: &[f64]) -> f64 {
    row.entries.iter().zip(unknowns).map(|(by, value)| by * value).sum()
}

fn norm(shape: &Matrix, part: &Part, of: &Measured, unknowns: &[f64]) -> f64 {
    let values: Vec<f64> = of.rows.iter().map(|place| value(&part.rows[*place], unknowns)).collect();
    shape.times_column(&values).iter().zip(&values).map(|(one, other)| one * other).sum()
}

/// Motions of each part, followed with the law of the contact, keep to the inequalities of its products, and the shapes that were found shrink along them as
/// proven.
#[test]
fn motions_keep_to_the_products_and_to_the_rate() {
    for overrides in STABLE {
        let mut pressed = 0;
        let (parts, inequality) = asked(&scene(overrides));
        let (solution, rate) = search(&inequality, &Unwatched, |solution| rate(&inequality, solution)).unwrap();
        assert!(rate < 1.0);
        for ((part, frame), shape) in inequality.parts.iter().zip(&parts).zip(&solution.shapes) {
            for beginning in [0.3, 1.7, 2.4, 4.1, 5.9] {
                for unknowns in motion(part, frame, beginning) {
                    let size = unknowns.iter().fold(0.0_f64, |most, value| most.max(value.abs())).powi(2);
                    for product in &part.products {
                        let [one, other] = product.factors.map(|factor| value(&part.rows[factor], &unknowns));
                        let found = product.weight * one * other;
                        let equal = inequality.free[product.multiplier];
                        assert!(if equal { found.abs() <= 1e-12 * size } else { found >= -1e-12 * size }, "{overrides:?}: {found} {product:?}");
                        pressed += usize::from(one != 0.0 && other != 0.0);
                    }
                    let [before, after] = [&part.before, &part.after].map(|of| norm(shape, part, of, &unknowns));
                    assert!(after <= rate * rate * before * (1.0 + 1e-9) + 1e-20, "{overrides:?}: {after} after {before}, {rate}");
                }
            }
        }
        assert!(pressed > 0, "{overrides:?}: nothing touched");
    }
}

/// The check refuses changed solutions.
#[test]
fn shapes_and_multipliers_that_are_changed_are_refused() {
    let (_, inequality) = asked(&scene(&[]));
    let (solution, _) = search(&inequality, &Unwatched, |solution| rate(&inequality, solution)).unwrap();
    let refused = |change: &dyn Fn(&mut Solution)| {
        let mut changed = solution.clone();
        change(&mut changed);
        rate(&inequality, &changed).is_none()
    };
    assert!(!refused(&|_| {}));
    assert!(refused(&|changed| changed.shapes[0] = changed.shapes[0].scaled(30.0)));
    assert!(refused(&|changed| changed.shapes[1] = changed.shapes[1].scaled(0.01)));
    assert!(refused(&|changed| changed.shapes[0][(0, 1)] += 1e-9));
    assert!(refused(&|changed| changed.multipliers.iter_mut().for_each(|multiplier| *multiplier = 0.0)));
    let signed = inequality.free.iter().position(|free| !free).unwrap();
    assert!(refused(&|changed| changed.multipliers[signed] = -1e-12));
    let mut wide = inequality.clone();
    wide.parts[0].rows.iter_mut().filter(|row| row.error > 0.0).for_each(|row| row.error = 0.05);
    assert!(rate(&wide, &solution).is_none());
}

/// Every combination of contacts is stable, and a motion that opens and closes one grows.
#[test]
fn a_motion_grows_where_every_combination_is_stable() {
    let scene = scene(GROWS);
    let analysis = analyse(&scene, Method::Reduced).unwrap();
    assert_eq!((analysis.verdict(), analysis.modes.len()), (Verdict::Stable, 4));
    let found = prove_switching(&scene, &Unwatched).unwrap();
    let growing = found.motions[0].growing.unwrap();
    assert_eq!(found.guarantee(), Guarantee::Unstable);
    assert!(growing.growth > 1.03 && growing.growth < 1.08 && growing.changes > growing.frames, "{growing:?}");
}

#[test]
fn what_cannot_be_asked_is_refused() {
    let refused = |overrides: &[&str]| prove_switching(&scene(overrides), &Unwatched).unwrap_err();
    assert_eq!(refused(&["peer.contact=grasp"]), SwitchingError::NoContact);
    assert_eq!(refused(&["link.loss=1%"]), SwitchingError::Chance);
    assert_eq!(refused(&["peer.coupling.stiffness=0"]), SwitchingError::NoSpring { what: "peer1".to_owned() });
    let fine = refused(&["coordination.update=80ms"]);
    assert!(matches!(fine, SwitchingError::TooLarge { rows: 150.., .. }), "{fine}");
    let law = refused(&["coordination.strategy=passivity-control"]);
    assert!(matches!(law, SwitchingError::Analysis(AnalysisError::NoAnalysis { .. })), "{law}");
}
