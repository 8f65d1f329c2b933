//! `cohaptic check`: scenes as tests.

use serde_json::Value;

use crate::integration::desk::{Desk, parse};
use crate::integration::scenes::TWO;

fn scene(expect: &str) -> String {
    format!("{TWO}\n[expect]\n{expect}\n")
}

/// Returns a desk with a folder of scenes whose expectations hold, one of them in an inner folder.
fn folder() -> Desk {
    let desk = Desk::new();
    desk.write("scenes/a.toml", scene("discrepancy = { max = 0.01 }"));
    desk.write("scenes/within/b.toml", scene("delay = [{ min = \"24ms\", max = \"24ms\" }]"));
    desk.write("scenes/c.toml", TWO);
    desk.write("scenes/notes.txt", "not a scene");
    desk
}

#[test]
fn a_folder_that_holds_gives_one_line_a_scene() {
    let text = folder().text("check scenes");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3 + 1, "{text}");
    assert!(lines.contains(&"ok    scenes/a.toml") && lines.contains(&"ok    scenes/within/b.toml"), "{text}");
    assert!(text.contains("ok    scenes/c.toml (it has no [expect]: nothing was compared)"), "{text}");
    // An empty table expects nothing either.
    let empty = folder().text("check scenes/a.toml --set expect={}");
    assert!(empty.contains("ok    scenes/a.toml (it has no [expect]: nothing was compared)"), "{empty}");
    assert!(text.ends_with("3 passed, 0 failed\n"), "{text}");
}

#[test]
fn the_document_lists_every_scene() {
    let document = folder().json("check scenes --json");
    let scenes = document["scenes"].as_array().unwrap();
    let files: Vec<&str> = scenes.iter().map(|scene| scene["file"].as_str().unwrap()).collect();
    assert_eq!(files, ["scenes/a.toml", "scenes/c.toml", "scenes/within/b.toml"]);
    assert!(scenes.iter().all(|scene| scene["passed"] == true && scene["failures"] == Value::Array(Vec::new())), "{document:#}");
}

#[test]
fn files_and_folders_may_be_mixed_and_overridden() {
    let desk = folder();
    assert!(desk.text("check scenes/a.toml scenes/within --set scene.duration=100ms").ends_with("2 passed, 0 failed\n"));
    let outcome = desk.cohaptic("check scenes/a.toml scenes/within --set link.delay=40ms");
    assert_eq!(outcome.status, Some(1));
    assert!(outcome.stdout.contains("ok    scenes/a.toml\nFAIL  scenes/within/b.toml\n"), "{}", outcome.stdout);
}

/// Each of these expectations would pass if the last number before the overflow counted.
#[test]
fn a_run_that_was_cut_short_proves_nothing_about_later_instants() {
    let cut = |expect: &str| {
        let text = scene(expect).replace("200ms", "60s");
        let desk = Desk::with("scene.toml", &text);
        let document = parse(&desk.cohaptic("check scene.toml --set coordination.stiffness=1e12 --json").stdout);
        document["scenes"][0]["failures"].as_array().unwrap().iter().map(|line| line.as_str().unwrap().to_owned()).collect::<Vec<String>>()
    };
    for expect in [
        "position = [{ peer = \"right\", at = \"59s\", min = -1e308, max = 1e308 }]",
        "position = [{ peer = \"right\", at = \"60s\", min = -1e308 }]",
        "position = [{ peer = \"right\", at = \"59s\", min = -1e308 }, { peer = \"right\", at = \"1s\", max = 1e308 }]",
        "discrepancy = { min = 0.5, max = 1e308 }",
        "loss = [{ max = \"100%\" }]",
        "delay = [{ max = \"10s\" }]",
    ] {
        let failures = cut(expect);
        assert!(!failures.is_empty() && failures.iter().all(|line| line.contains("the run diverged at ")), "{expect}: {failures:?}");
    }
    assert!(cut("position = [{ peer = \"right\", at = \"59s\", min = -1.0 }]")[0].contains(", before 59s"));
    // The run proves what happened before the overflow: the place of a copy, and a distance that was exceeded.
    for expect in ["position = [{ peer = \"right\", at = \"1ms\", min = -1.0, max = 1.0 }]", "discrepancy = { min = 0.5 }"] {
        assert_eq!(cut(expect), Vec::<String>::new(), "{expect}");
    }
}

#[test]
fn an_expectation_that_fails_is_named_with_both_numbers() {
    for (expect, parts) in [
        ("discrepancy = { max = 1e-9 }", &["largest discrepancy between copies: ", " m, expected at most 1e-9 m"][..]),
        ("discrepancy = { min = 0.5, max = 1.0 }", &["largest discrepancy", "expected 0.5 to 1 m"]),
        ("position = [{ peer = \"right\", at = \"100ms\", min = 0.5 }]", &["position of right's copy along x at", "expected at least 0.5 m"]),
        ("travel = [{ peer = \"left\", distance = 9.0, max = \"1s\" }]", &["left's copy travels 9 m along x: not reached, expected at most 1 s"]),
        // 13 of 25 packets a link are sent after 96 ms: 104 ms, ... 192 ms are 12.
        ("loss = [{ cause = \"loss\", max = \"1%\" }]", &["fraction of packets dropped on all links (loss): 0.48 (24 of 50), expected at most 0.01"]),
        ("delay = [{ link = { from = \"left\", to = \"right\" }, max = \"20ms\" }]", &["mean delay on left->right: 24ms, expected at most 20ms"]),
        ("stable = false", &["expected unstable, but it is stable: the spectral radius is 0.973070828625", "within"]),
    ] {
        let timeline = "[[timeline]]\nat = \"100ms\"\nlink = \"all\"\nset = { loss = \"100%\" }\n";
        let timeline = if expect.starts_with("loss") { timeline } else { "" };
        // Whether it is stable takes longer to tell.
        let duration = if expect.starts_with("stable") { "2s" } else { "200ms" };
        let text = format!("{}{timeline}", scene(expect)).replace("200ms", duration);
        let desk = Desk::with("scene.toml", &text);
        let outcome = desk.cohaptic("check scene.toml");
        assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(1), ""), "{expect}: {}", outcome.stdout);
        assert!(outcome.stdout.starts_with("FAIL  scene.toml\n      ") && outcome.stdout.ends_with("0 passed, 1 failed\n"), "{}", outcome.stdout);
        let outcome = desk.cohaptic("check scene.toml --json");
        assert_eq!(outcome.status, Some(1));
        let document = parse(&outcome.stdout);
        assert_eq!(document["scenes"][0]["passed"], false);
        let failures = document["scenes"][0]["failures"].as_array().unwrap();
        assert_eq!(failures.len(), 1, "{document:#}");
        assert!(parts.iter().all(|part| failures[0].as_str().unwrap().contains(part)), "{expect}: {failures:?}");
    }
}

#[test]
fn every_expectation_that_fails_is_listed() {
    let desk = Desk::with("scene.toml", &scene("discrepancy = { max = 1e-9 }\ndelay = [{ max = \"1ms\" }, { min = \"1s\" }, { max = \"1s\" }]"));
    let document = parse(&desk.cohaptic("check scene.toml --json").stdout);
    assert_eq!(document["scenes"][0]["failures"].as_array().map(Vec::len), Some(3), "{document:#}");
}

#[test]
fn a_broken_scene_does_not_keep_the_others_from_being_checked() {
    let desk = folder();
    desk.write("scenes/b.toml", TWO.replace("mass = 0.3", "mas = 0.3"));
    desk.write("scenes/d.toml", scene("discrepancy = { max = 1e-9 }"));
    let outcome = desk.cohaptic("check scenes");
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(2), ""));
    for part in ["ok    scenes/a.toml\n", "FAIL  scenes/b.toml\n", "scenes/b.toml:7:1: object.mas: unknown key", "^^^", "FAIL  scenes/d.toml\n"] {
        assert!(outcome.stdout.contains(part), "no {part:?} in {}", outcome.stdout);
    }
    assert!(outcome.stdout.ends_with("3 passed, 2 failed\n"), "{}", outcome.stdout);
    let outcome = desk.cohaptic("check scenes --json");
    let document = parse(&outcome.stdout);
    let passed: Vec<bool> = document["scenes"].as_array().unwrap().iter().map(|scene| scene["passed"].as_bool().unwrap()).collect();
    assert_eq!((outcome.status, passed), (Some(2), vec![true, false, true, false, true]));
    assert!(document["scenes"][1]["failures"][0].as_str().unwrap().contains("object.mas"));
}

#[test]
fn results_do_not_depend_on_how_many_run_at_once() {
    let desk = folder();
    desk.write("scenes/b.toml", "broken");
    desk.write("scenes/d.toml", scene("discrepancy = { max = 1e-9 }"));
    desk.write("scenes/slow.toml", scene("discrepancy = { max = 1e-9 }").replace("200ms", "5s"));
    for options in ["", "--json", "--general"] {
        let [one, two, many] = ["--jobs 1", "--jobs 2", ""].map(|jobs| desk.cohaptic(&format!("check scenes {options} {jobs}")));
        assert_eq!((one.status, &one.stdout), (Some(2), &two.stdout));
        assert_eq!(one.stdout, many.stdout);
    }
    assert_eq!(desk.cohaptic("check scenes").stdout, desk.cohaptic("check scenes --general").stdout);
}

#[test]
fn what_is_not_there_cannot_be_checked() {
    let desk = folder();
    desk.cohaptic("check nowhere").assert_refused(3, &["nowhere", "cannot be read"]);
    desk.cohaptic("check nowhere.toml --json").assert_refused(3, &["nowhere.toml: cannot be read"]);
    desk.write("empty/notes.txt", "not a scene");
    desk.cohaptic("check empty").assert_refused(2, &["empty: no scene here"]);
    desk.cohaptic("check").assert_refused(2, &["SCENE"]);
    desk.cohaptic("check scenes --jobs 0").assert_refused(2, &["--threads"]);
}

#[test]
fn a_path_that_is_not_there_does_not_keep_the_others_from_being_checked() {
    let desk = folder();
    let outcome = desk.cohaptic("check nowhere scenes");
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stdout.starts_with("FAIL  nowhere\n      nowhere: cannot be read: "), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("\nok    scenes"), "{}", outcome.stdout);
}

#[test]
fn a_scene_whose_hand_is_missing_is_an_input_error() {
    let desk = folder();
    desk.write("scenes/b.toml", TWO.replace("{ force = 1.5 }", "{ file = \"gone.csv\" }"));
    let outcome = desk.cohaptic("check scenes");
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stdout.contains("gone.csv") && outcome.stdout.ends_with("3 passed, 1 failed\n"), "{}", outcome.stdout);
}

/// Clocks that drift by 200 ppm have a frame of minutes, with samples in the ten thousands: the second moment would take hours. A check of such a scene took ten
/// minutes and said nothing. Smaller drifts have longer frames, which the simulation takes longer to pass.
#[test]
fn a_second_moment_that_takes_long_is_told_by_a_simulation_and_that_is_said() {
    let desk = Desk::new();
    let scene = crate::integration::desk::shipped("network/clock-offset-and-drift.toml");
    let drifts = "--set peers.left.clock.drift=200ppm --set peers.right.clock.drift=-200ppm --set peers.third.clock.drift=50ppm";
    let line = format!("check {} --set link.loss=5% {drifts}", scene.display());
    let outcome = desk.cohaptic_within(std::time::Duration::from_secs(240), &format!("{line} --json"));
    assert!(matches!(outcome.status, Some(0 | 1)), "{outcome:?}");
    let checked = parse(&outcome.stdout)["scenes"][0].clone();
    let note = checked["notes"][0].as_str().unwrap();
    assert!(note.starts_with("stable: judged by a simulation") && note.contains("operations"), "{note}");
    // A scene without chance has nothing to note.
    assert_eq!(folder().json("check scenes/a.toml --json")["scenes"][0]["notes"], Value::Array(Vec::new()));
}
