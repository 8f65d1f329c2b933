//! `cohaptic stability point --switching`, against motions computed by an independent program: `crates/stability/tests/reference/contact_motions.py`.

use std::process::Command;

use crate::integration::desk::Desk;

const PUSHED: &str = r#"
[scene]
title = "Three who push"
duration = "1s"
count = 3
[object]
mass = 0.45
enclosure = { min = -0.02, max = 0.03, stiffness = 500.0, damping = 5.0 }
[coordination]
strategy = "average-position"
stiffness = 1000.0
damping = 5.0
update = "8ms"
[peer]
contact = { push = "+x" }
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 3500.0, damping = 5.0 }
[link]
delay = "8ms"
"#;

/// By how much the fastest of some motions grows in a frame, by the program in Python; `None` without one, which is said.
fn followed(file: &std::path::Path) -> Option<f64> {
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/../stability/tests/reference/contact_motions.py");
    let can = Command::new("python3").args(["-c", "import tomllib"]).output().is_ok_and(|output| output.status.success());
    if !can {
        eprintln!("skipped: no python3 of version 3.11 or later was found");
        return None;
    }
    let output = Command::new("python3").arg(program).arg(file).env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    document["growth"].as_f64()
}

#[test]
fn motions_shrink_by_the_rate_that_is_proven() {
    let walls = "enclosure = { min = -0.02, max = 0.03, stiffness = 500.0, damping = 5.0 }";
    for scene in [
        PUSHED.to_owned(),
        PUSHED.replace(walls, ""),
        PUSHED.replace("contact = { push = \"+x\" }", "contact = \"grasp\""),
        PUSHED.replace(walls, "").replace("\"average-position\"\nstiffness = 1000.0", "\"proportional-derivative\"\nstiffness = 300.0"),
    ] {
        let desk = Desk::with("pushed.toml", &scene);
        let document = desk.json("stability point pushed.toml --switching --json");
        let motion = &document["switching"]["motions"][0];
        assert_eq!((&document["switching"]["verdict"], &motion["verdict"]), (&"stable".into(), &"stable".into()), "{scene} {document:#}");
        let rate = motion["rate"].as_f64().unwrap();
        if let Some(growth) = followed(&desk.path("pushed.toml")) {
            assert!(growth < rate + 0.003, "{scene}: {growth} a frame, and proven {rate}");
        }
    }
}

#[test]
fn a_motion_that_grows_is_found_where_every_combination_is_stable() {
    let desk = Desk::with("fingers.toml", include_str!("../../../../scenarios/counterexamples/two-fingers.toml"));
    let document = desk.json("stability point fingers.toml --switching --json");
    let motion = &document["switching"]["motions"][0];
    assert_eq!((&document["verdict"], &document["switching"]["verdict"]), (&"stable".into(), &"unstable".into()), "{document:#}");
    let growth = motion["growth"].as_f64().unwrap();
    assert!(motion["changes"].as_u64() > motion["frames"].as_u64() && motion["rate"].is_null(), "{motion}");
    if let Some(followed) = followed(&desk.path("fingers.toml")) {
        assert!(growth > 1.03 && (followed - growth).abs() < 0.02, "{followed} a frame, and found {growth}");
    }
}

#[test]
fn refusals_say_what_could_be_asked() {
    let desk = Desk::with("pushed.toml", PUSHED);
    desk.write("grasped.toml", PUSHED.replace("enclosure", "#").replace("contact = { push = \"+x\" }", ""));
    let outcome = desk.cohaptic("stability point grasped.toml --switching");
    outcome.assert_refused(2, &["grasped.toml: --switching: ", "expected contact = { push = … } or an enclosure"]);
    for (options, words) in [
        ("--set link.loss=5%", "expected links without jitter and loss"),
        ("--set peer.coupling.stiffness=0", "the contact of peer1 has no stiffness"),
        ("--set coordination.update=80ms", "expected at most 150"),
    ] {
        desk.cohaptic(&format!("stability point pushed.toml --switching {options}")).assert_refused(2, &["pushed.toml: --switching: ", words]);
    }
}
