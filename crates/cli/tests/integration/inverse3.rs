//! `cohaptic inverse3`. No device and no service is needed: both are simulated. Times are asserted in virtual time alone.

use serde_json::Value;

use crate::integration::desk::{Desk, parse, shipped};

fn document(desk: &Desk, line: &str) -> Value {
    let outcome = desk.cohaptic(line);
    assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.stderr);
    parse(&outcome.stdout)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number: {value}"))
}

#[test]
fn help_names_the_commands_and_their_options() {
    let desk = Desk::new();
    assert!(desk.text("--help").contains("inverse3"));
    let text = desk.text("inverse3 --help");
    assert!(["probe", "watch", "simulate", "Exit status: 0 done"].iter().all(|word| text.contains(word)), "{text}");
    for (command, options) in [
        ("probe", &["--service <IP:PORT>", "--device <ID>", "--simulated", "--origin <X,Y,Z>", "--for <TIME>", "--json"][..]),
        ("watch", &["--force <X,Y,Z>", "--spring <STIFFNESS>", "--limit <NEWTONS>", "--csv <FILE>"]),
        ("simulate", &["--listen <IP:PORT>", "--format <FORMAT>", "--fault <FAULT>", "--reply-after <TIME>", "--seed <N>"]),
    ] {
        let text = desk.text(&format!("inverse3 {command} --help"));
        let words: Vec<&str> = text.split_whitespace().collect();
        for part in options {
            assert!(words.join(" ").contains(part), "no {part:?} in {text}");
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let desk = Desk::new();
    for (line, status, parts) in [
        ("inverse3", 2, &["Usage"][..]),
        ("inverse3 probe --simulated --device A", 2, &["--simulated"]),
        ("inverse3 probe --service 192.0.2.1:10001", 2, &["192.0.2.1:10001 is not an address of this machine"]),
        ("inverse3 probe --simulated --for 0s", 2, &["a time above zero"]),
        ("inverse3 watch --simulated --limit 2.5", 2, &["up to 2"]),
        ("inverse3 watch --simulated --force 0,0,1", 2, &["limit of 0.5 N", "--limit"]),
        ("inverse3 simulate --limit 11", 2, &["up to 10"]),
        ("inverse3 simulate --fault late", 2, &["NAME@TIME+LENGTH"]),
        ("inverse3 simulate --fault early=1%", 2, &["no fault \"early\"", "late, missing"]),
        ("inverse3 simulate --fault restart=1%", 2, &["restart@TIME+LENGTH"]),
        ("inverse3 simulate --listen 0.0.0.0:0", 2, &["is not an address of this machine"]),
        ("inverse3 simulate --format 2.0", 2, &["3.1", "3.5"]),
    ] {
        desk.cohaptic(line).assert_refused(status, parts);
    }
}

#[test]
fn a_simulation_shows_faults_and_repeats() {
    let desk = Desk::new();
    let line = "inverse3 simulate --force 0,0,0.5 --fault restart@2s+200ms --fault missing=0.1% --seed 3 --for 4s --json";
    let run = document(&desk, line);
    assert_eq!(run, document(&desk, line));
    let phases: Vec<&str> = run["changes"].as_array().unwrap().iter().map(|change| change["phase"].as_str().unwrap()).collect();
    assert_eq!(phases, ["disarmed", "active", "connecting", "disarmed", "active"]);
    assert_eq!((&run["exchanges"]["connections"], &run["exchanges"]["losses"]), (&2.into(), &1.into()));
    assert!(number(&run["exchanges"]["lost"]) >= 1.0, "{run:#}");
    assert!((number(&run["largest_motor_force_n"]) - 0.5).abs() < 1e-6);
    assert_eq!(run["motor_force_n"], serde_json::json!([0.0, 0.0, 0.0]));
    assert_eq!((&run["exchanges"]["exchange_every"], &run["ending"]), (&1.into(), &"complete".into()));
    let text = desk.text("inverse3 simulate --for 1s");
    assert!(["simulated Inverse3, seed 0", "active", "exchanges per second", "the service took"].iter().all(|part| text.contains(part)), "{text}");
    // Before 3.5 the origin is given, and forces go out all the same.
    let old = document(&desk, "inverse3 simulate --format 3.1 --force 0.5,0,0 --for 2s --json");
    assert!((number(&old["largest_motor_force_n"]) - 0.5).abs() < 1e-6, "{old:#}");
    let late = document(&desk, "inverse3 simulate --reply-after 2500us --for 2s --json");
    assert_eq!(late["exchanges"]["exchange_every"], 3);
    assert!(number(&late["exchanges"]["late"]) > 100.0);
}

#[test]
fn a_probe_and_rows_of_a_simulated_device() {
    let desk = Desk::new();
    let probe = document(&desk, "inverse3 probe --simulated --for 500ms --json");
    assert_eq!((&probe["simulated"], &probe["device"], &probe["service_version"]), (&true.into(), &"04C3".into(), &"3.5".into()));
    assert_eq!((&probe["error"], &probe["hears_events"], &probe["exchanges"]["forces"]["largest_n"]), (&Value::Null, &true.into(), &0.0.into()));
    assert!(number(&probe["exchanges"]["readings"]) > 0.0);
    let rows = desk.cohaptic("inverse3 watch --simulated --for 500ms --csv cursor.csv");
    assert_eq!(rows.status, Some(0), "{}", rows.stderr);
    assert!(rows.stdout.starts_with("t,phase,x,y,z,vx,vy,vz,fx,fy,fz\n0.0"), "{}", rows.stdout);
    // Standard error tells the user what to do.
    assert!(rows.stderr.contains("hold the cursor still at the origin"), "{}", rows.stderr);
    assert!(desk.read("cursor.csv").lines().count() > 2);
    let watch = document(&desk, "inverse3 watch --simulated --spring 50 --for 500ms --json");
    assert_eq!(watch["ending"], "complete");
}

#[test]
fn a_missing_service_is_said() {
    let desk = Desk::new();
    // Port 1 is nobody's: it needs a right that tests do not have.
    let outcome = desk.cohaptic("inverse3 probe --service 127.0.0.1:1 --for 300ms");
    assert_eq!(outcome.status, Some(3), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("no Inverse3") && outcome.stdout.contains("start Haply's Inverse Service"), "{}", outcome.stdout);
}

#[test]
fn a_service_is_served_to_other_programs() {
    let desk = Desk::new();
    let served = document(&desk, "inverse3 simulate --listen 127.0.0.1:0 --for 100ms --json");
    assert!(served["address"].as_str().unwrap().starts_with("ws://127.0.0.1:"), "{served:#}");
    assert_eq!((&served["ending"], &served["device"]["messages"]), (&"complete".into(), &0.into()));
}

/// A session of simulated devices in real time: what is asserted holds however slow the machine is, because a device whose service replies late gives no force.
#[test]
fn a_session_with_two_devices_reports_their_exchanges_and_replays() {
    let desk = Desk::new();
    let scene = shipped("live/two-inverse3s.toml");
    let outcome = desk.cohaptic(&format!("live '{}' --for 1500ms --no-priority --out session --json", scene.display()));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let session = parse(&outcome.stdout);
    for peer in session["peers"].as_array().unwrap() {
        assert_eq!(peer["kind"], "inverse3");
        assert!(peer["seat"]["joined"].as_u64() >= Some(1), "{peer:#}");
        let exchanges = &peer["exchanges"];
        assert!(number(&exchanges["readings"]) > 0.0 && number(&exchanges["reply_p50_us"]) > 0.0 && number(&exchanges["exchange_every"]) >= 1.0);
        assert!(number(&exchanges["force_rms_n"]) >= 0.0, "{exchanges:#}");
    }
    let again = desk.cohaptic(&format!(
        "run '{}' --set scene.duration=1.5s --set 'expect={{}}' --inputs session/inputs.csv --out again --no-plot",
        scene.display()
    ));
    assert_eq!(again.status, Some(0), "{}", again.stderr);
    for file in ["trajectory.csv", "packets.csv"] {
        assert!(desk.read(&format!("session/{file}")) == desk.read(&format!("again/{file}")), "{file} differs");
    }
}
