//! `cohaptic run --against`: a scene and a variant of it side by side.

use crate::integration::desk::{Desk, timeless};
use crate::integration::scenes::{RANDOM, TWO};

#[test]
fn both_runs_are_in_the_document_and_each_is_what_it_is_alone() {
    let desk = Desk::with("three.toml", RANDOM);
    let both =
        desk.json("run three.toml --json --set scene.seed=5 --against coordination.strategy=proportional-derivative --against link.delay=30ms");
    let mut first = both.clone();
    let mut second = first.as_object_mut().unwrap().remove("against").expect("the second run");
    assert_eq!(timeless(first), timeless(desk.json("run three.toml --json --set scene.seed=5")));
    assert_eq!(second["title"], "Three users, far apart, with coordination.strategy=proportional-derivative, link.delay=30ms");
    second["title"] = both["title"].clone();
    let alone = "run three.toml --json --set scene.seed=5 --set coordination.strategy=proportional-derivative --set link.delay=30ms";
    assert_eq!(timeless(second), timeless(desk.json(alone)));
}

#[test]
fn without_a_variant_there_is_no_second_run() {
    let document = Desk::with("two.toml", TWO).json("run two.toml --json");
    assert!(document.get("against").is_none());
}

#[test]
fn random_numbers_are_the_same_in_both_runs() {
    let document = Desk::with("three.toml", RANDOM).json("run three.toml --json --against coordination.stiffness=500");
    assert_eq!(document["links"], document["against"]["links"]);
    assert_ne!(document["peers"], document["against"]["peers"]);
}

#[test]
fn the_summary_shows_both() {
    let text = Desk::with("two.toml", TWO).text("run two.toml --no-plot --against link.delay=8ms");
    assert_eq!(text.matches("200ms simulated, 200 ticks").count(), 2, "{text}");
    assert!(text.contains("\nAgainst link.delay=8ms:\n"), "{text}");
    // With 8 ms, those sent until 192 ms arrive: all.
    assert!(text.contains("46 delivered") && text.contains("50 delivered"), "{text}");
}

#[test]
fn the_second_run_is_written_into_a_folder_of_its_own() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("run two.toml --json --out out --against link.delay=8ms");
    assert_eq!(desk.files("out"), desk.files("out/against"));
    let files =
        |document: &serde_json::Value| document["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap().to_owned()).collect::<Vec<_>>();
    assert!(files(&document).contains(&"out/links.csv".to_owned()), "{document:#}");
    assert!(files(&document["against"]).contains(&"out/against/links.csv".to_owned()), "{document:#}");
    desk.text("run two.toml --out first");
    desk.text("run two.toml --out second --set link.delay=8ms");
    for file in ["trajectory.csv", "packets.csv", "links.csv"] {
        assert_eq!(desk.read(&format!("out/{file}")), desk.read(&format!("first/{file}")));
        assert_eq!(desk.read(&format!("out/against/{file}")), desk.read(&format!("second/{file}")));
    }
}

#[test]
fn a_mistake_in_the_variant_is_found_before_anything_runs() {
    let desk = Desk::with("two.toml", TWO);
    let refused = desk.cohaptic("run two.toml --set scene.duration=24h --out out --against link.delay=8");
    refused.assert_refused(2, &["link.delay=8: link.delay", "expected a duration", "^"]);
    assert!(!desk.path("out").exists());
}

#[test]
fn a_mistake_in_the_variant_names_the_option_that_it_was_given_with() {
    let refused = Desk::with("two.toml", TWO).cohaptic("run two.toml --set scene.seed=1 --against link.dlay=8ms");
    refused.assert_refused(2, &["--against link.dlay=8ms: link.dlay: unknown key"]);
    assert!(!refused.stderr.contains("--set"), "{}", refused.stderr);
}
