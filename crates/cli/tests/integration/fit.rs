//! `cohaptic fit`: estimates from the packets of a link agree with the configuration of the link.

use std::fmt::Write as _;

use cohaptic_tests_common::are_all;
use serde_json::Value;

use crate::integration::desk::Desk;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
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
    let drifts = [(0, 1), (20, 3), (-1000, 6), (0, 2), (-20, 4), (100, 5)];
    for &(nanos_each_ms, seed) in if are_all() { &drifts[..] } else { &drifts[..3] } {
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
            let text = desk.text("fit m.csv --skew");
            assert!([" us/s, in 99 % from -", ": not significant at 1 %, left in"].iter().all(|part| text.contains(part)), "{text}");
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

/// The written link can be read again: as the keys of `link`, and as the `[link]` of a scene. Packets at one spacing give a law per packet, packets at several
/// spacings a law in time.
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
        desk.write("scene.toml", format!("{SCENE}{link}"));
        assert!(desk.text("explain scene.toml").contains("jitter"), "{link}");
    }
}

/// Scene without links.
const SCENE: &str = "[scene]\nduration = \"1s\"\ncount = 2\n[object]\nmass = 0.45\n[coordination]\nstrategy = \"average-position\"\nstiffness = 100\n\
                     damping = 5\nupdate = \"8ms\"\n[peer]\ncontact = \"none\"\ndevice = { mass = 0.1, damping = 5 }\n\
                     coupling = { stiffness = 100, damping = 5 }\n";

/// Delays of a clock of a millisecond. SciPy finds the mean 22.0966 ms, the deviation 1.4916 ms and the floor 19.9647 ms of a Weibull law, at a distance of 0.0078
/// (`crates/measure/tests/reference`). The floor of a law of greatest density is the least delay, and its deviation 2.46 ms.
#[test]
fn a_coarse_clock_shows_intervals() {
    let counts = [(20, 22), (21, 61), (22, 53), (23, 31), (24, 17), (25, 9), (26, 4), (27, 3)];
    let mut delays: Vec<u32> = counts.iter().flat_map(|&(delay, count)| std::iter::repeat_n(delay, count)).collect();
    // In an order without memory: 77 is prime to 200.
    delays = (0..200).map(|i| delays[i * 77 % 200]).collect();
    let rows = delays.iter().enumerate().map(|(i, delay)| format!("{},{delay}\n", i * 10));
    let desk = Desk::with("m.csv", &format!("t_ms,delay_ms\n{}", rows.collect::<String>()));
    let document = desk.json("fit m.csv --require-law --out link.toml --json");
    let near = |value: &Value, expected: f64, of: f64| assert!((number(value) - expected).abs() < of, "{value} {expected} {document:#}");
    let (jitter, best) = (&document["link"]["jitter"], &document["goodness"]["laws"][0]);
    assert_eq!(jitter["distribution"], "weibull");
    near(&document["link"]["delay_s"], 22.0966e-3, 1e-6);
    near(&jitter["sd_s"], 1.4916e-3, 1e-6);
    near(&jitter["floor_s"], 19.9647e-3, 1e-5);
    near(&best["kolmogorov"], 0.0078, 1e-4);
    near(&document["goodness"]["resolution_s"], 1e-3, 1e-12);
    assert_eq!(best["fits"], true);
    assert!(number(&best["p_value"]) > 0.99 && number(&document["goodness"]["effective"]) > 100.0, "{document:#}");
    assert!(desk.text("fit m.csv").contains(", in steps of 1ms\n"));
    assert_eq!(desk.files("."), ["link.toml", "m.csv"]);
}

/// Two routes, and what spikes do to a link, have no law. Shot noise of 2 spikes of 50 ms a second that decay in 20 ms has the mean 2·50·0.02 = 2 ms and the deviation
/// 50·√(2·0.02/2) = 7.07 ms (Campbell); with a correlation time of 20 ms, 600 s tell the mean to 7.07 ms·√(2·20 ms/600 s) = 58 µs. The deviation is known to a tenth.
#[test]
fn delays_without_a_law_are_the_law() {
    let desk = Desk::new();
    // 2 of 10 are 21 ms, and so on, in an order without memory (777 is prime to 2000), and up to 0.6 ms more: mean 30.6 + 0.3 ms, deviation √(104.44 + 0.04) ms.
    let route = |i: u32| [20, 40, 21, 41, 20, 42, 40, 20, 41, 21][(i * 777 % 2000 / 200) as usize];
    let routes = (0..2000).map(|i| format!("{},{}.{}\n", i * 10, route(i), i % 7));
    desk.write("routes.csv", format!("t_ms,delay_ms\n{}", routes.collect::<String>()));
    desk.text("link delay=20ms jitter={sd=\"100us\"} spike={rate=2,height=\"50ms\",decay=\"20ms\"} --packets 60000 --every 10ms --fates spike.csv");
    for (file, mean, mean_of, sd, sd_of) in [("routes.csv", 30.9e-3, 0.01e-3, 10.222e-3, 0.01e-3), ("spike.csv", 22e-3, 5.0 * 58e-6, 7.07e-3, 0.7e-3)]
    {
        let document = desk.json(&format!("fit {file} --out link.toml --json"));
        let (link, goodness) = (&document["link"], &document["goodness"]);
        assert_eq!(link["jitter"]["distribution"], "empirical", "{document:#}");
        assert!((number(&link["delay_s"]) - mean).abs() < mean_of && (number(&link["jitter"]["sd_s"]) - sd).abs() < sd_of, "{document:#}");
        for law in goodness["laws"].as_array().unwrap() {
            assert!(
                law["fits"] == false && number(&law["kolmogorov"]) > number(&goodness["kolmogorov_limit"]) && number(&law["p_value"]) < 0.01,
                "{law}"
            );
        }
        let text = desk.text(&format!("fit {file}"));
        assert!(text.contains("no law fits: the link draws from the measured delays"), "{text}");
        // The link and its file of delays are read by a scene, whose law has the moments that were said.
        assert!(desk.read("link.toml").contains("distribution = { empirical = \"link.delays.csv\" }"));
        desk.write("scene.toml", format!("{SCENE}{}", desk.read("link.toml")));
        assert!(desk.text("explain scene.toml").contains("measured"));
        for left in ["link.toml", "link.delays.csv"] {
            std::fs::remove_file(desk.path(left)).unwrap();
        }
        let refused = desk.cohaptic(&format!("fit {file} --require-law --out link.toml"));
        assert_eq!((refused.status, refused.stdout.contains("no law fits"), desk.path("link.toml").exists()), (Some(1), true, false), "{refused:?}");
        assert!(!desk.path("link.delays.csv").exists());
    }
}

/// A delay of 300 years, which no scene reads, is not written.
#[test]
fn a_link_that_no_scene_reads_is_not_written() {
    let rows = (0..100).map(|i| format!("{i},{}\n", 1e10 + f64::from(i % 7)));
    let desk = Desk::with("m.csv", &format!("t,delay\n{}", rows.collect::<String>()));
    desk.cohaptic("fit m.csv --offset 0s --out link.toml")
        .assert_refused(2, &["the mean of the delays is 10000000002.9", " s, and 9223372036.854776 s in a scene"]);
    assert_eq!(desk.files("."), ["m.csv"]);
}

/// A file for both commands: a packet each 10 ms, of which five were lost, with a byte order mark, milliseconds, columns of others, and two packets at one instant.
#[test]
fn what_is_fitted_can_be_replayed() {
    let mut rows = "\u{feff}number,delay_ms,t_ms\n".to_owned();
    for i in 0..100 {
        let delay = match i {
            7 | 8 => "-1".to_owned(),
            30 => "NaN".to_owned(),
            31 => "NA".to_owned(),
            60 => String::new(),
            _ => format!("{}", 20 + i * 37 % 11),
        };
        let _ = writeln!(rows, "{i},{delay},{}", i * 10);
        if i == 40 {
            let _ = writeln!(rows, "more,{delay},{}", i * 10);
        }
    }
    let desk = Desk::with("m.csv", &rows);
    let goodness = &desk.json("fit m.csv --json")["goodness"];
    assert_eq!((goodness["packets"].as_u64(), goodness["received"].as_u64()), (Some(101), Some(96)), "{goodness:#}");
    let document = desk.json("link trace=m.csv --packets 100 --every 10ms --fates f.csv --json");
    assert_eq!((document["fates"]["delivered"].as_u64(), document["fates"]["dropped"]["loss"].as_u64()), (Some(95), Some(5)), "{document:#}");
    let lost: Vec<String> =
        desk.read("f.csv").lines().filter(|row| row.contains(",loss,")).map(|row| row.split(',').next().unwrap().to_owned()).collect();
    assert_eq!(lost, ["7", "8", "30", "31", "60"]);
    // The third packet: 20 + 2·37 modulo 11 ms.
    assert!(desk.read("f.csv").contains("\n2,0,20000000,64,48000000,delivered,0,0\n"), "{}", desk.read("f.csv"));
    // Instants of delivery may have a byte order mark, too.
    desk.write("line.trace", "\u{feff}1\n2\n");
    assert_eq!(desk.json("link trace=line.trace --packets 10 --json")["fates"]["delivered"].as_u64(), Some(10));
}

#[test]
fn what_cannot_be_estimated_is_refused() {
    let desk = Desk::with("m.csv", "t,delay\n0,0.1\n1,0.2\n");
    desk.write("bad.csv", "t,delay\n0,soon\n");
    for (line, status, part) in [
        ("fit m.csv", 2, "m.csv: only 2 packets arrived: expected at least 50"),
        ("fit bad.csv", 2, "bad.csv: line 2, column delay: found \"soon\", expected a decimal number, or for a lost packet"),
        ("fit gone.csv", 3, "cannot read gone.csv"),
        ("fit m.csv bad.csv", 2, "m.csv, bad.csv: the capture of the sender"),
        ("fit m.csv --port 9", 2, "RECEIVER"),
    ] {
        desk.cohaptic(line).assert_refused(status, &[part]);
    }
}

/// A level that stays for 2 s, with 60 % of the variance, and a jitter of each packet on top. 40 000 packets every 10 ms have 100 independent levels, so that the
/// share is known to about 0.07, and the time to a factor of 1.3.
#[test]
fn a_share_with_memory_is_found_again() {
    let desk = Desk::new();
    let jitter = "jitter={sd=\"4ms\",distribution=\"gamma\",floor=\"30ms\",correlation-time=\"2s\",correlation-share=0.6}";
    desk.text(&format!("link delay=40ms {jitter} --packets 40000 --every 10ms --fates f.csv"));
    let document = desk.json("fit f.csv --json --out link.toml");
    let jitter = &document["link"]["jitter"];
    let (share, time) = (number(&jitter["correlation_share"]), number(&jitter["correlation_time_s"]));
    assert!((share - 0.6).abs() < 4.5 * 0.07 && (time / 2.0).ln().abs() < 4.5 * 0.26, "{jitter:#}");
    let fitted = &document["goodness"]["correlation"];
    assert_eq!((number(&fitted["share"]), number(&fitted["time_s"])), (share, time));
    assert!((share - 0.6).abs() < 4.5 * number(&fitted["share_se"]), "{fitted:#}");
    // The correlation of neighbours 10 ms apart, of a normal law.
    let asked = desk.json("link delay=40ms jitter={sd=\"4ms\",correlation-time=\"2s\",correlation-share=0.6} --packets 1000 --every 10ms --json");
    assert!((number(&asked["asked"]["autocorrelation"][0]) - 0.6 * (-0.005_f64).exp()).abs() < 1e-6, "{asked:#}");
    assert!(desk.read("link.toml").contains("correlation-share = 0."), "{}", desk.read("link.toml"));
    let text = desk.text("fit f.csv");
    assert!(text.contains(" of the share 0.") && text.contains("of the variance; the rest differs from packet to packet"), "{text}");
}
