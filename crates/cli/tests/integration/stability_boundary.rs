//! `cohaptic stability boundary`: where a scene turns stable and unstable along one key. Crossings are compared with `stability point` on their two
//! sides, and with one another where a law relates them.

use serde_json::Value;

use crate::integration::desk::Desk;
use crate::integration::scenes::{PAPER, TWO};
use crate::integration::svg::words;

const ALONG: &str = "stability boundary paper.toml --along coordination.stiffness=100..8000";

fn crossings(document: &Value) -> Vec<f64> {
    document["crossings"].as_array().unwrap().iter().map(|crossing| crossing["value"].as_f64().unwrap()).collect()
}

#[test]
fn the_verdict_changes_at_every_crossing_and_nowhere_else() {
    let desk = Desk::with("paper.toml", PAPER);
    let document = desk.json(&format!("{ALONG} --json --tolerance 0.001 --set coordination.damping=1"));
    let verdict = |stiffness: f64| {
        desk.json(&format!("stability point paper.toml --json --set coordination.damping=1 --set coordination.stiffness={stiffness}"))["verdict"]
            .clone()
    };
    assert_eq!((document["first"].clone(), document["settled"].clone()), (verdict(100.0), true.into()));
    let found = document["crossings"].as_array().unwrap();
    assert!(!found.is_empty());
    for crossing in found {
        let value = crossing["value"].as_f64().unwrap();
        assert_eq!((verdict(value - 0.01), verdict(value + 0.01)), (crossing["from"].clone(), crossing["to"].clone()), "{value}");
    }
    // Between the crossings the verdict stays, seen from places that have nothing to do with the samples.
    let mut last = &document["first"];
    for (place, value) in (1..40)
        .map(|step| 100.0 + 7900.0 * f64::from(step) / 40.0)
        .map(|value| (crossings(&document).iter().filter(|at| **at < value).count(), value))
    {
        last = if place == 0 { &document["first"] } else { &found[place - 1]["to"] };
        assert_eq!(&verdict(value), last, "{value}");
    }
    assert_eq!(&verdict(8000.0), last);
}

/// PD with gains K is AP with gains 2 K for three peers: so it crosses at half the stiffness.
#[test]
fn one_strategy_crosses_where_the_law_says() {
    let desk = Desk::with("paper.toml", PAPER);
    let pd = crossings(&desk.json(&format!("{ALONG} --json --tolerance 1e-6 --set coordination.strategy=proportional-derivative")));
    let ap = crossings(
        &desk.json("stability boundary paper.toml --along coordination.stiffness=200..16000 --json --tolerance 1e-6 --set coordination.damping=10"),
    );
    assert!(!pd.is_empty() && pd.len() == ap.len());
    for (pd, ap) in pd.iter().zip(&ap) {
        assert!((2.0 * pd - ap).abs() < 4e-6, "{pd} {ap}");
    }
}

#[test]
fn files_hold_what_was_found() {
    let desk = Desk::with("paper.toml", PAPER);
    let document = desk.json(&format!("{ALONG} --json --out out --samples 50 --set coordination.damping=1"));
    assert_eq!(desk.files("out"), ["boundary.csv", "boundary.html", "boundary.svg", "samples.csv"]);
    let mut table = csv::Reader::from_path(desk.path("out/boundary.csv")).unwrap();
    assert_eq!(table.headers().unwrap(), vec!["coordination.stiffness", "from", "to"]);
    let values: Vec<f64> = table.records().map(|row| row.unwrap()[0].parse().unwrap()).collect();
    // The reader of JSON in this test may be off by the last bit.
    assert!(values.iter().zip(crossings(&document)).all(|(table, document)| (table - document).abs() <= 4.0 * f64::EPSILON * document));
    assert_eq!(values.len(), crossings(&document).len());
    let samples = desk.read("out/samples.csv");
    assert!(samples.starts_with("coordination.stiffness,spectral_radius,error_bound,verdict\n100.0,"));
    assert_eq!(samples.lines().count() as u64 - 1, document["samples"].as_u64().unwrap());
    let svg = desk.read("out/boundary.svg");
    assert_eq!(cohaptic_picture::testing::faults(&svg), [""; 0]);
    let words = words(&svg);
    for part in ["Coordination stiffness", "Spectral radius", "spectral radius"] {
        assert!(words.iter().any(|word| word == part), "no {part:?} in {words:?}");
    }
    let crossing = words.iter().find_map(|word| word.strip_prefix("unstable from coordination.stiffness="));
    let digits = crossing.and_then(|words| words.split_whitespace().next()).map_or(0, |value| value.bytes().filter(u8::is_ascii_digit).count());
    assert!((1..=6).contains(&digits), "{words:?}");
}

#[test]
fn people_get_the_same_in_words() {
    let desk = Desk::with("two.toml", TWO);
    let along = "stability boundary two.toml --along link.delay=1ms..200ms --samples 100 --tolerance 0.001";
    let (text, document) = (desk.text(along), desk.json(&format!("{along} --json")));
    assert!(text.starts_with("Two users\n"), "{text}");
    for (value, crossing) in crossings(&document).iter().zip(document["crossings"].as_array().unwrap()) {
        let line = format!("{} from link.delay={value}ms (before: {})", crossing["to"].as_str().unwrap(), crossing["from"].as_str().unwrap());
        assert!(text.contains(&line), "no {line} in {text}");
    }
    assert!(text.contains(&format!("{} values checked", document["samples"])), "{text}");
    let none = desk.text("stability boundary two.toml --along coordination.stiffness=100..101 --samples 5");
    assert!(none.contains("no crossing up to coordination.stiffness=101"), "{none}");
}

#[test]
fn what_makes_no_sense_is_refused_and_nothing_is_written() {
    let desk = Desk::with("two.toml", TWO);
    let along = "--along coordination.stiffness=0..6000";
    for (rest, parts) in [
        (String::new(), &["--along"][..]),
        (format!("{along} --tolerance 0"), &["--tolerance 0", "above zero"]),
        (format!("{along} --tolerance -1"), &["--tolerance -1", "above zero"]),
        (format!("{along} --tolerance nan"), &["--tolerance NaN", "above zero"]),
        (format!("{along} --samples 1"), &["--samples 1", "from 2"]),
        (format!("{along} --samples 1000000000"), &["--samples 1000000000", "from 2"]),
        ("--along coordination.stifness=0..1".to_owned(), &["--along coordination.stifness=", "unknown key"]),
        ("--along peers.nobody.device.mass=1..2".to_owned(), &["--along peers.nobody.device.mass=1", "nobody"]),
        ("--along coordination.strategy=0..1".to_owned(), &["coordination.strategy is not a number"]),
        ("--along link.delay=0..1".to_owned(), &["link.delay"]),
        ("--along coordination.stiffness=1".to_owned(), &["--along: ", "KEY=LOW..HIGH"]),
        (format!("{along} --set peers.left.clock.drift=0.0123456789"), &["two.toml: ", "clocks"]),
    ] {
        desk.cohaptic(&format!("stability boundary two.toml {rest} --out out --json")).assert_refused(2, parts);
        assert_eq!((desk.files(""), desk.path("out").exists()), (vec!["two.toml".to_owned()], false), "{rest}");
    }
    desk.cohaptic(&format!("stability boundary gone.toml {along}")).assert_refused(3, &["gone.toml: cannot be read"]);
}

#[test]
fn a_search_ends_after_the_values_that_it_may_look_at_and_says_so() {
    let desk = Desk::with("two.toml", TWO);
    let line = "stability boundary two.toml --along link.delay=1ms..200ms";
    let document = desk.json(&format!("{line} --values 5 --json"));
    assert_eq!((document["samples"].as_u64(), document["settled"].as_bool()), (Some(5), Some(false)));
    assert!(
        desk.text(&format!("{line} --values 5"))
            .contains("NOT SETTLED: the search reached its limit of values, and may have missed crossings; allow more with --values")
    );
    desk.cohaptic(&format!("{line} --values 5 --samples 6")).assert_refused(2, &["--samples 6: expected from 2 to 5"]);
}

/// The answer of a search that is ended has the crossings found by then.
#[cfg(unix)]
#[test]
fn a_search_that_is_ended_says_what_it_has_found() {
    let desk = Desk::with("paper.toml", PAPER);
    // A delay is read anew for each value: a million of them take far longer than a second on any machine.
    let line = "stability boundary paper.toml --along link.delay=1ms..40ms --samples 1000000 --values 1000000 --tolerance 0.0001";
    let (error, child) = crate::integration::stability_point::running(&desk, line, "note: ");
    let outcome = crate::integration::stability_point::ended(child);
    let said = std::fs::read_to_string(error).unwrap();
    assert_eq!(outcome.status, Some(130), "{said}");
    assert!(said.contains("the search ends after 1000000 at the latest") && said.contains("looked at: nothing is kept"), "{said}");
    assert!(outcome.stdout.contains("stable") && outcome.stdout.contains("NOT SETTLED: the search was stopped early"), "{}", outcome.stdout);
}

#[cfg(unix)]
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn an_interrupted_search_goes_on_and_ends_with_the_same_bytes() {
    let desk = Desk::with("paper.toml", PAPER);
    // A delay is read anew for each value: a second or two of work.
    let line = "stability boundary paper.toml --along link.delay=1ms..40ms --samples 20000 --tolerance 0.0001 --out out";
    let outcome = crate::integration::interrupt::interrupted(&desk, line, |_| desk.path("out/boundary.rows.partial").exists());
    assert_eq!(outcome.status, Some(130));
    assert!(outcome.stdout.is_empty() || outcome.stdout.contains("NOT SETTLED: the search was stopped early"), "{}", outcome.stdout);
    assert!(outcome.stderr.contains("interrupted: ") && outcome.stderr.contains("kept in out/boundary.rows.partial"), "{}", outcome.stderr);
    desk.cohaptic(&line.replace("40ms", "41ms")).assert_refused(2, &["boundary.rows.partial holds the rows of another command"]);
    // A slow machine is told how long the search takes.
    for line in [line.to_owned(), line.replace("--out out", "--out whole")] {
        let outcome = desk.cohaptic(&line);
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    }
    assert_eq!(desk.files("out"), ["boundary.csv", "boundary.html", "boundary.svg", "samples.csv"]);
    for file in desk.files("out") {
        assert_eq!(desk.read(&format!("out/{file}")), desk.read(&format!("whole/{file}")), "{file}");
    }
}
