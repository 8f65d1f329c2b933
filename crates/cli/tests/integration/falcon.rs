//! `cohaptic falcon`. No device is needed: what is simulated is simulated down to its bytes, and in virtual time where times are looked at.

use std::collections::BTreeMap;

use cohaptic_falcon::usb;
use serde_json::Value;

use crate::integration::desk::{Desk, Outcome, parse};
#[cfg(unix)]
use crate::integration::interrupt::interrupted;

const VIRTUAL: &str = "--simulated --virtual-time";

/// The document of a command that may say something beside.
fn document(desk: &Desk, line: &str) -> Value {
    let outcome = desk.cohaptic(line);
    assert_eq!(outcome.status, Some(0), "{line}: {}", outcome.stderr);
    parse(&outcome.stdout)
}

fn number(document: &Value, key: &str) -> f64 {
    document[key].as_f64().unwrap_or_else(|| panic!("{key} in {document:#}"))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("a list: {value}")).iter().map(|part| part.as_f64().unwrap()).collect()
}

fn length(value: &Value) -> f64 {
    numbers(value).iter().map(|part| part * part).sum::<f64>().sqrt()
}

fn assert_keys(document: &Value, keys: &[&str]) {
    for key in keys {
        assert!(document.get(key).is_some(), "no {key} in {document:#}");
    }
}

const TRAFFIC: [&str; 13] = [
    "seconds",
    "exchanges",
    "reports",
    "reports_per_s",
    "timeouts",
    "garbage_bytes",
    "faults",
    "implausible",
    "unlocated",
    "unhomed",
    "late_turns",
    "worst_late_us",
    "farewells",
];
const SEEN: [&str; 8] = ["phase", "light", "homed", "encoders", "buttons", "position_m", "velocity_m_s", "force_n"];
const IDENTITY: [&str; 5] = ["simulated", "serial", "product", "bus", "address"];

#[test]
fn help_names_the_commands_and_their_options() {
    let desk = Desk::new();
    assert!(desk.text("--help").contains("falcon"));
    let text = desk.text("falcon --help");
    assert!(["probe", "home", "watch", "simulate", "Exit status: 0 done"].iter().all(|word| text.contains(word)), "{text}");
    for (command, options) in [
        ("probe", &["--serial <SERIAL>", "--simulated", "--virtual-time", "--firmware <FILE>", "--for <TIME>", "--json"][..]),
        ("home", &["--serial <SERIAL>", "--simulated", "--firmware <FILE>", "--for <TIME>", "--json"]),
        ("watch", &["--force <X,Y,Z>", "--spring <STIFFNESS>", "--damping <DAMPING>", "--limit <NEWTONS>", "--csv <FILE>", "--for <TIME>"]),
        ("simulate", &["--hand <HAND>", "--force <X,Y,Z>", "--garbage <", "--drop <", "--unplug-after <TIME>", "--seed <N>", "--for <TIME>"]),
    ] {
        let text = desk.text(&format!("falcon {command} --help"));
        let words: Vec<&str> = text.split_whitespace().collect();
        for part in options.iter().chain(&["Exit status: 0 done"]) {
            assert!(words.join(" ").contains(part), "no {part:?} in {text}");
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused_before_a_device_is_touched() {
    let desk = Desk::with("short.bin", "too short");
    for (line, status, parts) in [
        ("falcon", 2, &["Usage"][..]),
        ("falcon fly", 2, &["'fly'"]),
        ("falcon probe --simulated --serial A", 2, &["--serial"]),
        ("falcon probe --virtual-time", 2, &["--simulated"]),
        ("falcon home --simulated --for 0s", 2, &["a time above zero"]),
        ("falcon watch --simulated --force 1,2", 2, &["three numbers"]),
        ("falcon watch --simulated --force 0,0,1 --spring 3", 2, &["--spring"]),
        ("falcon watch --simulated --force -0.4,0,-0.4", 2, &["limit of 0.5 N", "--limit"]),
        ("falcon watch --simulated --limit 4.5", 2, &["up to 4"]),
        ("falcon watch --simulated --spring 3001", 2, &["0 to 3000"]),
        ("falcon watch --simulated --damping 1", 2, &["--spring"]),
        ("falcon simulate --drop 2", 2, &["--drop"]),
        ("falcon simulate --hand shaky", 2, &["swaying"]),
        ("falcon probe --simulated --firmware short.bin", 2, &["short.bin", "1024"]),
        ("falcon probe --simulated --firmware none.bin", 3, &["none.bin"]),
    ] {
        desk.cohaptic(line).assert_refused(status, parts);
    }
}

/// With a real device at the machine this asks for another one.
#[test]
fn where_none_is_plugged_in_that_is_said() {
    let desk = Desk::new();
    for command in ["probe", "home", "watch --for 1s"] {
        desk.cohaptic(&format!("falcon {command} --serial no-such-serial --json")).assert_refused(3, &["error: "]);
    }
    match usb::list() {
        Ok(listed) if listed.is_empty() => {
            for command in ["probe", "probe --json", "home", "watch"] {
                desk.cohaptic(&format!("falcon {command}"))
                    .assert_refused(3, &["no Novint Falcon", "power supply", "lsusb -d 0403:cb48", "docs/falcon.md"]);
            }
            desk.cohaptic("falcon probe --serial X1").assert_refused(3, &["\"X1\"", "there are: none"]);
        }
        // Others are there, and are left alone.
        Ok(_) => desk.cohaptic("falcon probe --serial X1").assert_refused(3, &["\"X1\"", "there are: bus"]),
        Err(error) => desk.cohaptic("falcon probe").assert_refused(3, &[&error.to_string()]),
    }
}

#[test]
fn a_probe_says_how_a_device_answers() {
    let desk = Desk::new();
    let document = document(&desk, &format!("falcon probe {VIRTUAL} --json"));
    let falcon = &document["falcons"][0];
    assert_keys(falcon, &IDENTITY);
    assert_keys(falcon, &TRAFFIC);
    assert_keys(falcon, &SEEN);
    assert_eq!((&falcon["opened"], &falcon["firmware"], &falcon["error"]), (&Value::Bool(true), &"running".into(), &Value::Null));
    // One exchange a millisecond for a second, each answered; the calls of the driver take a little time in virtual time, too.
    assert!((950.0..=1001.0).contains(&number(falcon, "exchanges")), "{falcon:#}");
    assert_eq!((falcon["reports"].as_u64(), falcon["timeouts"].as_u64()), (falcon["exchanges"].as_u64(), Some(0)));
    assert_eq!(falcon["late_turns"].as_u64(), Some(0));
    assert!((950.0..=1001.0).contains(&number(falcon, "reports_per_s")));
    assert_eq!((falcon["garbage_bytes"].as_u64(), falcon["farewells"].as_u64()), (Some(0), Some(5)));
    let text = desk.text(&format!("falcon probe {VIRTUAL} --for 50ms"));
    // The hand has hardly begun to pull.
    assert!(
        ["it may be opened", "its firmware runs", "top ", "(not homed)", "buttons pressed: none", "light red"].iter().all(|word| text.contains(word)),
        "{text}"
    );
}

#[test]
fn a_device_that_was_just_switched_on_gets_its_firmware() {
    let desk = Desk::new();
    // Nobody looks at what is in it. 137 blocks of 62 bytes, the last one shorter, as the one that everybody uses.
    desk.write("firmware.bin", (0..8492_u32).map(|byte| byte.to_le_bytes()[0]).collect::<Vec<u8>>());
    for command in ["probe", "home", "watch --for 1s"] {
        let outcome = desk.cohaptic(&format!("falcon {command} {VIRTUAL} --firmware firmware.bin --json"));
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        assert!(
            outcome.stderr.contains("loading the firmware, attempt 1") && outcome.stderr.contains("all 8492 bytes are sent"),
            "{}",
            outcome.stderr
        );
        let document = parse(&outcome.stdout);
        let falcon = document["falcons"].get(0).unwrap_or(&document);
        assert_eq!((&falcon["firmware"], falcon["timeouts"].as_u64()), (&"loaded".into(), Some(0)), "{falcon:#}");
    }
}

#[test]
fn homing_is_guided_and_ends_active_without_a_force() {
    let desk = Desk::new();
    let outcome = desk.cohaptic(&format!("falcon home {VIRTUAL} --json"));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let order: Vec<usize> = ["red light", "blue light", "green light"].iter().map(|light| outcome.stderr.find(light).unwrap()).collect();
    assert!(order.is_sorted(), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_keys(&document, &IDENTITY);
    assert_keys(&document, &TRAFFIC);
    assert_keys(&document, &SEEN);
    assert_eq!((&document["is_homed"], &document["is_active"], &document["ending"]), (&true.into(), &true.into(), &"complete".into()));
    assert_eq!((&document["phase"], &document["light"], length(&document["force_n"])), (&"active".into(), &"green".into(), 0.0));
    // Active is beyond 170 mm from the base, and the origin at 125 mm; one exchange later the grip may be where it was, less a count of 0.06 mm. The hand gets
    // there at 0.92 s at the earliest and lies still beyond it until 3.3 s.
    let z = numbers(&document["position_m"])[2];
    assert!(z > 0.0449 && (0.9..3.3).contains(&number(&document, "seconds")), "{document:#}");
    let text = desk.cohaptic(&format!("falcon home {VIRTUAL}")).stdout;
    assert!(text.contains("homed and active after") && text.contains("the grip is at x "), "{text}");
}

#[test]
fn a_device_that_nobody_homes_in_time_is_an_error() {
    let outcome = Desk::new().cohaptic(&format!("falcon home {VIRTUAL} --for 50ms --json"));
    assert_eq!(outcome.status, Some(3));
    assert!(outcome.stderr.contains("error: after 50ms the device is not homed"), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_eq!((&document["is_homed"], &document["position_m"]), (&false.into(), &Value::Null));
}

/// The columns of a table by name.
fn columns(text: &str) -> BTreeMap<String, Vec<String>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let mut columns: BTreeMap<String, Vec<String>> = names.iter().map(|name| (name.clone(), Vec::new())).collect();
    for row in reader.records() {
        for (name, cell) in names.iter().zip(row.unwrap().iter()) {
            columns.get_mut(name).unwrap().push(cell.to_owned());
        }
    }
    columns
}

#[test]
fn a_spring_pulls_to_the_origin_within_its_limit() {
    let desk = Desk::new();
    let document = document(&desk, &format!("falcon watch {VIRTUAL} --spring 60 --damping 0.5 --limit 1 --for 6s --csv samples.csv --json"));
    for keys in [&IDENTITY[..], &TRAFFIC, &SEEN, &["firmware", "ending", "active_after_s", "lowest_m", "highest_m", "fastest_m_s", "forces", "files"]]
    {
        assert_keys(&document, keys);
    }
    let forces = &document["forces"];
    assert_keys(forces, &["limit_n", "largest_n", "limited", "slewed", "saturated", "zeroed"]);
    // Pulled out to 45 mm and more, 60 N/m want more than 2 N.
    assert!(forces["limited"].as_u64() > Some(0) && (number(forces, "largest_n") - 1.0).abs() < 1e-9, "{forces:#}");
    let table = columns(&desk.read("samples.csv"));
    assert_eq!(table["t"].len() as u64, document["exchanges"].as_u64().unwrap());
    let value = |name: &str, row: usize| table[name][row].parse::<f64>();
    let mut compared = 0;
    for (row, phase) in table["phase"].iter().enumerate().skip(1) {
        let force = ["fx", "fy", "fz"].map(|name| value(name, row).unwrap());
        assert!(force.iter().map(|part| part * part).sum::<f64>().sqrt() <= 1.0 + 1e-12);
        if phase != "active" {
            assert_eq!(force, [0.0; 3], "row {row}");
        }
        // From 5 s on the grip sways around the middle: what goes out is of what was read in the exchange before, shortened to 1 N.
        if value("t", row).unwrap() > 5.0 {
            let spring = ["x", "y", "z"].map(|axis| {
                let [place, speed] = [axis.to_owned(), format!("v{axis}")].map(|name| value(&name, row - 1).unwrap());
                -60.0 * place - 0.5 * speed
            });
            let length = spring.iter().map(|part| part * part).sum::<f64>().sqrt();
            let off = spring.iter().zip(force).map(|(spring, force)| (spring / length.max(1.0) - force).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "row {row}: {force:?} N, a spring {spring:?} N");
            compared += 1;
        }
    }
    assert!(compared > 900);
}

#[test]
fn what_is_watched_comes_as_rows_where_no_terminal_is() {
    let outcome = Desk::new().cohaptic(&format!("falcon watch {VIRTUAL} --for 2s --force 0,0,-0.3"));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(outcome.stdout.starts_with("t,phase,homed,encoder1,encoder2,encoder3,x,y,z,vx,vy,vz,fx,fy,fz,buttons\n"));
    let table = columns(&outcome.stdout);
    let last = table["t"].len() - 1;
    // Ten a second, of exchanges a little longer than a millisecond.
    assert!((18..20).contains(&last));
    assert_eq!((table["phase"][0].as_str(), table["x"][0].as_str(), table["homed"][0].as_str()), ("homing", "", "000"));
    assert_eq!((table["phase"][last].as_str(), table["fz"][last].as_str(), table["homed"][last].as_str()), ("active", "-0.3", "111"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_watch_ends_in_good_order() {
    let desk = Desk::new();
    let begun = |_| desk.path("samples.csv.partial").metadata().is_ok_and(|file| file.len() > 0);
    // In real time, and without an end.
    let Outcome { status, stdout, .. } = interrupted(&desk, "falcon watch --simulated --csv samples.csv --json", begun);
    assert_eq!(status, Some(130));
    let document = parse(&stdout);
    assert_eq!((&document["ending"], document["farewells"].as_u64()), (&"interrupted".into(), Some(5)));
    let samples = desk.read("samples.csv");
    assert!(samples.ends_with('\n'));
    assert_eq!(samples.lines().count() as u64, 1 + document["exchanges"].as_u64().unwrap());
}

#[test]
fn in_real_time_it_is_homed_as_well() {
    // However slow the machine is, the hand lies beyond 170 mm before it comes back, or after it.
    let document = document(&Desk::new(), "falcon home --simulated --for 60s --json");
    assert_eq!((&document["is_active"], &document["phase"]), (&true.into(), &"active".into()));
}

#[test]
fn a_simulated_device_shows_both_sides() {
    let desk = Desk::new();
    let line = "falcon simulate --hand homing --force 0.3,0,0.4 --json";
    let simulated = desk.json(line);
    let keys = ["hand", "seed", "asked_n", "ending", "driver_error", "changes", "more_changes", "forces", "device", "true_position_m"];
    for keys in [&TRAFFIC[..], &SEEN, &keys, &["largest_position_error_m", "motor_force_n", "largest_motor_force_n"]] {
        assert_keys(&simulated, keys);
    }
    let device = ["commands", "garbage_bytes", "misheard_bytes", "largest_count", "largest_count_unhomed", "saturated", "torque_timeouts"];
    assert_keys(&simulated["device"], &device);
    let phases: Vec<&str> = simulated["changes"].as_array().unwrap().iter().map(|change| change["phase"].as_str().unwrap()).collect();
    assert_eq!(phases, ["homing", "homed", "active", "stopped"]);
    // Whole motor counts make 0.5 N to 5e-5 N·m at three arms, 29 rad/m at most: 4.4 mN. Between two packets the grip moves on, at most 0.12 mm at 0.12 m/s, where
    // the same torques make some thousandths of another force: 1 % in all.
    assert!((number(&simulated, "largest_motor_force_n") - 0.5).abs() < 0.005 + 0.0044, "{simulated:#}");
    assert_eq!((length(&simulated["motor_force_n"]), simulated["device"]["largest_count_unhomed"].as_u64()), (0.0, Some(0)));
    // Counts of 0.06 mm at three arms, and what the grip moves until the report is there.
    assert!(number(&simulated, "largest_position_error_m") < 0.06e-3 * 1.74 + 0.3e-3);
    assert_eq!(desk.text(line), desk.text(line), "the same each time");
    let text = desk.text("falcon simulate");
    assert!(
        ["hand swaying", "homed (blue)", "the driver ran for 6.0", "the motors pushed with 0.000 N"].iter().all(|word| text.contains(word)),
        "{text}"
    );
}

#[test]
fn nothing_is_pushed_that_nobody_has_homed() {
    let simulated = Desk::new().json("falcon simulate --hand still --force 0,0,3 --for 3s --json");
    assert_eq!((&simulated["phase"], &simulated["position_m"]), (&"homing".into(), &Value::Null));
    assert_eq!((simulated["device"]["largest_count"].as_u64(), number(&simulated, "largest_motor_force_n")), (Some(0), 0.0));
    assert_eq!(simulated["forces"]["zeroed"]["not homed"], simulated["exchanges"]);
}

#[test]
fn an_unplugged_device_is_noticed_at_once() {
    let desk = Desk::new();
    let simulated = desk.json("falcon simulate --force 0,0,0.5 --unplug-after 5s --for 9s --json");
    assert_eq!(simulated["ending"], "failed");
    assert!(simulated["driver_error"].as_str().unwrap().contains("unplugged"));
    assert!((4.9..5.01).contains(&number(&simulated, "seconds")), "{simulated:#}");
    assert_eq!(simulated["changes"].as_array().unwrap().last().unwrap()["phase"], "stopped");
    assert!(desk.text("falcon simulate --unplug-after 1s").contains("the driver gave up after "));
}

#[test]
fn faults_are_counted_and_no_force_comes_of_them() {
    let desk = Desk::new();
    let spoilt = desk.json("falcon simulate --force 0,0,0.5 --limit 0.6 --garbage 0.2% --drop 0.2% --for 20s --json");
    let counts = ["timeouts", "garbage_bytes"].map(|key| spoilt[key].as_u64().unwrap());
    // 16 bytes each way lose one in 32·0.2 % of 20000 exchanges, and 16·0.4 % of the reports are spoilt otherwise: more than 1000 of either kind.
    assert!(counts.iter().all(|count| *count > 500), "{counts:?}");
    assert!(spoilt["device"]["garbage_bytes"].as_u64() > Some(100));
    assert_eq!(spoilt["device"]["largest_count_unhomed"].as_u64(), Some(0));
    // 0.5 N are asked for; what changed on the way is where the grip seems to be, by at most 300 counts: 15 mm, over which the torques for a force change by less
    // than half.
    assert!(number(&spoilt["forces"], "largest_n") <= 0.5 + 1e-9 && number(&spoilt, "largest_motor_force_n") < 0.75, "{spoilt:#}");
    let other = desk.json("falcon simulate --force 0,0,0.5 --limit 0.6 --garbage 0.2% --drop 0.2% --for 20s --seed 2 --json");
    assert!(other["garbage_bytes"] != spoilt["garbage_bytes"] || other["timeouts"] != spoilt["timeouts"], "another seed, other faults");
}
