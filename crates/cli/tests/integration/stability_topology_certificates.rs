//! Certificates of scenes with a `[topology]`: the checker encloses the eigenvalues of the averaging matrix by itself.

use serde_json::{Value, json};

use crate::integration::certificate_checker::{accepts, assert_shares, can_check, other_scene, refuses};
use crate::integration::desk::Desk;

const EQUAL: &str = r#"
scene = { title = "Equal peers", duration = "1s", count = 5 }
object = { mass = 0.45, damping = 0.2 }
coordination = { strategy = "average-position", stiffness = 1500.0, damping = 5.0, update = "8ms" }
peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link = { delay = "8ms" }
"#;
const PD: &str = "--set coordination.strategy=proportional-derivative";
/// Weights of a graph of five peers whose sums of weights all differ.
const UNEVEN: &str = include_str!("../../../proofs/tests/weights/uneven.csv");
/// Weights of the graph of a cube, whose matrix has two triple eigenvalues.
const CUBE: &str = include_str!("../../../proofs/tests/weights/cube.csv");

fn desk(topology: &str) -> Desk {
    let desk = Desk::with("scene.toml", &format!("topology = {topology}\n{EQUAL}"));
    desk.write("uneven.csv", UNEVEN);
    desk.write("cube.csv", CUBE);
    desk
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn certificates_of_topologies_hold_for_a_checker_that_shares_no_code() {
    if !can_check() {
        return;
    }
    let gains = "map scene.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..20 --prove 4";
    let line = |range: &str| format!("boundary scene.toml --along coordination.stiffness={range} --prove --tolerance 20");
    for (topology, command) in [
        ("{ kind = \"star\", hub = \"peer2\" }", gains.to_owned()),
        ("{ kind = \"graph\", file = \"uneven.csv\" }", gains.to_owned()),
        ("{ kind = \"ring\", neighbours = 4 }", format!("{} --set scene.count=6 {PD}", line("50..2000"))),
        ("{ kind = \"graph\", file = \"cube.csv\" }", format!("{} --set scene.count=8 {PD}", line("20..4000"))),
        ("{ kind = \"star\" }", format!("{} --set scene.count=2", line("100..6000"))),
        ("{ kind = \"star\" }", format!("{} --set scene.count=100", line("100..6000"))),
        ("{ kind = \"full\" }", line("100..6000")),
        ("{ kind = \"ring\" }", "boundary scene.toml --along link.delay=0ms..40ms --prove".to_owned()),
        ("{ kind = \"ring\" }", format!("{} --set coordination.strategy=extrapolated", line("10..2000"))),
        (
            "{ kind = \"ring\" }",
            "map scene.toml --x object.mass=0.3..2 --y coordination.stiffness=100..4000 --prove 4 --set object.damping=0".to_owned(),
        ),
    ] {
        let desk = desk(topology);
        let document = desk.json(&format!("stability {command} --certificate --out out --json"));
        let text = accepts(&desk, "out/certificate.json", &format!("{topology} {command}"));
        if let Some(region) = document["regions"].get(0) {
            assert_shares(&text, region);
            assert!(region["undecided"].as_f64().unwrap() < 0.7, "{region}");
        }
        assert!(!text.contains("undecided 100"), "{topology} {command}: {text}");
    }
}

/// The verdicts of a certificate must follow from its numbers, for the scene and the weights in the certificate.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_certificate_of_a_topology_that_says_more_than_it_shows_is_refused() {
    if !can_check() {
        return;
    }
    let desk = desk("{ kind = \"graph\", file = \"uneven.csv\" }");
    desk.text("stability map scene.toml --x coordination.stiffness=100..6000 --y coordination.damping=0..20 --prove 4 --certificate --out out");
    let whole: Value = serde_json::from_str(&desk.read("out/certificate.json")).unwrap();
    let boxes = whole["boxes"].as_array().unwrap();
    let of = |verdict: &str| boxes.iter().position(|one| one["verdict"] == verdict).unwrap();
    let (stable, unstable) = (of("stable"), of("unstable"));
    let parts = whole["boxes"][stable]["parts"].as_array().unwrap();
    let at = |place: usize, key: &str| format!("/boxes/{place}{key}");
    let scene = |from: &str, to: &str| ("/scene".to_owned(), other_scene(&whole, from, to));
    let vectors = whole["topology"]["eigenvectors"].as_str().unwrap();
    let column = vectors.len() / 4;
    let weights = |change: fn(&mut Vec<Vec<f64>>)| {
        let mut rows: Vec<Vec<f64>> = serde_json::from_value(whole["topology"]["weights"].clone()).unwrap();
        change(&mut rows);
        ("/topology/weights".to_owned(), json!(rows))
    };
    let without_one = parts[1..].to_vec();
    let changes = [
        (("/topology/eigenvectors".to_owned(), vectors[..3 * column].into()), "expected 4 eigenvectors"),
        (("/topology/eigenvectors".to_owned(), format!("{}{}", &vectors[..3 * column], &vectors[..column]).into()), "not orthogonal"),
        (("/topology".to_owned(), Value::Null), "keys not covered"),
        (("/topology/weights".to_owned(), Value::Null), "weights of a file"),
        (weights(|rows| rows[0][1] = 3.5), "not mutual"),
        (weights(|rows| rows.truncate(4)), "not mutual"),
        (weights(|rows| rows[0][0] = 1.0), "of a peer with itself"),
        (weights(|rows| (rows[0][1], rows[1][0]) = (-3.0, -3.0)), "below zero"),
        // Other eigenvalues.
        (weights(|rows| (rows[0][2], rows[2][0]) = (2.0, 2.0)), "none of the scene|no eigenvalue|missing|not orthogonal|not dominant"),
        (scene("kind = \"graph\", file = \"uneven.csv\"", "kind = \"star\""), "weights of a file"),
        (scene("count = 5", "count = 6"), "not mutual"),
        (scene("\"average-position\"", "\"proportional-derivative\""), "more neighbours"),
        (scene("link = {", "links = [{ from = \"peer1\", to = \"peer2\", delay = \"24ms\" }]\nlink = {"), "differ, on a topology"),
        (scene("damping = 0.2", "damping = 900.0"), "not dominant"),
        ((at(stable, "/parts/0/eigenvalues"), json!([0.1, 0.1])), "no eigenvalue"),
        ((at(stable, "/parts/0/eigenvalues"), json!([-1.0, 1.0])), "not dominant"),
        ((at(stable, "/parts/0/eigenvalues"), parts[1]["eigenvalues"].clone()), "not dominant|missing"),
        ((at(stable, "/parts"), without_one.into()), "a part of the scene is missing"),
        ((at(stable, "/parts/1"), parts[0].clone()), "a part of the scene is missing"),
        ((at(stable, "/verdict"), "unstable".into()), "not shown to be outside|no eigenvalue is shown"),
        ((at(unstable, "/verdict"), "stable".into()), "not all eigenvalues"),
        (("/every_number".to_owned(), json!({ "from": 2, "to": null })), "sides that are not those"),
    ];
    for ((place, value), words) in changes {
        refuses(&desk, &whole, &place, value, words);
    }
    // The weights of a ring are those of its scene.
    let desk = self::desk("{ kind = \"ring\" }");
    desk.text("stability boundary scene.toml --along coordination.stiffness=100..6000 --prove --tolerance 20 --certificate --out out");
    let whole: Value = serde_json::from_str(&desk.read("out/certificate.json")).unwrap();
    let text = whole["scene"].as_str().unwrap();
    for (from, to, words) in [
        ("kind = \"ring\"", "kind = \"ring\", neighbours = 4", "missing|no eigenvalue|none of the scene|not orthogonal|not dominant"),
        ("kind = \"ring\"", "kind = \"star\"", "missing|no eigenvalue|none of the scene|not orthogonal|not dominant"),
        ("kind = \"ring\"", "kind = \"star\", role = \"relay\"", "not covered"),
        ("kind = \"ring\"", "kind = \"full\"", "not covered"),
    ] {
        refuses(&desk, &whole, "/scene", text.replace(from, to).into(), words);
    }
}
