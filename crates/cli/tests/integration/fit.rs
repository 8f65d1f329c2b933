//! `cohaptic fit`: what a link did is estimated, and is what it was told.

use std::fmt::Write as _;

use serde_json::Value;

use crate::integration::desk::Desk;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// 40 000 packets. The mean of AR(1) delays with ρ = 0.5 has the standard error 4 ms·√(3/40 000) = 35 µs, the deviation 4 ms·√(5/6/40 000) = 18 µs, ρ
/// √(0.75/40 000) = 0.0043; p and r of the chain are known to √(p(1−p)·q/40 000·…) = 0.0005 and √(r(1−r)/1000) = 0.013. 4.5 of each.
#[test]
fn what_a_link_was_told_is_found_again() {
    let desk = Desk::new();
    desk.text("link delay 40ms 4ms 50% distribution normal loss gemodel 1% 25% --packets 40000 --fates f.csv");
    let document = desk.json("fit f.csv --json --out link.toml");
    let link = &document["link"];
    assert!((number(&link["delay_s"]) - 0.04).abs() < 4.5 * 35e-6, "{document:#}");
    assert!((number(&link["jitter"]["sd_s"]) - 0.004).abs() < 4.5 * 18e-6);
    assert!((number(&link["jitter"]["correlation"]) - 0.5).abs() < 4.5 * 0.0043);
    let chain = &link["loss"]["gilbert-elliott"];
    assert!((number(&chain["p"]) - 0.01).abs() < 4.5 * 0.0005 && (number(&chain["r"]) - 0.25).abs() < 4.5 * 0.013, "{document:#}");
    assert_eq!((document["goodness"]["packets"].as_u64(), document["goodness"]["laws"].as_array().map(Vec::len)), (Some(40_000), Some(6)));
    let scene = desk.read("link.toml");
    assert_eq!(document["scene"], scene);
    assert!(scene.starts_with("[link]\ndelay = \"") && scene.contains("gilbert-elliott"), "{scene}");
}

/// A uniform law: the correlation of normal scores φ is 2·sin(πρ/6) = 0.9080 for ρ = 0.9, and it is ρ that a scene takes.
#[test]
fn the_correlation_is_that_of_delays_and_not_of_their_scores() {
    let desk = Desk::new();
    desk.text("link delay 40ms 4ms 90% --packets 40000 --fates f.csv");
    let document = desk.json("fit f.csv --json");
    assert_eq!(document["link"]["jitter"]["distribution"], "uniform");
    let (rho, phi) = (number(&document["link"]["jitter"]["correlation"]), number(&document["goodness"]["correlation"]["lag_one"]));
    assert!((rho - 6.0 / std::f64::consts::PI * (phi / 2.0).asin()).abs() < 1e-9, "{rho} {phi}");
    assert!((rho - 0.9).abs() < 0.01, "{rho}");
}

/// The fates of that link as measured by a clock that gains a number of nanoseconds each millisecond.
fn drifting(desk: &Desk, link: &str, nanos_each_ms: i32) {
    desk.text(&format!("{link} --fates f.csv"));
    let log = desk.read("f.csv");
    let mut rows: Vec<[i64; 2]> = log.lines().skip(1).map(|row| [2, 4].map(|place| row.split(',').nth(place).unwrap().parse().unwrap())).collect();
    rows.sort_unstable();
    let mut csv = "t_ns,delay_ns\n".to_owned();
    for [offered, at] in rows {
        let _ = writeln!(csv, "{offered},{}", at - offered + offered / 1_000_000 * i64::from(nanos_each_ms));
    }
    desk.write("m.csv", csv);
}

#[test]
fn measurements_are_read_and_a_drift_is_removed() {
    let desk = Desk::new();
    drifting(&desk, "link delay 20ms 2ms --packets 5000", 1000);
    let document = desk.json("fit m.csv --skew --json");
    assert!((number(&document["skew"]["seconds_per_second"]) - 1e-3).abs() < 1e-5, "{document:#}");
    assert!((number(&document["link"]["delay_s"]) - 0.02).abs() < 2e-4);
    let text = desk.text("fit m.csv --skew");
    for part in ["[link]\ndelay = ", "jitter = {", "5000 packets, 5000 arrived", "clocks drift by", ": removed", "Kolmogorov", "uniform", "BIC"] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

/// 40 000 packets in 40 s at 40 ms ± 4 ms, normal: the slope of delays in time is known to 4 ms·√(12/40 000)/40 s = 1.7 µs/s, and the mean to 20 µs, or, of
/// the first packet, to 1.7 µs/s·20 s = 40 µs. Five of each.
#[test]
fn a_drift_is_removed_only_where_there_is_one() {
    let desk = Desk::new();
    for (nanos_each_ms, seed) in [(0, 1), (0, 2), (20, 3), (-20, 4), (100, 5), (-1000, 6)] {
        drifting(&desk, &format!("link delay 40ms 4ms distribution normal --packets 40000 --seed {seed}"), nanos_each_ms);
        let document = desk.json("fit m.csv --skew --json");
        let (skew, drift) = (&document["skew"], 1e-6 * f64::from(nanos_each_ms));
        assert!((number(&skew["seconds_per_second"]) - drift).abs() < 5.0 * 1.7e-6, "{document:#}");
        assert!((1.2e-6..2.4e-6).contains(&number(&skew["standard_error"])), "{document:#}");
        assert!(number(&skew["interval_99"][0]) <= drift && drift <= number(&skew["interval_99"][1]), "{document:#}");
        assert_eq!(skew["significant"], nanos_each_ms != 0, "{document:#}");
        assert!((number(&document["link"]["delay_s"]) - 0.04).abs() < 5.0 * 40e-6, "{document:#}");
        if nanos_each_ms == 0 {
            assert_eq!(document["link"], desk.json("fit m.csv --json")["link"]);
            assert!(desk.text("fit m.csv --skew").contains(" us/s, in 99 % from -"));
            assert!(desk.text("fit m.csv --skew").contains(": not significant at 1 %, left in"));
        }
    }
}

#[test]
fn one_capture_says_that_two_are_needed() {
    let desk = Desk::new();
    desk.text("link delay 20ms 2ms --packets 100 --pcapng one.pcapng");
    desk.cohaptic("fit one.pcapng")
        .assert_refused(2, &["one.pcapng: found the capture of one end: expected two", "cohaptic fit SENDER RECEIVER", "--fates"]);
    for magic in [[0xd4, 0xc3, 0xb2, 0xa1], [0xa1, 0xb2, 0x3c, 0x4d]] {
        desk.write("old.pcap", magic);
        desk.cohaptic("fit old.pcap --skew").assert_refused(2, &["old.pcap: found the capture of one end: expected two"]);
    }
}

/// What is written is read again: by `link` as its keys, by a scene as its `[link]`. At one spacing it speaks of packets, at several of time.
#[test]
fn the_link_that_is_found_is_the_link_of_a_scene() {
    let desk = Desk::new();
    let spec = "link delay=24ms jitter={sd=\"2ms\",distribution=\"gamma\",floor=\"20ms\",correlation-time=\"50ms\"} loss={gilbert-elliott={mean-good=\"200ms\",mean-bad=\"30ms\"}}";
    desk.text(&format!("{spec} --packets 8000 --every 2ms --fates even.csv"));
    desk.text(&format!("{spec} --packets 8000 --every 5ms --seed 2 --fates other.csv"));
    let mut uneven = "t_ns,delay_ns,lost\n".to_owned();
    let mut begin = 0;
    for file in ["even.csv", "other.csv"] {
        let mut latest = 0;
        let log = desk.read(file);
        let mut rows: Vec<(u64, &str, String)> = log
            .lines()
            .skip(1)
            .map(|row| {
                let values: Vec<&str> = row.split(',').collect();
                let (offered, at): (u64, u64) = (values[2].parse().unwrap(), values[4].parse().unwrap());
                if values[5] == "delivered" { (offered, "0", (at - offered).to_string()) } else { (offered, "1", String::new()) }
            })
            .collect();
        rows.sort_unstable();
        for (offered, lost, delay) in rows {
            let _ = writeln!(uneven, "{},{delay},{lost}", begin + offered);
            latest = offered;
        }
        begin += latest + 5_000_000;
    }
    desk.write("uneven.csv", uneven);
    for (file, words) in [("even.csv", ["correlation =", " p ="]), ("uneven.csv", ["correlation-time", "mean-good"])] {
        desk.text(&format!("fit {file} --out link.toml"));
        let link = desk.read("link.toml");
        assert!(words.iter().all(|word| link.contains(word)), "{link}");
        let rest = "[scene]\nduration = \"1s\"\ncount = 2\n[object]\nmass = 0.45\n[coordination]\nstrategy = \"average-position\"\nstiffness = 100\n\
                    damping = 5\nupdate = \"8ms\"\n[peer]\ncontact = \"none\"\ndevice = { mass = 0.1, damping = 5 }\n\
                    coupling = { stiffness = 100, damping = 5 }\n";
        desk.write("scene.toml", format!("{rest}{link}"));
        assert!(desk.text("explain scene.toml").contains("jitter"), "{link}");
    }
}

#[test]
fn what_cannot_be_estimated_is_refused() {
    let desk = Desk::with("m.csv", "t,delay\n0,0.1\n1,0.2\n");
    desk.write("bad.csv", "t,delay\n0,soon\n");
    for (line, status, part) in [
        ("fit m.csv", 2, "m.csv: only 2 packets arrived: expected at least 50"),
        ("fit bad.csv", 2, "bad.csv: line 2, column delay: found \"soon\", expected a decimal number"),
        ("fit gone.csv", 3, "cannot read gone.csv"),
        ("fit m.csv bad.csv", 2, "m.csv, bad.csv: the capture of the sender"),
        ("fit m.csv --port 9", 2, "RECEIVER"),
    ] {
        desk.cohaptic(line).assert_refused(status, &[part]);
    }
}
