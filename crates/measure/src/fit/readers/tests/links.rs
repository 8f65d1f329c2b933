//! Links of iperf3, CellReplay and netem-trace.

use serde_json::{Value, json};

use super::*;

pub(super) fn iperf3(protocol: &str, sums: &[Value]) -> String {
    let intervals: Vec<Value> = sums.iter().map(|sum| json!({ "streams": [], "sum": sum })).collect();
    json!({ "start": { "test_start": { "protocol": protocol } }, "intervals": intervals, "end": {} }).to_string()
}

pub(super) fn sum(start: f64, bps: f64) -> Value {
    json!({ "start": start, "end": start + 1.0, "seconds": 1.0, "bytes": 5, "bits_per_second": bps, "omitted": false })
}

#[test]
fn iperf3_gives_the_mean_rate() {
    let mut omitted = sum(0.0, 9e9);
    omitted["omitted"] = json!(true);
    let sums: Vec<Value> = std::iter::once(omitted).chain((1..=10).map(|i| sum(f64::from(i), f64::from(i) * 1e6))).collect();
    let found = recording(&iperf3("TCP", &sums));
    let rate = Rate { intervals: 10, seconds: 10.0, mean_bps: 5.5e6, between_bps: [1e6, 9e6], is_lower_bound: true, loss: None };
    assert_eq!(found.rate, Some(rate));
    assert_eq!((found.to_scene_toml("x"), found.beside()), ("[link]\nrate = \"5500000bit\"\n".to_owned(), None));
    assert!(found.notes.iter().any(|note| note.contains("lower bound")));
    let counted = |start: f64, lost: i64| {
        let mut sum = sum(start, 8e6);
        sum["lost_packets"] = json!(lost);
        sum["packets"] = json!(500);
        sum
    };
    let udp = recording(&iperf3("UDP", &[counted(0.0, 6), counted(1.0, -1)]));
    assert_eq!(udp.rate.unwrap().loss, Some(0.005));
    assert_eq!(udp.to_scene_toml(""), "[link]\nrate = \"8000000bit\"\nloss = 0.005\n");
}

/// 300 s whose rate rests for some seconds. Tenths of a second, and seconds that begin 0.1 ms late, give the rates of the same seconds.
#[test]
fn iperf3_gives_a_walk_of_the_rate() {
    let mut rng = crate::tests::TestRng::new(2);
    let mut rate = 3.0;
    let rates: Vec<f64> = (0..300)
        .map(|_| {
            rate = if rng.unit() < 0.2 { 1.0 + 5.0 * rng.unit() } else { rate };
            (rate * 1e6_f64).round()
        })
        .collect();
    let walk = |sums: &[Value]| recording(&iperf3("TCP", sums)).with_rate_walk().unwrap();
    let seconds = |from: f64| rates.iter().zip(0..).map(|(rate, second)| sum(f64::from(second) + from, *rate)).collect::<Vec<_>>();
    let found = walk(&seconds(0.0));
    let estimated = found.walk.clone().unwrap();
    assert_eq!((estimated.seconds, &estimated.refused), (300, &Vec::new()));
    assert_eq!(estimated, crate::fit::RateWalk::of(&rates.iter().copied().map(Some).collect::<Vec<_>>()).unwrap());
    assert_eq!((Some(found.to_scene_toml("x")), found.beside()), (estimated.to_scene_toml(), None));
    // Seconds count from the first interval on.
    assert_eq!(walk(&seconds(1e-4)).walk.unwrap().rates_bps.map(f64::round), estimated.rates_bps.map(f64::round));
    let mut tenths = Vec::new();
    for (second, rate) in (0..).zip(&rates) {
        for tenth in 0..10 {
            let mut part = sum(f64::from(second) + f64::from(tenth) / 10.0, if tenth % 2 == 0 { rate + 9e5 } else { rate - 9e5 });
            part["end"] = json!(f64::from(second) + f64::from(tenth + 1) / 10.0);
            tenths.push(part);
        }
    }
    for (found, expected) in walk(&tenths).walk.unwrap().rates_bps.into_iter().zip(estimated.rates_bps) {
        assert!((found - expected).abs() < 1.0, "{found} {expected}");
    }
    // A second that is not there is no second without a rate. The last one is measured for half of a second.
    let mut gaps = seconds(0.0);
    gaps.remove(100);
    gaps.last_mut().unwrap()["end"] = json!(299.5);
    assert_eq!(walk(&gaps).walk.unwrap().seconds, 298);
    // A refused walk leaves the mean rate.
    let constant = walk(&(0..60).map(|second| sum(f64::from(second), 2e6)).collect::<Vec<_>>());
    assert_eq!((constant.walk.as_ref().unwrap().refused.len(), constant.to_scene_toml("")), (1, "[link]\nrate = \"2000000bit\"\n".to_owned()));
    let refused = |sums: &[Value]| recording(&iperf3("TCP", sums)).with_rate_walk().unwrap_err().to_string();
    assert_eq!(refused(&seconds(0.0)[..59]), "walk: found 59 whole seconds with a rate, expected at least 60 for a walk of the rate");
    let mut long = sum(0.0, 1e6);
    long["end"] = json!(10.0);
    assert_eq!(refused(&[long]), "walk: found an interval of 10.000 s, expected intervals of at most a second, as of iperf3 -i 1");
    assert_eq!(refused(&[sum(0.0, 1e6), sum(1e8, 1e6)]), "walk: found 100000001 s, expected at most 10000000 s");
}

/// Instants of a second in which n leave are n·bytes, and the last second, in which the line begins anew, does not count.
#[test]
fn a_line_gives_a_walk_of_the_rate() {
    let counts: Vec<u64> = (0..100_u64).map(|second| 1 + (second / 7 * 5) % 11).collect();
    let text: String =
        (0..).zip(&counts).flat_map(|(second, count)| (0..*count).map(move |instant| format!("{}\n", second * 1_000 + instant * 90))).collect();
    let line = recording(&format!("{text}100005\n"));
    let rates = |bytes: f64| counts.iter().map(|count| Some(crate::series::count_u64(*count) * bytes * 8.0)).collect::<Vec<_>>();
    assert_eq!(line.clone().with_rate_walk().unwrap().walk, Some(crate::fit::RateWalk::of(&rates(1_400.0)).unwrap()));
    let of_mahimahi = line.with_bytes(1_504).unwrap();
    assert_eq!(of_mahimahi.to_scene_toml("a"), "[link]\ntrace = { file = \"a\", bytes = \"1504B\" }\n");
    assert_eq!(of_mahimahi.notes[0], "the line sends 1504 bytes at each instant");
    assert_eq!(of_mahimahi.with_rate_walk().unwrap().walk, Some(crate::fit::RateWalk::of(&rates(1_504.0)).unwrap()));
    let light = || recording("0 30 0 1 1 2\n500 42 0 0 3\n1000 36 0\n");
    assert!(light().with_rate_walk().unwrap_err().to_string().starts_with("walk: the file measures no rate"));
    assert!(light().with_bytes(5).unwrap_err().to_string().starts_with("bytes: the file has no instants of delivery"));
    let far = recording("0\n1000000000000\n").with_rate_walk().unwrap_err().to_string();
    assert_eq!(far, "walk: found 1000000000 s, expected at most 10000000 s");
}

#[test]
fn iperf3_is_refused_at_its_place() {
    let sender = refused(&iperf3("UDP", &[sum(0.0, 1e6)]));
    assert!(
        sender.starts_with("intervals[0].sum.lost_packets: found nothing, expected the count of the receiver: run iperf3 with -u -R"),
        "{sender}"
    );
    assert!(refused(&iperf3("SCTP", &[sum(0.0, 1e6)])).starts_with("start.test_start.protocol: found \"SCTP\""));
    assert!(refused(&iperf3("TCP", &[sum(0.0, -1.0)])).starts_with("intervals[0].sum.bits_per_second: found -1"));
    let mut backwards = sum(3.0, 1e6);
    backwards["end"] = json!(2.0);
    assert_eq!(refused(&iperf3("TCP", &[backwards])), "intervals[0].sum.end: found 2, expected a time after the start, 3");
    assert!(refused(&iperf3("TCP", &[])).starts_with("intervals: found none"));
    assert!(refused(&iperf3("TCP", &[json!({ "start": 0 })])).contains("missing field `end`"));
    let failed = json!({ "start": {}, "intervals": [], "error": "unable to connect" }).to_string();
    assert!(refused(&failed).starts_with("error: found \"unable to connect\""));
}

#[test]
fn cellreplay_gives_the_base_delay_or_the_line() {
    let light = recording("0 30 0 1 1 2\n500 42 0 0 3\n1000 36 0\n");
    assert_eq!(light.to_scene_toml("l.delays.csv"), "[link]\ntrace = { file = \"l.delays.csv\", between = \"lines\", repeat = true }\n");
    assert_eq!(light.beside(), Some(("delays.csv", "t_ms,delay_ms\n0,30\n500,42\n1000,36\n")));
    assert!(light.notes.iter().any(|note| note.contains("no link depends on the load")));
    let heavy = recording("0\n3\n3\n9\n");
    assert_eq!(heavy.to_scene_toml("h.line"), "[link]\ntrace = { file = \"h.line\", bytes = \"1400B\" }\n");
    assert_eq!(heavy.beside(), Some(("line", "0\n3\n3\n9\n")));
}

#[test]
fn cellreplay_is_refused_at_its_place() {
    assert_eq!(refused("0\n5\nx\n"), "line 3, time: found \"x\", expected whole milliseconds, at most 10^12");
    assert_eq!(refused("0\n5 6\n"), "line 2: found \"6\", expected one instant a line, as on the first line");
    assert_eq!(refused("5\n4\n"), "line 2, time: found 4, expected at least 5, the time of the line before");
    assert_eq!(refused("0 30 0\n5\n9 30\n"), "line 2, base delay: found \"\", expected whole milliseconds, at most 10^12");
    assert_eq!(refused("0 30 0\n5 30 x\n"), "line 2: found \"x\", expected whole milliseconds of the packets of a train");
    assert_eq!(refused("0 30\n5 30\n"), "the trace: found 2 lines, expected at least 3 of a light trace");
    assert_eq!(refused("0\n0\n"), "line 2, time: found 0, expected a trace that lasts longer than 0 ms");
    assert!(refused("0\n\n5\n").starts_with("line 2, time: found \"\""));
}

pub(super) fn rate_for(bps: u64, secs: u64) -> Value {
    json!({ "StaticBwConfig": { "bw": { "gbps": bps / 1_000_000_000, "bps": bps % 1_000_000_000 }, "duration": { "secs": secs, "nanos": 0 } } })
}

#[test]
fn netem_trace_is_a_constant_or_a_pattern() {
    let constant = json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(1_200_000_000, 1)], "count": 0 } });
    assert_eq!(recording(&constant.to_string()).to_scene_toml(""), "[link]\nrate = \"1200000000bit\"\n");
    let twice = json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(12_000_000, 1), rate_for(24_000_000, 2)], "count": 0 } });
    let pattern = "[link]\n\
                   modulated = { by = \"pattern\", turn-1 = { rate = \"12000000bit\" }, turn-2 = { rate = \"24000000bit\" } }\n\n\
                   [[modulators]]\n\
                   name = \"pattern\"\n\
                   states = [\n    \
                   { name = \"turn-1\", sojourn = { fixed = \"1s\" }, next = \"turn-2\" },\n    \
                   { name = \"turn-2\", sojourn = { fixed = \"2s\" }, next = \"turn-1\" },\n]\n";
    assert_eq!(recording(&twice.to_string()).to_scene_toml(""), pattern);
    // Texts, a count, and patterns within patterns: four turns, of which the last one stays.
    let human = r#"{"RepeatedDelayPatternConfig":{"pattern":[{"StaticDelayConfig":{"delay":"10ms","duration":"1s"}},
        {"StaticDelayConfig":{"delay":"20ms","duration":"1s 500ms"}}],"count":2}}"#;
    let human = recording(human);
    let text = human.to_scene_toml("");
    assert!(
        text.contains("turn-4 = { delay = \"20ms\" }") && text.contains("fixed = \"1.5s\"") && text.ends_with("{ name = \"turn-4\" },\n]\n"),
        "{text}"
    );
    assert_eq!(human.notes, ["the pattern ends: its last turn holds for ever"]);
    let trace = recording(r#"{"TraceBwConfig":[[29.0,[2.0,4.0]],[8.5,[0.5]]]}"#).to_scene_toml("");
    assert!(trace.contains("turn-2 = { rate = \"4000000bit\" }") && trace.contains("fixed = \"29ms\"") && trace.contains("turn-3"), "{trace}");
    assert_eq!(recording("[[29.0,[2.0]]]").to_scene_toml(""), "[link]\nrate = \"2000000bit\"\n");
    let loss = |numbers: &str| recording(&format!("{{\"StaticLossConfig\":{{\"loss\":{numbers}}}}}")).to_scene_toml("");
    assert_eq!(loss("[0.25]"), "[link]\nloss = 0.25\n");
    assert_eq!(loss("[0.1,0.25]"), "[link]\nloss = { gilbert-elliott = { p = 0.1, r = 0.75 } }\n");
    let rate = |text: &str| recording(&json!({ "StaticBwConfig": { "bw": text } }).to_string()).to_scene_toml("");
    assert_eq!((rate("12Mbps"), rate("1Gbps 200Mbps")), ("[link]\nrate = \"12000000bit\"\n".into(), "[link]\nrate = \"1200000000bit\"\n".into()));
}

#[test]
fn netem_trace_is_refused_at_its_place() {
    let of = |value: Value| refused(&value.to_string());
    assert!(of(json!({ "NormalizedBwConfig": {} })).starts_with("NormalizedBwConfig: another library draws these rates"));
    let within = |entry: Value| of(json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(5, 1), entry], "count": 1 } }));
    assert!(
        within(json!({ "StaticBwConfig": { "bw": "fast" } })).starts_with("RepeatedBwPatternConfig.pattern[1].StaticBwConfig.bw: found \"fast\"")
    );
    assert!(within(json!({ "StaticDelayConfig": {} })).ends_with("found \"StaticDelayConfig\", expected configurations of one kind in a pattern"));
    assert!(within(json!(5)).starts_with("RepeatedBwPatternConfig.pattern[1]: found 5, expected a table with the name"));
    assert!(of(json!({ "TraceBwConfig": [[29.0, [2.0, -1.0]]] })).starts_with("TraceBwConfig[0][1][1]: found -1.0, expected a rate above 0"));
    assert!(of(json!({ "TraceBwConfig": [[29.0]] })).starts_with("TraceBwConfig[0]: found [29.0], expected pairs of milliseconds"));
    assert!(
        of(json!({ "StaticLossConfig": { "loss": [0.1, 0.2, 0.3] } }))
            .starts_with("StaticLossConfig.loss: found [0.1,0.2,0.3], expected a list of one or two")
    );
    assert!(of(json!({ "StaticBwConfig": { "duration": "soon" } })).starts_with("StaticBwConfig.duration: found \"soon\""));
    let many = json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(5, 1), rate_for(6, 1)], "count": 1_000_000_000_u64 } });
    assert!(of(many).ends_with("expected at most 1000"));
    assert!(refused("[]").starts_with("the configuration: found nothing that lasts"));
    let for_ever = json!({ "RepeatedBwPatternConfig": { "pattern": [rate_for(6, 1)], "count": 0 } });
    assert!(within(for_ever).starts_with("RepeatedBwPatternConfig.pattern[1]: a pattern that repeats for ever after another one"));
}
