//! Every command of every page is of one of these kinds; one that is of none fails the test, so that nobody adds one that is not run.
//!
//! | command | is |
//! | --- | --- |
//! | a program of this package | run, with the least work: see below, one test each |
//! | `benches/measure` | run by `script.rs`, as the program that it starts |
//! | `cohaptic …` | run by `crates/cli/tests/integration/measured.rs`, which is where that program can be had |
//! | `cohaptic-accuracy` | run by `crates/accuracy/tests/integration/program.rs`, which is where that program can be had. Its whole line is known |
//! | of `benches/realtime` | not run here: they wait by the wall clock, for an hour even. Package, program and arguments are looked up |
//! | the ignored test of `crates/cli/tests/cluster` | not run here: it takes minutes, and schedulers. Its text is known |
//! | `benches/devices` | makes its page from the reports on the page. `crates/cli/tests/integration/measured.rs` runs it, which is where that program can be had |
//! | `benches/first-result` | not run here: it compiles the project several times, and downloads. Its rows are looked up |
//! | `fuzz/run` | not run here: `.ci/nightly` runs it. Its targets are looked up |
//! | of `benches/peers` | not run here: a workspace of its own with the crates of others, which CI does not build. Folder, programs and scripts are looked up |

use std::process::Command;

use cohaptic_benches::effort::Effort;
use cohaptic_benches::pages::{commands, table};

use crate::manifests::{PACKAGES, default_program, programs};
use crate::{pages, root};

/// What a command is, as far as it is understood.
#[derive(PartialEq, Eq, Debug)]
enum Kind {
    /// A program of this package that writes this page, and with which effort.
    Table { program: String, page: String, effort: Effort },
    /// The script that writes the page on which all is.
    Script,
    /// Of the command line, with these words.
    Cohaptic,
    /// The program of speed against error.
    Accuracy,
    /// Programs of another package, by folder and name.
    Elsewhere(&'static str, Vec<String>),
    /// A script of its own: how long users wait for a first result or for a build, and a session with devices.
    Alone,
    /// The script that runs the fuzz targets.
    Fuzz,
    /// An ignored test of the command line, which is where the program and schedulers can be had.
    IgnoredTest,
}

/// `None` for a command that this test does not know.
fn kind(command: &str) -> Option<Kind> {
    if command == "benches/measure" {
        return Some(Kind::Script);
    }
    let alone = [
        "benches/first-result > docs/measured-first.md",
        "benches/build-times > docs/measured-build.md",
        "benches/devices > docs/measured-devices.md",
    ];
    if alone.contains(&command) {
        return Some(Kind::Alone);
    }
    if command == "fuzz/run --runs 10000000 --page" {
        return Some(Kind::Fuzz);
    }
    if command.starts_with("cohaptic ") {
        return Some(Kind::Cohaptic);
    }
    if command == "cargo run --profile dist -p cohaptic-accuracy -- --json --out out/measured/accuracy" {
        return Some(Kind::Accuracy);
    }
    if command == "cargo build --profile dist && COHAPTIC_PROGRAM=target/dist/cohaptic cargo test --workspace --test cluster -- --ignored" {
        return Some(Kind::IgnoredTest);
    }
    if let Some(inside) = command.strip_prefix("cd benches/peers && ") {
        return peers(inside);
    }
    let (what, rest) = command.strip_prefix("cargo run --profile dist -p ")?.split_once(" --bin ")?;
    match what {
        "cohaptic-benches" => {
            let (run, page) = rest.split_once(" > docs/")?;
            let (program, effort) = match run.split_once(" -- ") {
                Some((program, option)) => (program, Effort::named(option)?),
                None => (run, Effort::Full),
            };
            Some(Kind::Table { program: program.to_owned(), page: page.to_owned(), effort })
        }
        "cohaptic-benches-realtime" => {
            let program = match rest {
                // The arguments are those that benches/realtime/tests run it with: a span and a page.
                "soak -- 1h --out docs/measured-soak.md" => "soak",
                _ => rest.split_once(" > docs/").filter(|(_, page)| !page.contains(' '))?.0,
            };
            Some(Kind::Elsewhere("benches/realtime", vec![program.to_owned()]))
        }
        _ => None,
    }
}

/// A line that is typed in `benches/peers`: what prints the page, and its page.
fn peers(line: &str) -> Option<Kind> {
    const FOLDER: &str = "benches/peers";
    let (run, page) = line.split_once(" > ../../docs/")?;
    let parts: Vec<&str> = run.trim_start_matches('(').trim_end_matches(')').split(" && ").collect();
    let program = |part: &&str| match *part {
        "cargo run --release" => Some(default_program(FOLDER)),
        // A script that says itself what it starts.
        "others/run" => {
            let script = std::fs::read_to_string(root().join(FOLDER).join("others/run")).ok()?;
            Some(script.trim_end().rsplit_once("cargo run --release --quiet --bin ")?.1.to_owned())
        }
        part => Some(part.strip_prefix("cargo run --release --bin ")?.to_owned()),
    };
    let found: Option<Vec<String>> = parts.iter().map(program).collect();
    found.filter(|_| !page.contains(' ')).map(|programs| Kind::Elsewhere(FOLDER, programs))
}

fn all() -> Vec<(&'static str, String, Kind)> {
    let mut all = Vec::new();
    for (page, text) in pages() {
        for command in commands(&text) {
            let kind = kind(command).unwrap_or_else(|| panic!("docs/{page}: this test does not know how to run {command:?}"));
            all.push((page, command.to_owned(), kind));
        }
    }
    all
}

#[test]
fn every_page_has_its_command_and_every_command_is_known() {
    let all = all();
    for (page, text) in pages() {
        let its: Vec<&Kind> = all.iter().filter(|(of, _, _)| *of == page).map(|(_, _, kind)| kind).collect();
        let [first, rest @ ..] = &its[..] else { panic!("docs/{page} has no command") };
        if page == "measured.md" {
            assert_eq!(*first, &Kind::Script);
            assert!(rest.contains(&&Kind::Cohaptic) && rest.contains(&&Kind::Accuracy));
        } else {
            assert!(rest.is_empty() && text.contains("This page is written by\n\n    "), "docs/{page}");
        }
    }
    for (page, command, kind) in &all {
        if let Kind::Table { page: written, .. } = kind {
            assert!(*page == "measured.md" || page == written, "docs/{page} is not written by {command}");
        }
        // A command on two pages is the same on both.
        let whole = command.replace(" -- --quick", "");
        let known = all.iter().any(|(of, other, _)| *of != "measured.md" && other.replace(" -- --quick", "") == whole);
        assert!(known || matches!(kind, Kind::Script | Kind::Cohaptic | Kind::Accuracy), "{command}");
    }
}

#[test]
fn every_program_that_writes_a_page_has_its_command_on_one() {
    let all = all();
    for (name, folder) in PACKAGES {
        for program in programs(folder) {
            let found = all.iter().any(|(_, _, kind)| match kind {
                Kind::Table { program: other, .. } => name == "cohaptic-benches" && *other == program,
                // That the script starts this program is tested in script.rs.
                Kind::Script => program == "measured-page",
                Kind::Elsewhere(of, others) => *of == folder && others.contains(&program),
                Kind::Cohaptic | Kind::Accuracy | Kind::Alone | Kind::Fuzz | Kind::IgnoredTest => false,
            });
            assert!(found, "{program} of {name} is on no page");
        }
    }
    for (_, command, kind) in &all {
        let (folder, used) = match kind {
            Kind::Table { program, .. } => ("benches", std::slice::from_ref(program)),
            Kind::Elsewhere(folder, used) => (*folder, &used[..]),
            Kind::Script | Kind::Cohaptic | Kind::Accuracy | Kind::Alone | Kind::Fuzz | Kind::IgnoredTest => continue,
        };
        assert!(used.iter().all(|program| programs(folder).contains(program)), "{command}");
    }
}

/// The script has a row for each user of the page, and refuses other names before anything is built.
#[test]
fn the_rows_of_first_result_are_those_of_its_page() {
    let script = root().join("benches/first-result");
    let output = Command::new(&script).arg("another").output().unwrap();
    // `env` ends with this status where there is no Python.
    if output.status.code() == Some(127) {
        return;
    }
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && output.stdout.is_empty() && said.contains("there is no row another"), "{said}");
    let help = String::from_utf8(Command::new(&script).arg("--help").output().unwrap().stdout).unwrap();
    let shipped = std::fs::read_to_string(root().join("docs/measured-first.md")).unwrap();
    for user in ["programmer", "researcher", "laboratory"] {
        assert!(help.contains(user) && shipped.contains(&format!("\n| {user} | ")), "{user}: {help}\n{shipped}");
    }
}

/// The script makes the page in `docs/` from the reports on the page.
#[test]
fn the_page_of_devices_is_that_of_its_reports() {
    let shipped = std::fs::read_to_string(root().join("docs/measured-devices.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut blocks = shipped.split("\n```text\n").skip(1).map(|rest| rest.split("\n```\n").next().unwrap());
    let three = blocks.next().unwrap().split("\n\n").zip(["live.txt", "join.txt", "router.txt"]);
    let reports: Vec<(&str, &str)> = three.chain(blocks.next().map(|report| (report, "grip.txt"))).collect();
    assert_eq!(reports.len(), 4, "{shipped}");
    reports.iter().for_each(|(report, name)| std::fs::write(folder.path().join(name), format!("{report}\n")).unwrap());
    let output = Command::new(root().join("benches/devices")).arg("--reports").arg(folder.path()).output().unwrap();
    // `env` ends with this status where there is no Python.
    if output.status.code() == Some(127) {
        return;
    }
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let without_machine = |page: &str| page.lines().filter(|line| !line.starts_with("and measured on ")).collect::<Vec<_>>().join("\n");
    assert_eq!(without_machine(&String::from_utf8(output.stdout).unwrap()), without_machine(&shipped), "write docs/measured-devices.md anew");
}

/// The page has a row for each target, and no other.
#[test]
fn the_rows_of_the_fuzz_targets_are_those_of_their_folder() {
    let manifest = std::fs::read_to_string(root().join("fuzz/Cargo.toml")).unwrap();
    let targets: Vec<&str> = manifest.split("[[bin]]\nname = \"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let page = std::fs::read_to_string(root().join("docs/measured-fuzz.md")).unwrap();
    let rows: Vec<&str> =
        page.lines().filter_map(|line| line.strip_prefix("| ")?.split(" |").next()).filter(|name| !["target", "---"].contains(name)).collect();
    assert!(targets.len() > 10 && rows == targets, "{rows:?} {targets:?}");
}

#[test]
fn what_is_not_a_command_of_ours_is_not_known() {
    for command in [
        "cargo run --profile dist -p cohaptic-benches --bin speed-table -- --fast > docs/measured-speed.md",
        "cargo run --profile dist -p cohaptic-benches --bin speed-table",
        "cargo run --profile dist -p cohaptic-wan --bin x > docs/x.md",
        "cd benches/peers && cargo test > ../../docs/x.md",
        "cargo run --profile dist -p cohaptic-benches-realtime --bin soak -- 2h --out docs/measured-soak.md",
        "benches/first-result programmer > docs/measured-first.md",
        "cargo run --profile dist -p cohaptic-accuracy -- --json --out elsewhere",
        "fuzz/run --page",
        "rm -r docs",
    ] {
        assert_eq!(kind(command), None, "{command}");
    }
}

/// Runs a program of this package with the least work, and looks at what it prints: a page with its own command and the tables of the one in `docs/`.
/// Returns what the program prints, and the page in `docs/`.
pub(crate) fn prints_its_page(path: &str, program: &str) -> (String, String) {
    let all = all();
    let of_program = all.iter().find_map(|(_, _, kind)| match kind {
        Kind::Table { program: of, page, .. } if of == program => Some(page.clone()),
        Kind::Table { .. } | Kind::Script | Kind::Cohaptic | Kind::Accuracy | Kind::Elsewhere(..) | Kind::Alone | Kind::Fuzz | Kind::IgnoredTest => {
            None
        }
    });
    let page = of_program.unwrap_or_else(|| panic!("{program} is on no page"));
    let output = Command::new(path).arg("--smoke").output().unwrap();
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8(output.stdout).unwrap();
    assert_eq!(commands(&printed), [format!("{} > docs/{page}", Effort::Smoke.command(program))]);
    let headings = |text: &str| text.lines().filter(|line| line.starts_with('#')).map(str::to_owned).collect::<Vec<_>>();
    let heads = |text: &str| text.lines().filter(|line| line.starts_with("| ---")).map(str::to_owned).collect::<Vec<_>>();
    let shipped = std::fs::read_to_string(root().join("docs").join(&page)).unwrap();
    assert_eq!(
        (headings(&printed), heads(&printed)),
        (headings(&shipped), heads(&shipped)),
        "docs/{page} is not what {program} writes; write it anew"
    );
    let refused = Command::new(path).arg("--fast").output().unwrap();
    assert!(!refused.status.success() && refused.stdout.is_empty() && String::from_utf8_lossy(&refused.stderr).contains("--fast"));
    (printed, shipped)
}

#[test]
fn speed_table_prints_its_page() {
    prints_its_page(env!("CARGO_BIN_EXE_speed-table"), "speed-table");
}

#[test]
fn link_table_prints_its_page() {
    let (printed, shipped) = prints_its_page(env!("CARGO_BIN_EXE_link-table"), "link-table");
    // The figures of queues are the same on every machine. Those of ns-3 are printed where ns-3 is installed.
    let queues = |page: &str| table(page, "## Queues beside ns-3", |row| row.contains("| cohaptic |"));
    assert!(queues(&shipped).is_some_and(|rows| rows.lines().count() == 2 + 4));
    assert_eq!(queues(&printed), queues(&shipped), "docs/measured-link.md is not what link-table writes; write its last part anew");
}

#[test]
fn samplers_table_prints_its_page() {
    prints_its_page(env!("CARGO_BIN_EXE_samplers-table"), "samplers-table");
}

#[test]
fn stability_table_prints_its_page() {
    prints_its_page(env!("CARGO_BIN_EXE_stability-table"), "stability-table");
}

/// One that is added to Cargo.toml needs a test above.
#[test]
fn every_program_of_this_package_is_run() {
    let run = ["speed-table", "samplers-table", "link-table", "stability-table", "measured-page"];
    assert_eq!(programs("benches"), run);
}
