//! `cohaptic run`: its text and its document.

use serde_json::Value;

use crate::integration::desk::{Desk, shipped, timeless};
use crate::integration::scenes::{PLANE, RANDOM, TWO};

/// Dropped packets of a link or access line, whatever the cause.
pub(crate) fn dropped(link: &Value) -> u64 {
    link["dropped"].as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum()
}

#[test]
fn the_document_has_every_key_of_the_contract() {
    let document = Desk::with("three.toml", RANDOM).json("run three.toml --json");
    assert_eq!(document["title"], "Three users, far apart");
    for key in ["duration_s", "wall_s", "realtime_factor", "max_discrepancy_m"] {
        assert!(document[key].as_f64().is_some_and(|value| value > 0.0), "{key} is {}", document[key]);
    }
    assert!(document["ticks"].is_u64());
    let peers = document["peers"].as_array().unwrap();
    assert_eq!(peers.iter().map(|peer| peer["name"].as_str().unwrap()).collect::<Vec<_>>(), ["left", "right", "third"]);
    assert!(peers.iter().all(|peer| peer["position_m"].is_f64() && peer["velocity_m_s"].is_f64()));
    let links = document["links"].as_array().unwrap();
    assert_eq!(links.len(), 3 * 2);
    for link in links {
        assert!(link["from"].is_string() && link["to"].is_string(), "{link}");
        for key in ["offered", "duplicated", "delivered", "in_flight"] {
            assert!(link[key].is_u64(), "{key} of {link}");
        }
        assert!(link["mean_delay_s"].is_f64(), "{link}");
        let causes: Vec<&String> = link["dropped"].as_object().unwrap().keys().collect();
        assert!(causes.iter().any(|cause| *cause == "loss") && causes.iter().any(|cause| *cause == "outage"), "{link}");
    }
}

#[test]
fn ticks_and_samples_are_as_many_as_the_clocks_say() {
    let document = Desk::with("two.toml", TWO).json("run two.toml --json");
    assert_eq!((document["ticks"].as_u64(), document["duration_s"].as_f64(), document["ending"].as_str()), (Some(200), Some(0.2), Some("complete")));
    for link in document["links"].as_array().unwrap() {
        // 25 sent, of which those of 184 ms and 192 ms are on the way at 200 ms.
        let counters = ["offered", "delivered", "in_flight", "duplicated"].map(|key| link[key].as_u64().unwrap());
        assert_eq!((counters, dropped(link), link["mean_delay_s"].as_f64()), ([25, 23, 2, 0], 0, Some(0.024)), "{link}");
    }
}

#[test]
fn an_object_that_nobody_touches_flies_straight() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk
        .json("run two.toml --json --set peer.contact=none --set coordination.stiffness=0 --set coordination.damping=0 --set object.velocity=0.5");
    for peer in document["peers"].as_array().unwrap() {
        let (position, velocity) = (peer["position_m"].as_f64().unwrap(), peer["velocity_m_s"].as_f64().unwrap());
        // 0.5 m/s for 0.2 s, in 200 steps of which each may round by half a unit in the last place.
        assert!((position - 0.1).abs() < 200.0 * 0.1 * f64::EPSILON && velocity == 0.5, "{peer}");
    }
    assert_eq!(document["max_discrepancy_m"].as_f64(), Some(0.0));
}

#[test]
fn a_position_is_a_number_with_one_axis_and_a_list_with_more() {
    let document = Desk::with("plane.toml", PLANE).json("run plane.toml --json");
    for peer in document["peers"].as_array().unwrap() {
        for key in ["position_m", "velocity_m_s"] {
            let values: Vec<f64> = peer[key].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
            assert!(values.len() == 2 && values[0] > 0.0 && values[1] < 0.0, "{key} of {peer}");
        }
    }
    let one = Desk::with("two.toml", TWO).json("run two.toml --json");
    assert!(one["peers"][0]["position_m"].is_f64() && one["peers"][1]["velocity_m_s"].is_f64());
}

#[test]
fn no_packet_vanishes_and_none_comes_from_nowhere() {
    let document = Desk::with("three.toml", RANDOM).json("run three.toml --json");
    let count = |link: &Value, key: &str| link[key].as_u64().unwrap();
    let links = document["links"].as_array().unwrap();
    let lines = document["access_lines"].as_array().unwrap();
    for link in links.iter().chain(lines) {
        assert_eq!(count(link, "offered") + count(link, "duplicated"), count(link, "delivered") + dropped(link) + count(link, "in_flight"), "{link}");
    }
    assert!(links.iter().all(|link| link["dropped"]["loss"].as_u64() > Some(0) && link["dropped"]["outage"].as_u64() > Some(0)), "{document:#}");
    let [uplink] = lines.as_slice() else { panic!("one access line: {document:#}") };
    assert_eq!((uplink["peer"].as_str(), uplink["line"].as_str()), (Some("left"), Some("uplink")));
    // 75 frames of two packets. What the line lets through is what is offered to the links behind it.
    let behind: u64 = links.iter().filter(|link| link["from"] == "left").map(|link| count(link, "offered")).sum();
    assert_eq!((count(uplink, "offered"), count(uplink, "delivered")), (150, behind));
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_does_not() {
    let desk = Desk::with("three.toml", RANDOM);
    let run = |seed: u32| timeless(desk.json(&format!("run three.toml --json --set scene.seed={seed}")));
    let first = run(3);
    assert_eq!(first, run(3));
    assert_ne!(first, run(4));
}

#[test]
fn the_general_model_gives_the_same_answer() {
    let desk = Desk::with("three.toml", RANDOM);
    desk.write("plane.toml", PLANE);
    desk.write("two.toml", TWO);
    for scene in ["two.toml", "plane.toml", "three.toml"] {
        let least = timeless(desk.json(&format!("run {scene} --json")));
        assert_eq!(least, timeless(desk.json(&format!("run {scene} --json --general"))), "{scene}");
    }
}

#[test]
fn the_summary_says_what_happened() {
    let text = Desk::with("two.toml", TWO).text("run two.toml");
    for part in [
        "Two users\n",
        "200ms simulated, 200 ticks, in ",
        "times real time",
        "largest discrepancy between two copies: ",
        "left ends at ",
        "right ends at ",
        "50 packets sent over 2 links, 46 delivered, 4 on the way at the end\n",
    ] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
    assert!(!text.contains("DIVERGED") && !text.contains("dropped"), "{text}");
    let text = Desk::with("three.toml", RANDOM).text("run three.toml");
    assert!(text.contains("dropped (loss)") && text.contains("dropped (outage)") && text.contains("dropped (queue-full)"), "{text}");
}

#[test]
fn a_scene_that_diverges_says_when() {
    let desk = Desk::with("two.toml", TWO);
    let diverge = "run two.toml --set coordination.stiffness=1e12 --set scene.duration=60s";
    let text = desk.text(diverge);
    assert!(text.contains("DIVERGED: at ") && !text.contains("60s simulated"), "{text}");
    let document = desk.json(&format!("{diverge} --json"));
    assert_eq!(document["ending"], "diverged");
    assert!(document["duration_s"].as_f64().unwrap() < 60.0);
}

/// The copies are far apart, and every number is finite: run, check, campaign and compare say the same.
#[test]
fn a_run_whose_copies_come_apart_has_diverged_in_every_command() {
    let desk = Desk::with("two.toml", TWO);
    let set = "--set coordination.stiffness=20000 --set scene.duration=2s";
    let document = desk.json(&format!("run two.toml {set} --json"));
    assert_eq!(document["ending"], "diverged");
    assert_eq!(document["duration_s"], 2.0, "no number overflowed");
    assert!(document["max_discrepancy_m"].as_f64().unwrap() > 1.0);
    let text = desk.text(&format!("run two.toml {set}"));
    assert!(text.contains("DIVERGED: two copies were more than 1 m apart\n"), "{text}");
    let text = desk.text("campaign two.toml --set scene.duration=2s --vary coordination.stiffness=1000,20000 --out out --format csv");
    assert!(text.contains("  1 diverged; the largest discrepancy of the others is "), "{text}");
    let rows = desk.read("out/runs.csv");
    assert!(rows.lines().nth(1).unwrap().contains(",complete,2.0,") && rows.lines().nth(2).unwrap().contains(",diverged,2.0,"), "{rows}");
    let compared = desk.json("compare two.toml --strategies average-position,proportional-derivative --set scene.duration=2s --vary coordination.stiffness=1000,20000 --runs 2 --out compared --json");
    let counts = compared["combinations"].as_array().unwrap().iter().map(|combination| combination["diverged"]["count"].as_u64());
    assert_eq!(counts.collect::<Vec<_>>(), [Some(0), Some(2), Some(0), Some(2)], "{compared:#}");
}

/// Characters of braille patterns.
fn dots(text: &str) -> usize {
    text.chars().filter(|letter| ('\u{2801}'..='\u{28ff}').contains(letter)).count()
}

#[test]
fn positions_are_drawn_unless_no_plot_is_given() {
    let desk = Desk::with("two.toml", TWO);
    let (drawn, plain) = (desk.text("run two.toml"), desk.text("run two.toml --no-plot"));
    // Each of the 72 columns has at least a dot of one of the curves.
    assert!(dots(&drawn) >= 72, "{drawn}");
    assert!(drawn.contains("position of each copy of the object"), "{drawn}");
    assert_eq!(dots(&plain), 0, "{plain}");
    assert!(plain.contains("left ends at "), "{plain}");
}

#[test]
fn a_plot_does_not_change_the_result() {
    let desk = Desk::with("three.toml", RANDOM);
    let ends = |text: &str| text.lines().filter(|line| line.contains(" ends at ") || line.contains("packets")).map(str::to_owned).collect::<Vec<_>>();
    let (drawn, plain) = (ends(&desk.text("run three.toml")), ends(&desk.text("run three.toml --no-plot")));
    assert!(drawn == plain && drawn.len() == 4, "{drawn:?} {plain:?}");
}

#[test]
fn shipped_scenes_run_and_are_explained() {
    let desk = Desk::new();
    for name in ["network/timeline.toml", "network/two-axes.toml", "network/clock-offset-and-drift.toml", "network/shared-access-line.toml"] {
        let scene = shipped(name);
        let document = desk.json(&format!("run '{}' --json --set scene.duration=4.5s", scene.display()));
        assert_eq!(document["ending"], "complete", "{name}");
        desk.json(&format!("explain '{}' --json", scene.display()));
    }
}
