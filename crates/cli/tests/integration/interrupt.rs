//! Ctrl-C: a run ends in good order.

use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::integration::desk::{Desk, Outcome, parse};
use crate::integration::scenes::TWO;

/// Interrupts a command once the process of this id has begun.
pub(crate) fn interrupted(desk: &Desk, line: &str, begun: impl Fn(u32) -> bool) -> Outcome {
    let mut child = desk.command(line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while !begun(child.id()) {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        sleep(Duration::from_millis(5));
    }
    send_interrupt(&child);
    end_within(&mut child, PATIENCE);
    Outcome::of(child.wait_with_output().unwrap())
}

/// Far more than an interrupted run needs on a slow machine. One that does not stop must not go on filling the disk.
const PATIENCE: Duration = Duration::from_secs(60);

fn end_within(child: &mut Child, patience: Duration) {
    let asked = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if asked.elapsed() > patience {
            child.kill().unwrap();
            panic!("it did not end when it was interrupted");
        }
        sleep(Duration::from_millis(5));
    }
}

fn send_interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

/// Returns whether a file has any content.
fn has_content(desk: &Desk, file: &str) -> bool {
    desk.path(file).metadata().is_ok_and(|metadata| metadata.len() > 0)
}

/// The records are whole lines under their own names, and the rows agree with the ticks said.
fn assert_whole(desk: &Desk, ticks: u64) {
    assert_eq!(desk.files("out"), ["forces.svg", "links.csv", "network.svg", "packets.csv", "positions.svg", "run.html", "trajectory.csv"]);
    let trajectory = desk.read("out/trajectory.csv");
    assert_eq!((trajectory.ends_with('\n'), trajectory.lines().count() as u64), (true, 1 + 2 * ticks));
    assert!(desk.read("out/packets.csv").ends_with("delivered\n"));
}

#[test]
fn a_run_that_is_interrupted_keeps_whole_records_and_says_so() {
    let desk = Desk::with("two.toml", TWO);
    let begun = |_| has_content(&desk, "out/trajectory.csv.partial");
    let outcome = interrupted(&desk, "run two.toml --json --out out --set scene.duration=24h", begun);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(130), ""));
    let document = parse(&outcome.stdout);
    assert_eq!(document["ending"], "interrupted");
    let (ticks, duration) = (document["ticks"].as_u64().unwrap(), document["duration_s"].as_f64().unwrap());
    assert!(ticks > 0 && duration < 86400.0, "{document:#}");
    assert_whole(&desk, ticks);
}

#[test]
fn people_are_told_too() {
    let desk = Desk::with("two.toml", TWO);
    let begun = |_| has_content(&desk, "out/trajectory.csv.partial");
    let outcome = interrupted(&desk, "run two.toml --out out --set scene.duration=24h", begun);
    assert_eq!(outcome.status, Some(130));
    assert!(outcome.stderr.contains("wrote out/trajectory.csv\n"), "{}", outcome.stderr);
    assert!(outcome.stdout.contains("INTERRUPTED after ") && outcome.stdout.contains(" of 86400s"), "{}", outcome.stdout);
}

#[test]
fn after_an_interruption_the_variant_does_not_begin() {
    let desk = Desk::with("two.toml", TWO);
    let begun = |_| has_content(&desk, "out/trajectory.csv.partial");
    let outcome = interrupted(&desk, "run two.toml --json --out out --set scene.duration=24h --against link.delay=8ms", begun);
    assert_eq!(outcome.status, Some(130));
    assert!(parse(&outcome.stdout).get("against").is_none() && !desk.path("out/against").exists());
}

/// Returns whether a process has a handler for SIGINT, number 2: bit 1 of the signals that it catches.
#[cfg(target_os = "linux")]
pub(crate) fn listens(id: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    caught.is_some_and(|mask| mask & 0b10 != 0)
}

#[cfg(target_os = "linux")]
#[test]
fn a_check_that_is_interrupted_has_not_passed() {
    let desk = Desk::with("two.toml", &format!("{TWO}\n[expect]\ndiscrepancy = {{ max = 1.0 }}\n"));
    // A check writes nothing that would show that it has begun.
    let outcome = interrupted(&desk, "check two.toml --json --set scene.duration=24h", listens);
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(130), "interrupted: 0 of 1 scenes were checked\n"));
    let document = parse(&outcome.stdout);
    assert_eq!(document["scenes"][0]["passed"], false);
    assert!(document["scenes"][0]["failures"][0].as_str().unwrap().starts_with("interrupted"), "{document:#}");
}
