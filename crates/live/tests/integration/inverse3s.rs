//! Two simulated Inverse3s hold one object over links of 24 ms, down to the messages of their services, in virtual time: the scene
//! `scenarios/live/two-inverse3s.toml`.
//!
//! The expected positions are the equilibrium of the scene: see the comments of its `[expect]`.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fs;
use std::path::Path;
use std::time::Duration;

use cohaptic_device::Device;
use cohaptic_harness::live::{Inputs, LiveScene, replay};
use cohaptic_harness::record::{InputRecorder, Recorder};
use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_inverse3::client::{ClientConfig, Phase};
use cohaptic_inverse3::service::{Fault, FaultKind, Service, ServiceConfig, When};
use cohaptic_inverse3::stepped::SteppedInverse3;
use cohaptic_scene::{PeerKind, Scene, SceneContent, link_keys};
use cohaptic_units::Instant;

/// Time for which a device is armed before the session.
const ARMING: Duration = Duration::from_millis(400);
/// Time at which faults begin, from the beginning of the session.
const FAULTY: Duration = Duration::from_millis(1000);

fn path() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/live/two-inverse3s.toml")
}

fn scene() -> Scene {
    Scene::read_live(&path(), &[]).unwrap()
}

/// Returns an armed device in the hand of the peer at `place`, with these faults.
fn device(scene: &Scene, place: usize, faults: Vec<Fault>) -> Box<dyn Device> {
    let peer = &scene.peers[place];
    let (PeerKind::Inverse3(_, spec), Some(cohaptic_peer::Hand::Arm { arm, follows })) = (&peer.kind, peer.hand.clone()) else {
        panic!("an Inverse3 in a hand: {peer:?}")
    };
    let by_chance = faults.iter().any(|fault| matches!(fault.when, When::Chance(_)));
    let config =
        ServiceConfig { seed: place as u64, mass: peer.device.mass + arm.mass, damping: peer.device.damping, faults, ..ServiceConfig::default() };
    let hand = move |now: Instant, position: [f64; 3], velocity: [f64; 3]| {
        // The hand arms the device at the origin first.
        let elapsed = now.checked_duration_since(Instant::ZERO + ARMING);
        let wanted = elapsed.map_or([0.0; 3], |elapsed| follows.value::<3>(Instant::ZERO + elapsed));
        core::array::from_fn(|axis| arm.stiffness * (wanted[axis] - position[axis]) - arm.damping * velocity[axis])
    };
    let limits = cohaptic_device::Limits { force: spec.force_limit, ..ClientConfig::DEFAULT.limits };
    let mut device = SteppedInverse3::new(Service::new(config, hand), ClientConfig { limits, ..ClientConfig::DEFAULT }).unwrap();
    device.wait(ARMING);
    // Faults by chance may disarm the device even before the session.
    assert!(by_chance || device.snapshot().phase == Phase::Active, "{:?}", device.snapshot());
    Box::new(device)
}

/// Content of each file of a record, by the name of the file.
type Files = BTreeMap<String, Vec<u8>>;

fn record(scene: &Scene, run: impl FnOnce(&mut (Recorder, InputRecorder)) -> cohaptic_harness::Summary) -> Files {
    let folder = tempfile::tempdir().unwrap();
    let inputs = InputRecorder::create(folder.path(), scene, SceneContent::default()).unwrap();
    let mut observer = (Recorder::create(folder.path(), scene).unwrap(), inputs);
    let summary = run(&mut observer);
    observer.0.finish(&summary).unwrap();
    observer.1.finish().unwrap();
    let entries = fs::read_dir(folder.path()).unwrap().map(Result::unwrap);
    entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect()
}

/// Runs a session with these faults of the device of `left`, and returns its record and how often `left` has joined.
fn session(scene: &Scene, faults: &[Fault]) -> (Files, u64) {
    let mut joined = 0;
    let files = record(scene, |observer| {
        let mut live = LiveScene::new(scene, |place| Some(device(scene, place, if place == 0 { faults.to_vec() } else { Vec::new() })));
        while let Some(at) = live.poll_timeout() {
            live.handle_timeout(at, observer).unwrap();
        }
        joined = live.seat_stats(0).unwrap().joined;
        live.summary()
    });
    (files, joined)
}

fn again(scene: &Scene, files: &Files) -> Files {
    let text = std::str::from_utf8(&files["inputs.csv"]).unwrap();
    let keys = link_keys(&path(), &[]).unwrap().into_values().next().unwrap();
    let inputs = Inputs::read(text, scene, &keys).unwrap_or_else(|error| panic!("{error}"));
    record(scene, |observer| replay(scene, &inputs, observer).unwrap())
}

fn assert_same(one: &Files, other: &Files, what: &str) {
    assert!(one.keys().eq(other.keys()), "{what}: {:?} and {:?}", one.keys(), other.keys());
    for (name, bytes) in one {
        assert!(*bytes == other[name], "{what}: {name} differs");
    }
}

/// Each fault of a service, in the middle of a session: the replay of the recorded readings has the same bytes in every file.
#[test]
fn the_replay_of_a_session_with_each_fault_is_equal_to_the_byte() {
    let scene = Scene { duration: Duration::from_millis(1800), ..scene() };
    let (whole, joined) = session(&scene, &[]);
    assert_eq!(joined, 1);
    assert_same(&whole, &again(&scene, &whole), "no fault");
    for kind in FaultKind::ALL {
        let fault = Fault::during(kind, Instant::ZERO + ARMING + FAULTY, Duration::from_millis(300));
        let (faulty, _) = session(&scene, &[fault]);
        assert_same(&faulty, &again(&scene, &faulty), kind.name());
        // A second reply is passed over; every other fault shows in the readings.
        assert_eq!(faulty["inputs.csv"] != whole["inputs.csv"], kind != FaultKind::Doubled, "{}", kind.name());
    }
    let chance = |kind| Fault { kind, when: When::Chance(0.002) };
    let faults: Vec<Fault> = FaultKind::ALL.into_iter().filter(|kind| kind.hits_replies()).map(chance).collect();
    let (faulty, _) = session(&scene, &faults);
    assert_same(&faulty, &session(&scene, &faults).0, "the same seed");
    assert_same(&faulty, &again(&scene, &faulty), "faults by chance");
}

/// The copies rest where the copies of plain masses rest: replies in single precision shift nothing that is seen.
#[test]
fn the_copies_rest_where_plain_masses_do() {
    let scene = scene();
    let mut live = LiveScene::new(&scene, |place| Some(device(&scene, place, Vec::new())));
    while let Some(at) = live.poll_timeout() {
        live.handle_timeout(at, &mut cohaptic_harness::NoObserver).unwrap();
    }
    for (place, expected) in [(0, 0.016_765), (1, 0.013_235)] {
        let state = live.peer(place).unwrap();
        assert!((state.object.position[0] - expected).abs() < 1e-5, "{state:?}");
        assert_eq!(live.seat_stats(place).unwrap().joined, 1);
    }
}

/// Largest difference, after the first second, between FC of a tick and FC of the reading of the same tick \[N\].
#[derive(Default)]
struct Couplings(f64);

impl Observer for Couplings {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if row.at.as_nanos() >= 1_000_000_000 {
            for axis in 0..3 {
                let stretched = row.device.position[axis] - row.object.position[axis];
                let expected = 400.0 * stretched + 2.0 * (row.device.velocity[axis] - row.object.velocity[axis]);
                self.0 = self.0.max((row.coupling_force[axis] - expected).abs());
            }
        }
        Ok(())
    }
}

/// In virtual time a reading is used an exchange later. The reading of a device is that old by itself, so that a session uses the reading at once.
#[test]
fn readings_of_a_device_are_not_delayed_twice() {
    let scene = Scene { duration: Duration::from_millis(1500), ..scene() };
    let mut couplings = Couplings::default();
    let mut live = LiveScene::new(&scene, |place| Some(device(&scene, place, Vec::new())));
    while let Some(at) = live.poll_timeout() {
        let Ok(()) = live.handle_timeout(at, &mut couplings);
    }
    assert!(couplings.0 < 1e-9, "{}", couplings.0);
    let mut simulated = Couplings::default();
    let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut simulated);
    assert!(simulated.0 > 1e-6, "{}", simulated.0);
}
