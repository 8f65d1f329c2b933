//! Contacts that open and close: real peers shrink by the rate that is proven, or grow as the motion that was found.

use core::convert::Infallible;
use std::path::Path;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_proofs::{Guarantee, SwitchingError, prove_switching};
use cohaptic_scene::Scene;
use cohaptic_stability::{Method, Unwatched, Verdict, analyse};

use crate::properties::count;

/// What moves in each frame of 8 ms: the largest velocity, contact force and distance from the first copy.
#[derive(Default)]
struct Sizes {
    frames: Vec<f64>,
    first: f64,
    touching: Vec<bool>,
}

impl Observer for Sizes {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let frame = usize::try_from(row.at.as_nanos() / 8_000_000).unwrap();
        if frame >= self.frames.len() {
            self.frames.resize(frame + 1, 0.0);
        }
        if row.peer == 0 {
            self.first = row.object.position[0];
        }
        let device = if self.touching[row.peer] { row.device.velocity[0] } else { 0.0 };
        let distance = 100.0 * (row.object.position[0] - self.first);
        for size in [row.object.velocity[0], device, distance, row.coupling_force[0]] {
            self.frames[frame] = self.frames[frame].max(size.abs());
        }
        Ok(())
    }
}

/// By which factor a frame real peers move on between two frames.
fn factor(scene: &Scene, from: usize, to: usize) -> f64 {
    let touching = scene.peers.iter().map(|spec| spec.contact != cohaptic_peer::Contact::None).collect();
    let mut sizes = Sizes { touching, ..Sizes::default() };
    let Ok(_) = Simulation::new(scene, Model::Least).run(&mut sizes);
    libm::pow(sizes.frames[to] / sizes.frames[from], 1.0 / count(to - from))
}

const PUSHED: &str = r#"
    scene = { duration = "3s" }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, contact = { push = "+x" } }
    peers = [
        { name = "a", velocity = 0.3 },
        { name = "b", velocity = -0.2, position = 0.004 },
        { name = "c", velocity = 0.1, position = -0.003 },
    ]
    link.delay = "8ms"
"#;

#[test]
fn real_peers_come_to_rest_by_the_rate_that_is_proven() {
    let walls = "object.enclosure={ min = -0.01, max = 0.01, stiffness = 2000.0, damping = 20.0 }";
    for overrides in [
        &[][..],
        &["coordination.strategy=proportional-derivative", "coordination.stiffness=300"],
        &["peer.contact=grasp", walls],
        &["peers.b.contact={ push = \"-x\" }", "coordination.stiffness=300"],
        &["peers.b.contact=none", "peers.c.contact=none", "link.delay=24ms", "coordination.damping=20"],
    ] {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let scene = Scene::parse(PUSHED, Path::new("pushed.toml"), &overrides).unwrap();
        let found = prove_switching(&scene, &Unwatched).unwrap();
        let rate = found.motions[0].rate.unwrap_or_else(|| panic!("{overrides:?}: {found:?}"));
        // The norm that shrinks by the rate is another one: over 200 frames that is a factor of e² at most.
        let seen = factor(&scene, 100, 300);
        assert!(found.guarantee() == Guarantee::Stable && seen < rate + 0.01, "{overrides:?}: {seen} a frame, proven {rate}");
    }
}

#[test]
fn two_fingers_bounce_higher_as_the_motion_that_is_found() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/counterexamples/two-fingers.toml");
    let text = std::fs::read_to_string(file).unwrap();
    let scene = |set: &[String]| Scene::parse(&text, Path::new(file), set).unwrap();
    let shipped = scene(&[]);
    assert_eq!(analyse(&shipped, Method::Reduced).unwrap().verdict(), Verdict::Stable);
    let growth = prove_switching(&shipped, &Unwatched).unwrap().motions[0].growing.unwrap().growth;
    let seen = factor(&shipped, 20, 240);
    // Bounces are irregular: the growth of a piece of a motion varies.
    assert!(seen > 1.02 && (libm::log(seen) / libm::log(growth) - 1.0).abs() < 0.4, "{seen} a frame, found {growth}");
    // With contacts that pull too it comes to rest.
    let grasped = scene(&["peers.left.contact=grasp".to_owned(), "peers.right.contact=grasp".to_owned()]);
    assert_eq!(prove_switching(&grasped, &Unwatched), Err(SwitchingError::NoContact));
    assert!(factor(&grasped, 20, 240) < 1.0);
}
