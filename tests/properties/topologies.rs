//! Peers on a topology do what the analysis of their graph says: what disturbs them grows or decays as fast.

use std::path::Path;
use std::sync::Arc;

use cohaptic_harness::check::{Stability, stability};
use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::{Scene, Topology};
use cohaptic_stability::{Method, Verdict, analyse};

/// Peers of equal mass whose copies a hand displaces once; `stiffness` decides whether they stay together.
fn scene(peers: usize, stiffness: f64, topology: Topology) -> Scene {
    let text = format!(
        r#"
        scene = {{ duration = "6s", count = {peers} }}
        object = {{ mass = 0.3, split-mass = false, damping = 1.0 }}
        coordination = {{ strategy = "average-position", stiffness = {stiffness:?}, damping = 3.0, update = "8ms" }}
        peer = {{ contact = "none", device = {{ mass = 0.1, damping = 1.0 }}, tick = "2ms" }}
        link = {{ delay = "16ms" }}
        "#
    );
    let scene = Scene::parse(&text, Path::new("graph.toml"), &[]).unwrap();
    Scene { topology: Some(Arc::new(topology)), ..scene }
}

fn weighted() -> Topology {
    let rows =
        [[0.0, 2.0, 0.5, 0.0, 0.0], [2.0, 0.0, 1.0, 0.0, 3.0], [0.5, 1.0, 0.0, 0.25, 0.0], [0.0, 0.0, 0.25, 0.0, 1.0], [0.0, 3.0, 0.0, 1.0, 0.0]];
    Topology::graph(&rows.map(Vec::from)).unwrap()
}

type Make = fn() -> Topology;

/// Each topology with its number of peers.
const TOPOLOGIES: [(&str, usize, Make); 4] = [
    ("ring", 9, || Topology::ring(9, 2).unwrap()),
    ("ring of four neighbours", 11, || Topology::ring(11, 4).unwrap()),
    ("star", 6, || Topology::star(6, 2).unwrap()),
    ("graph", 5, weighted),
];

fn radius(peers: usize, stiffness: f64, topology: Topology) -> f64 {
    analyse(&scene(peers, stiffness, topology), Method::Reduced).unwrap().radius.value
}

/// The stiffness at which the analysis finds the edge of stability, halved until it is known to a thousandth.
fn edge(peers: usize, make: Make) -> f64 {
    let (mut low, mut high) = (1.0, 2000.0);
    assert!(radius(peers, low, make()) < 1.0 && radius(peers, high, make()) > 1.0);
    while high / low > 1.001 {
        let middle = f64::midpoint(low, high);
        if radius(peers, middle, make()) < 1.0 { low = middle } else { high = middle }
    }
    low
}

/// 15 % on either side of the edge that the analysis finds, a simulation finds the same.
#[test]
fn simulations_are_stable_where_the_analysis_says_so() {
    for (name, peers, make) in TOPOLOGIES {
        let edge = edge(peers, make);
        for (factor, verdict, expected) in [(0.85, Verdict::Stable, Stability::Stable), (1.15, Verdict::Unstable, Stability::Unstable)] {
            let scene = scene(peers, factor * edge, make());
            assert_eq!(analyse(&scene, Method::Reduced).unwrap().verdict(), verdict, "{name}");
            assert_eq!(stability(&scene, Model::Least, || true), expected, "{name}, {factor} of {edge} N/m");
        }
    }
}

/// How much the largest distance of a copy from rest grows in a frame, over many frames after the slower modes have been left behind.
fn growth(scene: &Scene) -> f64 {
    let size = |milliseconds: u64| {
        let mut scene = scene.clone();
        scene.duration = std::time::Duration::from_millis(milliseconds);
        let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
        let mean = summary.peers.iter().map(|peer| peer.position[0]).sum::<f64>() / crate::properties::count(summary.peers.len());
        summary.peers.iter().map(|peer| (peer.position[0] - mean).powi(2)).sum::<f64>().sqrt()
    };
    // An oscillation is seen at its largest over a while.
    let largest = |from: u64| (0..25).map(|step| size(from + 8 * step)).fold(0.0, f64::max);
    let frames = 400;
    (largest(4000 + 8 * frames) / largest(4000)).powf(1.0 / crate::properties::count(usize::try_from(frames).unwrap()))
}

/// Where a disturbance grows, it grows in each frame by the radius of the analysis.
#[test]
fn simulations_grow_as_fast_as_the_analysis_says() {
    for (name, peers, make) in TOPOLOGIES {
        let mut scene = scene(peers, 1.3 * edge(peers, make), make());
        scene.peers[0].position = [0.001, 0.0, 0.0];
        scene.peers[1].position = [-0.0004, 0.0, 0.0];
        let analysis = analyse(&scene, Method::Reduced).unwrap();
        assert_eq!(analysis.frame.as_millis(), 8);
        let found = growth(&scene);
        assert!(
            analysis.radius.value > 1.005 && (found / analysis.radius.value - 1.0).abs() < 5e-4,
            "{name}: {found}, expected {}",
            analysis.radius.value
        );
    }
}

/// The closed form of a ring of many neighbours is the spectrum of its weights as a graph.
#[test]
fn a_ring_has_the_spectrum_of_its_graph() {
    for (peers, neighbours) in [(40, 8), (9, 6), (8, 2), (7, 6)] {
        let ring = Topology::ring(peers, neighbours).unwrap();
        let row = |from: usize| (0..peers).map(|to| if ring.has_link(from, to) { 0.7 } else { 0.0 }).collect();
        let rows: Vec<Vec<f64>> = (0..peers).map(row).collect();
        let (closed, weighed) = (radius(peers, 300.0, ring), radius(peers, 300.0, Topology::graph(&rows).unwrap()));
        assert!((closed / weighed - 1.0).abs() < 1e-9, "{closed} {weighed}");
    }
}
