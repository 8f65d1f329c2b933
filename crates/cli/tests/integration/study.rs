//! `cohaptic study`: dry runs, reports, verification, and persons who are forgotten.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::integration::desk::{Desk, parse};

/// A desk with the shipped study, of four groups, two conditions and three trials each.
fn desk() -> Desk {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/pull");
    let desk = Desk::new();
    for name in ["study.toml", "pull.toml", "consent.md", "task.md"] {
        let text = fs::read_to_string(shipped.join(name)).unwrap();
        let shorter = [
            ("participants = 12", "participants = 8"),
            ("trials = 5", "trials = 2"),
            ("practice = 2", "practice = 1"),
            ("\"coordination.strategy\" = [\"average-position\", \"proportional-derivative\"]\n", ""),
        ];
        desk.write(name, shorter.iter().fold(text, |text, (from, to)| text.replace(from, to)));
    }
    desk
}

/// Files of a folder by path, with their bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(path) = folders.pop() {
        for entry in fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else if !entry.ends_with("cohaptic.lock") {
                files.insert(entry.strip_prefix(folder).unwrap().display().to_string(), fs::read(&entry).unwrap());
            }
        }
    }
    files
}

/// Number of kept trials.
fn kept(folder: &Path) -> usize {
    fs::read_dir(folder.join("trials")).map_or(0, Iterator::count)
}

/// The process is killed ten times, each time at another moment after another trial was kept: between two trials, within one, or while a file is written.
#[test]
fn a_dry_run_that_is_killed_ten_times_gives_the_bytes_of_one_that_is_not() {
    let desk = desk();
    let line = |out: &str| format!("study study.toml --dry-run --times 3 --threads 1 --out {out}");
    let text = desk.text(&line("whole"));
    assert!(text.contains("8 people in 4 groups, 2 conditions each"), "{text}");
    assert!(text.contains("With 4 groups the sign flip test has no p under 0.05") && text.contains("in 3 dry runs"), "{text}");
    for number in 1..=10_u64 {
        let mut child = desk.command(&line("killed")).stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
        let wanted = usize::try_from(number).unwrap() * 2;
        while kept(&desk.path("killed")) < wanted && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        std::thread::sleep(Duration::from_micros(number * 7919 % 5000));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert_eq!(desk.text(&line("killed")), text);
    let (whole, killed) = (files(&desk.path("whole")), files(&desk.path("killed")));
    assert_eq!(whole.keys().collect::<Vec<_>>(), killed.keys().collect::<Vec<_>>());
    assert!(whole.contains_key("trials/G04-006/inputs.csv") && whole.contains_key("dry-runs/00002.json"), "{:?}", whole.keys());
    for (name, bytes) in &whole {
        assert!(killed[name] == *bytes, "{name}");
    }
}

#[test]
fn a_study_is_verified_and_a_person_is_forgotten() {
    let desk = desk();
    desk.text("study study.toml --dry-run --out out");
    // The folder needs none of the files that it was made from.
    for name in ["study.toml", "pull.toml", "consent.md", "task.md"] {
        fs::remove_file(desk.path(name)).unwrap();
    }
    assert_eq!(desk.json("study verify out --json")["differences"], serde_json::json!([]));
    assert_eq!(desk.text("study verify out"), "24 trials replayed: every measure, every scene and every table is as it is kept\n");
    desk.write("out/trials.csv", desk.read("out/trials.csv").replacen("done", "undone", 1));
    let changed = desk.cohaptic("study verify out");
    assert_eq!(changed.status, Some(1));
    assert!(changed.stdout.starts_with("24 trials replayed, with 1 difference:\n  trials.csv: line 2: "), "{}", changed.stdout);
    let changed = desk.cohaptic("study verify out --json");
    let document = parse(&changed.stdout);
    assert_eq!((changed.status, &document["trials"], document["differences"].as_array().unwrap().len()), (Some(1), &24.into(), 1));
    assert_eq!(desk.text("study report out"), "4 of 4 sessions are complete\n");
    assert!(desk.text("study forget P03 out").starts_with("P03 is forgotten"));
    for name in ["trials.csv", "answers.csv", "report.html"] {
        assert!(!desk.read(&format!("out/{name}")).contains("P03"), "{name}");
    }
    assert_eq!(desk.text("study report out"), "3 of 4 sessions are complete\n");
    assert!(desk.text("study verify out").starts_with("18 trials replayed: every"));
    desk.cohaptic("study forget P33 out").assert_refused(2, &["nobody in the study in out has the code P33"]);
    desk.cohaptic("study forget anna out").assert_refused(2, &["\"anna\" is no code of a person", "such as P07"]);
    desk.cohaptic("study verify nowhere").assert_refused(2, &["nowhere holds no study", "--out"]);
}

/// The documents have the figures of the words and of the tables.
#[test]
fn a_dry_run_and_a_report_are_documents_with_the_same_figures() {
    let desk = desk();
    let line = "study study.toml --dry-run --times 3 --out out";
    let dry = desk.json(&format!("{line} --json"));
    let words = desk.text(line);
    assert_eq!((&dry["schema"], &dry["people"], &dry["groups"], &dry["times"]), (&"cohaptic/study-dry-run".into(), &8.into(), &4.into(), &3.into()));
    assert!(dry["warnings"].as_array().unwrap().iter().all(|warning| words.contains(warning.as_str().unwrap())), "{dry:#}");
    let power = dry["power"].as_array().unwrap();
    assert!(!power.is_empty() && power.iter().all(|row| row["found"]["of"] == 3), "{dry:#}");
    let first = &dry["measures"][0];
    assert_eq!((first["means"].as_array().unwrap().len(), first["differences"].as_array().unwrap().len()), (2, 1));
    let report = desk.json("study report out --json");
    assert_eq!((&report["measures"], &report["conditions"], &report["files"]), (&dry["measures"], &dry["conditions"], &dry["files"]));
    assert_eq!(report["sessions_complete"], 4);
    desk.cohaptic("study study.toml --out other --json").assert_refused(2, &["--dry-run"]);
}

#[test]
fn a_study_in_another_folder_and_a_fault_are_refused_with_a_way_out() {
    let desk = desk();
    desk.text("study run study.toml --dry-run --out out");
    desk.write("study.toml", desk.read("study.toml").replace("seed = 1", "seed = 2"));
    desk.cohaptic("study study.toml --dry-run --out out").assert_refused(2, &["out holds another study", "give this one a folder of its own"]);
    desk.write("study.toml", desk.read("study.toml").replace("trials = 2", "trails = 2"));
    desk.cohaptic("study study.toml --dry-run --out other").assert_refused(2, &["study.toml:10:1: study.trails", "did you mean \"trials\"?"]);
    desk.cohaptic("study missing.toml --dry-run --out other").assert_refused(3, &["missing.toml"]);
    desk.cohaptic("study study.toml --out other --control 127.0.0.1:0 --control-files .")
        .assert_refused(2, &["--control-files", "unexpected argument"]);
    assert!(!desk.path("other").exists());
}
