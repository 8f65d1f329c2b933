//! Certificates of `--switching` for scenes with walls: the checker follows copies at both ends of an axis, and what copies with the same walls have in common.

use serde_json::{Value, json};

use crate::integration::certificate_checker::{accepts, can_check, other_scene, refuses};
use crate::integration::desk::Desk;

const HELD: &str = r#"
scene = { title = "Between walls", duration = "1s", count = 3 }
object = { mass = 0.45, enclosure = { min = -0.02, max = 0.03, stiffness = 2000.0, damping = 20.0 } }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer = { contact = "grasp", device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;
/// Scene with one-sided contacts of two peers along two axes, walls at both ends of each axis, and one faster link.
const TWO_AXES: &str = r#"
scene = { title = "Two directions", duration = "1s", axes = 2 }
object = { mass = 0.45, enclosure = { min = -0.1, max = 0.1, stiffness = 500.0, damping = 20.0 } }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 20.0, update = "8ms" }
peer = { contact = "none", device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
peers = [{ name = "left", contact = { push = "+x" } }, { name = "right", contact = { push = "-y" } }, { name = "third" }]
link = { delay = "24ms" }
links = [{ from = "left", to = "right", delay = "16ms" }]
"#;
const ARM: &str = "--set 'peers=[{ name = \"peer1\", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } } }]'";
const PUSH: &str = "--set 'peers=[{ name = \"peer1\", contact = { push = \"+x\" } }, { name = \"peer2\", contact = \"none\" }]'";

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_walls_hold_for_a_checker_that_shares_no_code() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("held.toml", HELD);
    desk.write("axes.toml", TWO_AXES);
    for (scene, words) in [
        ("held.toml".to_owned(), "close: stable"),
        ("held.toml --set peer.contact=none --set coordination.stiffness=500 --set object.damping=2".to_owned(), "close: stable"),
        // Of two classes with the same walls.
        (format!("held.toml --set coordination.stiffness=300 {PUSH}"), "close: stable"),
        // Contacts are open at rest.
        (format!("held.toml --set coordination.stiffness=300 {ARM}"), "close: stable"),
        ("held.toml --set scene.axes=3 --set scene.count=8".to_owned(), "close: stable"),
        ("axes.toml --set coordination.stiffness=300 --set link.delay=8ms --set links=[]".to_owned(), "close: stable, stable"),
    ] {
        desk.text(&format!("stability point {scene} --switching --certificate contacts.json"));
        let text = accepts(&desk, "contacts.json", &scene);
        assert!(text.trim_end().ends_with(words), "{scene}: {text}");
    }
    // No axis with walls may be missing.
    let axes: Value = serde_json::from_str(&desk.read("contacts.json")).unwrap();
    refuses(&desk, &axes, "/motions", json!([axes["motions"][0]]), "is missing");
    refuses(&desk, &axes, "/motions/1", axes["motions"][0].clone(), "stands there twice");
}

/// Certificates whose forms or multipliers do not prove the verdict, or belong to another scene, are refused.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_certificate_of_walls_that_says_more_than_it_shows_is_refused() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("held.toml", HELD);
    desk.text("stability point held.toml --switching --certificate contacts.json");
    let whole: Value = serde_json::from_str(&desk.read("contacts.json")).unwrap();
    let multipliers = whole["motions"][0]["multipliers"].as_str().unwrap();
    let parts = whole["motions"][0]["parts"].as_array().unwrap();
    let shape = parts[0]["shape"].as_str().unwrap();
    let ticks = 8;
    // Seven of each tick of the walls, and two for those of two copies.
    assert_eq!(multipliers.len(), 16 * (7 + 2) * ticks, "multipliers");
    let (own, shared) = multipliers.split_at(16 * 7 * ticks);
    let minus = |digits: &str, place: usize| {
        let number = -f64::from_bits(u64::from_str_radix(&digits[16 * place..16 * (place + 1)], 16).unwrap());
        format!("{}{:016x}{}", &digits[..16 * place], number.to_bits(), &digits[16 * (place + 1)..])
    };
    let none = |digits: &str| "0".repeat(digits.len());
    let scene = |from: &str, to: &str| ("/scene", other_scene(&whole, from, to));
    let changes = [
        (("/motions/0/factor", json!(0.2)), "not shown to fall"),
        (("/motions/0/multipliers", own.into()), "another size"),
        (("/motions/0/multipliers", format!("{}{shared}", minus(own, 2)).into()), "below zero"),
        (("/motions/0/multipliers", format!("{own}{}", minus(shared, 3)).into()), "below zero"),
        (("/motions/0/multipliers", format!("{own}{}", none(shared)).into()), "not shown to fall"),
        (("/motions/0/multipliers", format!("{}{shared}", none(own)).into()), "not shown to fall"),
        (("/motions/0/parts", json!([parts[0]])), "a part of the scene is missing"),
        (("/motions/0/parts", json!([parts[1]])), "a part of the scene is missing"),
        (("/motions/0/parts/0/shape", shape[..160].into()), "another size"),
        (("/motions/0/parts/0/shape", minus(shape, 0).into()), "not shown to fall"),
        (("/motions/0/axis", json!(1)), "an axis along which contacts push is missing"),
        (scene("stiffness = 2000.0", "stiffness = 200000.0"), "not shown to fall"),
        (scene("stiffness = 2000.0", "stiffness = 0.0"), "walls that are not covered"),
        (scene(", enclosure = { min = -0.02, max = 0.03, stiffness = 2000.0, damping = 20.0 }", ""), "another size"),
        (scene("damping = 20.0 }", "damping = 20.0, friction = 1.0 }"), "walls that are not covered"),
        (scene("delay = \"8ms\"", "delay = \"40ms\""), "a sample that is missing"),
        (scene("count = 3", "count = 4"), "classes of peers"),
        (scene("\"grasp\"", "\"none\""), "nothing begins with"),
        (scene("\"grasp\"", "{ push = \"+x\" }"), "another size"),
    ];
    for ((place, value), words) in changes {
        refuses(&desk, &whole, place, value, words);
    }
}
