//! With nobody elsewhere a live session is the simulation of its scene, in whatever steps time passes.

use std::path::Path;

use cohaptic_scene::{PeerKind, Scene, scene_files};
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

proptest! {
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
