//! Certificates of `wave` coordination: the checker writes down the sums of waves that copies feel by itself.

use serde_json::{Value, json};

use crate::integration::certificate_checker::{accepts, assert_shares, can_check, other_scene, refuses};
use crate::integration::desk::Desk;

const WAVES: &str = r#"
scene = { title = "Waves", duration = "1s", count = 3 }
object = { mass = 0.45 }
coordination = { strategy = "wave", stiffness = 0.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;
const KINDS: &str =
    "--set scene.count=5 --set 'peers=[{ name = \"peer1\", device = { mass = 0.3 } }, { name = \"peer2\", device = { mass = 0.3 } }]'";
const ARM: &str = "--set scene.count=4 --set 'peers=[{ name = \"peer2\", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } } }]'";
const LOOSE: &str = "--set 'peers=[{ name = \"peer1\", contact = \"none\" }]'";

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_waves_hold_for_a_checker_that_shares_no_code() {
    if !can_check() {
        return;
    }
    let stiffness = "boundary scene.toml --along peer.coupling.stiffness=150000..400000 --prove --tolerance 20000";
    let damping = "boundary scene.toml --along peer.coupling.damping=8..20 --prove --tolerance 0.5";
    for (command, words) in [
        ("map scene.toml --x peer.device.damping=2..20 --y peer.coupling.damping=4..20 --prove 3".to_owned(), "stable "),
        ("boundary scene.toml --along object.mass=0.5..1 --prove --tolerance 0.1".to_owned(), "stable 100.000 %"),
        ("boundary scene.toml --along link.delay=0ms..12ms --prove --set scene.count=2".to_owned(), "stable 100.000 %"),
        (format!("{stiffness} {KINDS} --set link.delay=13ms"), "unstable 100.000 %"),
        (format!("{damping} {KINDS}"), "stable 100.000 %"),
        (format!("{damping} {LOOSE} --set link.delay=31ms --set coordination.wave.impedance=5"), "stable 100.000 %"),
        (format!("{damping} {ARM} --set coordination.wave.on-loss=hold --set peer.phase=3"), "stable 100.000 %"),
    ] {
        let desk = Desk::with("scene.toml", WAVES);
        let document = desk.json(&format!("stability {command} --certificate --out out --json"));
        let text = accepts(&desk, "out/certificate.json", &command);
        if let Some(region) = document["regions"].get(0) {
            assert_shares(&text, region);
        }
        assert!(text.contains(words), "{command}: {text}");
    }
    for (options, words) in [
        ("--every-number --set object.split-mass=false".to_owned(), "hold: stable from 2 on"),
        (format!("--every-number 30..100 {LOOSE}"), "hold: stable from 30 to 100"),
        (format!("--every-number 2..9 {KINDS} --set link.delay=13ms"), "hold: stable from 3 to 9"),
        ("--every-number 2..9 --set peer.coupling.stiffness=250000".to_owned(), "hold: unstable from 2 to 9"),
    ] {
        let desk = Desk::with("scene.toml", WAVES);
        desk.text(&format!("stability point scene.toml {options} --certificate numbers.json"));
        let text = accepts(&desk, "numbers.json", &options);
        assert!(text.contains(words), "{options}: {text}");
    }
}

/// A certificate is accepted only if its numbers show its statement, for the scene that it holds.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_certificate_of_waves_that_says_more_than_it_shows_is_refused() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", WAVES);
    desk.text(&format!("stability boundary scene.toml --along peer.coupling.damping=8..20 --prove --tolerance 1 {KINDS} --certificate --out out"));
    desk.text("stability point scene.toml --every-number 2..4 --set object.split-mass=false --certificate numbers.json");
    let [whole, numbers] = ["out/certificate.json", "numbers.json"].map(|file| serde_json::from_str::<Value>(&desk.read(file)).unwrap());
    let boxes = whole["boxes"].as_array().unwrap();
    let stable = boxes.iter().position(|one| one["verdict"] == "stable").unwrap();
    let parts = whole["boxes"][stable]["parts"].as_array().unwrap();
    // Differences within both classes, and the averages.
    assert_eq!(parts.len(), 3);
    let at = |key: &str| format!("/boxes/{stable}{key}");
    let scene = |from: &str, to: &str| ("/scene".to_owned(), other_scene(&whole, from, to));
    let state = |wanted: Value| {
        let states = parts[2]["states"].as_array().unwrap();
        states.iter().position(|state| (&state[0], &state[3]) == (&json!("waves"), &wanted)).unwrap()
    };
    let (received, sent) = (state("received".into()), state("sent".into()));
    let unequal =
        "links = [{ from = \"peer1\", to = \"peer2\", delay = \"24ms\" }, { from = \"peer2\", to = \"peer1\", delay = \"24ms\" }]\nlink = {";
    for ((place, value), words) in [
        (scene("\"wave\"", "\"average-position\""), "a state that is missing"),
        (scene("\"wave\"", "\"wave\", wave = { impedance = 900.0 }"), "not dominant"),
        (scene("\"wave\"", "\"wave\", wave = { on-loss = \"wait\" }"), "not covered"),
        (scene("delay = \"8ms\"", "delay = \"40ms\""), "a sample that is missing"),
        (scene("update = \"8ms\"", "update = \"9ms\""), "not dominant|a sample that is missing"),
        (scene("mass = 0.45", "mass = 0.0045"), "not dominant"),
        (scene("damping = 5.0 }, coupling", "damping = 900.0 }, coupling"), "not dominant"),
        (scene("delay = \"8ms\"", "delay = \"8ms\", loss = \"5%\""), "chance"),
        (scene("link = {", unequal), "links that differ"),
        ((at("/parts/0/compliance"), json!(1e-9)), "not dominant"),
        ((at("/parts/0/compliance"), json!(0.0)), "compliance above zero"),
        ((at("/parts/2/heard"), json!([1000.0, 5.0])), "whole samples"),
        ((at("/parts/2/time"), json!(1.0)), "not dominant"),
        ((at(&format!("/parts/2/states/{received}/2")), json!(-7)), "without those after them|a sample that is missing"),
        ((at(&format!("/parts/2/states/{received}/3")), "sent".into()), "all classes but one|stand there twice|a sample that is missing"),
        ((at(&format!("/parts/2/states/{sent}/1")), json!(1)), "all classes but one"),
        ((at("/parts/2/states/0/0"), "copy".into()), "not those of the scene"),
        ((at("/parts"), parts[1..].to_vec().into()), "a part of the scene is missing"),
        ((at("/parts/1/coordinates"), parts[2]["coordinates"].clone()), "expected"),
        ((at("/verdict"), "unstable".into()), "not shown to be outside|no eigenvalue is shown"),
        (("/every_number".to_owned(), json!({ "from": 2, "to": null })), "sides that are not those"),
    ] {
        refuses(&desk, &whole, &place, value, words);
    }
    let scene = |from: &str, to: &str| ("/scene".to_owned(), other_scene(&numbers, from, to));
    for ((place, value), words) in [
        (("/spans/0/to".to_owned(), json!(4)), "two peers together with more"),
        (("/spans/0/moments".to_owned(), json!([{}])), "waves in the mean square"),
        (("/spans/1/to".to_owned(), Value::Null), "not dominant"),
        (("/spans/1/verdict".to_owned(), "unstable".into()), "not shown to be outside|no eigenvalue is shown"),
        (scene("\"wave\"", "\"client-server\""), "a server for every number of peers"),
        (scene("stiffness = 3500.0", "stiffness = 250000.0"), "not dominant|not all eigenvalues"),
    ] {
        refuses(&desk, &numbers, &place, value, words);
    }
}
