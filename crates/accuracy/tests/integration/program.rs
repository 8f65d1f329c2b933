//! The program as its users meet it: a command in a folder of its own, with exit status, standard output, standard error and files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use cohaptic_picture::testing::{faults, page_faults};
use serde_json::Value;
use tempfile::TempDir;

const NAMES: [&str; 6] = ["motion", "rotation", "time", "network", "analysis", "real-time"];

/// A temporary folder for commands, removed at the end.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn files(&self, folder: &str) -> Vec<String> {
        let mut files: Vec<String> =
            fs::read_dir(self.path(folder)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        files.sort();
        files
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cohaptic-accuracy"));
        command.args(line.split_whitespace()).current_dir(self.0.path()).stdin(Stdio::null());
        command
    }

    fn run(&self, line: &str) -> Outcome {
        Outcome::of(self.command(line).output().unwrap())
    }

    /// Returns the standard output of a command that succeeds, and that writes only the name of the page to standard error.
    fn text(&self, line: &str) -> String {
        let outcome = self.run(line);
        assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.lines().all(|line| line.starts_with("wrote ")), "{line}: {}", outcome.stderr);
        outcome.stdout
    }

    fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.text(line)).unwrap()
    }

    fn assert_refused(&self, line: &str, status: i32, parts: &[&str]) {
        let outcome = self.run(line);
        assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(status), ""), "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.starts_with("error: "), "{line}: {}", outcome.stderr);
        for part in parts {
            assert!(outcome.stderr.contains(part), "{line}: {part} is not in {}", outcome.stderr);
        }
    }
}

/// Result of a command.
struct Outcome {
    status: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Outcome {
    fn of(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Self { status: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

#[test]
fn a_file_in_place_of_the_folder_is_refused_before_anything_is_measured() {
    let folder = Folder::new();
    folder.write("taken", "");
    folder.assert_refused("--quick --only motion --out taken", 3, &["cannot write taken"]);
}

#[test]
fn an_unknown_subject_is_refused_with_the_names_of_all() {
    let folder = Folder::new();
    folder.assert_refused("--only motion,speed", 2, &["speed", &NAMES.join(", ")]);
    folder.assert_refused("--only", 2, &["--only <SUBJECT>"]);
    folder.assert_refused("scene.toml", 2, &["scene.toml"]);
}

#[test]
fn the_rows_the_plots_and_the_page_lie_in_the_folder() {
    let folder = Folder::new();
    folder.write("out/rows-interrupted.csv", "of an earlier measurement");
    let document = folder.json("--quick --only motion --json --out out");
    assert_eq!((document["schema"].as_str(), document["version"].as_u64()), (Some("cohaptic/accuracy"), Some(1)));
    let rows = document["rows"].as_array().unwrap();
    assert!(rows.len() > 100 && document["interrupted"] == false && document["wall_s"].as_f64().unwrap() > 0.0);
    for row in rows {
        let texts = ["subject", "case", "method", "cost_unit", "error_unit", "reference"];
        assert!(texts.iter().all(|key| row[*key].as_str().is_some_and(|text| !text.is_empty())), "{row}");
        assert!(row["setting"].is_string() && row["note"].is_string() && row["subject"] == "motion");
        assert!(row["cost"].as_f64().unwrap() > 0.0);
        assert!(row["error"].as_f64().is_some_and(|error| error >= 0.0) || !row["note"].as_str().unwrap().is_empty(), "{row}");
    }
    let mut reader = csv::Reader::from_path(folder.path("out/rows.csv")).unwrap();
    for (record, row) in reader.records().map(Result::unwrap).zip(rows) {
        assert_eq!(&record[2], row["method"].as_str().unwrap());
        let (written, printed) = (record[6].parse::<f64>().ok(), row["error"].as_f64());
        // The JSON parser rounds in the last place.
        assert!(written == printed || (written.unwrap() / printed.unwrap() - 1.0).abs() < 1e-15, "{record:?} {row}");
    }
    let files = folder.files("out");
    assert!(files.iter().all(|file| !file.ends_with(".partial") && file != "rows-interrupted.csv"), "{files:?}");
    let plots: Vec<&String> = files.iter().filter(|file| file.ends_with(".svg")).collect();
    // Four scenes have position and energy, and two of them have a boundary, whose cost has two units.
    assert_eq!(plots.len(), 4 * 2 + 2 * 2, "{files:?}");
    let drawn: Vec<String> = plots.iter().map(|plot| folder.read(&format!("out/{plot}"))).collect();
    for (plot, svg) in plots.iter().zip(&drawn) {
        assert_eq!(faults(svg), [""; 0], "{plot}");
        assert!(svg.contains(" width=\"800\""), "{plot}");
    }
    // The page of measured figures shows plots of this subject, which must be among the files.
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/measured.md")).unwrap();
    let shown: Vec<&str> = page.split("](images/measured/").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0)).collect();
    let of_motion: Vec<&&str> = shown.iter().filter(|plot| plot.starts_with("motion-")).collect();
    assert!(!of_motion.is_empty() && of_motion.iter().all(|plot| folder.path(&format!("out/{plot}")).is_file()), "{of_motion:?}");
    let page = folder.read("out/index.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("cohaptic-accuracy --quick --only motion, version "));
    assert_eq!(page.matches("<svg").count(), plots.len());
    assert_eq!(page_faults(&page), [""; 0]);
}

#[test]
fn plots_have_the_size_that_was_asked_for() {
    let folder = Folder::new();
    folder.json("--quick --only motion --json --out out --size one-column");
    for plot in folder.files("out").iter().filter(|file| file.ends_with(".svg")) {
        let svg = folder.read(&format!("out/{plot}"));
        assert!(svg.contains(" width=\"85mm\""), "{plot}");
        assert_eq!(faults(&svg), [""; 0], "{plot}");
    }
    assert!(folder.read("out/index.html").contains(" width=\"85mm\""));
    // Without a folder there is no picture to which a size could apply.
    folder.assert_refused("--quick --only motion --size page", 2, &["--out"]);
    folder.assert_refused("--quick --only motion --out out --size huge", 2, &["one-column"]);
}

#[test]
fn people_get_tables() {
    let text = Folder::new().text("--quick --only motion");
    assert!(text.starts_with("motion, free device: position [m] against ns a tick\n  against: the same loop"), "{text}");
    assert!(text.contains("exact propagator") && text.contains("RK4, stepped") && !text.contains("INTERRUPTED"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_loses_no_row() {
    for file in ["rows.csv", "index.html"] {
        let folder = Folder::new();
        folder.write("out/keep", "");
        std::os::unix::fs::symlink("/dev/full", folder.path(&format!("out/{file}"))).unwrap();
        let outcome = folder.run("--quick --only motion --json --out out");
        assert_eq!(outcome.status, Some(3));
        assert!(outcome.stderr.starts_with(&format!("error: cannot write out/{file}: ")), "{}", outcome.stderr);
        let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
        assert!(document["rows"].as_array().unwrap().len() > 100);
        assert!(folder.path(&format!("out/{file}")).symlink_metadata().unwrap().is_symlink());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error() {
    for line in ["--quick --only motion", "--help", "--version"] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let outcome = Outcome::of(Folder::new().command(line).stdout(full).stderr(Stdio::piped()).output().unwrap());
        assert_eq!(outcome.status, Some(3), "{line}");
        assert!(outcome.stderr.starts_with("error: cannot write to standard output: "), "{line}: {}", outcome.stderr);
    }
}

/// Returns whether a process has a handler for SIGINT, number 2, which is bit 1 of the mask of caught signals.
#[cfg(target_os = "linux")]
fn listens(id: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    caught.is_some_and(|mask| mask & 0b10 != 0)
}

#[cfg(target_os = "linux")]
#[test]
fn an_interruption_keeps_what_was_measured_and_says_so() {
    let folder = Folder::new();
    folder.write("out/rows.csv", "of an earlier measurement");
    // The whole measurement of motion takes seconds; SIGINT is caught long before its end.
    let mut child = folder.command("--only motion,time --json --out out").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let pause = || std::thread::sleep(Duration::from_millis(5));
    while !listens(child.id()) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        pause();
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let asked = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if asked.elapsed() > Duration::from_secs(60) {
            child.kill().unwrap();
            panic!("it did not end when it was interrupted");
        }
        pause();
    }
    let outcome = Outcome::of(child.wait_with_output().unwrap());
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(130), ""));
    let document: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(document["interrupted"], true);
    let rows = document["rows"].as_array().unwrap().len();
    let files = folder.files("out");
    assert!(files.contains(&"rows-interrupted.csv".to_owned()) && !files.contains(&"rows.csv".to_owned()), "{files:?}");
    assert_eq!(csv::Reader::from_path(folder.path("out/rows-interrupted.csv")).unwrap().records().count(), rows);
    assert!(folder.read("out/index.html").contains("The measurement was interrupted"));
}
