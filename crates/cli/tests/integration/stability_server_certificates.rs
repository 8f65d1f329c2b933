//! Certificates of `client-server` coordination: the checker writes down the frame of the server and its clients by itself.

use serde_json::{Value, json};

use crate::integration::certificate_checker::{accepts, assert_shares, can_check, other_scene, refuses};
use crate::integration::desk::Desk;

const SERVER: &str = r#"
scene = { title = "A server", duration = "1s", count = 3 }
object = { mass = 0.45 }
coordination = { strategy = "client-server", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 150.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;
const OBJECT: &str = "--set coordination.client-server.returns=object";
const ARM: &str = "--set 'peers=[{ name = \"peer2\", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } } }]'";
const LOOSE: &str = "--set 'peers=[{ name = \"peer1\", contact = \"none\" }]'";
const LOOSE_CLIENT: &str = "--set scene.count=4 --set 'peers=[{ name = \"peer3\", contact = \"none\" }]'";
const KINDS: &str =
    "--set scene.count=6 --set 'peers=[{ name = \"peer3\", device = { mass = 0.3 } }, { name = \"peer5\", device = { mass = 0.3 } }]'";
const FAR: &str = "--set 'links=[{ from = \"peer1\", to = \"peer3\", delay = \"21ms\" }]'";

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_servers_hold_for_a_checker_that_shares_no_code() {
    if !can_check() {
        return;
    }
    let coupling = "map scene.toml --x peer.coupling.stiffness=1..400 --y peer.coupling.damping=0..8 --prove 4";
    let line = "boundary scene.toml --along peer.coupling.stiffness=1..2000 --prove --tolerance 10";
    for command in [
        coupling.to_owned(),
        format!(
            "map scene.toml --x peer.coupling.stiffness=1..3000 --y object.mass=0.1..2 --prove 4 --set scene.count=4 --set link.delay=13ms {OBJECT}"
        ),
        format!("{coupling} {ARM} --set link.delay=0ms"),
        format!("{line} {LOOSE} --set link.delay=31ms"),
        format!("{line} {LOOSE_CLIENT}"),
        format!("{line} {KINDS}"),
        format!("{line} {KINDS} {OBJECT} --set link.delay=11ms"),
        format!("{line} {FAR} --set scene.count=4"),
        format!("{line} {FAR} {OBJECT} --set scene.count=4 --set coordination.client-server.server=peer2"),
        format!("{line} --set scene.count=2 --set peer.coupling.scaling=inverse-n"),
        "boundary scene.toml --along link.delay=0ms..60ms --prove".to_owned(),
        "map scene.toml --x peer.device.mass=0.02..1 --y peer.device.damping=0.5..20 --prove 3".to_owned(),
    ] {
        let desk = Desk::with("scene.toml", SERVER);
        let document = desk.json(&format!("stability {command} --certificate --out out --json"));
        let text = accepts(&desk, "out/certificate.json", &command);
        if let Some(region) = document["regions"].get(0) {
            assert_shares(&text, region);
        }
        assert!(text.contains("stable ") && !text.contains("undecided 100"), "{command}: {text}");
    }
}

/// The verdicts of a certificate must follow from its numbers, for the scene in the certificate.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_certificate_of_a_server_that_says_more_than_it_shows_is_refused() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", SERVER);
    desk.text("stability map scene.toml --x peer.coupling.stiffness=1..400 --y peer.coupling.damping=0..8 --prove 4 --certificate --out out");
    let whole: Value = serde_json::from_str(&desk.read("out/certificate.json")).unwrap();
    let boxes = whole["boxes"].as_array().unwrap();
    let of = |verdict: &str| boxes.iter().position(|one| one["verdict"] == verdict).unwrap();
    let (stable, unstable) = (of("stable"), of("unstable"));
    let parts = whole["boxes"][stable]["parts"].as_array().unwrap();
    let at = |place: usize, key: &str| format!("/boxes/{place}{key}");
    let scene = |from: &str, to: &str| ("/scene".to_owned(), other_scene(&whole, from, to));
    let with_table =
        |table: &str| ("/scene".to_owned(), Value::from(format!("coordination.client-server = {table}{}", without_coordination(&whole))));
    // The first part is that of the clients' differences, the last that of averages.
    let returned = parts[0]["states"].as_array().unwrap().iter().position(|state| state[0] == "returned").unwrap();
    let without_one = parts[1..].to_vec();
    let changes = [
        (with_table("{ returns = \"object\" }"), "those after them"),
        (with_table("{ server = \"peer3\" }"), "classes of peers|none of the scene|those of the scene"),
        (with_table("{ returns = \"velocity\" }"), "not covered"),
        (with_table("{ returns = \"none\" }"), "not covered"),
        (with_table("{ sends = \"increments\" }"), "not covered"),
        (scene("\"client-server\"", "\"average-position\""), "a state that is missing"),
        (scene("delay = \"8ms\"", "delay = \"40ms\""), "a sample that is missing"),
        (scene("update = \"8ms\"", "update = \"9ms\""), "not dominant|sample that is missing"),
        (scene("count = 3", "count = 6"), "none of the scene"),
        (scene("mass = 0.45", "mass = 0.045"), "not dominant"),
        (scene("damping = 5.0 }, coupling", "damping = 900.0 }, coupling"), "not dominant"),
        (scene("delay = \"8ms\"", "delay = \"8ms\", loss = \"5%\""), "chance"),
        ((at(stable, "/parts/0/compliance"), json!(1e-9)), "not dominant"),
        ((at(stable, "/parts/0/compliance"), json!(0.0)), "compliance above zero"),
        ((at(stable, "/parts/0/heard"), json!([1000.0, 5.0])), "whole samples"),
        ((at(stable, "/parts/0/time"), json!(1.0)), "not dominant"),
        ((at(stable, &format!("/parts/0/states/{returned}/2")), json!(-7)), "without those after them|a sample that is missing"),
        ((at(stable, "/parts/0/states/0/0"), "copy".into()), "not those of the scene"),
        ((at(stable, "/parts"), without_one.into()), "a part of the scene is missing"),
        ((at(stable, "/parts/1/coordinates"), parts[0]["coordinates"].clone()), "expected|not dominant"),
        ((at(stable, "/verdict"), "unstable".into()), "not shown to be outside|no eigenvalue is shown"),
        ((at(unstable, "/verdict"), "stable".into()), "not all eigenvalues|missing"),
    ];
    for ((place, value), words) in changes {
        refuses(&desk, &whole, &place, value, words);
    }
}

/// Returns the text of a scene with `coordination` written key by key, so that further keys can be added.
fn without_coordination(whole: &Value) -> String {
    let text = whole["scene"].as_str().unwrap();
    let line = text.lines().find(|line| line.starts_with("coordination = ")).unwrap();
    let pairs = line.trim_start_matches("coordination = {").trim_end_matches('}').split(", ").map(|pair| format!("\ncoordination.{}", pair.trim()));
    format!("{}{}", pairs.collect::<String>(), text.replace(line, ""))
}
