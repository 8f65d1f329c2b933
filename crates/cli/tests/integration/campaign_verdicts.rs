//! `cohaptic campaign --verdicts`: each combination is judged as `cohaptic stability point` judges it.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::PAPER;

/// Loss does nothing to the first stiffness, and takes the second beyond its limit: only the mean square sees that.
const LOSSY: &str = "campaign paper.toml --set scene.count=2 --vary coordination.stiffness=1000,1400 --vary link.loss=0%,30% --verdicts";

/// Bursts of loss between two peers: some hundredths of a second for each verdict.
const BURSTS: &str = "link.loss={gilbert-elliott={p=0.05,r=0.25}}";

fn desk() -> Desk {
    Desk::with("paper.toml", PAPER)
}

/// Returns the answer of `stability point` for a combination of a campaign: verdict, word, radius and error.
fn point(desk: &Desk, set: &str, combination: &Value) -> [Value; 4] {
    let mut command = desk.command(&format!("stability point paper.toml --json {set}"));
    for vary in combination["vary"].as_array().unwrap() {
        command.arg("--set").arg(vary.as_str().unwrap());
    }
    let document: Value = serde_json::from_slice(&command.output().unwrap().stdout).unwrap();
    let (word, radius) = match document.get("mean_square_radius") {
        Some(_) => ("mean-square", "mean_square_"),
        None => ("spectral-radius", ""),
    };
    let names = if radius.is_empty() { ["spectral_radius", "error_bound"] } else { ["mean_square_radius", "mean_square_error_bound"] };
    [document["verdict"].clone(), word.into(), document[names[0]].clone(), document[names[1]].clone()]
}

fn judged(combination: &Value) -> [Value; 4] {
    ["verdict", "judged", "radius", "error_bound"].map(|key| combination[key].clone())
}

#[test]
fn every_combination_is_judged_as_a_point() {
    let desk = desk();
    let document = desk.json(&format!("{LOSSY} --vary peer.contact=\"grasp\",{{push=\"+x\"}} --format csv --out out --json"));
    let combinations = document["combinations"].as_array().unwrap();
    assert_eq!((combinations.len(), &document["notes"]), (8, &Value::Array(Vec::new())));
    for combination in combinations {
        assert_eq!(judged(combination), point(&desk, "--set scene.count=2", combination), "{combination}");
        assert_eq!(combination["reason"], Value::Null);
    }
    // Stable with nothing lost, and by the spectral radius with 30 % lost; not in the mean square.
    let worst = &combinations[6];
    assert_eq!((&worst["vary"][0], &worst["vary"][1]), (&"coordination.stiffness=1400".into(), &"link.loss=30%".into()));
    assert_eq!((&worst["verdict"], &worst["judged"]), (&"unstable".into(), &"mean-square".into()));
    assert!((worst["radius"].as_f64().unwrap() - 1.0254).abs() < 5e-5, "{worst}");
    assert_eq!(combinations[4]["verdict"], "stable");
    // The rows of the runs say the same.
    let mut reader = csv::Reader::from_path(desk.path("out/runs.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let from = header.iter().position(|name| name == "verdict").unwrap();
    assert_eq!((header[from - 1].as_str(), header[from + 4].as_str()), ("peer.contact", "ending"));
    assert_eq!(header[from..from + 4], ["verdict", "judged", "radius", "error_bound"]);
    for (row, combination) in reader.records().zip(combinations) {
        let row = row.unwrap();
        let [verdict, word, radius, error] = judged(combination);
        assert_eq!([&row[from], &row[from + 1]], [verdict.as_str().unwrap(), word.as_str().unwrap()]);
        // The reader of JSON rounds the last digit once more.
        for (place, number) in [(2, radius), (3, error)] {
            let (cell, number) = (row[from + place].parse::<f64>().unwrap(), number.as_f64().unwrap());
            assert!((cell - number).abs() <= 2.0 * f64::EPSILON * number, "{cell} {number}");
        }
    }
    let text = desk.text(&format!("{LOSSY} --vary peer.contact=\"grasp\",{{push=\"+x\"}} --format csv --out out"));
    assert!(text.contains("  unstable      mean-square  1.02544"), "{text}");
}

#[test]
fn what_cannot_be_followed_is_nominal_and_counted() {
    let desk = desk();
    let outages = "link.outage=[],{random={up=\"5s\",down=\"50ms\"}},{random={up=\"4s\",down=\"50ms\"}}";
    let document = desk.json(&format!("campaign paper.toml --vary {outages} --verdicts --out out --json"));
    let combinations = document["combinations"].as_array().unwrap();
    assert_eq!(combinations.iter().map(|combination| &combination["judged"]).collect::<Vec<_>>(), ["spectral-radius", "nominal", "nominal"]);
    for combination in &combinations[1..] {
        let [verdict, _, radius, _] = point(&desk, "", combination);
        assert_eq!(combination["verdict"], verdict);
        // A mean-square radius of a scene that leaves nothing to chance is the square of the spectral one, as in a map.
        let (found, radius) = (combination["radius"].as_f64().unwrap(), radius.as_f64().unwrap());
        assert!((found - radius.powi(2)).abs() < 1e-12, "{found} {radius}");
    }
    assert!(document["notes"][0].as_str().unwrap().starts_with("2 combinations are nominal: the second moment"), "{document}");
    let one = desk.text("campaign paper.toml --set link.outage={random={up=\"5s\",down=\"50ms\"}} --verdicts --out one");
    assert!(one.contains("note: 1 combination is nominal"), "{one}");
}

#[test]
fn what_analysis_refuses_has_no_verdict_and_its_reason_is_counted() {
    let desk = desk();
    let drifts = "--vary peer.clock.drift=0,0.0000123456789,0.0000123456788";
    let timelines = "--vary timeline=[],[{at=\"10ms\",link=\"all\",set={delay=\"16ms\"}}]";
    let command = format!("campaign paper.toml --set scene.duration=50ms {drifts} {timelines} --verdicts --format csv --out out");
    let document = desk.json(&format!("{command} --json"));
    let combinations = document["combinations"].as_array().unwrap();
    let stable = judged(&combinations[0]);
    assert_eq!((&stable[0], &combinations[0]["reason"]), (&"stable".into(), &Value::Null));
    for combination in &combinations[1..] {
        assert_eq!(judged(combination), [const { Value::Null }; 4], "{combination}");
        let is_timeline = combination["vary"][1] != "timeline=[]";
        let part = if is_timeline { "the timeline changes the scene" } else { "everything repeats only after" };
        assert!(combination["reason"].as_str().unwrap().contains(part), "{combination}");
    }
    let notes: Vec<&str> = document["notes"].as_array().unwrap().iter().map(|note| note.as_str().unwrap()).collect();
    assert!(notes.iter().any(|note| note.starts_with("3 combinations have no verdict: the timeline")), "{notes:?}");
    assert_eq!(desk.json(&format!("{command} --json"))["combinations"], document["combinations"], "read back from the folder");
    assert!(desk.read("out/runs.csv").lines().nth(2).unwrap().contains(",,,,,complete,"));
    // Without verdicts there are no such keys.
    let document = desk.json(&format!("{} --json", command.replace("--verdicts ", "").replace("--out out", "--out plain")));
    assert!(document["combinations"][0].get("verdict").is_none() && !desk.read("plain/runs.csv").contains("verdict"));
    desk.cohaptic(&command.replace("--verdicts ", "")).assert_refused(2, &["--verdicts is given there and not given here"]);
}

#[test]
fn threads_change_nothing() {
    let desk = desk();
    let files = ["runs.parquet", "verdicts.csv", "campaign.json"];
    for threads in ["1", "2", "5"] {
        desk.text(&format!("{LOSSY} --runs 20 --part 16 --threads {threads} --out threads{threads}"));
        for file in files {
            let read = |threads: &str| std::fs::read(desk.path(&format!("threads{threads}/{file}"))).unwrap();
            assert!(read(threads) == read("1"), "{threads} {file}");
        }
    }
}

#[cfg(unix)]
#[test]
fn verdicts_that_were_interrupted_are_kept_and_end_with_the_same_bytes() {
    use crate::integration::interrupt::interrupted;
    let desk = desk();
    let line = format!("campaign paper.toml --set scene.duration=50ms --set {BURSTS} --vary object.mass=0.3..0.9/30 --verdicts --format csv");
    let lines = || std::fs::read_to_string(desk.path("out/verdicts.part.csv")).unwrap_or_default().lines().count();
    let outcome = interrupted(&desk, &format!("{line} --set scene.count=2 --threads 1 --out out"), |_| lines() > 2);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(130), ""));
    let kept = lines();
    assert!(outcome.stderr.contains(&format!("{kept} of 30 verdicts are kept in out; repeat the command to go on from there")), "{}", outcome.stderr);
    assert_eq!(desk.files("out"), ["campaign.json", "verdicts.part.csv"]);
    desk.text(&format!("{line} --set scene.count=2 --threads 2 --out out"));
    desk.text(&format!("{line} --set scene.count=2 --threads 3 --out whole"));
    for file in ["runs.csv", "verdicts.csv", "campaign.json"] {
        assert!(desk.read(&format!("out/{file}")) == desk.read(&format!("whole/{file}")), "{file}");
    }
    assert_eq!(desk.files("out"), desk.files("whole"));
    // A verdict of seconds is given up in time: the command ends by itself, and not because its time is over.
    let outcome = interrupted(&desk, &format!("{line} --set scene.count=3 --threads 1 --out slow"), |_| desk.path("slow/verdicts.part.csv").exists());
    assert_eq!(outcome.status, Some(130));
    assert!(outcome.stderr.contains("of 30 verdicts are kept in slow"), "{}", outcome.stderr);
}
