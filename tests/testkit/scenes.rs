//! Scene files as tests.

use std::fs;

use cohaptic_testkit::{check_scene, check_scenes};

use crate::testkit::message;

/// Two copies that are held together by springs over 24 ms: too far away to be stable.
const SCENE: &str = r#"
scene = { duration = "1s", count = 2 }
object = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "24ms" }
"#;

#[test]
fn shipped_scenes_hold() {
    // As a user writes it: relative to the package.
    check_scene("../scenarios/network/loss-independent.toml");
    check_scene("../scenarios/network/ideal.toml");
    check_scene("../scenarios/coordination/n2-pd.toml");
}

#[test]
fn a_scene_that_does_something_else_fails_with_what_it_did() {
    let base = tempfile::tempdir().unwrap();
    let path = base.path().join("mine.toml");
    fs::write(&path, format!("{SCENE}\nexpect = {{ stable = true }}\n")).unwrap();
    let text = message(|| check_scene(&path));
    assert!(text.starts_with(&format!("{}: the results differ from the expectations of the scene:\n  ", path.display())), "{text}");
    assert!(text.contains("stable"), "{text}");
    fs::write(&path, format!("{SCENE}\nexpect = {{ stable = false }}\n")).unwrap();
    check_scene(&path);
}

#[test]
fn a_scene_that_expects_nothing_or_makes_no_sense_fails_with_the_way_out() {
    let base = tempfile::tempdir().unwrap();
    let path = base.path().join("mine.toml");
    let nothing =
        format!("{}: the scene has no expectations to check: expected a table [expect] with the results that must come out", path.display());
    fs::write(&path, SCENE).unwrap();
    assert_eq!(message(|| check_scene(&path)), nothing);
    fs::write(&path, SCENE.replace("24ms", "24 parsecs")).unwrap();
    let text = message(|| check_scene(&path));
    assert!(text.starts_with(&format!("{}:6:18: link.delay: unknown unit \"parsecs\"", path.display())) && text.contains("\n6 | link = "), "{text}");
    assert!(message(|| check_scene(base.path().join("none.toml"))).contains("none.toml: cannot be read: "));
}

#[test]
fn all_scenes_of_a_folder_are_checked_whatever_came_before() {
    let base = tempfile::tempdir().unwrap();
    assert!(message(|| check_scenes(base.path())).contains("no scene here"));
    let write = |name: &str, text: &str| fs::write(base.path().join(name), text).unwrap();
    write("a.toml", "scene = 1");
    write("b.toml", &format!("{SCENE}\nexpect = {{ stable = false }}\n"));
    write("c.toml", SCENE);
    let text = message(|| check_scenes(base.path()));
    assert!(
        text.starts_with("2 of 3 scenes failed:\n")
            && text.contains("a.toml:1:9: scene: found the integer 1")
            && text.contains("c.toml: the scene has no expectations to check"),
        "{text}"
    );
    fs::remove_file(base.path().join("a.toml")).unwrap();
    fs::remove_file(base.path().join("c.toml")).unwrap();
    check_scenes(base.path());
}
