//! People who track a target by the law crossover, against radii and boundaries that were computed apart from this program: see `tests/reference/README.md`.

use cohaptic_stability::{
    Admittance, AdmittanceError, Analysis, AnalysisError, Family, FamilyScratch, Graph, GraphError, KeyRange, Method, StateKind, Unwatched, Verdict,
    analyse, analyse_loaded, analyse_on, analyse_spinning, judge, mean_square, monodromy,
};
use cohaptic_tests_common::are_all;
use rayon::prelude::*;

use crate::reference_file::{Case, ReferenceFile, compare_boundary, compare_family, owned, parsed, parts};

const FILE: ReferenceFile = ReferenceFile { json: include_str!("../reference/crossover.json"), radii: 22 };

/// The reference has twelve digits, from arithmetic in double. A motion that lasts for ever is an eigenvalue 1 beside others that are not far: the claimed error is
/// larger there.
#[track_caller]
fn compare(case: &Case, analysis: &Analysis, sharp: f64) {
    let (name, radius) = (&case.name, analysis.radius);
    let apart = (radius.value - case.radius).abs();
    assert!(apart < 2e-12, "{name}: {radius:?}, but it is {}", case.radius);
    assert!(radius.error < sharp, "{name}: a bound of {:e} says little", radius.error);
    assert_eq!(analysis.rigid_modes, 0, "{name}");
}

#[test]
fn the_reduced_radii_are_those_of_another_program() {
    for case in FILE.cases() {
        compare(&case, &analyse(&case.scene, Method::Reduced).unwrap(), 1e-6);
    }
}

/// The general path pushes the simulator's operators. The states of many ticks are as many eigenvalues near zero, and the general path bounds a radius beside them
/// loosely, so that of the bound only the truth is asked. It takes long where both people remember what they saw: by day only smaller scenes are compared.
#[test]
fn real_people_with_real_arms_find_the_same() {
    let cases = FILE.cases();
    let (largest, least_compared) = if are_all() { (300, 12) } else { (200, 4) };
    let compare_if_small = |case: &Case| {
        let reduced = analyse(&case.scene, Method::Reduced).unwrap();
        let is_small = reduced.dimension < largest;
        if is_small {
            let full = analyse(&case.scene, Method::Full).unwrap();
            compare(case, &full, f64::INFINITY);
            assert_eq!(full.dimension, reduced.dimension, "{}", case.name);
        }
        is_small
    };
    // In parallel, because this is the longest test of its program, which would end on one core.
    let compared = cases.par_iter().filter(|case| compare_if_small(case)).count();
    assert!(compared > least_compared, "{compared}");
}

/// Within 10⁻³ rad/s on either side.
#[test]
fn a_scene_becomes_unstable_where_another_program_says() {
    let entries = FILE.entries("boundaries");
    assert_eq!(entries.len(), 4);
    entries.iter().for_each(|entry| compare_boundary(entry, "peers.a.hand.operator.crossover", 1e-3));
}

/// Equal people are one class, with the differences apart. Who is seen by another is a class alone, and all who look at that peer stay together.
#[test]
fn what_people_see_counts_in_what_makes_peers_equal() {
    let parts = |name: &str| parts(&FILE.case(name));
    let together = ("together", None, 1);
    assert_eq!(parts("both-own"), [together, ("apart", Some(0), 1)]);
    assert_eq!(parts("four-two-own"), [together, ("apart", Some(0), 1), ("apart", Some(2), 1)]);
    assert_eq!(parts("each-sees-the-other"), [together]);
    assert_eq!(parts("unequal-eyes"), [together]);
    assert_eq!(parts("two-see-a-third"), [together, ("apart", Some(0), 1)]);
    // A scene of one person and of two peers without a person.
    assert_eq!(parts("three"), [together, ("apart", Some(1), 1)]);
    // Two equal peers without a person, of which the person sees the first or the second: each is a class alone. The general path knows no classes.
    for sees in ["b", "c"] {
        let scene = parsed(&FILE.case("three").text, &[&format!("peers.a.hand.operator.sees={sees}")]);
        let (found, witness) = (analyse(&scene, Method::Reduced).unwrap(), analyse(&scene, Method::Full).unwrap());
        assert_eq!(found.modes[0].parts.iter().map(|part| part.kind.word()).collect::<Vec<_>>(), ["together"], "{sees}");
        assert!((found.radius.value - witness.radius.value).abs() < 1e-9, "{sees}: {:?} {:?}", found.radius, witness.radius);
    }
}

/// If both people watch one copy, hands may pull against each other without moving this copy. No person sees and corrects the pull, so the pull stays.
#[test]
fn two_who_watch_one_copy_pull_against_each_other_without_end() {
    for name in ["two-see-a-third", "both-watch-one-copy"] {
        assert_eq!(analyse(&FILE.case(name).scene, Method::Reduced).unwrap().verdict(), Verdict::Marginal, "{name}");
    }
}

#[test]
fn the_states_of_a_person_have_names() {
    let found = monodromy(&FILE.case("within-a-frame").scene).unwrap();
    let of_first: Vec<StateKind> = found.states.iter().filter(|state| state.peer == 0).map(|state| state.kind).collect();
    let expected = [
        StateKind::DevicePosition { axis: 0 },
        StateKind::DeviceVelocity { axis: 0 },
        StateKind::ObjectPosition { axis: 0 },
        StateKind::ObjectVelocity { axis: 0 },
        StateKind::WantedPosition { axis: 0 },
        StateKind::SeenPosition { axis: 0, age: 1 },
        StateKind::SeenPosition { axis: 0, age: 2 },
        StateKind::SeenPosition { axis: 0, age: 3 },
    ];
    assert_eq!(of_first[..8], expected);
    assert_eq!((found.rigid_modes, found.relative), (0, vec![vec![None], vec![None]]));
}

const PLANE: [&str; 2] = ["scene.axes=2", "task.sines=[{ amplitude = [0.02, 0.0], frequency = 0.1 }]"];

/// Along each axis people track alone: a plane has the radius of a line, twice.
#[test]
fn a_person_tracks_along_each_axis_alone() {
    for name in ["own", "within-a-frame"] {
        let case = FILE.case(name);
        let plane = parsed(&case.text, &PLANE);
        let (one, two) = (analyse(&case.scene, Method::Reduced).unwrap(), analyse(&plane, Method::Reduced).unwrap());
        assert_eq!((two.radius, two.dimension), (one.radius, 2 * one.dimension), "{name}");
    }
    let full = analyse(&parsed(&FILE.case("within-a-frame").text, &PLANE), Method::Full).unwrap();
    assert!((full.radius.value - FILE.case("within-a-frame").radius).abs() < 2e-12, "{:?}", full.radius);
}

/// The keys of a person are axes of maps and lines: those that only set a number, and those that change the size of the matrix.
#[test]
fn maps_and_lines_follow_the_keys_of_a_person() {
    for (key, values) in [
        ("peers.a.hand.operator.crossover=1..8", [1.5, 7.5]),
        ("peers.a.hand.operator.visual-delay=100ms..300ms", [150.0, 290.0]),
        ("peers.a.hand.operator.arm.stiffness=0..900", [0.0, 600.0]),
    ] {
        compare_family(&FILE.case("own").text, key, values, 1e-6);
    }
}

#[track_caller]
fn refused<T>(what: &str, found: Result<T, AnalysisError>) {
    let Err(error) = found else { panic!("{what} answers") };
    let expected = format!("{what} does not follow the operator of a, whose law is \"crossover\": ");
    assert!(error.to_string().starts_with(&expected), "{error}");
}

#[test]
fn what_does_not_follow_a_person_says_so_by_name() {
    let scene = FILE.case("both-own").scene;
    refused("the mean square", mean_square(&scene));
    let Err(AdmittanceError::Analysis(error)) = Admittance::of(&scene, 1) else { panic!("the admittance answers") };
    refused::<()>("the admittance", Err(error));
    let Err(GraphError::Analysis(error)) = analyse_on(&scene, &Graph::Complete) else { panic!("a graph answers") };
    refused::<()>("a graph", Err(error));
}

/// Overrides that give the object an inertia, so that it turns.
const TURNS: [&str; 4] = [
    "scene.axes=3",
    "object={ mass = 0.45, inertia = [3e-4, 3e-4, 3e-4] }",
    "coordination={ strategy = \"average-position\", stiffness = 1000.0, damping = 5.0, update = \"8ms\", rotational-stiffness = 2.0, \
     rotational-damping = 0.02 }",
    "task.sines=[{ amplitude = [0.02, 0.0, 0.0], frequency = 0.1 }]",
];

/// Topologies and objects that turn are refused on every way to a radius.
#[test]
fn neither_topologies_nor_objects_that_turn_follow_a_person() {
    let case = FILE.case("three");
    for (what, overrides) in [("a graph", &["topology.kind=ring"][..]), ("the analysis of an object that turns", &TURNS)] {
        let scene = parsed(&case.text, overrides);
        refused(what, analyse(&scene, Method::Reduced));
        let family = Family::new(&case.text, "three.toml".as_ref(), &owned(overrides), vec![KeyRange::parse("coordination.damping=1..10").unwrap()]);
        let error = family.and_then(|family| family.bounded_radius(&[5.0], &mut FamilyScratch::default())).unwrap_err().to_string();
        assert!(error.contains(&format!("{what} does not follow the operator of a, whose law is \"crossover\": ")), "{error}");
    }
    let turns = parsed(&case.text, &TURNS);
    let what = "the analysis of an object that turns";
    refused(what, analyse(&turns, Method::Full));
    refused(what, analyse_loaded(&turns, Method::Reduced, &Unwatched));
    refused(what, analyse_spinning(&turns, &Unwatched));
}

/// Waves carry no position, so that a person who watches the copy of another peer moves that copy to the target, and the own copy stays where it came to rest.
#[test]
fn waves_leave_the_own_copy_of_who_watches_another_where_it_is() {
    let waves = ["coordination.strategy=wave", "peers.a.hand.operator.visual-delay=3ms"];
    let [own, other] = ["own", "sees-the-second"].map(|name| analyse(&parsed(&FILE.case(name).text, &waves), Method::Reduced).unwrap());
    assert_eq!((own.verdict(), own.rigid_modes), (Verdict::Stable, 1));
    assert_eq!((other.verdict(), other.rigid_modes), (Verdict::Marginal, 0));
    assert!((other.radius.value - 1.0).abs() < 1e-9 && other.radius.error < 1e-9, "{:?}", other.radius);
}

/// A loss leaves the verdict nominal, with the reason.
#[test]
fn with_chance_the_verdict_on_a_person_is_nominal() {
    let scene = parsed(&FILE.case("own").text, &["link.loss=10%"]);
    let judged = judge(&scene, Method::Reduced, 1 << 20).unwrap();
    assert!((judged.analysis.radius.value - FILE.case("own").radius).abs() < 2e-12);
    assert!(
        judged.mean_square.is_none() && judged.analysis.notes.iter().any(|note| note.contains("the mean square does not follow the operator of a"))
    );
    // A map has the second moment of equal people over equal links, or its nominal value: the square of the radius.
    let keys = vec![KeyRange::parse("coordination.damping=1..10").unwrap()];
    let both = FILE.case("both-own");
    let family = Family::new(&both.text, "both.toml".as_ref(), &["link.loss=10%".to_owned()], keys).unwrap();
    let found = family.radius(&[5.0], &mut FamilyScratch::default()).unwrap();
    assert!(found.is_nominal && (found.radius - both.radius.powi(2)).abs() < 1e-9, "{found:?}");
}
