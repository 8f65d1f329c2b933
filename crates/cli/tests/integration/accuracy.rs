//! `cohaptic accuracy`: speed against error.

use crate::integration::desk::{Desk, parse};

const NAMES: [&str; 7] = ["motion", "rotation", "time", "network", "analysis", "real-time", "least-model"];

#[test]
fn a_file_in_place_of_the_folder_is_refused_before_anything_is_measured() {
    Desk::with("taken", "").cohaptic("accuracy --quick --only motion --out taken").assert_refused(3, &["cannot create taken"]);
}

#[test]
fn an_unknown_subject_is_refused_with_the_names_of_all() {
    Desk::new().cohaptic("accuracy --only motion,speed").assert_refused(2, &["speed", &NAMES.join(", ")]);
    Desk::new().cohaptic("accuracy --only").assert_refused(2, &["--only <SUBJECT>"]);
    Desk::new().cohaptic("accuracy scene.toml").assert_refused(2, &["scene.toml"]);
}

#[test]
fn the_rows_the_plots_and_the_page_lie_in_the_folder() {
    let desk = Desk::new();
    desk.write("out/rows-interrupted.csv", "of an earlier measurement");
    let document = desk.json("accuracy --quick --only motion --json --out out");
    let rows = document["rows"].as_array().unwrap();
    assert!(rows.len() > 100 && document["interrupted"] == false && document["wall_s"].as_f64().unwrap() > 0.0);
    for row in rows {
        assert!(
            ["subject", "case", "method", "cost_unit", "error_unit", "reference"]
                .iter()
                .all(|key| row[*key].as_str().is_some_and(|text| !text.is_empty())),
            "{row}"
        );
        assert!(row["setting"].is_string() && row["note"].is_string() && row["subject"] == "motion");
        assert!(row["cost"].as_f64().unwrap() > 0.0);
        assert!(row["error"].as_f64().is_some_and(|error| error >= 0.0) || !row["note"].as_str().unwrap().is_empty(), "{row}");
    }
    let mut reader = csv::Reader::from_path(desk.path("out/rows.csv")).unwrap();
    for (record, row) in reader.records().map(Result::unwrap).zip(rows) {
        assert_eq!(&record[2], row["method"].as_str().unwrap());
        let (written, printed) = (record[6].parse::<f64>().ok(), row["error"].as_f64());
        // The parser of JSON rounds in the last place.
        assert!(written == printed || (written.unwrap() / printed.unwrap() - 1.0).abs() < 1e-15, "{record:?} {row}");
    }
    let files = desk.files("out");
    assert!(files.iter().all(|file| !file.ends_with(".partial") && file != "rows-interrupted.csv"), "{files:?}");
    let plots: Vec<&String> = files.iter().filter(|file| file.ends_with(".svg")).collect();
    // Four scenes with position and energy, and two of them with a boundary, whose cost has two units.
    assert_eq!(plots.len(), 4 * 2 + 2 * 2, "{files:?}");
    for plot in &plots {
        assert_eq!(cohaptic_picture::testing::faults(&desk.read(&format!("out/{plot}"))), [""; 0], "{plot}");
    }
    let page = desk.read("out/index.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("cohaptic accuracy --quick --only motion, version "));
    assert_eq!(page.matches("<svg").count(), plots.len());
    assert_eq!(cohaptic_picture::testing::page_faults(&page), [""; 0]);
    assert!(plots.iter().all(|plot| desk.read(&format!("out/{plot}")).contains(" width=\"800\"")));
}

#[test]
fn plots_have_the_size_that_was_asked_for() {
    let desk = Desk::new();
    desk.json("accuracy --quick --only motion --json --out out --size one-column");
    for plot in desk.files("out").iter().filter(|file| file.ends_with(".svg")) {
        let svg = desk.read(&format!("out/{plot}"));
        assert!(svg.contains(" width=\"85mm\""), "{plot}");
        assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0], "{plot}");
    }
    assert!(desk.read("out/index.html").contains(" width=\"85mm\""));
    // Without a folder there is nothing that could have a size.
    desk.cohaptic("accuracy --quick --only motion --size page").assert_refused(2, &["--out"]);
    desk.cohaptic("accuracy --quick --only motion --out out --size huge").assert_refused(2, &["one-column"]);
}

#[test]
fn people_get_tables() {
    let text = Desk::new().text("accuracy --quick --only motion");
    assert!(text.starts_with("motion, free device: position [m] against ns a tick\n  against: the same loop"), "{text}");
    assert!(text.contains("exact propagator") && text.contains("RK4, stepped") && !text.contains("INTERRUPTED"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_that_loses_no_row() {
    for file in ["rows.csv", "index.html"] {
        let desk = Desk::new();
        desk.write("out/keep", "");
        std::os::unix::fs::symlink("/dev/full", desk.path(&format!("out/{file}.partial"))).unwrap();
        let outcome = desk.cohaptic("accuracy --quick --only motion --json --out out");
        assert_eq!(outcome.status, Some(3));
        assert!(outcome.stderr.starts_with(&format!("error: cannot write out/{file}: ")), "{}", outcome.stderr);
        assert!(parse(&outcome.stdout)["rows"].as_array().unwrap().len() > 100);
        assert!(!desk.path(&format!("out/{file}")).exists());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_interruption_keeps_what_was_measured_and_says_so() {
    let desk = Desk::new();
    desk.write("out/rows.csv", "of an earlier measurement");
    // The whole measurement of motion takes seconds; SIGINT is caught long before its end.
    let outcome =
        crate::integration::interrupt::interrupted(&desk, "accuracy --only motion,time --json --out out", crate::integration::interrupt::listens);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(130), ""));
    let document = parse(&outcome.stdout);
    assert_eq!(document["interrupted"], true);
    let rows = document["rows"].as_array().unwrap().len();
    let files = desk.files("out");
    assert!(files.contains(&"rows-interrupted.csv".to_owned()) && !files.contains(&"rows.csv".to_owned()), "{files:?}");
    assert_eq!(csv::Reader::from_path(desk.path("out/rows-interrupted.csv")).unwrap().records().count(), rows);
    assert!(desk.read("out/index.html").contains("The measurement was interrupted"));
}
