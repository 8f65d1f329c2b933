//! Contents of tables.

use std::fs::File;
use std::path::Path;

use cohaptic_campaign::Format;
use cohaptic_harness::measures::Measures;
use cohaptic_harness::{Ending, Model, NoObserver, Simulation};
use cohaptic_scene::Scene;
use cohaptic_wan::DropCause;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;

use crate::bench::{Bench, SCENE, VARY, comma_separated};

/// Returns the cells of a Parquet file in the form of CSV.
fn parquet(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let header = reader.metadata().file_metadata().schema_descr().columns().iter().map(|column| column.name().to_owned()).collect();
    #[expect(clippy::wildcard_enum_match_arm, reason = "none of the twenty others is in a table")]
    let text = |field: &Field| match field {
        Field::Null => String::new(),
        Field::Long(integer) => integer.to_string(),
        Field::Double(number) => format!("{number:?}"),
        Field::Str(text) => text.clone(),
        other => panic!("a field of another kind: {other:?}"),
    };
    let rows = reader.get_row_iter(None).unwrap().map(|row| row.unwrap().get_column_iter().map(|(_, field)| text(field)).collect()).collect();
    (header, rows)
}

/// Compares a row with a run alone, cell by cell, without using code of the tested crate.
fn alone(cells: &[(String, String)], set: &[String], text: &str) {
    let cell = |name: &str| cells.iter().find(|(column, _)| column == name).map(|(_, cell)| cell.clone()).unwrap_or_else(|| panic!("no {name}"));
    let seed = format!("scene.seed={}", cell("seed"));
    let overrides: Vec<String> = set.iter().cloned().chain([seed]).collect();
    let scene = Scene::parse(text, Path::new(""), &overrides).unwrap();
    let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
    let (ending, ended) = match summary.ending {
        // The definition of a diverged run, repeated here.
        Ending::Complete => (if summary.max_discrepancy > 1.0 { "diverged" } else { "complete" }, summary.duration.as_secs_f64()),
        Ending::Diverged(at) => ("diverged", std::time::Duration::from_nanos(at.as_nanos()).as_secs_f64()),
        Ending::Interrupted(_) => panic!("nobody interrupts"),
    };
    let mut expected = vec![
        ("ending".to_owned(), ending.to_owned()),
        ("ended_at_s".to_owned(), format!("{ended:?}")),
        ("ticks".to_owned(), summary.ticks.to_string()),
        ("max_discrepancy_m".to_owned(), format!("{:?}", summary.max_discrepancy)),
        ("stale_samples".to_owned(), summary.peers.iter().map(|peer| peer.stale_samples).sum::<u64>().to_string()),
        ("refused_samples".to_owned(), summary.peers.iter().map(|peer| peer.refused_samples).sum::<u64>().to_string()),
    ];
    for peer in &summary.peers {
        for (axis, letter) in ["x", "y", "z"].iter().enumerate().take(scene.axes.count()) {
            expected.push((format!("peers.{}.position_{letter}_m", peer.name), format!("{:?}", peer.position[axis])));
            expected.push((format!("peers.{}.velocity_{letter}_m_s", peer.name), format!("{:?}", peer.velocity[axis])));
        }
    }
    let sum = |count: &dyn Fn(&cohaptic_wan::LinkStats) -> u64| summary.links.iter().map(|link| count(&link.stats)).sum::<u64>().to_string();
    expected.push(("links.offered".to_owned(), sum(&|stats| stats.offered())));
    expected.push(("links.duplicated".to_owned(), sum(&|stats| stats.duplicated())));
    expected.push(("links.delivered".to_owned(), sum(&|stats| stats.delivered())));
    expected.push(("links.in_flight".to_owned(), sum(&|stats| stats.in_flight())));
    expected.push(("links.marked".to_owned(), sum(&|stats| stats.marked())));
    expected.push(("links.damaged".to_owned(), sum(&|stats| stats.damaged())));
    if cells.iter().any(|(column, _)| column == "links.cross_offered") {
        expected.push(("links.cross_offered".to_owned(), sum(&|stats| stats.cross_traffic().offered)));
        expected.push(("links.cross_dropped".to_owned(), sum(&|stats| stats.cross_traffic().dropped)));
    }
    for cause in DropCause::ALL {
        expected.push((format!("links.dropped_{}", cause.name().replace('-', "_")), sum(&|stats| stats.dropped(cause))));
    }
    for measured in Measures::run(&scene, Model::Least).values {
        expected.push((measured.name.text(&scene), measured.value.map_or_else(String::new, |value| format!("{value:?}"))));
    }
    for (name, value) in expected {
        assert_eq!(cell(&name), value, "{name} of {overrides:?}");
    }
}

fn named(header: &[String], row: &[String]) -> Vec<(String, String)> {
    header.iter().cloned().zip(row.iter().cloned()).collect()
}

/// The columns of cross packets stand in a table whose lines have cross-traffic in some run, also if it begins later, and in no other table.
#[test]
fn cross_packets_are_counted_where_there_are_some() {
    const CROSS: &str = "{ poisson = { rate = \"200kbit\", size = \"100B\" } }";
    let begins = format!("timeline=[{{ at = \"20ms\", link = \"all\", set = {{ cross-traffic = {CROSS} }} }}]");
    for (cross, has_columns) in [("link.cross-traffic=\"none\"".to_owned(), false), (format!("link.cross-traffic={CROSS}"), true), (begins, true)] {
        let mut bench = Bench::new(&VARY[1..], 2);
        bench.format = Format::Csv;
        bench.set = vec!["link.rate=\"400kbit\"".to_owned(), "link.queue.limit=\"2 packets\"".to_owned(), cross];
        bench.finish("out", 1);
        let (header, rows) = comma_separated(&bench.path("out/runs.csv"));
        let place = header.iter().position(|name| name == "links.cross_offered");
        assert_eq!((place.is_some(), header.iter().any(|name| name == "access.cross_offered")), (has_columns, false));
        for row in &rows {
            let cells = named(&header, row);
            let loss = cells.iter().find(|(name, _)| name == "link.loss_percent").unwrap().1.clone();
            let set: Vec<String> = bench.set.iter().cloned().chain([format!("link.loss={loss}%")]).collect();
            alone(&cells, &set, SCENE);
            assert!(place.is_none_or(|place| row[place].parse::<u64>().unwrap() > 0), "{row:?}");
        }
    }
}

#[test]
fn every_run_is_the_run_alone_to_the_last_bit() {
    let mut bench = Bench::new(&VARY, 5);
    bench.format = Format::Csv;
    bench.set = vec!["link.duplicate=10%".to_owned(), "measure.names=[\"age_p99_s\", \"peers.right.energy_j\"]".to_owned()];
    let report = bench.finish("out", 2);
    assert_eq!((report.runs, report.computed, report.combinations.len()), (20, 20, 4));
    let (header, rows) = comma_separated(&bench.path("out/runs.csv"));
    assert_eq!(header[..5], ["run", "combination", "seed", "coordination.stiffness", "link.loss_percent"]);
    assert_eq!(rows.len(), 20);
    for (number, row) in rows.iter().enumerate() {
        let (combination, seed) = (number / 5, 7 + number % 5);
        let (stiffness, loss) = (["500.0", "1500.0"][combination / 2], ["0.0", "40.0"][combination % 2]);
        let expected = [number.to_string(), combination.to_string(), seed.to_string(), stiffness.to_owned(), loss.to_owned()];
        assert_eq!(row[..5], expected, "the last key varies fastest, and seeds count up in each combination");
        let mut set = bench.set.clone();
        set.extend([format!("coordination.stiffness={stiffness}"), format!("link.loss={loss}%")]);
        alone(&named(&header, row), &set, SCENE);
    }
    assert_eq!(header[header.len() - 2..], ["peers.right.energy_j", "age_p99_s"], "measures come last, in their order");
    let lost = |row: &Vec<String>| row[header.iter().position(|name| name == "links.dropped_loss").unwrap()].parse::<u64>().unwrap();
    assert!(rows.iter().any(|row| lost(row) > 0), "the network does something");
    // The report sums up the table.
    let discrepancy = header.iter().position(|name| name == "max_discrepancy_m").unwrap();
    for (combination, sums) in report.combinations.iter().enumerate() {
        let values: Vec<f64> = rows[combination * 5..combination * 5 + 5].iter().map(|row| row[discrepancy].parse().unwrap()).collect();
        assert_eq!((sums.runs, sums.diverged, sums.mean_discrepancy), (5, 0, Some(values.iter().sum::<f64>() / 5.0)));
        assert_eq!(sums.largest_discrepancy, values.iter().copied().reduce(f64::max));
    }
}

/// A diverged run says so, and may have values that are not numbers.
#[test]
fn both_formats_hold_the_same_also_of_what_diverges_and_of_who_is_missing() {
    let text = SCENE
        .replace("seed     = 7", "count = 2")
        .replace("[[peers]]\nname = \"left\"", "[[peers]]\nname = \"peer1\"")
        .replace("[[peers]]\nname = \"right\"\n", "");
    let vary =
        ["scene.count=2,4,3", "scene.axes=2", "coordination.strategy=average-position,proportional-derivative", "coordination.stiffness=100,1e12"];
    let mut bench = Bench::new(&vary, 2);
    bench.text = text.clone();
    bench.set = [
        "scene.duration=2s",
        "peers.peer2.uplink={ delay = \"1ms\" }",
        "peers.peer1.hand={ sine = { amplitude = [1.0, 0.5], frequency = 2.0 } }",
        "measure={ names = \"all\", probe = { peer = \"peer1\" } }",
    ]
    .map(str::to_owned)
    .to_vec();
    bench.part = Some(5);
    let report = bench.finish("parquet", 2);
    let (header, rows) = parquet(&bench.path("parquet/runs.parquet"));
    bench.format = Format::Csv;
    assert_eq!(bench.finish("csv", 1).combinations, report.combinations);
    assert_eq!((header.clone(), rows.clone()), comma_separated(&bench.path("csv/runs.csv")));
    assert_eq!(rows.len(), 24);
    let cell = |row: &Vec<String>, name: &str| row[header.iter().position(|found| found == name).unwrap()].clone();
    assert!(report.diverged() > 0 && rows.iter().any(|row| cell(row, "ending") == "diverged"), "some diverge");
    for row in &rows {
        let count: usize = cell(row, "scene.count").parse().unwrap();
        for peer in 1..=4 {
            assert_eq!(cell(row, &format!("peers.peer{peer}.position_y_m")).is_empty(), peer > count);
            let is_measured = cell(row, "ending") == "complete" && peer <= count;
            assert!(!is_measured || !cell(row, &format!("peers.peer{peer}.energy_j")).is_empty());
            assert!(peer <= count || cell(row, &format!("peers.peer{peer}.energy_j")).is_empty());
        }
        assert!(cell(row, "access.offered").parse::<u64>().unwrap() > 0);
        let stiffness = cell(row, "coordination.stiffness");
        let strategy = cell(row, "coordination.strategy");
        let mut set = bench.set.clone();
        set.extend([
            format!("scene.count={count}"),
            "scene.axes=2".to_owned(),
            format!("coordination.strategy={strategy}"),
            format!("coordination.stiffness={stiffness}"),
        ]);
        alone(&named(&header, row), &set, &text);
    }
}

#[test]
fn fewer_axes_leave_columns_empty() {
    let mut bench = Bench::new(&["scene.axes=3,1"], 1);
    bench.format = Format::Csv;
    bench.text = bench.text.replace("hand = { force = 1.5 }\n", "");
    bench.finish("out", 1);
    let (header, rows) = comma_separated(&bench.path("out/runs.csv"));
    let empty = |row: usize| header.iter().zip(&rows[row]).filter(|(_, cell)| cell.is_empty()).map(|(name, _)| name.as_str()).collect::<Vec<&str>>();
    assert_eq!(empty(0), Vec::<&str>::new());
    let missing = ["left", "right"]
        .iter()
        .flat_map(|peer| ["position_y_m", "position_z_m", "velocity_y_m_s", "velocity_z_m_s"].map(|name| format!("peers.{peer}.{name}")));
    assert_eq!(empty(1), missing.collect::<Vec<String>>());
}

#[test]
fn the_mean_delay_is_that_of_all_packets_of_all_links() {
    let mut bench = Bench::new(&["links.left.right.delay=3ms,9ms"], 1);
    bench.format = Format::Csv;
    bench.set = ["link.jitter=0ms", "link.loss=0", "link.delay=7ms"].map(str::to_owned).to_vec();
    bench.finish("out", 1);
    let (header, rows) = comma_separated(&bench.path("out/runs.csv"));
    let place = header.iter().position(|name| name == "links.mean_delay_s").unwrap();
    for (row, delay) in rows.iter().zip([3_u32, 9]) {
        // A packet is sent every 2 ms from 0 on, and counts if it arrives before 40 ms. No packet arrives at exactly 40 ms.
        let arrived = |delay: u32| (0..20).map(|packet| f64::from(u8::from(packet * 2 + delay < 40))).sum::<f64>();
        let expected = (arrived(delay) * f64::from(delay) + arrived(7) * 7.0) / (arrived(delay) + arrived(7)) / 1e3;
        // The mean is rounded down to a nanosecond twice.
        let found = row[place].parse::<f64>().unwrap();
        assert!(found <= expected + 1e-15 && expected - found < 2e-9, "{found} {expected}");
    }
    let mut nothing = Bench::new(&[], 1);
    (nothing.format, nothing.set) = (Format::Csv, vec!["link.loss=100%".to_owned()]);
    nothing.finish("out", 1);
    assert_eq!(comma_separated(&nothing.path("out/runs.csv")).1[0][place - 1], "", "without a varied key the column is one further left");
}

#[test]
fn a_parquet_file_says_what_it_is_and_nothing_of_when() {
    let bench = Bench::new(&VARY, 3);
    bench.finish("out", 2);
    let reader = SerializedFileReader::new(File::open(bench.path("out/runs.parquet")).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    assert_eq!((metadata.created_by(), metadata.num_rows()), (Some("a test"), 12));
    let about = metadata.key_value_metadata().unwrap();
    assert_eq!((about.len(), about[0].key.as_str()), (1, "cohaptic.campaign"));
    assert_eq!(about[0].value.as_deref(), Some(std::fs::read_to_string(bench.path("out/campaign.json")).unwrap().as_str()));
    assert_eq!(bench.files("out"), ["campaign.json", "runs.parquet"]);
}

#[test]
fn the_task_of_each_run_stands_in_its_row() {
    let mut bench = Bench::new(&["task.radius=1,1e-9"], 2);
    bench.format = Format::Csv;
    bench.set = vec!["task={ kind = \"reach\", targets = [0.5], start = \"2ms\", timeout = \"20ms\", radius = 1 }".to_owned()];
    bench.finish("out", 2);
    let (header, rows) = comma_separated(&bench.path("out/runs.csv"));
    let place = header.iter().position(|name| name == "task.outcome").unwrap();
    assert_eq!(header[place..place + 4], ["task.outcome", "task.time_s", "task.reached", "max_discrepancy_m"]);
    let of_task: Vec<&[String]> = rows.iter().map(|row| &row[place..place + 3]).collect();
    // Copies are always within a metre of the target, and never within a nanometre.
    assert_eq!(of_task[..2], [["done", "0.0", "1"]; 2]);
    assert_eq!(of_task[2..], [["timed-out", "0.02", "0"]; 2]);
}
