//! Certificates of `stability map --prove`, `boundary --prove` and `point --every-number`, checked by a program that shares no code with this one.

use cohaptic_tests_common::are_all;
use serde_json::Value;

use crate::integration::certificate_checker::{accepts, assert_shares, can_check, other_scene, refuses};
use crate::integration::desk::Desk;

const EQUAL: &str = r#"
scene = { title = "Equal peers", duration = "1s", count = 3 }
object = { mass = 0.45, damping = 0.2 }
coordination = { strategy = "proportional-derivative", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;

/// Scene of one peer whose hand is an arm, one peer that touches the object, and two peers that do not.
const UNEQUAL: &str = r#"
scene = { title = "Four peers", duration = "1s" }
object = { mass = 0.45, damping = 0.2 }
coordination = { strategy = "average-position", stiffness = 300.0, damping = 5.0, update = "8ms", scaling = "inverse-n" }
peer = { contact = "none", device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
peers = [
    { name = "arm", contact = "grasp", hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 200.0 }, follows = { sine = { amplitude = 0.04, frequency = 0.25, phase = 0.0 } } } },
    { name = "touches", contact = "grasp" },
    { name = "third" },
    { name = "fourth" },
]
link = { delay = "13ms" }
"#;

/// Scene with one-sided contacts of two peers along two axes, and one faster link.
const TWO_AXES: &str = r#"
scene = { title = "Two directions", duration = "1s", axes = 2 }
object = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 20.0, update = "8ms" }
peer = { contact = "none", device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
peers = [{ name = "left", contact = { push = "+x" } }, { name = "right", contact = { push = "-y" } }, { name = "third" }]
link = { delay = "24ms" }
links = [{ from = "left", to = "right", delay = "16ms" }]
"#;
/// Scene of equal peers, and one peer from which samples arrive later.
const FAR: &str = r#"
scene = { title = "One far away", duration = "1s" }
object = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 400.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
peers = [{ name = "far", contact = "none" }, { name = "a" }, { name = "b" }]
link = { delay = "8ms" }
links = [{ from = "far", to = "a", delay = "13ms" }, { from = "far", to = "b", delay = "13ms" }]
"#;

#[test]
fn certificates_hold_for_a_checker_that_shares_no_code() {
    if !can_check() {
        return;
    }
    // Peers that are told apart by their links alone.
    let alike = FAR.replace(", contact = \"none\"", "");
    // One map of each kind of scene, and of a strategy that only some scenes have.
    let by_day = [
        (EQUAL, "--x coordination.stiffness=100..3050 --y coordination.damping=30..60 --prove 2 --set coordination.strategy=average-position"),
        (UNEQUAL, "--x coordination.stiffness=210..400 --y peer.coupling.stiffness=500..1500 --prove 2"),
        (FAR, "--x coordination.stiffness=50..225 --y peer.coupling.stiffness=500..1500 --prove 2"),
        (EQUAL, "--x coordination.stiffness=1005..2000 --y coordination.damping=10..20 --prove 2 --set coordination.strategy=extrapolated"),
    ];
    let at_night = [
        (alike.as_str(), "--x coordination.stiffness=50..225 --y peer.coupling.stiffness=500..1500 --prove 2"),
        (EQUAL, "--x coordination.stiffness=100..800 --y peer.coupling.stiffness=500..2000 --prove 2"),
        (EQUAL, "--x coordination.stiffness=50..175 --y peer.coupling.damping=0..10 --prove 2 --set coordination.damping=0 --set object.damping=15"),
        (UNEQUAL, "--x coordination.stiffness=20..3000 --y peer.coupling.stiffness=500..2500 --prove 2"),
        (EQUAL, "--x object.mass=0.3..1.15 --y coordination.stiffness=550..1000 --prove 2 --set coordination.strategy=average-position"),
        (EQUAL, "--x object.mass=0.1..1.05 --y object.damping=0..2.5 --prove 2"),
        (EQUAL, "--x peer.device.mass=0.275..0.5 --y peer.device.damping=0..10 --prove 2"),
    ];
    let more = if are_all() { &at_night[..] } else { &[] };
    for (scene, options) in by_day.iter().chain(more) {
        let desk = Desk::with("scene.toml", scene);
        let document = desk.json(&format!("stability map scene.toml {options} --certificate --out out --json"));
        let text = accepts(&desk, "out/certificate.json", options);
        let region = &document["regions"][0];
        assert_shares(&text, region);
        assert!(region["undecided"].as_f64().unwrap() < 0.9, "{region}");
    }
}

/// A line and spans of numbers are checked as regions are: the checker says the same stretches of numbers.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_lines_and_numbers_hold_too() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", EQUAL);
    let document =
        desk.json("stability boundary scene.toml --along coordination.stiffness=100..6000 --prove --tolerance 1 --certificate --out out --json");
    let text = accepts(&desk, "out/certificate.json", "out/certificate.json");
    assert!(text.contains(" boxes hold: stable "), "{text}");
    let open: f64 = document["stretches"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|one| one["verdict"] == "undecided")
        .map(|one| one["high"].as_f64().unwrap() - one["low"].as_f64().unwrap())
        .sum();
    assert!(text.contains(&format!("undecided {:.3} %", 100.0 * open / 5900.0)), "{text} {document}");
    // `None`: something has no limit; else whether the checker follows the numbers without end.
    for (scene, options, without_end) in [
        (EQUAL, "--set object.split-mass=false --set coordination.strategy=average-position --set object.damping=0", Some(true)),
        (EQUAL, "--set object.split-mass=false", None),
        (EQUAL, "--set coordination.strategy=average-position --set object.damping=0", None),
        (
            EQUAL,
            "--set coordination.strategy=average-position --set coordination.scaling=inverse-n --set peer.coupling.scaling=inverse-n --set object.damping=0",
            None,
        ),
        (UNEQUAL, "--set object.split-mass=false", None),
        (FAR, "--set object.split-mass=false", Some(true)),
        (UNEQUAL, "--set object.damping=0 --set peer.coupling.scaling=inverse-n", None),
        // A divided mass with damping: its step maps have four coefficients that vary.
        (EQUAL, "--set coordination.strategy=average-position", Some(true)),
        (EQUAL, "--set coordination.strategy=extrapolated --set object.split-mass=false --set link.delay=11ms", Some(true)),
        (UNEQUAL, "--set object.damping=2", None),
    ] {
        let desk = Desk::with("scene.toml", scene);
        let document = desk.json(&format!("stability point scene.toml {options} --every-number --certificate numbers.json --json"));
        let text = accepts(&desk, "numbers.json", options);
        let spans = document["every_number"]["spans"].as_array().unwrap();
        assert_eq!(document["every_number"]["without_limit"].is_null(), without_end.is_some(), "{document:#}");
        for span in spans.iter().filter(|span| !span["to"].is_null() && span["to"].as_u64().unwrap() < 100_000) {
            let words = format!("{} from {} to {}", span["verdict"].as_str().unwrap(), span["from"], span["to"]);
            assert!(text.contains(&words), "{options}: {words}: {text}");
        }
        let last = spans.last().unwrap();
        match without_end {
            Some(true) => assert!(text.contains(&format!("{} from {} on", last["verdict"].as_str().unwrap(), last["from"])), "{options}: {text}"),
            Some(false) => assert!(text.contains(&format!("{} from {} to", last["verdict"].as_str().unwrap(), last["from"])), "{options}: {text}"),
            None => {}
        }
    }
}

/// In the mean square the same checker follows second moments, and of contacts quadratic forms.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_moments_and_of_contacts_hold_too() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", EQUAL);
    for (options, words) in [
        ("--set coordination.strategy=average-position --set object.split-mass=false --set link.loss=20%", "hold: stable from 2 on"),
        (
            "--set object.split-mass=false --set link.loss=10% --every-number 15..60",
            "stable from 15 to 21, unstable from 22 to 46, stable from 47 to 60",
        ),
        ("--set coordination.stiffness=60000 --set link.loss=20% --every-number 2..2", "hold: unstable from 2 to 2"),
        (
            "--set peer.contact=none --set coordination.stiffness=200 --set coordination.damping=2 --set link.loss=10% --every-number 2..2",
            "hold: stable from 2 to 2",
        ),
    ] {
        let every = if options.contains("--every-number") { "" } else { "--every-number" };
        desk.text(&format!("stability point scene.toml {options} {every} --certificate numbers.json"));
        let text = accepts(&desk, "numbers.json", options);
        assert!(text.contains(words), "{options}: {text}");
    }
    desk.write("axes.toml", TWO_AXES);
    let push = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/network/push-contact.toml");
    for (scene, words) in [(push, "contacts that open and close: stable"), ("axes.toml", "contacts that open and close: stable, stable")] {
        desk.text(&format!("stability point {scene} --switching --certificate contacts.json"));
        let text = accepts(&desk, "contacts.json", "contacts.json");
        assert!(text.contains(words), "{text}");
    }
    // Of the second scene no axis may be missing, and none stand there twice.
    let axes: Value = serde_json::from_str(&desk.read("contacts.json")).unwrap();
    refuses(&desk, &axes, "/motions", Value::Array(axes["motions"].as_array().unwrap()[..1].to_vec()), "is missing");
    refuses(&desk, &axes, "/motions/1", axes["motions"][0].clone(), "stands there twice");
    refuses(
        &desk,
        &axes,
        "/scene",
        axes["scene"].as_str().unwrap().replace("\"16ms\"", "\"24ms\"").into(),
        "not shown to fall|not dominant|nothing begins with|classes",
    );
}

/// Certificates whose moments or forms do not prove the verdict are refused.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_moments_and_of_contacts_that_say_more_than_they_show_are_refused() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", EQUAL);
    desk.text("stability point scene.toml --set coordination.strategy=average-position --set object.split-mass=false --set link.loss=20% --every-number 3..9 --certificate numbers.json");
    let push = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/network/push-contact.toml");
    desk.text(&format!("stability point {push} --switching --certificate contacts.json"));
    desk.text("stability point scene.toml --set link.loss=20% --every-number 2..2 --certificate pair.json");
    let [numbers, contacts, pair] =
        ["numbers.json", "contacts.json", "pair.json"].map(|file| serde_json::from_str::<Value>(&desk.read(file)).unwrap());
    let half = |digits: &Value| Value::from(digits.as_str().unwrap()[..16].to_owned());
    let changes = [
        (&numbers, "/spans/0/verdict", "unstable".into(), "something else"),
        (&numbers, "/spans/0/moments/0/factor", 1.5.into(), "something else"),
        (&numbers, "/spans/0/moments/0/factor", 0.05.into(), "leaves more"),
        (&numbers, "/spans/0/moments/0/blocks/0", half(&numbers["spans"][0]["moments"][0]["blocks"][0]), "expected a moment"),
        (&numbers, "/scene", other_scene(&numbers, "stiffness = 1000.0", "stiffness = 60000.0"), "leaves more"),
        (&pair, "/spans/0/verdict", "unstable".into(), "something else"),
        (&pair, "/spans/0/moments/0/factor", 1.5.into(), "something else"),
        (&pair, "/spans/0/moments/0/factor", 0.5.into(), "leaves more"),
        (&pair, "/spans/0/moments/0/blocks", numbers["spans"][0]["moments"][0]["blocks"].clone(), "expected 2 kinds"),
        (&pair, "/spans/0/moments/0/blocks/1", half(&pair["spans"][0]["moments"][0]["blocks"][1]), "expected a moment"),
        (&pair, "/spans/0/moments/0/blocks/0", pair["spans"][0]["moments"][0]["blocks"][1].clone(), "expected a moment"),
        (&pair, "/spans/0/moments/0/depth", 5.into(), "expected a moment"),
        (&pair, "/spans/0/moments/0/heard", Value::Null, "two numbers are heard"),
        (&pair, "/spans/0/to", 3.into(), "two together with more"),
        (&pair, "/scene", other_scene(&pair, "stiffness = 1000.0", "stiffness = 60000.0"), "leaves more"),
        (&pair, "/scene", other_scene(&pair, "damping = 0.2", "damping = 900.0"), "leaves more"),
        (&pair, "/scene", other_scene(&pair, "delay = \"8ms\"", "delay = \"16ms\""), "leaves more|a sample that is missing"),
        (&contacts, "/motions/0/factor", 0.2.into(), "not shown to fall"),
        (&contacts, "/motions/0/multipliers", half(&contacts["motions"][0]["multipliers"]), "another size"),
        (&contacts, "/motions/0/rest", Value::Array(Vec::new()), "missing"),
        (&contacts, "/motions/0/parts", Value::Array(Vec::new()), "missing"),
        (&contacts, "/scene", other_scene(&contacts, "stiffness = 3500.0", "stiffness = 350000.0"), "not shown to fall|not dominant"),
        (&contacts, "/scene", other_scene(&contacts, "mass = 0.1", "mass = 0.001"), "not shown to fall|not dominant"),
    ];
    for (whole, place, value, words) in changes {
        refuses(&desk, whole, place, value, words);
    }
}

/// Delays and numbers of peers as sides of boxes.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_delays_and_of_every_number_hold_too() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", EQUAL);
    for (command, words) in [
        ("map scene.toml --x link.delay=0ms..6ms --y coordination.stiffness=100..4000 --prove 4", "stable "),
        ("boundary scene.toml --along link.delay=0ms..20ms --prove", "undecided 0.000 %"),
        (
            "map scene.toml --x coordination.stiffness=100..2000 --y coordination.damping=0..20 --prove 4 --every-number 3.. --set object.split-mass=false --set coordination.strategy=average-position",
            "stable ",
        ),
    ] {
        desk.text(&format!("stability {command} --certificate --out out"));
        let text = accepts(&desk, "out/certificate.json", command);
        assert!(text.contains(words), "{command}: {text}");
        let whole: Value = serde_json::from_str(&desk.read("out/certificate.json")).unwrap();
        refuses(&desk, &whole, "/boxes", whole["boxes"].as_array().unwrap()[1..].to_vec().into(), "left out|nothing covers");
    }
}

/// Certificates whose spans leave a number out, or whose numbers do not prove the verdict of a span, are refused.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_certificate_of_numbers_that_says_more_than_it_shows_is_refused() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", EQUAL);
    desk.text("stability point scene.toml --every-number 2..60 --certificate numbers.json --set object.split-mass=false");
    let whole: Value = serde_json::from_str(&desk.read("numbers.json")).unwrap();
    let spans = whole["spans"].as_array().unwrap();
    let of = |verdict: &str| spans.iter().position(|one| one["verdict"] == verdict).unwrap();
    let (stable, unstable) = (of("stable"), of("unstable"));
    let at = |place: usize, key: &str| format!("/spans/{place}{key}");
    let mut fewer = spans.clone();
    fewer.remove(1);
    for (place, value, words) in [
        (at(stable, "/verdict"), "unstable".into(), "no eigenvalue is shown"),
        (at(unstable, "/verdict"), "stable".into(), "not all eigenvalues"),
        ("/spans".to_owned(), fewer.into(), "left out"),
        (at(spans.len() - 1, "/to"), Value::Null, "without a limit"),
        (at(spans.len() - 1, "/to"), 5_000_000.into(), "not dominant|no eigenvalue is shown"),
        (at(stable, "/parts/0/weights"), "".into(), "expected"),
        ("/scene".to_owned(), whole["scene"].as_str().unwrap().replace("8ms\" }", "80ms\" }").into(), "not dominant|sample that is missing"),
        ("/growing".to_owned(), 7.into(), "not in list"),
    ] {
        refuses(&desk, &whole, &place, value, words);
    }
}

/// The verdicts of a certificate must follow from its numbers, for the scene in the certificate.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_certificate_that_says_more_than_it_shows_is_refused() {
    if !can_check() {
        return;
    }
    let desk = Desk::with("scene.toml", EQUAL);
    desk.text(
        "stability map scene.toml --x coordination.stiffness=100..4000 --y peer.coupling.stiffness=500..2500 --prove 3 --certificate --out out",
    );
    let whole: Value = serde_json::from_str(&desk.read("out/certificate.json")).unwrap();
    let boxes = whole["boxes"].as_array().unwrap();
    let of = |verdict: &str| boxes.iter().position(|one| one["verdict"] == verdict).unwrap();
    let (stable, unstable, undecided) = (of("stable"), of("unstable"), of("undecided"));
    let parts = |place: usize| whole["boxes"][place]["parts"].clone();
    let at = |place: usize, key: &str| format!("/boxes/{place}{key}");
    let scene = |from: &str, to: &str| ("/scene".to_owned(), other_scene(&whole, from, to));
    let mut fewer = boxes.clone();
    fewer.remove(undecided);
    let changes = [
        ((at(stable, "/verdict"), "unstable".into()), "not shown to be outside|no eigenvalue is shown"),
        ((at(unstable, "/verdict"), "stable".into()), "not all eigenvalues"),
        ((at(undecided, "/verdict"), "stable".into()), "a part of the scene is missing"),
        ((at(undecided, "/verdict"), "unstable".into()), "no part that grows"),
        ((at(stable, "/parts"), Value::from(vec![parts(stable)[0].clone()])), "a part of the scene is missing"),
        ((at(stable, "/parts/0/circle"), serde_json::json!(["around-zero", 1.5])), "not all eigenvalues"),
        ((at(stable, "/parts/0/coordinates"), parts(stable)[1]["coordinates"].clone()), "expected|not dominant"),
        ((at(unstable, "/parts/0/circle"), serde_json::json!(["around-zero", 0.9])), "not dominant|no eigenvalue is shown"),
        (("/boxes".to_owned(), fewer.into()), "nothing covers"),
        (("/ranges/0/1".to_owned(), 4001.0.into()), "nothing covers"),
        (scene("delay = \"8ms\"", "delay = \"40ms\""), "not dominant|sample that is missing"),
        (scene("count = 3", "count = 30"), "classes of peers|not dominant"),
        (scene("damping = 0.2", "damping = 900.0"), "not dominant"),
        (scene("delay = \"8ms\"", "delay = \"8ms\", loss = \"5%\""), "chance"),
    ];
    for ((place, value), words) in changes {
        refuses(&desk, &whole, &place, value, words);
    }
}
