//! Devices that exchange late or not at each tick, against radii and boundaries that were computed apart from this program: see `tests/reference/README.md`.

use cohaptic_stability::{
    Analysis, Family, FamilyScratch, Graph, KeyRange, Method, StateKind, admittance, analyse, analyse_on, judge, mean_square, monodromy,
};

use crate::reference_file::{Case, ReferenceFile, compare_boundary, compare_family, parsed, parts, text};

const FILE: ReferenceFile = ReferenceFile { json: include_str!("../reference/exchange.json"), radii: 15 };

/// The reference has twelve digits, from arithmetic in double.
#[track_caller]
fn compare(case: &Case, analysis: &Analysis, sharp: f64) {
    let (name, radius) = (&case.name, analysis.radius);
    let apart = (radius.value - case.radius).abs();
    assert!(apart < 1e-11, "{name}: {radius:?}, but it is {}", case.radius);
    assert!(apart <= radius.error + 1e-11 && radius.error < sharp, "{name}: a bound of {:e} says little", radius.error);
}

#[test]
fn the_reduced_radii_are_those_of_another_program() {
    for case in FILE.cases() {
        compare(&case, &analyse(&case.scene, Method::Reduced).unwrap(), 1e-9);
    }
}

/// The general path steps the simulator's own peers.
#[test]
fn real_peers_with_real_devices_find_the_same() {
    for case in FILE.cases() {
        let reduced = analyse(&case.scene, Method::Reduced).unwrap();
        let full = analyse(&case.scene, Method::Full).unwrap();
        compare(&case, &full, 1e-6);
        assert_eq!((full.dimension, full.rigid_modes), (reduced.dimension, reduced.rigid_modes), "{}", case.name);
    }
}

/// Within 10⁻⁴ N/m on either side.
#[test]
fn a_scene_becomes_unstable_where_another_program_says() {
    let entries = FILE.entries("boundaries");
    assert_eq!(entries.len(), 16);
    entries.iter().for_each(|entry| compare_boundary(entry, "peer.coupling.stiffness", 1e-4));
}

/// An exchange at each tick without delay adds no state and changes no bit, also where the keys say so.
#[test]
fn an_exchange_at_each_tick_is_no_exchange() {
    let case = FILE.case("two");
    let plain = case.text.replace("device = { exchange-every = 2, exchange-age = 0 }\n", "");
    assert_ne!(plain, case.text);
    let [plain, each] = [parsed(&plain, &[]), parsed(&case.text, &["peers.a.device.exchange-every=1", "peers.b.device.exchange-every=1"])];
    assert_eq!(plain, each);
    assert_eq!(format!("{plain:?}"), format!("{each:?}"));
    for method in [Method::Reduced, Method::Full] {
        let [plain, each] = [&plain, &each].map(|scene| analyse(scene, method).unwrap());
        assert_eq!((plain.radius, plain.dimension), (each.radius, each.dimension));
    }
}

#[test]
fn the_states_of_an_exchange_have_names() {
    let found = monodromy(&FILE.case("three-unlike").scene).unwrap();
    let of = |peer: usize| found.states.iter().filter(move |state| state.peer == peer).map(|state| state.kind).collect::<Vec<_>>();
    let reading = [StateKind::ReadingPosition { axis: 0 }, StateKind::ReadingVelocity { axis: 0 }, StateKind::KeptCoupling { axis: 0 }];
    let latest = [StateKind::LatestPosition { axis: 0 }, StateKind::LatestVelocity { axis: 0 }];
    // The position of the first copy is the reference of all positions, and no state.
    assert_eq!(of(0)[3..6], reading);
    assert_eq!((&of(1)[4..6], &of(1)[6..9]), (&latest[..], &reading[..]));
    assert_eq!(of(2)[4..6], latest);
    assert!(!of(2).contains(&reading[0]));
}

/// Equal exchanges make equal peers, other exchanges make other classes.
#[test]
fn exchanges_count_in_what_makes_peers_equal() {
    let parts = |name: &str| parts(&FILE.case(name));
    let together = ("together", None, 1);
    assert_eq!(parts("five-of-eight"), [together, ("apart", Some(0), 2)]);
    assert_eq!(parts("four-classes"), [together, ("apart", Some(0), 1), ("apart", Some(2), 1)]);
    assert_eq!(parts("one-slow"), [together]);
}

/// On the complete graph each peer hears every other, as without a graph.
#[test]
fn a_graph_of_slow_devices_has_the_radius_of_the_scene() {
    let case = FILE.case("five-of-eight");
    let found = analyse_on(&case.scene, &Graph::Complete).unwrap();
    assert!((found.radius.value - case.radius).abs() < 1e-11, "{:?}", found.radius);
}

/// Keys of maps and lines: numbers of the scene, and the exchanges themselves, which change the frame.
#[test]
fn maps_and_lines_follow_slow_devices() {
    for (key, values) in [("peer.coupling.stiffness=100..5000", [300.0, 4000.0]), ("peers.a.device.exchange-every=1..9", [2.0, 7.0])] {
        compare_family(&FILE.case("one-slow").text, key, values, 1e-9);
    }
}

/// Pushed at each tick, also between two exchanges.
#[test]
fn the_admittance_is_that_of_another_program() {
    let entries = FILE.entries("admittance");
    assert_eq!(entries.len(), 6);
    for entry in entries {
        let scene = parsed(&text(&entry, "scene"), &[]);
        let points = entry["points"].as_array().unwrap();
        let frequencies: Vec<f64> = points.iter().map(|point| point["hz"].as_f64().unwrap()).collect();
        let found = admittance(&scene, 0, &frequencies).unwrap();
        for (found, point) in found.points.iter().zip(points) {
            let [re, im] = ["re", "im"].map(|part| text(point, part).parse::<f64>().unwrap());
            let size = re.hypot(im);
            let apart = (found.value.re - re).hypot(found.value.im - im);
            assert!(apart < 1e-9 * size && found.error < 1e-6 * size, "{}: {found:?} is not {re} + {im}j", text(&entry, "name"));
        }
    }
}

/// The mean square does not follow slow devices: the verdict is nominal, with the reason.
#[test]
fn with_chance_the_verdict_on_a_slow_device_is_nominal() {
    let case = FILE.case("two-late");
    let error = mean_square(&case.scene).unwrap_err().to_string();
    assert!(error.starts_with("the mean square does not follow the device of a, which exchanges late or not at each tick: "), "{error}");
    let scene = parsed(&case.text, &["link.loss=10%"]);
    let judged = judge(&scene, Method::Reduced, 1 << 20).unwrap();
    assert!((judged.analysis.radius.value - case.radius).abs() < 1e-11);
    assert!(
        judged.mean_square.is_none() && judged.analysis.notes.iter().any(|note| note.contains("the mean square does not follow the device of a"))
    );
    let keys = vec![KeyRange::parse("coordination.damping=1..10").unwrap()];
    let family = Family::new(&case.text, "two-late.toml".as_ref(), &["link.loss=10%".to_owned()], keys).unwrap();
    let found = family.radius(&[5.0], &mut FamilyScratch::default()).unwrap();
    assert!(found.is_nominal && (found.radius - case.radius.powi(2)).abs() < 1e-9, "{found:?}");
}
