//! `cohaptic fit` of files of other programs. Files are written here by the formats of the programs.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::integration::desk::Desk;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// A part of a delay that differs from packet to packet \[ns\], below 5 ms: its mean is 2.5 ms.
fn jitter(packet: i64) -> i64 {
    packet * 7_919 % 5_003 * 1_000
}

/// The JSON of irtt: 2000 probes every 10 ms, 20 ms and the jitter up, 10 ms and the jitter of another packet down, on a server whose clock is ahead by 7 s.
/// Of 100 probes one is lost up, one down, and two nobody knows where.
fn irtt() -> String {
    const AHEAD: i64 = 7_000_000_000;
    let trips: Vec<Value> = (0..2_000)
        .map(|packet| {
            let (up, down) = (20_000_000 + jitter(packet), 10_000_000 + jitter(packet + 997));
            let lost = match packet % 100 {
                7 => "true_up",
                8 => "true_down",
                50 | 51 => "true",
                _ => "false",
            };
            let delay = if lost == "false" { json!({ "receive": down - AHEAD, "rtt": up + down, "send": up + AHEAD }) } else { json!({}) };
            let wall = 1_700_000_000_000_000_000 + 10_000_000 * packet;
            json!({ "seqno": packet, "lost": lost, "timestamps": { "client": { "send": { "wall": wall } } }, "delay": delay })
        })
        .collect();
    json!({ "round_trips": trips }).to_string()
}

/// The least delays of both ways are 20 and 10 ms, so with equal ones the mean is 15 + 2.5 ms on both ways.
#[test]
fn irtt_is_fitted_way_by_way() {
    let desk = Desk::with("line.json", &irtt());
    for (direction, added_s) in [("up", -7.005), ("down", 7.005)] {
        let document = desk.json(&format!("fit line.json --direction {direction} --json"));
        assert!((number(&document["goodness"]["mean_s"]) - 0.0175).abs() < 2e-5, "{document:#}");
        assert_eq!((&document["goodness"]["packets"], &document["goodness"]["received"]), (&json!(1_940), &json!(1_920)));
        let by = &document["measured_by"];
        assert_eq!(
            (&by["program"], &by["direction"], &by["either_way"], &by["other_way"]),
            (&json!("irtt"), &json!(direction), &json!(40), &json!(20))
        );
        assert!((number(&document["clocks"]["added_s"]) - added_s).abs() < 1e-5, "{document:#}");
        assert_eq!(document["clocks"]["is_assumed"], true);
    }
    let text = desk.text("fit line.json --direction up");
    for part in [
        "measured by IRTT: the way up, from client to server\n",
        "not counted: 40 packets lost on a way that the file does not name\n",
        "not counted: 20 packets lost on the other way, which hides the delay or kept the packet from being sent\n",
        "assumed: the least delays of both ways are equal, so -7004.99",
    ] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
    // A value that the user knows takes the place of an assumed value.
    for option in ["--offset=-7s", "--least 20ms"] {
        let known = desk.json(&format!("fit line.json --direction up {option} --json"));
        assert!((number(&known["goodness"]["mean_s"]) - 0.0225).abs() < 2e-5 && known["clocks"].get("is_assumed").is_none(), "{known:#}");
        assert!((number(&known["clocks"]["added_s"]) + 7.0).abs() < 1e-5, "{known:#}");
    }
    desk.cohaptic("fit line.json").assert_refused(2, &["line.json: direction: the file has both ways: expected up, down, or rtt"]);
    desk.cohaptic("fit line.json --direction up --split even").assert_refused(2, &["split: these are delays of one way"]);
}

/// The way up and the way down are 30 and 5 ms together.
#[test]
fn a_round_trip_is_no_delay_without_a_share() {
    let desk = Desk::with("line.json", &irtt());
    let refused = "split: the file has round trips, of which no share is known to be the delay of one way: expected even for half";
    desk.cohaptic("fit line.json --direction rtt").assert_refused(2, &[refused]);
    for (option, share) in [("even", 0.5), ("40%", 0.4), ("0.25", 0.25)] {
        let document = desk.json(&format!("fit line.json --direction rtt --split {option} --json"));
        assert!((number(&document["goodness"]["mean_s"]) - share * 0.035).abs() < 4e-5, "{document:#}");
        assert_eq!((number(&document["measured_by"]["share"]) - share, &document["goodness"]["received"]), (0.0, &json!(1_920)));
        assert!(document["clocks"].get("added_s").is_none());
    }
    let text = desk.text("fit line.json --direction rtt --split 40%");
    assert!(text.contains("assumed: the delay is 40.0000 % of the round trip; the loss is that of both ways together\n"), "{text}");
    for (option, part) in
        [("0", "expected even, or a share above 0"), ("2", "expected even, or a share above 0"), ("odd", "expected even, or a share")]
    {
        desk.cohaptic(&format!("fit line.json --direction rtt --split {option}")).assert_refused(2, &[part]);
    }
    desk.write("m.csv", "t,delay\n0,1\n");
    for option in ["--split even", "--direction up"] {
        desk.cohaptic(&format!("fit m.csv {option}")).assert_refused(2, &["the file has no round trips: expected one of IRTT, LENS or ping"]);
    }
}

/// 2000 round trips of 40 ms and the jitter, printed to 0.1 ms, of which one in 50 is missing and one came twice.
#[test]
fn ping_is_fitted_by_its_digits() {
    let mut text = "PING h (192.0.2.1) 56(84) bytes of data.\n".to_owned();
    for packet in (1..=2_000_i64).filter(|packet| packet % 50 != 9) {
        let rtt_ms = 40 + jitter(packet) / 1_000_000;
        let tenths = jitter(packet) / 100_000 % 10;
        let micros = packet * 10_000 + rtt_ms * 1_000 + tenths * 100;
        for copy in ["", " (DUP!)"].iter().take(if packet == 77 { 2 } else { 1 }) {
            let at = format!("{}.{:06}", micros / 1_000_000, micros % 1_000_000);
            let _ = writeln!(text, "[{at}] 64 bytes from 192.0.2.1: icmp_seq={packet} ttl=57 time={rtt_ms}.{tenths} ms{copy}");
        }
    }
    let desk = Desk::with("line.txt", &text);
    let document = desk.json("fit line.txt --split even --json");
    let goodness = &document["goodness"];
    assert_eq!((&goodness["packets"], &goodness["received"], &document["measured_by"]["copies"]), (&json!(2_000), &json!(1_960), &json!(1)));
    assert!((number(&goodness["resolution_s"]) - 5e-5).abs() < 1e-12 && (number(&goodness["spacing_s"]) - 0.01).abs() < 1e-6, "{goodness:#}");
    // 40 + 2.45 ms as cut to tenths by this test, halved.
    assert!((number(&document["link"]["delay_s"]) - 0.021_225).abs() < 2e-5, "{document:#}");
    assert!(desk.text("fit line.txt --split even").contains("not counted: 1 packet answered again\n"));
    desk.write("bad.txt", text.replace("time=4", "time=x"));
    desk.cohaptic("fit bad.txt --split even").assert_refused(2, &["bad.txt: line 2, time: found \"x", "expected a round trip in milliseconds"]);
    // This test cuts to tenths of a millisecond: --cut adds half a tenth to a round trip, and a quarter of a tenth to its half.
    let cut = desk.json("fit line.txt --split even --tick 100us --cut --json");
    assert!((number(&cut["goodness"]["mean_s"]) - number(&goodness["mean_s"]) - 25e-6).abs() < 1e-9, "{cut:#}");
    desk.cohaptic("fit line.txt --split even --cut").assert_refused(2, &["--tick"]);
}

#[test]
fn rates_and_recorded_links_are_links_of_a_scene() {
    let desk = Desk::new();
    let sums: Vec<Value> =
        (0..10).map(|i| json!({ "sum": { "start": i, "end": i + 1, "bits_per_second": 1e6 * f64::from(i + 1), "omitted": false } })).collect();
    desk.write("rate.json", json!({ "start": { "test_start": { "protocol": "TCP" } }, "intervals": sums }).to_string());
    let document = desk.json("fit rate.json --out rate.toml --json");
    assert_eq!(document["scene"], "[link]\nrate = \"5500000bit\"\n");
    assert_eq!(document["recorded"]["rate"]["between_bps"], json!([1e6, 9e6]));
    assert_eq!((&document["recorded"]["rate"]["is_lower_bound"], document.get("link")), (&json!(true), None));
    let text = desk.text("fit rate.json");
    assert!(text.contains("mean rate 5.500 Mbit/s, from 1.000 Mbit/s (10 %) to 9.000 Mbit/s (90 %)\n") && text.contains("lower bound"), "{text}");
    desk.cohaptic("fit rate.json --skew")
        .assert_refused(2, &["the file has no delays of packets: expected none of offset, least, skew, tick and hold-out"]);
    desk.cohaptic("fit rate.json --split even").assert_refused(2, &["split: the file has no round trips"]);

    desk.write("light.txt", "0 30 0 1\n500 42 0 0\n1000 36 0 3\n");
    desk.text("fit light.txt --out light.toml");
    assert_eq!(desk.read("light.delays.csv"), "t_ms,delay_ms\n0,30\n500,42\n1000,36\n");
    desk.write("heavy.txt", "0\n3\n3\n9\n");
    desk.text("fit heavy.txt --out heavy.toml --require-law");
    assert_eq!(desk.read("heavy.line"), "0\n3\n3\n9\n");
    let pattern = json!({ "RepeatedBwPatternConfig": { "count": 0, "pattern": [
        { "StaticBwConfig": { "bw": { "gbps": 0, "bps": 12_000_000 }, "duration": { "secs": 1, "nanos": 0 } } },
        { "StaticBwConfig": { "bw": "24Mbps", "duration": "2s" } },
    ] } });
    desk.write("pattern.json", pattern.to_string());
    desk.text("fit pattern.json --out pattern.toml");
    assert!(desk.read("pattern.toml").contains("[[modulators]]\nname = \"pattern\"\n"));
    // The written file is a link of a scene.
    for (link, word) in [
        ("rate", "5500kbit"),
        ("light", "a recorded delay of at least 30ms"),
        ("heavy", "a recorded line of"),
        ("pattern", "as \"pattern\" goes; state 1 (always 1s): queue (unlimited) before 12Mbit"),
    ] {
        desk.write("scene.toml", format!("{SCENE}{}", desk.read(&format!("{link}.toml"))));
        let told = desk.text("explain scene.toml");
        assert!(told.contains(word), "{link}: {told}");
    }
    // In the middle of the first half second the base delay is 36 ms.
    let between = desk.json("link trace={file=\"light.delays.csv\",between=\"lines\",repeat=true} --packets 2 --every 250ms --fates f.csv --json");
    assert_eq!(between["fates"]["delivered"], json!(2));
    assert!(desk.read("f.csv").contains("\n1,0,250000000,64,286000000,delivered"), "{}", desk.read("f.csv"));
}

/// A line that the emulator itself makes of a walk gives the walk back, and a rate that goes round gives none.
#[test]
fn a_recorded_line_gives_its_walk() {
    let desk = Desk::new();
    let record = |link: &str, name: &str| {
        desk.text(&format!("link {link} --size 1504B --every 1ms --packets 150000 --seed 3 --fates f.csv"));
        let fates = desk.read("f.csv");
        let arrived = fates.lines().filter_map(|row| row.split(',').nth(4)?.parse::<u64>().ok()).map(|at| format!("{}\n", at / 1_000_000));
        desk.write(name, arrived.collect::<String>());
    };
    record("lte-driving/down", "lte.line");
    let document = desk.json("fit lte.line --bytes 1504B --walk --require-law --out walk.toml --json");
    let walk = &document["recorded"]["walk"];
    assert_eq!(walk["refused"], json!([]), "{document:#}");
    // A measurement of 400 s gives a sojourn of 2.758 s to about a third: a state is visited 30 times, and the rate is correlated over several visits.
    assert!((1.8..4.2).contains(&number(&walk["sojourn_s"])), "{document:#}");
    assert!(desk.read("walk.toml").contains("name = \"rate-walk\"") && !desk.path("walk.line").exists());
    desk.write("scene.toml", format!("{SCENE}{}", desk.read("walk.toml")));
    assert!(desk.text("explain scene.toml").contains("as \"rate-walk\" goes"));
    let text = desk.text("fit lte.line --bytes 1504B --walk");
    for part in
        ["read from a file of CellReplay: the walk of the rate is estimated\n", " whole seconds; means of their fifths: ", "walk, fitted at 5 s"]
    {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
    // Without the number of bytes the rates are those of CellReplay.
    let of_cellreplay = &desk.json("fit lte.line --walk --json")["recorded"]["walk"]["rates_bps"];
    assert!((number(&of_cellreplay[0]) / number(&walk["rates_bps"][0]) - 1_400.0 / 1_504.0).abs() < 1e-9, "{of_cellreplay}");

    let in_turns: String = (0..120_u64)
        .flat_map(|second| (0..if (second / 7).is_multiple_of(2) { 200 } else { 600 }).map(move |instant| format!("{}\n", second * 1_000 + instant)))
        .collect();
    desk.write("turns.line", in_turns);
    let refused = desk.json("fit turns.line --bytes 1504B --walk --json");
    assert_eq!(refused["recorded"]["walk"]["refused"].as_array().map(Vec::len), Some(1), "{refused:#}");
    assert_eq!(refused["scene"], "[link]\ntrace = { file = \"link.line\", bytes = \"1504B\" }\n");
    assert!(desk.text("fit turns.line --walk").contains("refused: the autocorrelation of the rate after 5 s is -"));
    let outcome = desk.cohaptic("fit turns.line --walk --require-law --out turns.toml.out");
    assert_eq!((outcome.status, desk.path("turns.toml.out").exists()), (Some(1), false), "{outcome:?}");
    desk.cohaptic("fit turns.line --walk --split even").assert_refused(2, &["split: the file has no round trips"]);
    desk.write("m.csv", "t,delay\n0,1\n");
    for option in ["--walk", "--bytes 1504B"] {
        desk.cohaptic(&format!("fit m.csv {option}")).assert_refused(2, &["the file has no rates: expected one of iperf3, mahimahi or CellReplay"]);
    }
}

/// Scene without links.
const SCENE: &str = "[scene]\nduration = \"1s\"\ncount = 2\n[object]\nmass = 0.45\n[coordination]\nstrategy = \"average-position\"\nstiffness = 100\n\
                     damping = 5\nupdate = \"8ms\"\n[peer]\ncontact = \"none\"\ndevice = { mass = 0.1, damping = 5 }\n\
                     coupling = { stiffness = 100, damping = 5 }\n";

#[test]
fn help_says_how_to_measure() {
    let help = Desk::new().text("fit --help");
    for part in
        ["irtt client -i 10ms -d 10m", "ping -D -i 0.01", "iperf3 -c HOST", "--direction <DIRECTION>", "--split <SHARE>", "--tick <TIME>", "--cut"]
    {
        assert!(help.contains(part), "no {part:?} in:\n{help}");
    }
}
