//! Files that cannot be read, and folders of scenes.

use std::fs;
use std::path::{Path, PathBuf};

use cohaptic_scene::{Scene, SceneError, scene_files};

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
