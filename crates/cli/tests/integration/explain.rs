//! `cohaptic explain`: the modelled parts, the parts left out, and the reasons.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::{PLANE, RANDOM, TWO};

fn left_out(document: &Value) -> Vec<&str> {
    document["left_out"].as_array().unwrap().iter().map(|what| what.as_str().unwrap()).collect()
}

/// The model of the first part whose name contains this.
fn model<'a>(document: &'a Value, part: &str) -> &'a str {
    let mut rows = document["models"].as_array().unwrap().iter();
    rows.find(|row| row["part"].as_str().unwrap().contains(part)).unwrap_or_else(|| panic!("no {part} in {document:#}"))["model"].as_str().unwrap()
}

#[test]
fn every_part_has_a_model_and_a_reason() {
    for scene in [TWO, RANDOM, PLANE] {
        let document = Desk::with("scene.toml", scene).json("explain scene.toml --json");
        let rows = document["models"].as_array().unwrap();
        assert!(rows.len() > 5);
        for row in rows {
            assert!(["part", "model", "reason"].iter().all(|key| row[key].as_str().is_some_and(|text| !text.is_empty())), "{row}");
        }
        assert!(left_out(&document).iter().all(|what| !what.is_empty()));
    }
}

#[test]
fn what_the_scene_has_not_is_left_out() {
    let document = Desk::with("two.toml", TWO).json("explain two.toml --json");
    let left_out = left_out(&document).join("\n");
    for part in ["random numbers", "walls: the object has no enclosure", "changes: the timeline is empty", "an event for each tick"] {
        assert!(left_out.contains(part), "no {part:?} in {left_out}");
    }
    assert_eq!(model(&document, "2 links"), "constant delay 24ms");
    assert_eq!(model(&document, "axes"), "1");
    assert!(!left_out.contains("the device of"), "both touch: {left_out}");
}

#[test]
fn measures_of_more_than_ticks_need_events() {
    let desk = Desk::with("two.toml", TWO);
    let parts = |set: &str| -> Vec<String> {
        let document = desk.json(&format!("explain two.toml --json {set}"));
        document["models"].as_array().unwrap().iter().map(|row| row["part"].as_str().unwrap().to_owned()).collect()
    };
    let has = |parts: &[String], part: &str| parts.iter().any(|found| found == part);
    let arrays = "engine, unless packets are recorded";
    let (without, all, some) = (parts(""), parts("--set measure.names=all"), parts("--set 'measure.names=[\"force_peak_n\",\"discrepancy_rms_m\"]'"));
    assert!(has(&without, arrays) && !has(&without, "measures"), "{without:?}");
    assert!(has(&all, "measures") && !has(&all, arrays), "{all:?}");
    assert!(has(&some, "measures") && has(&some, arrays), "{some:?}");
}

#[test]
fn what_the_scene_has_is_not_left_out() {
    let document = Desk::with("three.toml", RANDOM).json("explain three.toml --json");
    let left_out = left_out(&document).join("\n");
    assert!(!left_out.contains("random"), "{left_out}");
    assert!(left_out.contains("the device of third: it touches nothing and no hand moves it"), "{left_out}");
    let links = model(&document, "6 links");
    for part in ["outage", "independent loss", "24ms", "jitter of 4ms"] {
        assert!(links.contains(part), "no {part} in {links}");
    }
    assert!(model(&document, "uplink of left").contains("2 packets"));
    assert!(model(&document, "peer left").contains("grasps the object"));
}

/// 24 ms of delay, and half of the 8 ms to the next sample.
#[test]
fn the_age_of_own_states_is_said_in_ticks() {
    let lagging = TWO.replace("average-position", "local-lag");
    let coordination = |scene: &str| model(&Desk::with("two.toml", scene).json("explain two.toml --json"), "coordination").to_owned();
    assert!(coordination(&lagging).contains("lag = auto; own states are taken 27 ticks old"), "{}", coordination(&lagging));
    let plain = coordination(&format!("{lagging}\n[coordination.local-lag]\nlag = \"0s\"\n"));
    assert!(plain.ends_with("lag = 0s"), "{plain}");
}

#[test]
fn a_timeline_that_loses_packets_draws_random_numbers() {
    let timeline = "[[timeline]]\nat = \"100ms\"\nlink = \"all\"\nset = { loss = \"10%\" }\n";
    let document = Desk::with("two.toml", &format!("{TWO}\n{timeline}")).json("explain two.toml --json");
    assert!(!left_out(&document).join("\n").contains("random"), "{document:#}");
    assert!(model(&document, "timeline").contains('1'));
}

#[test]
fn peers_with_clocks_of_their_own_run_with_events() {
    let desk = Desk::with("two.toml", TWO);
    let explained = |set: &str| desk.json(&format!("explain two.toml --json {set}"));
    assert_eq!(model(&explained(""), "ticks"), "lockstep, every 1ms");
    let (drifting, slower) = (explained("--set peers.left.clock.drift=20ppm"), explained("--set peers.left.tick=2ms"));
    assert_eq!([&drifting, &slower].map(|document| model(document, "ticks")), ["of each peer by its own clock"; 2]);
    for (document, why) in
        [(&drifting, "peers tick at instants of their own, by offsets or drifts"), (&slower, "the ticks of peers differ in length")]
    {
        assert!(left_out(document).join("\n").contains(&format!("arrays: {why}; the run has events")), "{document:#}");
    }
}

#[test]
fn dimensions_are_those_of_the_state() {
    let document = Desk::with("three.toml", RANDOM).json("explain three.toml --json");
    // Three copies and two devices, a position and a velocity each; three peers hold two samples of two numbers.
    assert_eq!((document["dimensions"]["plant"].as_u64(), document["dimensions"]["held"].as_u64()), (Some(10), Some(12)));
    // 6 links with 24 ms of 8 ms each.
    assert_eq!(document["dimensions"]["in_flight"], 18);
    assert_eq!((document["cost"]["peer_ticks_per_s"].as_f64(), document["cost"]["packets_per_s"].as_f64()), (Some(3000.0), Some(750.0)));
    let plane = Desk::with("plane.toml", PLANE).json("explain plane.toml --json");
    assert_eq!((plane["dimensions"]["plant"].as_u64(), plane["dimensions"]["held"].as_u64()), (Some(16), Some(8)));
}

#[test]
fn people_get_the_same_in_words() {
    let desk = Desk::with("three.toml", RANDOM);
    let (text, document) = (desk.text("explain three.toml"), desk.json("explain three.toml --json"));
    for part in ["Three users, far apart\n", "\nModelled\n", "\nLeft out\n", "\nState\n", "\nCost\n", "  10 numbers in devices and copies"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    for row in document["models"].as_array().unwrap() {
        let line =
            format!("  {}: {}\n      because: {}\n", row["part"].as_str().unwrap(), row["model"].as_str().unwrap(), row["reason"].as_str().unwrap());
        assert!(text.contains(&line), "no {line} in {text}");
    }
    assert!(left_out(&document).iter().all(|what| text.contains(&format!("  {what}\n"))), "{text}");
}

#[test]
fn nothing_is_run() {
    let desk = Desk::with("two.toml", TWO);
    // 584 years are all there is.
    desk.json("explain two.toml --json --set scene.duration=5000000h");
    assert_eq!(desk.files(""), ["two.toml"]);
}

#[test]
fn costs_are_measured_for_each_kind_and_engines_have_one_answer() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("explain two.toml --cost --json");
    assert_eq!(document["interrupted"], false);
    assert!(document["cost_span_s"].as_f64().unwrap() > 0.0 && document["models"].is_array());
    let methods = document["cost_measured"].as_array().unwrap();
    for kind in ["engine", "axes", "integrator", "analysis"] {
        let of_kind: Vec<&Value> = methods.iter().filter(|method| method["kind"] == kind).collect();
        assert_eq!(of_kind.iter().filter(|method| method["chosen"] == true).count(), 1, "{of_kind:#?}");
        for method in of_kind {
            assert!(method["cost_ms"].as_f64().is_some_and(|cost| cost > 0.0), "{method}");
            assert!(method["error"].as_f64().is_some_and(|error| error >= 0.0) && method["reference"].is_string(), "{method}");
            assert!(kind != "engine" || method["error"] == 0.0, "{method}");
        }
    }
    // Without the option the document is as before.
    assert!(desk.json("explain two.toml --json").get("cost_measured").is_none());
}

#[test]
fn people_get_a_table_and_a_picture_of_the_costs() {
    let desk = Desk::with("three.toml", RANDOM);
    let text = desk.text("explain three.toml --cost --out out --size one-column");
    for part in ["\nMeasured on this machine, over ", "  engine of runs", "exact propagator *", "ms a simulated second", "--method full", "error [m]"]
    {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    assert_eq!(desk.files("out"), ["cost.svg"]);
    let svg = desk.read("out/cost.svg");
    assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
    assert!(svg.contains(" width=\"85mm\"") && svg.contains("exact propagator (chosen)"));
    desk.cohaptic("explain three.toml --out out").assert_refused(2, &["--cost"]);
    desk.write("taken", "");
    desk.cohaptic("explain three.toml --cost --out taken").assert_refused(3, &["cannot write taken"]);
}

#[test]
fn standard_input_is_read_once_for_all_methods() {
    let desk = Desk::new();
    let outcome = desk.piped("explain - --cost --json", TWO);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let axes: Vec<Value> = crate::integration::desk::parse(&outcome.stdout)["cost_measured"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|method| method["kind"] == "axes")
        .cloned()
        .collect();
    assert!(axes.len() == 2 && axes.iter().all(|method| method["error"] == 0.0), "{axes:#?}");
}
