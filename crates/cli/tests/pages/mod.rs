//! Every command line on the pages of this project runs here, and prints what the page shows.
//!
//! A page is read from its first line to its last, in a folder of its own in which `scenarios`, `studies` and `docs` are those of the project,
//! and with an empty home; `programs` is the folder here, with what readers do not see. What counts:
//!
//! | on the page | is |
//! | --- | --- |
//! | a fenced block `sh`, and an indented one that begins with a program's name | a script for `sh`. It runs whole; every `cohaptic` in it ends with status 0 |
//! | a fenced block with lines `$ COMMAND` | commands, each with all that it prints (standard error too) in the lines below it. Nothing below: it prints nothing |
//! | a line `…` there, or `…` within a line | any lines, or any text, left out on the page |
//! | a figure with its error, `X +- 1.2e-13` | the same within that error, which may be another one up to ten times: rounding depends on the processor |
//! | `` `cohaptic …` `` within a sentence or a table, and a usage line `cohaptic …` | not run; its options must be in `--help` |
//! | `cargo …` | not run; the packages and programs it names must be there. `cargo run --release -- …` is `cohaptic …` |
//!
//! Comments (`<!-- … -->`), on lines of their own before a block, say what differs:
//!
//! | comment | says |
//! | --- | --- |
//! | `file: NAME` | the block is a file of that name, there for all commands of the page; the lines of the comment itself are, if it has more than one |
//! | `not run: REASON` | the commands of the block are not run; their options are looked up |
//! | `run with: OPTIONS` | every `cohaptic` of the block gets these besides, so that it takes less time |
//! | `run: TEXT; for: TEXT` | the first in place of the second, for the same reason |
//! | `needs: PROGRAM`, `needs: LINE` | where that program is not installed, or that line for `sh` fails, the block is not run |
//! | `exit status: N N …` | of each `cohaptic` of the block in turn |
//! | `exit status varies` | each is 0 or 1, as that of a test that fails now and then |
//! | `source: PATH` | the block is that file of the project, or whole lines of it |
//! | `drawn: FILE` | the picture in the next line is that file, which the commands of the page have written |
//! | `figures vary` | of what is shown, numbers and units of time are not compared |
//! | `figures vary: TEXT; TEXT` | the same, in lines that have one of these texts alone |
//! | `lines vary: TEXT; TEXT` | of a line that has one of these texts nothing else is compared |
//! | `run`, and lines `$ COMMAND` with what they print | commands that readers do not see: where the figures of a sentence or a table come from |
//! | `figures printed above` | of the paragraph or table that follows: each number with a decimal point is one that the session before it printed, rounded |
//!
//! `COHAPTIC_UPDATE_PAGES=1 cargo test -p cohaptic-cli` writes into the pages what the commands print now, and draws the pictures anew; read the difference
//! before it is kept. What was left out stays left out, as long as the lines around it can be found again.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]
#![expect(clippy::print_stderr, reason = "a test that cannot run here says so")]

mod blocks;
mod compare;
mod figures;
mod folder;
mod links;
mod notes;
mod page;
mod pictures;
mod prose;
mod reference;
mod script;
mod update;
mod usage;

use std::fs;
use std::path::{Path, PathBuf};

use crate::pages::blocks::Block;
use crate::pages::page::check;

/// Makes one test per page, so that pages are checked at the same time.
macro_rules! pages {
    ($($(#[$attribute:meta])* $name:ident: $path:literal),* $(,)?) => {
        const PAGES: &[&str] = &[$($path),*];
        $(
            #[test]
            $(#[$attribute])*
            fn $name() {
                check($path);
            }
        )*
    };
}

pages! {
    readme: "README.md",
    python_in_the_book: "docs/python.md",
    contributing: "CONTRIBUTING.md",
    releasing: "RELEASING.md",
    security: "SECURITY.md",
    accuracy: "docs/accuracy.md",
    architecture: "docs/architecture.md",
    campaign: "docs/campaign.md",
    claims: "docs/claims.md",
    cluster: "docs/cluster.md",
    coming_from: "docs/coming-from.md",
    commands: "docs/commands.md",
    commands_analysis: "docs/commands-analysis.md",
    commands_network: "docs/commands-network.md",
    commands_run: "docs/commands-run.md",
    compare: "docs/compare.md",
    the_book: "docs/README.md",
    fitted_link: "docs/fitted-link.md",
    emulator: "docs/emulator.md",
    emulator_stages: "docs/emulator-stages.md",
    extending: "docs/extending.md",
    exec: "docs/exec.md",
    falcon: "docs/falcon.md",
    inverse3: "docs/inverse3.md",
    hard_cases: "docs/hard-cases.md",
    live: "docs/live.md",
    play: "docs/play.md",
    study: "docs/study.md",
    how_to_study: "docs/how-to-study.md",
    live_control: "docs/live-control.md",
    live_protocol: "docs/live-protocol.md",
    measured_cluster: "docs/measured-cluster.md",
    measured_router: "docs/measured-router.md",
    gallery: "docs/gallery.md",
    gallery_links: "docs/gallery-links.md",
    how_to_dev_dependency: "docs/how-to-dev-dependency.md",
    how_to_existing_program: "docs/how-to-existing-program.md",
    #[ignore = ".ci/nightly runs it: real programs run many times in real time"]
    how_to_flaky_test: "docs/how-to-flaky-test.md",
    how_to_keep_a_failure: "docs/how-to-keep-a-failure.md",
    how_to_measure_your_line: "docs/how-to-measure-your-line.md",
    how_to_ci: "docs/how-to-ci.md",
    how_to_named_link: "docs/how-to-named-link.md",
    how_to_map_in_a_paper: "docs/how-to-map-in-a-paper.md",
    how_to_matplotlib: "docs/how-to-matplotlib.md",
    how_to_nat: "docs/how-to-nat.md",
    how_to_second_computer: "docs/how-to-second-computer.md",
    model: "docs/model.md",
    netem: "docs/netem.md",
    own_device: "docs/own-device.md",
    device_crate: "crates/device/README.md",
    falcon_crate: "crates/falcon/README.md",
    inverse3_crate: "crates/inverse3/README.md",
    peer_crate: "crates/peer/README.md",
    prediction: "docs/prediction.md",
    python: "python/README.md",
    reference_commands: "docs/reference-commands.md",
    reference_documents: "docs/reference-documents.md",
    reference_keys: "docs/reference-keys.md",
    reference_link_keys: "docs/reference-link-keys.md",
    reference_links: "docs/reference-links.md",
    reference_network_keys: "docs/reference-network-keys.md",
    relay: "docs/relay.md",
    #[ignore = ".ci/nightly runs it: it takes long"]
    results: "docs/results.md",
    rotation: "docs/rotation.md",
    router: "docs/router.md",
    scenes: "docs/scenes.md",
    stability: "docs/stability.md",
    stability_switching: "docs/stability-switching.md",
    scenarios: "scenarios/README.md",
    stability_crate: "crates/stability/README.md",
    tcp_crate: "crates/tcp/README.md",
    tasks: "docs/tasks.md",
    tested_with: "docs/tested-with.md",
    testing: "docs/testing.md",
    testkit_crate: "crates/testkit/README.md",
    tutorial_existing_program: "docs/tutorial-existing-program.md",
    #[ignore = ".ci/nightly runs it: it takes long"]
    tutorial_laboratory: "docs/tutorial-laboratory.md",
    tutorial_network_test: "docs/tutorial-network-test.md",
    #[ignore = ".ci/nightly runs it: it takes long"]
    tutorial_paper: "docs/tutorial-paper.md",
    tutorial_tray: "docs/tutorial-tray.md",
    wan_crate: "crates/wan/README.md",
    #[ignore = ".ci/nightly runs it: it takes long"]
    which_coordination: "docs/which-coordination.md",
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// All Markdown of the project, apart from built or fetched files.
fn markdown(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name());
        let hidden = name.to_string_lossy().starts_with('.');
        if entry.file_type().unwrap().is_dir() && !hidden && name != "target" {
            markdown(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
}

/// Pages that programs of `benches` write have their commands run there: `benches/tests/integration/commands.rs`; for the lines `cohaptic …` of
/// `docs/measured.md` that is `measured.rs`, beside this folder.
fn written_by_a_benchmark(text: &str) -> bool {
    text.contains("written by\n\n    cargo run --profile dist")
        || text.contains("written by\n\n    cd benches/")
        || text.contains("written by\n\n    benches/build-times")
        || text.contains("written by\n\n    benches/devices")
        || text.contains("written by\n\n    benches/first-result")
        || text.contains("\n\n    benches/measure\n")
}

#[test]
fn every_page_with_a_command_has_a_test() {
    let root = root();
    let mut found = Vec::new();
    markdown(&root, &mut found);
    let mut missing = Vec::new();
    for path in found {
        let (name, text) = (path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned(), fs::read_to_string(&path).unwrap());
        let has_commands = Block::all(&name, &text).iter().any(Block::has_commands);
        if has_commands && name != "CHANGELOG.md" && !written_by_a_benchmark(&text) && !PAGES.contains(&name.as_str()) {
            missing.push(name);
        }
    }
    assert!(missing.is_empty(), "pages with commands and without a test in crates/cli/tests/pages/mod.rs: {missing:?}");
}

#[test]
fn a_file_of_the_project_that_a_page_shows_is_that_file() {
    let root = root();
    let mut found = Vec::new();
    markdown(&root, &mut found);
    let mut shown = 0;
    for page in found {
        let text = fs::read_to_string(&page).unwrap();
        for rest in text.split("<!-- source: ").skip(1) {
            let (path, rest) = rest.split_once(" -->\n```").unwrap();
            let (_, rest) = rest.split_once('\n').unwrap();
            let (block, _) = rest.split_once("\n```").unwrap();
            let file = fs::read_to_string(root.join(path)).unwrap();
            assert!(format!("\n{file}").contains(&format!("\n{block}\n")), "{}: the block is no part of {path}", page.display());
            shown += 1;
        }
    }
    assert!(shown > 0, "no page shows a file");
}

#[test]
fn the_least_version_of_rust_is_that_of_the_manifest() {
    let read = |name: &str| fs::read_to_string(root().join(name)).unwrap();
    let manifest = read("Cargo.toml");
    let version = manifest.lines().find_map(|line| line.strip_prefix("rust-version = \"")).unwrap().trim_end_matches('"');
    for (name, text) in [("README.md", "Rust "), ("docs/tutorial-network-test.md", "Rust "), ("Dockerfile", "FROM rust:")] {
        let text = format!("{text}{version}");
        assert!(read(name).contains(&text), "{name} does not say `{text}`");
    }
}
