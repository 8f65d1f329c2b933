//! The pictures of the README and of the pages are those that their commands draw.

use cohaptic_picture::testing::faults;

use crate::desk::{Desk, shipped};

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
fn the_pictures_of_the_readme_are_drawn_by_its_first_command() {
    let desk = Desk::new();
    let page = page("README.md");
    let command = "--against coordination.strategy=proportional-derivative --out out";
    assert!(page.contains(&format!("run scenarios/paper/5-1-ap-2100.toml {command}")), "the README has another command");
    assert!(page.contains("](docs/images/ap.svg)") && page.contains("](docs/images/pd.svg)"));
    desk.cohaptic(&format!("run {} {command} --no-plot", shipped("paper/5-1-ap-2100.toml").display()));
    assert_shown("ap.svg", &desk.read("out/positions.svg"));
    assert_shown("pd.svg", &desk.read("out/against/positions.svg"));
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
