//! `cohaptic link`: the asked figures of a link beside the achieved ones.

use serde_json::Value;

use crate::integration::desk::{Desk, parse};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Returns the compared figure with this name.
fn compared<'a>(document: &'a Value, name: &str) -> &'a Value {
    let figures = document["compared"].as_array().unwrap();
    figures.iter().find(|figure| figure["name"] == name).unwrap_or_else(|| panic!("no {name} in {document:#}"))
}

#[test]
fn the_document_has_every_key_of_the_contract() {
    let document = Desk::new().json("link delay 20ms 2ms 25% distribution normal loss 1% --packets 20000 --json");
    let asked = &document["asked"];
    assert_eq!(asked["spec"], "delay 20ms 2ms 25% distribution normal loss 1%");
    assert_eq!([&asked["mean_s"], &asked["sd_s"], &asked["loss"]].map(number), [0.02, 0.002, 0.01]);
    assert!((number(&asked["autocorrelation"][0]) - 0.25).abs() < 1e-12);
    // Φ⁻¹(0.95) = 1.6449.
    assert!((number(&asked["quantiles_s"]["0.95"]) - 0.023_289_707).abs() < 1e-9);
    let achieved = &document["achieved"];
    // 20 000 delays: the mean has the standard error 2 ms·√(5/3/20 000) = 18 µs, the loss 0.07 %.
    assert!((number(&achieved["mean_s"]) - 0.02).abs() < 4.5 * 18e-6);
    assert!((number(&achieved["loss"]) - 0.01).abs() < 4.5 * 0.0007);
    let fates = &document["fates"];
    assert_eq!(fates["offered"], 20_000);
    assert_eq!(fates["delivered"].as_u64().unwrap() + fates["dropped"]["loss"].as_u64().unwrap(), 20_000);
    assert!(number(&document["packets_per_s"]) > 0.0);
    let figures = document["compared"].as_array().unwrap();
    assert!(figures.len() >= 10 && figures.iter().all(|figure| figure["outside"] == false), "{document:#}");
}

#[test]
fn words_and_keys_of_the_same_link_make_the_same_link() {
    let desk = Desk::new();
    let run = |line: &str| desk.json(&format!("link {line} --packets 3000 --json"))["achieved"].clone();
    assert_eq!(run("delay 24ms 2ms distribution normal loss 1%"), run("delay=24ms jitter=2ms loss=1%"));
    assert_eq!(run("delay 24ms loss gemodel 1% 10%"), run("delay=24ms 'loss={ gilbert-elliott = { p = 0.01, r = 0.1 } }'"));
    assert_eq!(run("rate 8mbit -14 delay 24ms"), run("delay 24ms rate 8mbit -14"));
    assert_eq!(run("'delay 24ms loss 1%'"), run("delay 24ms loss 1%"));
}

/// `loss 1% 25%` loses 0.00015 % in the kernel, and `exact` loses 1 %.
#[test]
fn the_kernel_does_not_do_what_it_is_told_and_the_table_says_so() {
    let desk = Desk::new();
    let line = "link delay 24ms loss 1% 25% --packets 50000";
    let exact = desk.json(&format!("{line} --json"));
    assert_eq!(compared(&exact, "loss")["outside"], false);
    let kernel = desk.json(&format!("{line} --json --profile kernel-6.6"));
    assert_eq!((number(&compared(&kernel, "loss")["asked"]), &compared(&kernel, "loss")["outside"]), (0.01, &Value::Bool(true)));
    assert!(number(&kernel["achieved"]["loss"]) < 1e-4);
    let text = desk.text(&format!("{line} --profile kernel-6.6"));
    assert!(text.contains("  *\n") && text.contains("more than 4 standard errors from what was asked"), "{text}");
    // What exact refuses, the kernel does somehow.
    desk.cohaptic("link delay 1ms 10ms").assert_refused(2, &["begins below zero", "\ndelay 1ms 10ms\n^^^^^\n"]);
    assert_eq!(desk.json("link delay 1ms 10ms --profile kernel-6.6 --json --packets 1000")["asked"]["mean_s"], Value::Null);
}

/// Memory does not grow with the stream: figures are those of the first packets, and counts of all.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_long_stream_is_measured_by_its_first_packets() {
    let desk = Desk::new();
    let words = "delay=20ms loss=10%";
    let [first, all] = [4_000_000, 4_000_100].map(|packets| desk.json(&format!("link {words} --packets {packets} --json")));
    assert_eq!((&all["measured_packets"], &first["measured_packets"]), (&4_000_000.into(), &4_000_000.into()));
    assert_eq!((&all["compared"], &all["achieved"]), (&first["compared"], &first["achieved"]));
    assert_eq!(all["fates"]["offered"], 4_000_100);
    let text = desk.text(&format!("link {words} --packets 4000100"));
    assert!(text.contains("\n  figures describe the first 4000000 packets, counts all packets\n  4000100 packets sent, "), "{text}");
}

/// A log of fates is read piece by piece and not held in memory, so that the larger limit of such files holds.
#[test]
#[cfg(target_os = "linux")]
fn a_log_of_fates_may_be_longer_than_other_files() {
    let desk = Desk::new();
    let header = "sequence,copy,offered_ns,size,at_ns,fate,marked,damaged\n0,0,0,64,1,delivered,0,0\n";
    desk.write("log.csv", header);
    // Zeros that take no room: they are read as a line that is no row.
    for (bytes, said) in [(300 << 20, "log.csv: line 3: "), (5 << 30, "it is longer than 4096 MiB")] {
        std::fs::File::options().write(true).open(desk.path("log.csv")).unwrap().set_len(bytes).unwrap();
        for line in ["link --from log.csv", "fit log.csv"] {
            let outcome = desk.cohaptic(line);
            assert!(outcome.stderr.contains(said), "{line}, {bytes} bytes: {outcome:?}");
        }
    }
}

#[test]
fn what_was_written_is_replayed_to_the_bit() {
    let desk = Desk::new();
    let line = "delay 20ms 5ms loss 5% duplicate 3%";
    let first = desk.json(&format!("link {line} --packets 2000 --json --fates f.csv --pcapng f.pcapng --seed 4"));
    assert_eq!(first["files"], serde_json::json!(["f.csv", "f.pcapng"]));
    assert_eq!(desk.files("."), ["f.csv", "f.pcapng"]);
    let again = desk.json("link --from f.csv --json --fates again.csv");
    assert_eq!(first["achieved"], again["achieved"]);
    assert_eq!(first["fates"], again["fates"]);
    assert_eq!(again["asked"], serde_json::json!({ "spec": "replay of f.csv" }));
    let sorted = |name: &str| {
        let mut rows: Vec<String> = desk.read(name).lines().map(str::to_owned).collect();
        rows.sort();
        rows
    };
    assert_eq!(sorted("f.csv"), sorted("again.csv"));
    // A section header block begins every pcapng file.
    assert_eq!(std::fs::read(desk.path("f.pcapng")).unwrap()[..4], [0x0a, 0x0d, 0x0d, 0x0a]);
    // Beyond the log there is nothing.
    let longer = desk.json("link --from f.csv --packets 2500 --json");
    assert_eq!(longer["fates"]["dropped"]["end-of-log"], 500);
}

#[test]
fn packets_that_can_be_marked_are() {
    let desk = Desk::new();
    let fates = |line: &str| desk.json(&format!("link loss 10% ecn --packets 1000 --json{line}"))["fates"].clone();
    assert_eq!((fates(" --ecn")["dropped"]["loss"].as_u64(), fates("")["marked"].as_u64()), (Some(0), Some(0)));
    assert!(fates(" --ecn")["marked"].as_u64() > Some(50) && fates("")["dropped"]["loss"].as_u64() > Some(50));
    // The queue of DualPI2 for scalable senders marks beyond a wait of 1 ms, and the classic queue later: 64 bytes at 500 kbit/s take 1.024 ms.
    let marked = |ecn: &str| {
        let line = format!("link rate=500kbit 'queue={{discipline=\"dualpi2\",limit=\"9kB\"}}' --packets 2000 --json{ecn}");
        desk.json(&line)["fates"]["marked"].as_u64().unwrap()
    };
    assert!(marked(" --ecn=l4s") > 2 * marked(" --ecn=classic") && marked(" --ecn=classic") == marked(" --ecn"));
}

#[test]
fn a_named_table_is_a_file_beside() {
    let desk = Desk::with("mine.dist", "-8192 8192\n");
    for profile in ["exact", "kernel-6.6"] {
        let document = desk.json(&format!("link delay 20ms 2ms distribution mine --packets 2000 --json --profile {profile}"));
        // Half at 18 ms, half at 22 ms; the kernel counts in ticks of 64 ns.
        let delay = &document["achieved"];
        assert!((number(&delay["least_s"]) - 0.018).abs() < 2e-7 && (number(&delay["greatest_s"]) - 0.022).abs() < 2e-7, "{document:#}");
    }
    desk.write("bad.dist", "1 two\n");
    desk.cohaptic("link delay 20ms 2ms distribution bad").assert_refused(2, &["bad.dist: line 1, column 3: `two`"]);
    desk.cohaptic("link delay 20ms 2ms distribution gone").assert_refused(2, &["there is no such table", "gone.dist"]);
}

#[test]
fn the_text_sets_asked_beside_achieved() {
    let text = Desk::new().text("link delay 20ms 2ms distribution normal loss 1% rate 10mbit --packets 2000");
    for part in ["asked", "achieved", "std. error", "mean delay", "loss", "rate", "10000.000 kbit/s", "2000 packets sent", "dropped (loss)"] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
    // The speed of the emulator says nothing of the link. Only the document has it.
    assert!(!text.contains("per second"), "{text}");
}

/// A missing standard error and a rate that the stream does not fill are explained where they occur.
#[test]
fn the_text_says_why_a_figure_tells_little() {
    let desk = Desk::new();
    let notes = |line: &str| {
        let text = desk.text(line);
        ["no standard error:", "does not fill the rate:"].map(|note| text.contains(note))
    };
    assert_eq!(notes("link starlink/down --packets 20000"), [true, true]);
    assert_eq!(notes("link starlink/down --packets 90000 --every 8ms"), [false, true]);
    assert_eq!(notes("link delay 20ms 2ms loss 1% --packets 2000"), [false; 2]);
    assert_eq!(notes("link delay=20ms rate=10Mbit --packets 2000 --size 1250B --every 1ms"), [false; 2]);
}

#[test]
fn what_cannot_be_read_is_shown_with_the_word() {
    let desk = Desk::with("log.csv", "not a log\n");
    for (line, status, parts) in [
        ("link", 2, &["<SPEC>"][..]),
        ("link delay 20ms loss 250%", 2, &["error: ", "\ndelay 20ms loss 250%\n                ^^^^ expected a percentage"]),
        ("link delay=20ms los=1%", 2, &["error: los=1%: link.los: unknown key", "loss"]),
        ("link delay=20ms loss", 2, &["not in both: loss is of the first kind, delay=20ms of the second"]),
        ("link delay=20ms --profile kernel-6.6", 2, &["words of tc-netem"]),
        ("link delay 1ms --every soon", 2, &["--every", "soon"]),
        ("link delay 1ms --packets 0", 2, &["--packets"]),
        ("link delay 1ms --profile kernel-7", 2, &["kernel-6.6"]),
        ("link delay 1ms --every 400s --packets 99999999999", 2, &["292 years"]),
        ("link --from log.csv", 2, &["log.csv: line 1: found \"not a log\""]),
        ("link --from gone.csv", 3, &["cannot read gone.csv"]),
        ("link delay 1ms --from log.csv", 2, &["cannot be used with"]),
        ("link delay 1ms --fates no/where.csv", 3, &["cannot write no/where.csv"]),
    ] {
        desk.cohaptic(line).assert_refused(status, parts);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_stream_reports_what_was_measured() {
    let desk = Desk::new();
    let begun = |_| desk.path("f.csv.partial").metadata().is_ok_and(|metadata| metadata.len() > 0);
    let outcome = crate::integration::interrupt::interrupted(&desk, "link delay 20ms --json --packets 100000000 --fates f.csv", begun);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(130), ""));
    let document = parse(&outcome.stdout);
    let offered = document["fates"]["offered"].as_u64().unwrap();
    assert!(document["interrupted"] == true && offered > 0 && document["fates"]["delivered"].as_u64() == Some(offered), "{document:#}");
    assert_eq!(desk.read("f.csv").lines().count() as u64, offered + 1);
}

/// A run of `link` has no end that is known before, but none lasts for ten years.
#[test]
fn a_recording_with_times_since_1970_is_refused_or_counted_from_its_first_row() {
    let desk = Desk::with("path.csv", "t,delay\n1700000000,0.010\n1700000001,0.030\n");
    desk.cohaptic("link 'trace=\"path.csv\"' --packets 2000").assert_refused(2, &["the recording begins at 1700000000s", "start = \"first\""]);
    // A second of 10 ms, and a second of 30 ms.
    let document = desk.json("link 'trace={file=\"path.csv\",start=\"first\"}' --packets 2000 --json");
    assert!((number(&document["achieved"]["mean_s"]) - 0.02).abs() < 1e-9, "{document:#}");
}
