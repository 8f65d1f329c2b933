//! Ten thousand peers do what the analysis, which looks at a few equal ones, says of them.

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, PartKind, analyse};

const PEERS: usize = 10_000;
/// A frame of the analysis: from sample to sample.
const FRAME_MS: u64 = 8;
/// After these, modes that are not the largest have sunk below one part in 10⁸.
const SETTLED: u64 = 30;

const SCENE: &str = r#"
    scene = { duration = "1s", count = 10000 }
    object = { mass = 10000.0, damping = 20.0, velocity = 0.3 }
    coordination = { strategy = "average-position", stiffness = 20000.0, damping = 10.0, update = "8ms" }
    peer = { contact = "none", device = { mass = 0.1, damping = 1.0 }, tick = "2ms" }
    peers = [{ name = "peer1", position = 0.5 }]
    link = { delay = "24ms" }
"#;

/// The velocity of all copies on average and that of the first beside another, after that number of frames.
fn together_and_apart(frames: u64) -> [f64; 2] {
    let set = [format!("scene.duration=\"{}ms\"", FRAME_MS * frames)];
    let scene = Scene::parse(SCENE, "many.toml".as_ref(), &set).unwrap();
    let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
    let velocity = |peer: usize| summary.peers[peer].velocity[0];
    [(0..PEERS).map(velocity).sum::<f64>() / crate::properties::count(PEERS), velocity(0) - velocity(1)]
}

/// The factor of growth a frame: the modulus of the larger root of z² = a·z + b, which four values in a row give if two conjugate modes are left.
fn growth([p, q, r, s]: [f64; 4]) -> f64 {
    let determinant = q * q - p * r;
    let (a, b) = ((q * r - p * s) / determinant, (q * s - r * r) / determinant);
    let discriminant = a * a / 4.0 + b;
    if discriminant < 0.0 { libm::sqrt(-b) } else { (a / 2.0).abs() + libm::sqrt(discriminant) }
}

/// What all do together grows by a quarter a frame, and what they do apart decays: of each the radius of its part of the analysis, to 10⁻⁶.
#[test]
fn ten_thousand_peers_grow_and_decay_as_the_analysis_says() {
    let scene = Scene::parse(SCENE, "many.toml".as_ref(), &[]).unwrap();
    let analysis = analyse(&scene, Method::Reduced).unwrap();
    assert_eq!(u128::from(FRAME_MS), analysis.frame.as_millis());
    let radius = |is_meant: fn(PartKind) -> bool| {
        let part = analysis.modes[0].parts.iter().find(|part| is_meant(part.kind)).unwrap();
        (part.copies, part.radius.value)
    };
    let (one, together) = radius(|kind| kind == PartKind::Together);
    let (copies, apart) = radius(|kind| matches!(kind, PartKind::Apart { .. }));
    assert_eq!((one, copies), (1, PEERS - 1));
    assert!(together > 1.2 && apart < 0.97, "{together} {apart}");
    let runs = [0, 1, 2, 3].map(|more| together_and_apart(SETTLED + more));
    for (place, expected) in [together, apart].into_iter().enumerate() {
        let found = growth(runs.map(|run| run[place]));
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} a frame, expected {expected}");
    }
}
