//! Ten thousand peers do what the analysis, which looks at a few equal ones, says of them.

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, PartKind, analyse};

const PEERS: usize = 10_000;
/// Ticks of 2 ms a frame.
const FRAME_MS: u64 = 8;

/// What all copies do on average and how two of them differ, after that number of frames.
fn together_and_apart(text: &str, frames: u64) -> [f64; 2] {
    let set = [format!("scene.duration=\"{}ms\"", FRAME_MS * frames)];
    let scene = Scene::parse(text, "many.toml".as_ref(), &set).unwrap();
    let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
    let position = |peer: usize| summary.peers[peer].position[0];
    [(0..PEERS).map(position).sum::<f64>() / crate::count(PEERS), position(0) - position(1)]
}

/// The modulus by which d grows a frame: the larger root of z² = a·z + b, which four values in a row give if no other mode is left.
fn growth(values: [f64; 4]) -> f64 {
    let [p, q, r, s] = values;
    let determinant = q * q - p * r;
    let (a, b) = ((q * r - p * s) / determinant, (q * s - r * r) / determinant);
    let discriminant = a * a / 4.0 + b;
    if discriminant < 0.0 { (-b).sqrt() } else { (a / 2.0).abs() + discriminant.sqrt() }
}

#[test]
fn ten_thousand_peers_grow_and_decay_as_the_analysis_says() {
    todo!()
}
