//! A watch sees the progress of an analysis and may end it; an analysis that would take too long is refused before it is begun.

use std::sync::Mutex;

use cohaptic_scene::Scene;
use cohaptic_stability::{
    Admittance, AdmittanceError, AnalysisError, Boundary, BoundaryOptions, Family, FamilyError, Graph, GraphError, Grid, KeyRange, Limits,
    MOST_MEMORY, Map, Method, PartCost, Unwatched, Watch, analyse_on_watched, analyse_watched, judge_watched, mean_square_watched,
};

use crate::ends::{Ends, ends_wherever_it_is_asked};

const THREE: &str = r#"
    scene        = { duration = "1s", count = 3 }
    object       = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "24ms", loss = { gilbert-elliott = { p = "2%", r = "30%" } } }
"#;

fn three(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Scene::parse(THREE, "three.toml".as_ref(), &overrides).unwrap()
}

fn limits(watch: &Ends) -> Limits<'_> {
    Limits { watch, ..Limits::of_unknowns(usize::MAX) }
}

#[test]
fn whoever_watches_ends_an_analysis_and_is_not_asked_again() {
    let scene = three(&[]);
    for at in [1, 2, 5, 20] {
        let full = Ends::at(at);
        assert_eq!(analyse_watched(&scene, Method::Full, &full).unwrap_err(), AnalysisError::Stopped);
        let mean_square = Ends::at(at);
        assert_eq!(mean_square_watched(&scene, &limits(&mean_square)).unwrap_err(), AnalysisError::Stopped);
        assert_eq!((full.asked(), mean_square.asked()), (at, at));
        // A verdict that was stopped is none, and not a nominal one.
        assert_eq!(judge_watched(&scene, Method::Reduced, &limits(&Ends::at(at))).unwrap_err(), AnalysisError::Stopped);
    }
}

/// The operations done are of the order of those expected, and a watch does not change the analysis.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn operations_are_about_those_that_are_expected() {
    let scene = three(&[]);
    let (full, mean_square) = (Ends::at(usize::MAX), Ends::at(usize::MAX));
    assert_eq!(analyse_watched(&scene, Method::Full, &full), cohaptic_stability::analyse(&scene, Method::Full));
    assert_eq!(mean_square_watched(&scene, &limits(&mean_square)), cohaptic_stability::mean_square(&scene));
    for watch in [full, mean_square] {
        let (expected, done) = *watch.operations.lock().unwrap();
        assert!(expected > 0.0 && done > expected / 5.0 && done < 5.0 * expected, "{done:e} of {expected:e}");
    }
}

/// Of bursts on six links there are 64 joint states. A clock that is 100 ppm fast meets the others after 10 000 of their sendings, 80 s: 30 000 samples
/// are as many rows, whose second moments are 9·10⁸ numbers.
#[test]
fn a_second_moment_that_takes_too_long_is_refused_before_it_is_begun() {
    let scene = three(&[]);
    let watch = Ends::at(usize::MAX);
    let refused = mean_square_watched(&scene, &Limits { operations: 1e7, ..limits(&watch) }).unwrap_err();
    let AnalysisError::TooManyOperations { operations, most } = refused else { panic!("{refused:?}") };
    assert!(operations > most && most.to_bits() == 1e7_f64.to_bits(), "{operations:e}");
    // It takes a second at a billion a second, and not a minute.
    assert!((1e8..1e10).contains(&operations), "{operations:e}");
    let drifting = three(&["peers.peer1.clock.drift=100ppm", "link.loss=5%"]);
    let refused = mean_square_watched(&drifting, &Limits { operations: 1e10, ..limits(&watch) }).unwrap_err();
    assert!(matches!(refused, AnalysisError::TooManyOperations { operations, .. } if operations > 1e12), "{refused:?}");
    let refused = mean_square_watched(&drifting, &limits(&watch)).unwrap_err();
    assert!(matches!(refused, AnalysisError::TooManyMoments { unknowns: Some(numbers), .. } if numbers > 900_000_000), "{refused:?}");
}

/// Watch that records the costs of parts, and ends an analysis that begins a part of more than 10¹⁰ operations.
struct Told {
    most_memory: u64,
    costs: Mutex<Vec<PartCost>>,
}

impl Told {
    const fn allowing(most_memory: u64) -> Self {
        Self { most_memory, costs: Mutex::new(Vec::new()) }
    }

    fn last(&self) -> PartCost {
        *self.costs.lock().unwrap().last().unwrap()
    }
}

impl Watch for Told {
    fn most_memory(&self) -> u64 {
        self.most_memory
    }

    fn begins(&self, cost: &PartCost) {
        self.costs.lock().unwrap().push(*cost);
    }

    fn stops(&self) -> bool {
        self.costs.lock().unwrap().iter().any(|cost| cost.operations > 1e10)
    }
}

/// 450 million samples of each peer are in flight. An analysis tells the cost before it allocates anything of that size, or is refused.
#[test]
fn a_delay_of_a_thousand_hours_is_told_or_refused_before_anything_is_made() {
    let text = THREE.replace("24ms", "1000h");
    let scene = Scene::parse(&text, "three.toml".as_ref(), &["link.loss=0".to_owned()]).unwrap();
    let told = Told::allowing(MOST_MEMORY);
    assert_eq!(analyse_watched(&scene, Method::Reduced, &told).unwrap_err(), AnalysisError::Stopped);
    // A number of each sample, of the average of equal peers.
    assert!(told.last().states > 440_000_000 && told.last().operations > 1e12, "{}", told.last());
    let told = Told::allowing(MOST_MEMORY);
    let refused = Admittance::between_watched(&scene, 0, None, None, &told).unwrap_err();
    assert_eq!((refused, told.last().states > 440_000_000), (AdmittanceError::Analysis(AnalysisError::Stopped), true));
    let refused = analyse_watched(&scene, Method::Full, &Unwatched).unwrap_err();
    assert!(matches!(refused, AnalysisError::TooMuchMemory { states, .. } if states > 2_600_000_000), "{refused}");
    // A map and a boundary have a matrix for each value.
    let range = KeyRange { key: "coordination.stiffness".to_owned(), low: 100.0, high: 2000.0, unit: String::new() };
    let refused = Family::new(&text, "three.toml".as_ref(), &["link.loss=0".to_owned()], vec![range]).map(drop).unwrap_err();
    assert!(matches!(refused, FamilyError::Analysis(AnalysisError::TooMuchMemory { .. })), "{refused}");
}

/// The mean delay of the spikes is 99990/s · 60 ms · 400 ms = 2400 s: 300 thousand samples.
#[test]
fn what_spikes_add_to_the_mean_delay_is_told_too() {
    let scene = three(&["link.loss=0", "link.spike={ rate = 99990.0, height = \"60ms\", decay = \"400ms\" }"]);
    let told = Told::allowing(MOST_MEMORY);
    let refused = Admittance::between_watched(&scene, 0, None, None, &told).unwrap_err();
    assert_eq!(refused, AdmittanceError::Analysis(AnalysisError::Stopped));
    assert!(told.last().states > 290_000, "{}", told.last());
}

#[test]
fn whoever_watches_says_how_much_memory_there_is() {
    let scene = three(&["link.delay=2s", "link.loss=0"]);
    let refused = analyse_watched(&scene, Method::Full, &Told::allowing(1 << 20)).unwrap_err();
    assert!(matches!(refused, AnalysisError::TooMuchMemory { most: 1_048_576, .. }), "{refused}");
    assert!(refused.to_string().contains("at most 1.0 MiB") && refused.to_string().contains("--memory"), "{refused}");
}

#[test]
fn an_admittance_that_is_ended_has_its_first_points() {
    let admittance = Admittance::of(&three(&["link.loss=0"]), 0).unwrap();
    let frequencies: Vec<f64> = (1..=2000).map(|place| 0.01 * f64::from(place)).collect();
    let whole = admittance.response(&frequencies).unwrap();
    let ended = admittance.response_watched(&frequencies, &Ends::at(700)).unwrap();
    // The threads share 256 points at a time: of the third time it is not known which were looked at first.
    assert!(ended.points.len() >= 512 && ended.points.len() < 700, "{}", ended.points.len());
    assert_eq!(ended.points, whole.points[..ended.points.len()]);
}

const LOSS: &str = "link.loss=5%";

/// Equal peers over links that lose independently: an image of the second moment takes microseconds here, and there is a question for each.
#[test]
fn the_second_moment_of_equal_peers_ends() {
    let scene = three(&[LOSS]);
    ends_wherever_it_is_asked(20, |ends| match mean_square_watched(&scene, &limits(ends)) {
        Err(AnalysisError::Stopped) => true,
        found => {
            assert_eq!(found.unwrap().method.word(), "symmetric");
            false
        }
    });
}

/// A delay of 8 s is a thousand samples on their way: there is a question for each point of each circle.
#[test]
fn a_determinant_ends() {
    let scene = three(&["link.loss=0%", "link.delay=8s"]);
    ends_wherever_it_is_asked(1000, |ends| match analyse_watched(&scene, Method::Reduced, ends) {
        Err(AnalysisError::Stopped) => true,
        found => {
            assert_eq!(found.unwrap().method, Method::Determinant);
            false
        }
    });
}

/// The watch is asked before the eigenvalues of each part of a graph, and of each part that the verdict of an admittance needs.
#[test]
fn a_graph_and_the_verdict_of_an_admittance_end() {
    let scene = three(&["link.loss=0%", "scene.count=8"]);
    ends_wherever_it_is_asked(5, |ends| match analyse_on_watched(&scene, &Graph::Ring { neighbours: 2 }, ends) {
        Err(GraphError::Analysis(AnalysisError::Stopped)) => true,
        found => found.is_err(),
    });
    ends_wherever_it_is_asked(1, |ends| {
        matches!(Admittance::between_watched(&scene, 0, None, None, ends), Err(AdmittanceError::Analysis(AnalysisError::Stopped)))
    });
}

/// The matrix of many different peers is asked about while it is made: 60 peers with 12 rows each over some 4000 events are ten million entries.
#[test]
fn the_frame_of_many_different_peers_ends() {
    let peers: Vec<String> = (1..=60).map(|peer| format!("peers.peer{peer}.device.mass=0.1{peer:02}")).collect();
    let overrides: Vec<&str> = ["scene.count=60", "link.loss=0%"].into_iter().chain(peers.iter().map(String::as_str)).collect();
    let scene = three(&overrides);
    let ends = Ends::at(3);
    assert_eq!(analyse_watched(&scene, Method::Reduced, &ends), Err(AnalysisError::Stopped));
    assert_eq!(ends.asked(), 3);
}

/// A cell of a map, and a value of a boundary, ends within: unfinished cells are left out, and finished ones are right.
#[test]
fn a_cell_and_a_value_end_within() {
    let text = THREE.replace("24ms", "8ms");
    let key = |range: &str| KeyRange::parse(range).unwrap();
    let keys = vec![key("coordination.stiffness=100..2000"), key("coordination.damping=1..10")];
    let family = Family::new(&text, "three.toml".as_ref(), &["scene.count=2".to_owned()], keys).unwrap();
    let grid = Grid::new(2, 2).unwrap();
    let whole = Ends::at(usize::MAX);
    assert!(Map::resume_watched(&family, grid, Vec::new(), |_, _| (), &whole).unwrap().is_complete());
    // Four cells: without questions within them there are at most three a row.
    assert!(whole.asked() > 100, "asked {} times", whole.asked());
    let (expected, done) = *whole.operations.lock().unwrap();
    assert!(expected > 0.0 && done > 0.0);
    let ends = Ends::at(20);
    let map = Map::resume_watched(&family, grid, Vec::new(), |_, _| (), &ends).unwrap();
    assert!(map.radius.iter().all(Vec::is_empty), "{map:?}");
    let along = key("coordination.stiffness=100..2000");
    let family = Family::new(&text, "three.toml".as_ref(), &["scene.count=2".to_owned()], vec![along.clone()]).unwrap();
    let options = BoundaryOptions { samples: 4, tolerance: 1.0, ..BoundaryOptions::of(&along) };
    let found = Boundary::find_watched(&family, options, &[], |_| (), &Ends::at(20)).unwrap();
    assert!(found.known.is_empty() && !found.is_settled(), "{found:?}");
}
