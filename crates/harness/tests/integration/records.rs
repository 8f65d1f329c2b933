//! Sessions with all their files, and replays of these sessions.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use cohaptic_device::Device;
use cohaptic_harness::live::{Inputs, LiveScene, Transmit, replay};
use cohaptic_harness::record::{InputRecorder, Recorder};
use cohaptic_harness::{Model, Simulation, Summary};
use cohaptic_scene::{Scene, SceneContent};

use crate::scenes::Written;

/// Content of each written file, by the name of the file.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

pub(crate) type Observing = (Recorder, InputRecorder);

/// Everything that a session has produced.
#[derive(PartialEq, Debug)]
pub(crate) struct Session {
    pub(crate) files: Files,
    pub(crate) transmits: Vec<Transmit>,
    pub(crate) summary: Summary,
}

fn files(folder: &Path) -> Files {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries.map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap())).collect()
}

/// Runs a session with all records. `drive` drives the session up to any instant, and the rest of the scene runs without inputs.
pub(crate) fn session(
    scene: &Scene,
    devices: impl FnMut(usize) -> Option<Box<dyn Device>>,
    drive: impl FnOnce(&mut LiveScene, &mut Observing, &mut Vec<Transmit>),
) -> Session {
    let folder = tempfile::tempdir().unwrap();
    let mut observer =
        (Recorder::create(folder.path(), scene).unwrap(), InputRecorder::create(folder.path(), scene, SceneContent::default()).unwrap());
    let mut live = LiveScene::new(scene, devices);
    let mut transmits = Vec::new();
    drive(&mut live, &mut observer, &mut transmits);
    while let Some(at) = live.poll_timeout() {
        live.handle_timeout(at, &mut observer).unwrap();
    }
    drain(&mut live, &mut transmits);
    let summary = live.summary();
    observer.0.finish(&summary).unwrap();
    observer.1.finish().unwrap();
    Session { files: files(folder.path()), transmits, summary }
}

pub(crate) fn drain(live: &mut LiveScene, transmits: &mut Vec<Transmit>) {
    transmits.extend(std::iter::from_fn(|| live.poll_transmit()));
}

/// Replays a session from its record of inputs.
pub(crate) fn again(written: &Written, session: &Session) -> (Files, Summary) {
    let text = std::str::from_utf8(&session.files["inputs.csv"]).unwrap();
    let inputs = Inputs::read(text, &written.scene, &written.keys).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let folder = tempfile::tempdir().unwrap();
    let scene = &written.scene;
    let mut observer =
        (Recorder::create(folder.path(), scene).unwrap(), InputRecorder::create(folder.path(), scene, SceneContent::default()).unwrap());
    let summary = replay(scene, &inputs, &mut observer).unwrap();
    observer.0.finish(&summary).unwrap();
    observer.1.finish().unwrap();
    (files(folder.path()), summary)
}

/// Runs the scene in virtual time. All its peers must be simulated.
pub(crate) fn simulated(scene: &Scene) -> (Files, Summary) {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), scene).unwrap();
    let summary = Simulation::new(scene, Model::Least).run(&mut recorder).unwrap();
    recorder.finish(&summary).unwrap();
    (files(folder.path()), summary)
}

/// Returns the first line of the first file in which `one` and `other` differ; `None` if all bytes are equal.
pub(crate) fn first_difference(one: &Files, other: &Files) -> Option<String> {
    if !one.keys().eq(other.keys()) {
        return Some(format!("files {:?} and {:?}", one.keys(), other.keys()));
    }
    let (name, bytes) = one.iter().find(|(name, bytes)| *bytes != &other[*name])?;
    let (one, two) = (String::from_utf8_lossy(bytes), String::from_utf8_lossy(&other[name]));
    let pair = one.lines().zip(two.lines()).enumerate().find(|(_, (a, b))| a != b);
    Some(format!("{name}: {pair:?}, {} and {} lines", one.lines().count(), two.lines().count()))
}
