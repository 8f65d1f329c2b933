//! Picture of a page whose runs take longer than the time limit of a page. Other pictures are compared in `crates/cli/tests/pages`.

use cohaptic_picture::testing::faults;

use crate::integration::desk::{Desk, shipped};

/// Compares a picture with the file that a page shows; with `COHAPTIC_UPDATE_PAGES` the file is written anew.
fn assert_shown(name: &str, drawn: &str) {
    let file = shipped("../docs/images").join(name);
    if std::env::var_os("COHAPTIC_UPDATE_PAGES").is_some() {
        std::fs::write(&file, drawn).unwrap();
    }
    let shown = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(shown == drawn, "docs/images/{name} is another picture: COHAPTIC_UPDATE_PAGES=1 draws it anew");
    assert_eq!(faults(drawn), [""; 0]);
}

/// The text of a page.
fn page(path: &str) -> String {
    std::fs::read_to_string(shipped("..").join(path)).unwrap()
}

#[test]
fn the_picture_of_campaigns_is_drawn_by_the_command_of_its_page() {
    let desk = Desk::new();
    let page = page("docs/campaign.md");
    let command = "--vary link.loss=0%..30%/7 --vary coordination.strategy=average-position,proportional-derivative --runs 100 --out bands";
    assert!(page.contains(command) && page.contains("](images/campaign.svg)"), "the page has another command");
    desk.text(&format!("campaign {} {command}", shipped("network/loss-independent.toml").display()));
    assert_shown("campaign.svg", &desk.read("bands/discrepancy.svg"));
}
