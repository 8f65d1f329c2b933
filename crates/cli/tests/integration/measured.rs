//! Every `cohaptic …` command on `docs/measured.md` runs as it stands there, with less work. Its other commands are those of `benches/tests/integration`
//! and of `crates/accuracy/tests/integration/program.rs`.
#![expect(clippy::print_stdout, reason = "a test that is skipped says why")]

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::integration::desk::{Desk, Outcome, parse};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the words after `cohaptic` of each command.
fn commands() -> Vec<Vec<String>> {
    let page = std::fs::read_to_string(root().join("docs/measured.md")).unwrap();
    let words = |line: &str| line.split(' ').map(str::to_owned).collect();
    page.lines().filter_map(|line| line.strip_prefix("    cohaptic ")).map(words).collect()
}

/// Puts another value in the place of an option's.
fn set(words: &mut [String], option: &str, value: &str) {
    let place = words.iter().position(|word| word == option).unwrap_or_else(|| panic!("no {option} in {words:?}"));
    value.clone_into(&mut words[place + 1]);
}

/// Typed in the folder of the project, as the page says.
fn text(words: &[String]) -> String {
    let outcome = Outcome::of(Command::new(env!("CARGO_BIN_EXE_cohaptic")).args(words).current_dir(root()).output().unwrap());
    assert_eq!(outcome.status, Some(0), "{words:?}: {}", outcome.stderr);
    assert!(outcome.stderr.lines().all(|line| line.starts_with("wrote ")), "{words:?}: {}", outcome.stderr);
    outcome.stdout
}

/// The script of docs/measured-devices.md prints a page of the same form after a short run. What the page says of its reports is tested in `benches`.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_session_with_devices_at_two_computers_becomes_a_page() {
    let works = |line: &str| Command::new("sh").args(["-c", line]).output().unwrap().status.success();
    if !works("unshare --map-root-user --net --mount true && test -w /dev/net/tun && ip -V && python3 -V") {
        println!("skipped: this needs namespaces, /dev/net/tun, ip and python3");
        return;
    }
    let script = root().join("benches/devices");
    let printed = Outcome::of(Command::new(&script).args(["--seconds", "3", "--program", env!("CARGO_BIN_EXE_cohaptic")]).output().unwrap());
    assert_eq!(printed.status, Some(0), "{}", printed.stderr);
    let shipped = std::fs::read_to_string(root().join("docs/measured-devices.md")).unwrap();
    let form = |page: &str| page.lines().filter(|line| line.starts_with(['#', '|'])).map(|line| line.split(['|', '#']).count()).collect::<Vec<_>>();
    assert_eq!(form(&printed.stdout), form(&shipped), "{}", printed.stdout);
    assert!(printed.stdout.contains("All of it is one session of 3s "), "{}", printed.stdout);
}

#[test]
fn the_commands_of_the_page_of_measured_figures_run() {
    let desk = Desk::new();
    let mut seen = Vec::new();
    for (number, mut words) in commands().into_iter().enumerate() {
        let folder = format!("out{number}");
        let kind = words[0].clone();
        set(&mut words, "--out", desk.path(&folder).to_str().unwrap());
        match kind.as_str() {
            "campaign" => {
                set(&mut words, "--runs", "9");
                let document = parse(&text(&words));
                assert_eq!((document["runs"].as_u64(), document["runs_computed"].as_u64()), (Some(9), Some(9)), "{words:?}");
                assert_eq!(desk.files(&folder), ["campaign.html", "campaign.json", "runs.parquet"]);
            }
            _ => panic!("docs/measured.md: this test does not know how to run cohaptic {}", words.join(" ")),
        }
        seen.push(kind);
    }
    assert!(seen.contains(&"campaign".to_owned()), "{seen:?}");
}
