//! `cohaptic paper`: the paper again.

use crate::integration::desk::Desk;

#[test]
fn a_file_in_place_of_the_folder_is_refused_before_anything_is_computed() {
    Desk::with("taken", "").cohaptic("paper --quick --out taken").assert_refused(3, &["cannot write taken"]);
}

#[test]
fn a_size_needs_a_folder_and_a_known_word() {
    Desk::new().cohaptic("paper --quick --size page").assert_refused(2, &["--out"]);
    Desk::new().cohaptic("paper --quick --out again --size huge").assert_refused(2, &["one-column"]);
}

#[test]
fn it_takes_no_scene() {
    Desk::new().cohaptic("paper scene.toml").assert_refused(2, &["scene.toml"]);
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_page_the_figures_and_the_data_lie_in_the_folder() {
    let desk = Desk::new();
    let document = desk.json("paper --quick --json --out again --size two-columns");
    let claims = document["claims"].as_array().unwrap();
    assert!(claims.len() > 10 && document["wall_s"].as_f64().unwrap() > 0.0);
    for claim in claims {
        let keys = ["id", "claim", "paper", "says", "ours", "verdict", "scene", "how", "commands"];
        assert!(keys.iter().all(|key| claim[*key].as_str().is_some_and(|text| !text.is_empty())), "{claim}");
        // Each command runs as it stands on the page, in the folder of the page.
        let file = format!("{}.toml", claim["id"].as_str().unwrap());
        for command in claim["commands"].as_str().unwrap().lines() {
            desk.text(&command.strip_prefix("cohaptic ").unwrap().replace(&file, &format!("again/{file}")));
        }
    }
    for figure in document["figures"].as_array().unwrap() {
        let file = figure["file"].as_str().unwrap();
        assert_eq!(cohaptic_picture::testing::faults(&desk.read(&format!("again/{file}"))), [""; 0], "{file}");
        assert!(desk.read(&format!("again/{file}")).contains(" width=\"175mm\""), "{file}");
        assert!(desk.read(&format!("again/{}", file.replace(".svg", ".csv"))).lines().count() > 100);
    }
    assert!(desk.read("again/index.html").starts_with("<!DOCTYPE html>"));
    assert!(!desk.read("again/claims.json").contains("wall_s"));
}
