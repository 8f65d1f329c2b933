//! Files that cannot be read, and folders of scenes.

use std::fs;
use std::path::{Path, PathBuf};

use cohaptic_scene::{ChangeKind, Scene, SceneError, scene_files};
use cohaptic_units::Instant;

/// A folder of its own for one test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn with_hand(hand: &str) -> String {
    format!(
        "scene = {{ duration = \"1s\", count = 2 }}\nobject.mass = 1\ncoordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\n\
         peer = {{ device.mass = 0.1, coupling.stiffness = 100, hand = {hand} }}\n"
    )
}

#[test]
fn a_scene_that_is_not_there_is_an_error_of_the_system() {
    let error = Scene::read(Path::new("no/such/scene.toml"), &[]).unwrap_err();
    assert!(error.is_io());
    assert!(error.to_string().starts_with("no/such/scene.toml: cannot be read: "), "{error}");
}

#[test]
fn a_scene_that_is_not_text_is_refused_with_the_line() {
    let folder = Folder::new("not-text");
    let path = folder.write("a.toml", b"[scene]\ntitle = \"\xff\xfe\"\n");
    let error = Scene::read(&path, &[]).unwrap_err();
    assert!(!error.is_io());
    let place = error.diagnostic().unwrap();
    assert_eq!((place.line(), place.column(), place.message()), (2, 10, "not UTF-8: expected a text file in TOML"));
}

#[test]
fn a_hand_file_that_is_not_there_is_named_with_the_key_that_names_it() {
    let folder = Folder::new("no-hand");
    let path = folder.write("a.toml", with_hand("{ file = \"gone.csv\" }"));
    let error = Scene::read(&path, &[]).unwrap_err();
    assert!(error.is_io());
    let place = error.diagnostic().unwrap();
    assert_eq!((place.line(), place.key()), (4, "peer.hand.file"));
    assert!(error.to_string().contains(":4:71: peer.hand.file: cannot read "), "{error}");
    assert!(error.to_string().contains("gone.csv: No such file"), "{error}");
}

#[test]
fn a_fault_in_a_hand_file_shows_its_line_and_says_who_named_it() {
    let folder = Folder::new("bad-hand");
    let path = folder.write("a.toml", with_hand("{ file = \"recorded/hand.csv\" }"));
    let csv = folder.write("recorded/hand.csv", "t,fx\n0,1\n0.1,inf\n");
    let error = Scene::read(&path, &[]).unwrap_err();
    assert!(!error.is_io());
    let expected = format!(
        "{}:3:5: peer.hand.file: column fx: \"inf\" is not finite: expected a number\n  |\n3 | 0.1,inf\n  |     ^^^\n\
         note: this file is named at {}:4:71, by the key peer.hand.file",
        csv.display(),
        path.display()
    );
    assert_eq!(error.to_string(), expected);
}

const TURNING: &str = "\
scene = { duration = \"1s\", axes = 3 }
object = { mass = 1, inertia = 0.01 }
coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }
peer = { device = { mass = 0.1, inertia = 0.001 }, coupling = { stiffness = 100, rotational-stiffness = 1 } }
peers = [{ name = \"a\", hand = HAND }, { name = \"b\" }]
timeline = [{ at = \"0.5s\", peer = \"b\", set = { hand = { file = \"hand.csv\" } } }]
";

#[test]
fn a_hand_file_gives_torques_beside_forces_and_wanted_motions() {
    let folder = Folder::new("torques");
    folder.write("hand.csv", "t,fx,fy,fz,tx,ty,tz\n0,1,2,3,4,5,6\n");
    folder.write("motion.csv", "t,x,y,z,tx,ty,tz\n0,1,2,3,0.5,0.25,-1\n");
    folder.write("force.csv", "t,fx,fy,fz\n0,1,2,3\n");
    let read = |hand: &str, overrides: &[&str]| {
        let path = folder.write("a.toml", TURNING.replace("HAND", hand));
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        Scene::read(&path, &overrides)
    };
    let torque = |hand: &str| {
        let scene = read(hand, &[]).unwrap_or_else(|error| panic!("{error}"));
        let torque_of = |what: &ChangeKind| if let ChangeKind::HandTorque { peer: 1, torque } = what { torque.clone() } else { None };
        let changed = scene.timeline.iter().find_map(|change| torque_of(&change.what));
        assert_eq!(changed.map(|torque| torque.value(Instant::ZERO)), Some([4.0, 5.0, 6.0]));
        let device = scene.rotation.unwrap().peers[0].device.clone().unwrap();
        device.torque.map(|torque| torque.value::<3>(Instant::ZERO))
    };
    let arm = "arm = { mass = 0, damping = 1, stiffness = 1 }, follows = { file = \"motion.csv\" }";
    assert_eq!(torque("{ file = \"hand.csv\" }"), Some([4.0, 5.0, 6.0]));
    assert_eq!(torque(&format!("{{ {arm} }}")), Some([0.5, 0.25, -1.0]));
    assert_eq!(torque("{ file = \"force.csv\", torque = [0, 0, 7] }"), Some([0.0, 0.0, 7.0]));
    assert_eq!(torque("{ file = \"force.csv\" }"), None);
    for (hand, overrides, expected) in [
        ("{ file = \"hand.csv\", torque = [0, 0, 7] }", &[][..], "peers.a.hand.torque: a torque and the torques of a file exclude each other"),
        (&format!("{{ {arm}, torque = [0, 0, 7] }}"), &[], "and the torques of a file exclude each other"),
        (
            "{ file = \"hand.csv\" }",
            &["peers.a.device={mass=0.1}", "peer={device={mass=0.1},coupling={stiffness=1}}"],
            "the torque of a hand needs a device that turns: expected device.inertia",
        ),
        ("\"none\"", &["peer={device={mass=0.1},coupling={stiffness=1}}"], "the timeline gives the hand of peer \"b\" a torque"),
        (
            "{ file = \"force.csv\" }",
            &["object={mass=1}", "peer={device={mass=0.1},coupling={stiffness=1}}"],
            "hand.csv:1:12: timeline.0.set.hand.file: column tx: a torque needs an object that turns",
        ),
    ] {
        let error = read(hand, overrides).unwrap_err().to_string();
        assert!(error.contains(expected), "{hand}: {error}");
    }
}

#[test]
fn a_folder_means_every_scene_below_it_in_order() {
    let folder = Folder::new("folder");
    let b = folder.write("b.toml", "");
    let a = folder.write("deep/er/a.toml", "");
    folder.write("hand.csv", "");
    assert_eq!(scene_files(&folder.0).unwrap(), [b.clone(), a]);
    assert_eq!(scene_files(&b).unwrap(), [b]);
}

#[test]
fn a_folder_without_scenes_and_a_path_to_nothing_are_errors() {
    let folder = Folder::new("empty");
    let error = scene_files(&folder.0).unwrap_err();
    assert!(matches!(error, SceneError::NoFile { .. }) && !error.is_io());
    assert!(scene_files(&folder.0.join("nothing")).unwrap_err().is_io());
}
