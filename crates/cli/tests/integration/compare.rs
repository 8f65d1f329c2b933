//! `cohaptic compare`: strategies side by side. The table of runs is compared with that of `cohaptic campaign`, figures with the runs themselves, and everything with itself
//! on other numbers of threads and after an interruption.

use std::fs;

use cohaptic_picture::testing::page_faults;
use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::{RANDOM, TWO};

const SIX: &str = "compare random.toml --strategies average-position,extrapolated --vary link.loss=0%,20%,40% --runs 6";

fn desk() -> Desk {
    Desk::with("random.toml", RANDOM)
}

/// Everything in a folder, by name.
fn folder(desk: &Desk, name: &str) -> Vec<(String, Vec<u8>)> {
    desk.files(name).into_iter().map(|file| (file.clone(), fs::read(desk.path(&format!("{name}/{file}"))).unwrap())).collect()
}

/// Returns the rows of the table of runs, each as a map from the name of a column.
fn rows(desk: &Desk, file: &str) -> Vec<std::collections::BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(desk.path(file)).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    reader.records().map(|record| header.iter().cloned().zip(record.unwrap().iter().map(str::to_owned)).collect()).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn count(values: &[f64]) -> f64 {
    f64::from(u32::try_from(values.len()).unwrap())
}

#[test]
fn the_table_of_runs_is_that_of_the_campaign_to_the_last_byte() {
    let desk = desk();
    desk.text(&format!("{SIX} --out compared"));
    let vary = "--vary coordination.strategy=average-position,extrapolated --vary link.loss=0%,20%,40%";
    desk.text(&format!("campaign random.toml {vary} --runs 6 --measure all --out plain --no-plot"));
    for file in ["runs.parquet", "campaign.json"] {
        assert!(fs::read(desk.path(&format!("compared/{file}"))).unwrap() == fs::read(desk.path(&format!("plain/{file}"))).unwrap(), "{file}");
    }
    // So a campaign becomes a comparison without a run.
    assert_eq!(desk.json(&format!("{SIX} --out plain --json"))["runs_computed"], 0);
    assert_eq!(folder(&desk, "plain"), folder(&desk, "compared"));
}

/// The figures of a document against those that the rows of the table give: sums in another order and Student's quantile of a table.
#[test]
fn means_and_paired_differences_are_those_of_the_runs() {
    // Abramowitz & Stegun, table 26.10: the 0.975 quantile with 5 degrees of freedom.
    const STUDENT_5: f64 = 2.571;
    let desk = desk();
    let document = desk.json(&format!("{SIX} --format csv --out out --json"));
    let rows = rows(&desk, "out/runs.csv");
    let combinations = document["combinations"].as_array().unwrap();
    assert_eq!((combinations.len(), rows.len(), document["measures"][0]["name"].as_str()), (6, 36, Some("max_discrepancy_m")));
    let values = |combination: usize| -> Vec<f64> {
        rows[6 * combination..6 * (combination + 1)].iter().map(|row| row["max_discrepancy_m"].parse().unwrap()).collect()
    };
    let assert_interval = |values: &[f64], found: &Value, mean: f64| {
        let (n, squares) = (count(values), values.iter().rev().map(|value| value * value).sum::<f64>());
        let half = STUDENT_5 * ((squares - n * mean * mean) / (n - 1.0) / n).sqrt();
        assert!((number(&found["value"]) - mean).abs() < 1e-12, "{found} and {mean}");
        let width = number(&found["high"]) - number(&found["low"]);
        assert!((width / (2.0 * half) - 1.0).abs() < 1e-3, "{found} and {half}");
    };
    let mean = |values: &[f64]| values.iter().rev().sum::<f64>() / count(values);
    for (place, combination) in combinations.iter().enumerate() {
        let found = &combination["measures"][0];
        let own = values(place);
        assert_eq!((found["count"].as_u64(), combination["runs"].as_u64(), combination["diverged"]["count"].as_u64()), (Some(6), Some(6), Some(0)));
        assert_interval(&own, &found["mean"], mean(&own));
        // Wilson's interval of none of n: from 0 to z²/(n + z²).
        let z2 = 1.959_963_984_540_054_f64.powi(2);
        assert!((number(&combination["diverged"]["high"]) - z2 / (6.0 + z2)).abs() < 1e-12);
        if place < 3 {
            assert_eq!((combination["strategy"].as_str(), &found["difference"]), (Some("average-position"), &Value::Null));
            continue;
        }
        // Rows of one seed and one loss are three combinations apart.
        let differences: Vec<f64> = own.iter().zip(values(place - 3)).map(|(own, baseline)| own - baseline).collect();
        assert_eq!((combination["strategy"].as_str(), found["difference"]["count"].as_u64()), (Some("extrapolated"), Some(6)));
        assert_interval(&differences, &found["difference"], mean(&differences));
    }
    for row in rows.chunks(6).flat_map(|combination| combination.iter().enumerate()) {
        assert_eq!(row.1["seed"], (3 + row.0).to_string(), "seeds are shared");
    }
}

#[test]
fn threads_and_repetitions_change_no_byte() {
    let desk = desk();
    for threads in [1, 2, 5] {
        desk.text(&format!("{SIX} --part 8 --out out{threads} --threads {threads}"));
        assert_eq!(folder(&desk, &format!("out{threads}")), folder(&desk, "out1"));
    }
    assert_eq!(desk.files("out1"), ["campaign.json", "compare.csv", "compare.html", "runs.parquet", "stability.csv"]);
    let before = folder(&desk, "out1");
    let again = desk.text(&format!("{SIX} --part 8 --out out1"));
    assert!(again.contains("nothing was run"), "{again}");
    assert_eq!(folder(&desk, "out1"), before);
}

/// A folder as a kill leaves it: some parts whole, some verdicts made.
#[test]
fn a_comparison_that_was_killed_goes_on_to_the_same_bytes() {
    let desk = desk();
    desk.text(&format!("{SIX} --part 8 --format csv --out whole"));
    // A worker makes the second part, its digest and the second verdict; the beginning of another verdict is torn off.
    desk.text(&format!("{SIX} --part 8 --format csv --out killed --shard 2/5"));
    let journal = desk.files("killed").into_iter().find(|name| name.starts_with("stability.")).unwrap();
    let torn = format!("{}2,sta", desk.read(&format!("killed/{journal}")));
    desk.write(&format!("killed/{journal}"), torn);
    let document = desk.json(&format!("{SIX} --part 8 --format csv --out killed --json"));
    assert_eq!(document["runs_computed"], 28);
    assert_eq!(folder(&desk, "killed"), folder(&desk, "whole"));
}

#[test]
fn a_combination_that_a_strategy_refuses_is_shown_with_its_reason() {
    let desk = Desk::with("two.toml", TWO);
    let line = "compare two.toml --strategies average-position,local-damping,local-damping{damping=58} --vary link.loss=0%,20% --runs 2 --out out";
    let document = desk.json(&format!("{line} --json"));
    let combinations = document["combinations"].as_array().unwrap();
    let refused: Vec<bool> = combinations.iter().map(|combination| !combination["refused"].is_null()).collect();
    assert_eq!(refused[..2], [false, false], "{document:#}");
    assert_eq!(
        (refused[3], &refused[4..], document["runs"].as_u64()),
        (true, &[false, false][..], Some(2 * refused.iter().filter(|refused| !**refused).count() as u64))
    );
    let reason = combinations[3]["refused"].as_str().unwrap();
    assert!(reason.starts_with("a damping of \"auto\" needs the age"), "{reason}");
    assert_eq!((combinations[3]["runs"].as_u64(), &combinations[3]["diverged"], &combinations[3]["verdict"]), (Some(0), &Value::Null, &Value::Null));
    let words = desk.text(line);
    assert!(words.contains("local-damping: a damping of \"auto\" needs the age"), "{words}");
    let page = desk.read("out/compare.html");
    assert!(page.contains("a damping of &quot;auto&quot; needs the age") && page.contains(">refused<"), "{page}");
    assert!(desk.read("out/compare.csv").contains(",\"a damping of \"\"auto\"\" needs the age"), "{}", desk.read("out/compare.csv"));
}

#[test]
fn the_page_is_well_formed_and_stands_alone() {
    let desk = desk();
    for (name, more) in [
        ("line", "--vary link.loss=0%,20%,40%"),
        ("panels", "--vary link.loss=0%,20% --vary object.mass=0.2,0.45,1"),
        ("names", "--vary peers.left.contact=grasp,none"),
        ("alone", ""),
        ("diverged", "--vary coordination.stiffness=1000,1e12 --set scene.duration=2s"),
        ("hostile", "--set 'scene.title=\"<script>alert(1)</script> & more\"'"),
        ("many", "--vary object.mass=0.2,1 --vary scene.duration=10ms..26ms/17"),
    ] {
        desk.text(&format!(
            "compare random.toml --strategies average-position,extrapolated{{horizon=20ms}},smoothed-average-position {more} --runs 3 --out {name}"
        ));
        let page = desk.read(&format!("{name}/compare.html"));
        assert_eq!(page_faults(&page), [""; 0], "{name}");
        for part in
            ["extrapolated{horizon=20ms}", "horizon 20ms", "max discrepancy", "cohaptic compare random.toml", "[object]", "How the numbers are made"]
        {
            assert!(page.contains(part), "{name}: no {part}");
        }
        assert_eq!(page.contains("<svg"), name != "many", "{name}");
    }
    assert!(desk.read("many/compare.html").contains("No pictures: a panel for each value of scene.duration would be 17 panels"));
    assert!(desk.read("diverged/compare.html").contains("diverged"));
}

/// The figures of a task against the rows of the table of runs. With a timeout of 6 s some runs are too slow.
#[test]
fn a_task_is_compared_by_the_runs_in_which_it_was_done() {
    let desk = Desk::with("together.toml", include_str!("../../../../scenarios/tasks/together.toml"));
    let line = "compare together.toml --strategies AP,PD --vary link.delay=0ms,50ms --vary scene.count=2,4 --set task.timeout=6s --runs 3 --format csv --out out";
    let document = desk.json(&format!("{line} --json"));
    let rows = rows(&desk, "out/runs.csv");
    let combinations = document["combinations"].as_array().unwrap();
    let mut counts = Vec::new();
    for (place, combination) in combinations.iter().enumerate() {
        let runs = &rows[3 * place..3 * (place + 1)];
        let times: Vec<f64> = runs.iter().filter(|row| row["task.outcome"] == "done").map(|row| row["task.time_s"].parse().unwrap()).collect();
        let time = combination["measures"].as_array().unwrap().iter().find(|measure| measure["name"] == "task_time_s").unwrap();
        assert_eq!((combination["done"]["count"].as_u64(), time["count"].as_u64()), (Some(times.len() as u64), Some(times.len() as u64)));
        assert!(times.is_empty() || (number(&time["mean"]["value"]) - times.iter().sum::<f64>() / count(&times)).abs() < 1e-12);
        counts.push(times.len());
    }
    // The two laws are one for two people. For four people over 50 ms, proportional-derivative coordination is the slower one.
    assert_eq!((counts[0], counts[2]), (counts[4], counts[6]), "{counts:?}");
    assert!(counts[7] < counts[3] && counts[0] == 3, "{counts:?}");
    let pictures = ["done.svg", "internal_force_n.svg", "motion_force_n.svg", "task_time_s.svg", "throughput_bit_s.svg"];
    let svg = |name: &String| name.ends_with(".svg");
    assert_eq!(desk.files("out").into_iter().filter(svg).collect::<Vec<String>>(), pictures);
    let page = desk.read("out/compare.html");
    assert_eq!(page_faults(&page), [""; 0]);
    for part in ["<h2>Task</h2>", "<figure id=\"done\">", "Share of the runs whose task was done", &format!("{} of 3 (", counts[7])] {
        assert!(page.contains(part), "no {part}");
    }
    // Each file has the picture with the same name on the page.
    for file in pictures {
        let (picture, name) = (desk.read(&format!("out/{file}")), file.trim_end_matches(".svg"));
        let shown = page.split(&format!(" id=\"{name}\"")).nth(1).and_then(|rest| rest.split("</figure>").next()).unwrap_or_default();
        assert!(shown.contains(&picture[picture.find("<path").unwrap()..picture.rfind("</svg>").unwrap()]), "{file} is another picture");
    }
    let before = folder(&desk, "out");
    desk.text(line);
    assert!(folder(&desk, "out") == before, "the second time other bytes are written");
    // Too many panels are drawn neither on the page nor in files.
    desk.text("compare together.toml --strategies AP,PD --vary link.delay=0ms,50ms --vary link.loss=0%..16%/17 --set task.timeout=100ms --runs 1 --out many");
    assert!(!desk.files("many").iter().any(svg) && desk.read("many/compare.html").contains("No pictures: "));
}

#[test]
fn people_are_told_what_came_out() {
    let desk = desk();
    let text = desk.text(&format!("{SIX} --out out"));
    for part in [
        "Three users, far apart\n  36 runs of 2 strategies at 3 combinations of link.loss, 6 of each\n",
        "a difference is that to average-position, over the seeds of which neither run diverged",
        "  1  average-position  0 of 18 (0 to 18 %)",
        "max discrepancy [mm]: Largest distance along an axis between two copies, over instants\n",
        "           0%  average-position  ",
        " ± ",
    ] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    // Of many combinations each measure is summed up.
    let many = desk.text("compare random.toml --strategies average-position,extrapolated --vary link.loss=0%..40%/13 --runs 2 --out many");
    assert!(many.contains("at how many of 13 combinations a strategy is lower") && many.contains("all figures are in compare.csv"), "{many}");
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_field_preset_compares_every_strategy() {
    let desk = desk();
    let document = desk.json("compare random.toml --preset field --runs 1 --set scene.duration=40ms --out out --json");
    let names: Vec<&str> = document["strategies"].as_array().unwrap().iter().map(|strategy| strategy["name"].as_str().unwrap()).collect();
    let all: Vec<&str> = cohaptic_peer::Coordination::ALL.iter().map(|strategy| strategy.name()).collect();
    assert_eq!((&names[..all.len()], names[all.len()..].join(" ")), (&all[..], "average-position{coordination.send-when.velocity=10%}".to_owned()));
    let vary = |place: usize| &document["combinations"][place]["vary"];
    let last = document["combinations"].as_array().unwrap().len() - 1;
    assert_eq!((&vary(0)[0], &vary(0)[1]), (&"link.delay=0ms".into(), &"link.loss=0%".into()));
    assert_eq!((&vary(last)[0], &vary(last)[1]), (&"link.delay=200ms".into(), &"link.loss=30%".into()));
}

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_written() {
    let desk = desk();
    for (rest, parts) in [
        ("--strategies average-position --out out", &["--strategies: \"average-position\" names fewer than two strategies", "such as"][..]),
        (
            "--strategies average-position,extrapolatd --out out",
            &["--strategies: unknown strategy \"extrapolatd\"", "did you mean \"extrapolated\"?"],
        ),
        ("--strategies average-position,extrapolated{horzon=5ms} --out out", &["extrapolated has no parameter \"horzon\"", "expected horizon"]),
        ("--strategies average-position,average-position --out out", &["average-position stands twice"]),
        ("--strategies average-position,extrapolated{horizon} --out out", &["NAME{KEY=VALUE,...}"]),
        (
            "--strategies average-position,extrapolated{horizon=5} --out out",
            &["--strategies coordination.extrapolated.horizon=5", "^", "note: in the combination"],
        ),
        ("--strategies average-position,extrapolated{coordination.stifness=5} --out out", &["--strategies coordination.stifness=5", "stiffness"]),
        ("--strategies average-position,extrapolated --vary link.dlay=8ms --out out", &["--vary link.dlay=8ms", "^"]),
        (
            "--strategies average-position,extrapolated --vary coordination.strategy=local-damping --out out",
            &["--vary coordination.strategy=local-damping", "--strategies"],
        ),
        ("--strategies average-position,extrapolated --vary link.delay --out out", &["--vary: no key"]),
        ("--strategies average-position,extrapolated --runs 0 --out out", &["0 runs"]),
        ("--strategies average-position,extrapolated", &["--out"]),
        ("--out out", &["--strategies"]),
        ("--preset fields --out out", &["field"]),
        ("--preset field --vary link.delay=8ms --out out", &["--vary"]),
    ] {
        let outcome = desk.cohaptic(&format!("compare random.toml {rest} --json"));
        outcome.assert_refused(2, parts);
        assert_eq!((desk.files(""), desk.path("out").exists()), (vec!["random.toml".to_owned()], false), "{rest}");
    }
    desk.cohaptic("compare gone.toml --preset field --out out").assert_refused(3, &["gone.toml: cannot be read"]);
}
