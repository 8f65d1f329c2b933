//! With nobody elsewhere a live session is the simulation of its scene, in whatever steps time passes.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::Path;

use cohaptic_harness::live::LiveScene;
use cohaptic_harness::{Observer, TickRow};
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::{PeerKind, Scene, scene_files};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::collection::vec;
use proptest::prelude::*;

use crate::records::{Session, first_difference, session, simulated};
use crate::scenes::{read, scene};

/// The scene live, time passing in steps of these lengths \[ns\], again and again.
fn stepped(scene: &Scene, steps: &[u64]) -> Session {
    session(
        scene,
        |_| None,
        |live, observer, _| {
            let mut now = 0;
            for step in steps.iter().cycle() {
                live.handle_timeout(Instant::from_nanos(now), observer).unwrap();
                now += step;
                if live.ended().is_some() {
                    break;
                }
            }
        },
    )
}

fn same(scene: &Scene, steps: &[u64]) -> Result<(), String> {
    let (files, summary) = simulated(scene);
    let mut live = stepped(scene, steps);
    live.files.remove("inputs.csv").unwrap();
    match first_difference(&files, &live.files) {
        Some(difference) => Err(difference),
        // As text: a run that diverged beyond all numbers ends with those that do not equal themselves.
        None => {
            let (simulated, live) = (format!("{summary:?}"), format!("{:?}", live.summary));
            if simulated == live { Ok(()) } else { Err(format!("{simulated}\n{live}")) }
        }
    }
}

fn steps() -> impl Strategy<Value = Vec<u64>> {
    let step = prop_oneof![Just(1_000_000_u64), 1..3_000_000_u64, 1_000_000..50_000_000_u64, Just(0), Just(250_000)];
    vec(step, 1..20).prop_map(|mut steps| {
        steps.push(700_001);
        steps
    })
}

properties! {
    #![proptest_config(crate::cases(60))]

    #[test]
    fn in_any_steps_the_bytes_are_those_of_the_simulation(text in scene(&["simulated"]), steps in steps()) {
        let written = read(text);
        if let Err(difference) = same(&written.scene, &steps) {
            prop_assert!(false, "{difference}\n{}", written.text);
        }
    }
}

/// Every shipped scene that can be cut to a tenth of a second and in which everybody lives here.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_shipped_scenes_are_the_same_live() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let mut compared = 0;
    for file in scene_files(&folder).unwrap() {
        let Ok(scene) = Scene::read(&file, &["scene.duration=100ms".to_owned(), "expect={}".to_owned()]) else { continue };
        let all_here = scene.peers.iter().all(|peer| peer.kind == PeerKind::Simulated);
        if all_here && scene.peers.len() <= 20 {
            same(&scene, &[370_000, 1_000_000, 2_500_000]).unwrap_or_else(|difference| panic!("{}: {difference}", file.display()));
            compared += 1;
        }
    }
    assert!(compared >= 15, "{compared}");
}

/// The attitudes of copy and device of each peer at one instant.
type Attitudes = Vec<(Attitude, Option<Attitude>)>;

/// By instant: where the first copy is, and all attitudes.
#[derive(Default)]
struct Turns(BTreeMap<Instant, (Vec<f64>, Attitudes)>);

impl Observer for Turns {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let (position, attitudes) = self.0.entry(row.at).or_default();
        if row.peer == 0 {
            *position = row.object.position.to_vec();
        }
        let turn = row.turn.unwrap();
        attitudes.push((*turn.object, turn.device.copied()));
        Ok(())
    }
}

#[test]
fn an_onlooker_sees_attitudes_of_the_same_instant_as_positions() {
    let text = "scene = { duration = \"1s\", axes = 3, count = 2 }\ncoordination = { strategy = \"average-position\", stiffness = 100, damping = 5, update = \"8ms\" }\n\
        object = { mass = 1, inertia = [0.001, 0.002, 0.0025], velocity = [1, 0, 0], angular-velocity = [1, 2, 0] }\n\
        peer = { device = { mass = 0.1 }, coupling = { stiffness = 100 } }\n\
        [[peers]]\nname = \"peer1\"\ndevice = { mass = 0.1, inertia = 0.0001 }\ncoupling = { stiffness = 100, rotational-stiffness = 1 }\n";
    let scene = Scene::parse_live(text, Path::new("live.toml"), &[]).unwrap();
    let (mut live, mut seen) = (LiveScene::new(&scene, |_| None), Turns::default());
    let mut shown = Vec::new();
    for millis in 0..50 {
        let Ok(()) = live.handle_timeout(Instant::from_nanos(millis * 1_000_000), &mut seen);
        let peers = [0, 1].map(|peer| live.peer(peer).unwrap());
        let attitudes: Attitudes = peers.iter().map(|peer| peer.turn.unwrap()).map(|turn| (turn.object, turn.device)).collect();
        shown.push((peers[0].object.position.to_vec(), attitudes));
    }
    // The state may be that before or after the latest tick: in either case all of it.
    assert!(shown[..49].iter().all(|shown| seen.0.values().any(|row| row == shown)), "{shown:?}");
    assert!(shown[0].1[0].1.is_some() && shown[0].1[1].1.is_none() && shown[40].1[0] != shown[30].1[0]);
    let still = text
        .replace("inertia = [0.001, 0.002, 0.0025], ", "")
        .replace(", angular-velocity = [1, 2, 0]", "")
        .replace(", inertia = 0.0001", "")
        .replace(", rotational-stiffness = 1", "");
    let live = LiveScene::new(&Scene::parse_live(&still, Path::new("live.toml"), &[]).unwrap(), |_| None);
    assert_eq!(live.peer(0).unwrap().turn, None);
}

/// A modelled person sees and moves in a session as in virtual time, in whatever steps time passes.
#[test]
fn operators_are_the_same_live() {
    let text = r#"
        scene = { duration = "1.5s", seed = 5 }
        object = { mass = 0.45 }
        coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
        peers = [{ name = "left", hand = { operator = { sees = "right" } } }, { name = "right", hand = { operator = {} } }]
        link = { delay = "24ms", jitter = "3ms", loss = "5%" }
        task = { kind = "reach", targets = [0.02, 0.0], radius = 0.015 }
    "#;
    let scene = Scene::parse(text, Path::new("operators.toml"), &[]).unwrap();
    same(&scene, &[370_000, 1_000_000, 2_500_000]).unwrap();
}

/// Simulated devices exchange in a session at the ticks at which they exchange in virtual time.
#[test]
fn slow_devices_are_the_same_live() {
    let text = r#"
        scene = { duration = "300ms", seed = 5 }
        object = { mass = 0.45 }
        coordination = { strategy = "average-position", stiffness = 500.0, damping = 5.0, update = "8ms" }
        peer = { device = { mass = 0.1, damping = 5.0, exchange-every = 3 }, coupling = { stiffness = 900.0, damping = 5.0 }, hand = { force = 1.0 } }
        peers = [{ name = "left", device.exchange-age = 1 }, { name = "right", clock.offset = "1.3ms" }]
        link = { delay = "24ms", jitter = "3ms", loss = "5%" }
    "#;
    let scene = Scene::parse(text, Path::new("slow.toml"), &[]).unwrap();
    same(&scene, &[370_000, 1_000_000, 2_500_000]).unwrap();
}
