//! Who watches an analysis sees how far it is, and may end it; what would take too long is refused before it is begun.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use cohaptic_scene::Scene;
use cohaptic_stability::{Admittance, AnalysisError, Limits, Method, Watch, analyse_watched, judge_watched, mean_square_watched};

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

/// Counts how often it is asked, and ends the work at the n-th time.
struct Ends {
    at: usize,
    asked: AtomicUsize,
    /// What is expected, and what is done.
    operations: Mutex<(f64, f64)>,
}

impl Ends {
    fn at(at: usize) -> Self {
        Self { at, asked: AtomicUsize::new(0), operations: Mutex::new((0.0, 0.0)) }
    }

    fn asked(&self) -> usize {
        self.asked.load(Ordering::Relaxed)
    }
}

impl Watch for Ends {
    fn expects(&self, operations: f64) {
        self.operations.lock().unwrap().0 += operations;
    }

    fn done(&self, operations: f64) {
        self.operations.lock().unwrap().1 += operations;
    }

    fn stops(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) + 1 >= self.at
    }
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

/// What is done is of the order of what was expected, and an analysis that is watched is the one that is not.
#[test]
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
