//! `benches/measure`, which builds all programs for release and starts `measured-page`: here the latter alone, beside the programs that Cargo has built for this test.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use tempfile::tempdir;

use crate::{pages, root};

fn measure(into: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_measured-page")).args(arguments).arg("--into").arg(into).output().unwrap()
}

/// A section without the ten characters of each date that follows "last written".
fn without_dates(section: &str) -> String {
    const BEFORE: &str = "last written ";
    let mut parts = section.split(BEFORE);
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |kept, part| kept + BEFORE + part.get(10..).unwrap_or_default())
}

#[test]
fn the_script_starts_the_program_that_is_tested_here() {
    let script = fs::read_to_string(root().join("benches/measure")).unwrap();
    assert!(script.ends_with("cargo run --profile dist --quiet -p cohaptic-benches --bin measured-page -- \"$@\"\n"), "{script}");
}

#[test]
fn a_step_writes_its_section_and_its_page_and_leaves_the_others_as_they_are() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("measured.md");
    let shipped = fs::read_to_string(root().join("docs/measured.md")).unwrap();
    fs::write(&file, &shipped).unwrap();
    let output = measure(folder.path(), &["--smoke", "samplers", "link"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.starts_with("[1/2] link (") && said.contains("\n[2/2] samplers ("), "{said}");
    let page = fs::read_to_string(&file).unwrap();
    for section in page.split("\n## ").zip(shipped.split("\n## ")) {
        let (now, before) = section;
        let heading = now.lines().next().unwrap();
        if ["One link", "Random delays"].contains(&heading) {
            assert!(now.contains("-table -- --smoke > docs/") && now.contains("\nMeasured on "), "{now}");
        } else {
            // When a page was last written is what the history of the working tree says.
            assert_eq!(without_dates(now), without_dates(before));
        }
    }
    assert_eq!(page.matches("\n## ").count(), shipped.matches("\n## ").count());
    for name in ["measured-link.md", "measured-samplers.md"] {
        assert!(fs::read_to_string(folder.path().join(name)).unwrap().starts_with("# "));
    }
    // Nothing else, and nothing half-written.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn what_cannot_be_done_is_refused_and_changes_nothing() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("measured.md");
    for (content, arguments, part) in [
        ("# Measured\n\n## My notes\n", &["--smoke", "link"][..], "My notes"),
        ("", &["--smoke", "links"], "links"),
        ("", &["--smoke", "--quick"], "--quick"),
    ] {
        fs::write(&file, content).unwrap();
        let output = measure(folder.path(), arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && said.contains(part), "{said}");
        assert_eq!(fs::read_to_string(&file).unwrap(), content);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

/// Alone in a folder, without the programs that measure, and where there is no shell.
#[test]
fn a_step_that_fails_changes_nothing_and_an_optional_one_is_said_on_the_page() {
    // Another name for the same file: a copy could still be open for writing, in a process that another test begins just then.
    let alone = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let program = alone.path().join("measured-page");
    fs::hard_link(env!("CARGO_BIN_EXE_measured-page"), &program).unwrap();
    let folder = tempdir().unwrap();
    let file = folder.path().join("measured.md");
    let run = |step: &str| {
        let mut command = Command::new(&program);
        command.args(["--smoke", step, "--into"]).arg(folder.path()).env("PATH", alone.path()).output().unwrap()
    };
    for step in ["speed", "campaign", "accuracy"] {
        let output = run(step);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && said.contains("cannot run ") && said.contains(&format!("error: not measured: {step};")), "{said}");
        assert!(!file.exists());
    }
    assert!(run("peers").status.success());
    let page = fs::read_to_string(&file).unwrap();
    assert!(page.contains("**Not measured then:** cannot run cd benches/peers && "), "{page}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

/// What a page shows is there, and nothing is kept that no page shows.
#[test]
fn the_plots_are_those_that_the_page_shows() {
    let (_, page) = pages().into_iter().next().unwrap();
    let shown: Vec<&str> = page.split("](images/measured/").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0)).collect();
    let mut there: Vec<String> =
        fs::read_dir(root().join("docs/images/measured")).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let mut sorted = shown.clone();
    sorted.sort_unstable();
    there.sort();
    assert_eq!(sorted, there);
    assert!(!shown.is_empty() && shown.len() <= 12);
}
