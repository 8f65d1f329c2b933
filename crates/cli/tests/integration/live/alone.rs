//! A scene in which nobody lives elsewhere is, by the wall clock, the run of its scene.

use std::collections::BTreeSet;
use std::time::Instant;

use serde_json::{Value, json};

use super::records::{assert_replays, assert_same, inputs, trajectory};
use super::session::Session;
use super::{PATIENCE, wait_for};
use crate::integration::desk::{Desk, parse};
use crate::integration::scenes::{RANDOM, TWO};

/// Everything that can happen to a scene without anybody outside: chance, queues, outages, and a timeline that changes all there is to change.
fn eventful() -> String {
    format!(
        "{RANDOM}\n[[timeline]]\nat = \"150ms\"\nlink = {{ from = \"left\", to = \"right\" }}\nset = {{ delay = \"5ms\", rate = \"64kbit\" }}\n\
         [[timeline]]\nat = \"200.5ms\"\nlink = \"all\"\nset = {{ loss = \"30%\" }}\n\
         [[timeline]]\nat = \"250ms\"\npeer = \"left\"\nset = {{ hand = {{ force = -1.0 }} }}\n\
         [[timeline]]\nat = \"400ms\"\ncoordination = {{ stiffness = 700.0 }}\n"
    )
}

fn numbers<'a>(document: &'a Value, key: &str) -> impl Fn(&str) -> f64 + use<'a> {
    let part = document[key].as_object().unwrap();
    move |name| part[name].as_f64().unwrap_or_else(|| panic!("{name} in {part:?}"))
}

#[test]
fn its_records_are_those_of_the_run_and_its_document_says_how_late_it_was() {
    let desk = Desk::with("scene.toml", &eventful());
    let begin = Instant::now();
    // Standard error is a pipe: no progress is drawn on it, and there is nothing else to say.
    let document = desk.json("live scene.toml --json --out out --set measure.names=all");
    assert!(begin.elapsed().as_secs_f64() >= 0.6, "600 ms by the wall clock");
    let run = desk.json("run scene.toml --json --out run --measure all");
    assert_same(&desk, "out", "run");
    assert_eq!(inputs(&desk, "out"), [], "nothing came in");
    for key in ["duration_s", "ending", "ticks", "links", "access_lines", "max_discrepancy_m", "title", "measures"] {
        assert_eq!(document[key], run[key], "{key}");
    }
    for (live, run) in document["peers"].as_array().unwrap().iter().zip(run["peers"].as_array().unwrap()) {
        let mut live = live.clone();
        assert_eq!(live.as_object_mut().unwrap().remove("kind"), Some(json!("simulated")));
        assert_eq!(live, *run);
    }
    assert!(document.get("door").is_none(), "nobody lives elsewhere");
    let ticks = document["ticks"].as_u64().unwrap();
    assert_eq!(ticks, 600);
    let late = document["late_ticks"].as_u64().unwrap();
    // Not more than one, which is no fault of so short a run; no datagram was sent, so nothing but ticks was late.
    assert_eq!(document["valid"], json!(late <= 1), "{late} of {ticks} were late");
    let lateness = numbers(&document, "lateness_us");
    assert!(0.0 <= lateness("p50") && lateness("p50") <= lateness("p99") && lateness("p99") <= lateness("p999"));
    assert!(lateness("p999") <= lateness("max") && lateness("count") == 600.0);
    // The histogram has three digits: the latest may be late or not when it is that near to the limit.
    let is_near = (lateness("max") - 1000.0).abs() <= 1000.0 * 2e-3;
    assert!(is_near || (late > 0) == (lateness("max") > 1000.0), "{late} late, at most {} µs", lateness("max"));
    let histogram = desk.read("out/lateness.csv");
    let counted: u64 = histogram.lines().skip(1).map(|line| line.rsplit(',').next().unwrap().parse::<u64>().unwrap()).sum();
    assert_eq!(counted, ticks);
}

#[test]
fn it_says_in_words_what_the_document_says() {
    let desk = Desk::with("two.toml", TWO);
    let text = desk.text("live two.toml --for 50ms --no-priority --out out");
    for part in ["Two users\n", "  50ms, 50 ticks\n", "  the run is ", "  lateness of ticks: p50 ", "  replay: cohaptic run two.toml --set '"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    let page = desk.read("out/live.html");
    assert_eq!(cohaptic_picture::testing::page_faults(&page), [""; 0]);
    for part in [
        "<h1>Two users: live session</h1>",
        "<p>The session lasted 50ms, 50 ticks",
        "<pre>cohaptic live two.toml --for 50ms --no-priority --out DIR</pre>",
        "<th scope=\"row\">ticks</th><td class=\"number\">50</td>",
        "<th scope=\"row\">left-&gt;right</th>",
        "<pre>cohaptic run two.toml --set scene.duration=50ms --set 'expect={}' --inputs DIR/inputs.csv</pre>",
        &cohaptic_picture::escape(TWO),
    ] {
        assert!(page.contains(part), "no {part} in {page}");
    }
    for picture in ["positions.svg", "forces.svg", "network.svg"] {
        assert!(page.contains(&desk.read(&format!("out/{picture}"))), "{picture}");
    }
    // The replay that is said is a command that works.
    let replay = text.lines().find_map(|line| line.trim().strip_prefix("replay: cohaptic ")).unwrap();
    desk.text(&format!("{replay} --out again"));
    assert_same(&desk, "out", "again");
}

/// A stiffness of 1e12 N/m diverges within 100 ms. No clock wakes a thread within 1 ns, so that nearly every tick is late.
#[test]
fn its_page_warns_and_has_the_timeline_the_measures_and_who_was_attached() {
    let desk = Desk::with("two.toml", TWO);
    let more = "[measure]\nnames = [\"travel_s\"]\n[[timeline]]\nat = \"10ms\"\nlink = \"all\"\nset = { delay = \"8ms\" }\n";
    desk.write("more.toml", format!("{TWO}\n{more}"));
    for (line, parts) in [
        (
            "more.toml --for 100ms --tolerance 1ns --set coordination.stiffness=1e12",
            &[
                "<p class=\"warning\">DIVERGED: at ",
                "<p class=\"warning\">The session is not valid: ",
                "<code>travel_s</code></th><td class=\"number\">0.",
                "<th scope=\"row\">10ms</th><td>link = &quot;all&quot;, set.delay = &quot;8ms&quot;</td>",
            ][..],
        ),
        (
            "two.toml --for 20ms --set peers.right.kind=udp --listen 127.0.0.1:0",
            &[
                "<h3>Attached from outside</h3>",
                "<th scope=\"row\">right</th><td>udp</td><td class=\"number\">0</td>",
                "--no-priority --listen 127.0.0.1:0 --out DIR</pre>",
            ],
        ),
    ] {
        assert_eq!(desk.cohaptic(&format!("live {line} --no-priority --out out")).status, Some(0), "{line}");
        let page = desk.read("out/live.html");
        assert!(parts.iter().all(|part| page.contains(part)), "{line}: {page}");
        // Linux grants a timer slack of 1 ns to everybody.
        assert_eq!(page.contains("<h2>Notes</h2>"), cfg!(target_os = "linux"), "{line}: {page}");
    }
}

#[test]
fn for_is_the_duration() {
    let desk = Desk::with("two.toml", TWO);
    let document = desk.json("live two.toml --json --for 80ms");
    assert_eq!((document["ticks"].as_u64(), document["duration_s"].as_f64()), (Some(80), Some(0.08)));
    assert_eq!((&document["ending"], document["files"].as_array().map(Vec::len)), (&json!("complete"), Some(0)));
    // Also if it is longer than what the scene says.
    assert_eq!(desk.json("live two.toml --json --for 250ms")["ticks"], json!(250));
}

#[test]
fn more_late_ticks_than_one_in_a_thousand_make_it_invalid() {
    let desk = Desk::with("two.toml", TWO);
    // A tick within a nanosecond of its instant is a rare chance, on any machine.
    let document = desk.json("live two.toml --json --tolerance 1ns");
    assert_eq!(document["valid"], json!(false));
    assert!(document["late_ticks"].as_u64().is_some_and(|late| (100..=200).contains(&late)), "{document}");
    // And no machine that runs this takes an hour for a tick.
    let document = desk.json("live two.toml --json --tolerance 1h");
    assert_eq!((&document["valid"], &document["late_ticks"]), (&json!(true), &json!(0)));
}

#[test]
fn ctrl_c_ends_it_with_whole_files_that_replay() {
    let desk = Desk::with("scene.toml", &eventful());
    let session = Session::begin(&desk, "scene.toml --json --out out --for 1h");
    wait_for("rows in the record", || desk.path("out/trajectory.csv.partial").metadata().is_ok_and(|file| file.len() > 0).then_some(()));
    let document = session.end();
    assert_eq!(document["ending"], "interrupted");
    let ticks = document["ticks"].as_u64().unwrap();
    let names: BTreeSet<String> = desk.files("out").into_iter().collect();
    assert!(names.iter().all(|name| !name.contains("partial")), "{names:?}");
    let record = trajectory(&desk, "out");
    assert!(ticks > 0 && record.len() == 3 && record.values().all(|rows| rows.len() as u64 == ticks), "{ticks} ticks");
    let inputs = inputs(&desk, "out");
    assert_eq!(inputs.iter().map(|row| row.kind.as_str()).collect::<Vec<_>>(), ["end"]);
    desk.cohaptic("run scene.toml --set scene.duration=1h --inputs out/inputs.csv --out again");
    assert_same(&desk, "out", "again");
}

#[test]
fn a_record_is_replayed_as_the_run_that_it_was() {
    let desk = Desk::with("scene.toml", &eventful());
    desk.json("live scene.toml --json --out out --for 500ms");
    assert_replays(&desk, "scene.toml", "--set scene.duration=500ms");
}

#[test]
fn help_has_every_option() {
    let text = Desk::new().text("live --help");
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in [
        "[SCENE]",
        "--set <KEY=VALUE>",
        "--json",
        "--out <DIR>",
        "--for <TIME>",
        "--listen <ADDRESS>",
        "--key-file <FILE>",
        "--new-key <FILE>",
        "--allow-remote",
        "--spin",
        "--no-priority",
        "--tolerance <TIME>",
        "--control [<ADDRESS>]",
        "--token-file <FILE>",
        "--firmware <FILE>",
        "Exit status: 0 done, 1 an expectation failed, 2 a bad argument or scene, 3 an input or output",
    ] {
        assert!(words.contains(part), "no {part:?} in {text}");
    }
}

#[test]
fn what_cannot_be_is_refused_with_a_status() {
    let desk = Desk::with("two.toml", TWO);
    desk.write("bad.toml", TWO.replace("mass = 0.3", "mass = -0.3"));
    desk.write("short.key", "abcd");
    desk.write("udp.toml", super::peer_elsewhere::SCENE);
    for (status, line, parts) in [
        (2, "live", &["<SCENE>"][..]),
        (2, "live bad.toml", &["mass"]),
        (2, "live two.toml --for 0s", &["duration"]),
        (2, "live two.toml --for soon", &["soon"]),
        (2, "live two.toml --listen here", &["here"]),
        (2, "live two.toml --token-file token", &["--control"]),
        (2, "live two.toml --control 0.0.0.0:0", &["0.0.0.0", "allow remote access"]),
        (3, "live missing.toml", &["missing.toml"]),
        (2, "live udp.toml --key-file short.key", &["short.key"]),
        (2, "live udp.toml --listen 0.0.0.0:0", &["0.0.0.0:0", "--key-file", "--allow-remote", "127.0.0.1"]),
        (2, "live udp.toml --listen [::]:0", &["[::]:0", "--allow-remote"]),
        (3, "live two.toml --out two.toml/out", &["two.toml"]),
        (2, "live two.toml --new-key new.key", &["--new-key"]),
    ] {
        // What is not refused would run to the end of its scene, an hour.
        let outcome = desk.cohaptic_within(PATIENCE, line);
        assert_eq!(outcome.status, Some(status), "{line}: {outcome:#?}");
        outcome.assert_refused(status, parts);
    }
    // In a scene without peers elsewhere nothing is listened on, and an address is no danger.
    parse(&desk.text("live two.toml --json --for 10ms --listen 0.0.0.0:0"));
}
