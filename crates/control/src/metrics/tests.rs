use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::Arc;

use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::text;
use crate::{Description, Kind, Latest, LinkCounters, LinkName, PeerName, PeerView, Presence, Quantiles, Snapshot};

#[derive(Debug, Default)]
struct Family {
    kind: String,
    /// (name with suffix, labels) → value
    samples: BTreeMap<(String, BTreeMap<String, String>), f64>,
}

/// Parses metrics by the rules of <https://prometheus.io/docs/instrumenting/exposition_formats/#text-based-format>, and panics at a violation.
fn parse(text: &str) -> BTreeMap<String, Family> {
    assert!(text.ends_with('\n'), "the last line must end with a line feed");
    let mut families: BTreeMap<String, Family> = BTreeMap::new();
    let mut open = String::new();
    let mut helped = String::new();
    for line in text.trim_end_matches('\n').split('\n') {
        if let Some(help) = line.strip_prefix("# HELP ") {
            let (name, words) = help.split_once(' ').unwrap();
            assert!(is_metric_name(name) && !words.is_empty());
            helped = name.to_owned();
        } else if let Some(kind) = line.strip_prefix("# TYPE ") {
            let (name, kind) = kind.split_once(' ').unwrap();
            assert_eq!(name, helped, "HELP and TYPE belong together");
            assert!(["counter", "gauge", "summary"].contains(&kind));
            assert_eq!(kind == "counter", name.ends_with("_total"), "{name}: counters and nothing else end in _total");
            open = name.to_owned();
            assert!(families.insert(open.clone(), Family { kind: kind.to_owned(), ..Family::default() }).is_none(), "{name} has one group of lines");
        } else {
            let (name, labels, value) = sample(line);
            let family = families.get_mut(&open).unwrap();
            let suffixes: &[&str] = if family.kind == "summary" { &["", "_sum", "_count"] } else { &[""] };
            assert!(suffixes.iter().any(|suffix| name == format!("{open}{suffix}")), "{name} stands in the group of {open}");
            assert_eq!(labels.contains_key("quantile"), family.kind == "summary" && name == open, "{line}");
            assert!(family.kind != "counter" || value >= 0.0);
            assert!(family.samples.insert((name, labels), value).is_none(), "{line}: a second time");
        }
    }
    families
}

fn is_metric_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn sample(line: &str) -> (String, BTreeMap<String, String>, f64) {
    let end = line.find(['{', ' ']).unwrap();
    let (name, mut rest) = line.split_at(end);
    assert!(is_metric_name(name), "{line}");
    let mut labels = BTreeMap::new();
    if let Some(inside) = rest.strip_prefix('{') {
        rest = inside;
        loop {
            let (label, after) = rest.split_once("=\"").unwrap();
            assert!(is_metric_name(label) && !label.starts_with("__"));
            let (value, after) = quoted(after);
            assert!(labels.insert(label.to_owned(), value).is_none());
            if let Some(after) = after.strip_prefix('}') {
                rest = after;
                break;
            }
            rest = after.strip_prefix(',').unwrap();
        }
    }
    let value = rest.strip_prefix(' ').unwrap();
    assert!(!value.contains(' '), "{line}: no time stamps here");
    let value = match value {
        "NaN" => f64::NAN,
        "+Inf" => f64::INFINITY,
        "-Inf" => f64::NEG_INFINITY,
        number => {
            assert!(number.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | 'e' | '-')), "{number}");
            number.parse().unwrap()
        }
    };
    (name.to_owned(), labels, value)
}

/// Returns the value of a label and the rest of the text. `text` begins after the opening quote.
fn quoted(text: &str) -> (String, &str) {
    let mut value = String::new();
    let mut chars = text.char_indices();
    loop {
        match chars.next().unwrap() {
            (at, '"') => return (value, &text[at + 1..]),
            (_, '\\') => value.push(match chars.next().unwrap().1 {
                'n' => '\n',
                '\\' => '\\',
                '"' => '"',
                other => panic!("\\{other} is no escape"),
            }),
            (_, c) => value.push(c),
        }
    }
}

fn labels(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
    pairs.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect()
}

fn example(strange: &str) -> (Description, Latest) {
    let description = Description {
        kind: Kind::Live,
        title: strange.to_owned(),
        links: vec![
            LinkName { name: format!("a{strange}"), from: "a".to_owned(), to: strange.to_owned() },
            LinkName { name: format!("b{strange}"), from: strange.to_owned(), to: "a".to_owned() },
        ],
        peers: vec![PeerName { name: strange.to_owned(), kind: "simulated".to_owned() }],
        clocks: vec![format!("tick{strange}")],
        measures: Vec::new(),
        body: None,
    };
    let spans = Quantiles {
        count: 1000,
        sum: Duration::from_millis(20),
        p50: Duration::from_micros(15),
        p99: Duration::from_micros(80),
        p999: Duration::from_micros(200),
        max: Duration::from_micros(400),
    };
    let link = LinkCounters {
        offered: u64::MAX,
        duplicated: 1,
        delivered: 5,
        delivered_bytes: 320,
        dropped: vec![("loss", 3), ("queue-full", 1), ("loss", 1)],
        marked: 2,
        damaged: 1,
        in_flight: 4,
        mean_delay: Some(Duration::from_millis(24)),
        recent_delay: spans,
    };
    let peer = PeerView {
        status: Presence::Stale,
        age: Some(Duration::from_millis(1500)),
        position: vec![0.25, f64::NAN],
        force: vec![f64::NEG_INFINITY],
        turn: None,
        joined: None,
    };
    let snapshot = Snapshot {
        elapsed: Duration::from_millis(12_500),
        invalid: Some("a tick came 3 ms too late".to_owned()),
        lateness: vec![spans],
        links: vec![link],
        peers: vec![peer],
        refused: vec![("too-short", 9), ("wrong-magic", 0)],
        measures: Vec::new(),
    };
    (description.clone(), Latest { description: Arc::new(description), number: 250, snapshot: Arc::new(snapshot) })
}

#[test]
fn every_number_stands_where_it_should() {
    let (description, latest) = example("→");
    let families = parse(&text(&description, &latest));
    let value = |name: &str, pairs: &[(&str, &str)]| {
        let family = name.trim_end_matches("_sum").trim_end_matches("_count");
        families[family].samples[&(name.to_owned(), labels(pairs))]
    };
    let link = [("link", "a→"), ("from", "a"), ("to", "→")];
    let with = |name: &'static str, value: &'static str| [link[0], link[1], link[2], (name, value)];
    let near = |found: f64, expected: f64| assert!((found - expected).abs() <= 1e-15 * expected.abs(), "{found} {expected}");
    near(value("cohaptic_run_elapsed_seconds", &[]), 12.5);
    near(value("cohaptic_run_valid", &[]), 0.0);
    near(value("cohaptic_run_snapshots_total", &[]), 250.0);
    near(value("cohaptic_run_info", &[("kind", "live"), ("title", "→")]), 1.0);
    near(value("cohaptic_link_delivered_bytes_total", &link), 320.0);
    near(value("cohaptic_link_dropped_packets_total", &with("cause", "loss")), 4.0);
    near(value("cohaptic_link_dropped_packets_total", &with("cause", "queue-full")), 1.0);
    near(value("cohaptic_link_mean_delay_seconds", &link), 0.024);
    near(value("cohaptic_link_recent_delay_seconds", &with("statistic", "p99.9")), 200e-6);
    near(value("cohaptic_clock_lateness_seconds", &[("clock", "tick→"), ("quantile", "1")]), 400e-6);
    near(value("cohaptic_clock_lateness_seconds_sum", &[("clock", "tick→")]), 0.02);
    near(value("cohaptic_clock_lateness_seconds_count", &[("clock", "tick→")]), 1000.0);
    near(value("cohaptic_peer_status", &[("peer", "→"), ("status", "stale")]), 1.0);
    near(value("cohaptic_peer_status", &[("peer", "→"), ("status", "here")]), 0.0);
    near(value("cohaptic_peer_age_seconds", &[("peer", "→")]), 1.5);
    near(value("cohaptic_peer_position_meters", &[("peer", "→"), ("axis", "x")]), 0.25);
    assert!(value("cohaptic_peer_position_meters", &[("peer", "→"), ("axis", "y")]).is_nan());
    assert!(value("cohaptic_peer_force_newtons", &[("peer", "→"), ("axis", "x")]).is_infinite());
    near(value("cohaptic_refused_datagrams_total", &[("cause", "too-short")]), 9.0);
    // Counts are written in full: 2^64 − 1.
    assert!(text(&description, &latest).contains(" 18446744073709551615\n"));
}

#[test]
fn a_link_of_which_nothing_was_published_has_seen_nothing() {
    let (description, latest) = example("b");
    let families = parse(&text(&description, &latest));
    let second = labels(&[("link", "bb"), ("from", "b"), ("to", "a")]);
    let value = |name: &str| families[name].samples[&(name.to_owned(), second.clone())];
    assert!(value("cohaptic_link_offered_packets_total").abs() < f64::EPSILON);
    assert!(value("cohaptic_link_mean_delay_seconds").is_nan());
}

#[test]
fn the_book_has_every_metric() {
    let book = include_str!("../../../../docs/live-control.md");
    let (description, latest) = example("c");
    let families = parse(&text(&description, &latest));
    for (name, family) in &families {
        let is_its_line = |line: &str| line.split_whitespace().take(2).eq([name.as_str(), family.kind.as_str()]);
        assert!(book.lines().any(is_its_line), "{name} is not in docs/live-control.md");
    }
    let shown = book.lines().filter(|line| line.starts_with("cohaptic_")).count();
    assert_eq!(shown, families.len(), "docs/live-control.md has a metric that is not there");
}

#[test]
fn strange_names_are_escaped() {
    let strange = "a\"b\\c\nd}, {e=\"f\" # HELP";
    let (description, latest) = example(strange);
    let families = parse(&text(&description, &latest));
    let key = ("cohaptic_peer_age_seconds".to_owned(), labels(&[("peer", strange)]));
    assert!(families["cohaptic_peer_age_seconds"].samples.contains_key(&key));
}

properties! {
    #[test]
    fn any_name_reads_back(name in any::<String>()) {
        let (description, latest) = example(&name);
        let families = parse(&text(&description, &latest));
        let key = ("cohaptic_run_info".to_owned(), labels(&[("kind", "live"), ("title", &name)]));
        prop_assert!(families["cohaptic_run_info"].samples.contains_key(&key));
    }
}
