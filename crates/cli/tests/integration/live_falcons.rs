//! `cohaptic live` with Falcons that are simulated in real time. What is asserted holds however slow the machine is: a Falcon whose driver is late gives no force
//! for a moment, and lets its hand go where that wants to be, but no farther.

use std::collections::BTreeMap;
use std::fs;
use std::time::Duration;

use cohaptic_harness::live::{Inputs, replay};
use cohaptic_harness::record::{InputRecorder, Recorder};
use cohaptic_scene::{Scene, link_keys, scene_content};
use serde_json::Value;

use crate::integration::desk::{Desk, parse, shipped};
use crate::integration::interrupt::interrupted;

const NAMES: [&str; 3] = ["left", "right", "third"];
/// KC and KT of the scene, and the stiffness of the arms \[N/m\].
const COUPLING: f64 = 1000.0;
const COORDINATION: f64 = 300.0;
const ARM: f64 = 100.0;
/// The dry friction of a simulated grip \[N\].
const FRICTION: f64 = 0.2;
/// Uncertainty of a position at rest from the whole counts of encoders and motors \[m\]: 0.104 mm and 0.025 mm (crates/live/tests/integration/falcons.rs).
const COUNTS: f64 = 0.13e-3;
/// Position along x \[m\] towards which the hand of `left` pulls. The other hands pull towards 0.
const WANTED: f64 = 0.03;

/// A session of the shipped scene in which `falcons` peers have a Falcon and the others are simulated as masses.
struct Session {
    desk: Desk,
    document: Value,
    overrides: Vec<String>,
    trajectory: BTreeMap<String, Vec<(f64, f64, f64)>>,
}

fn line(overrides: &[String], length: &str) -> String {
    let scene = shipped("live/three-falcons.toml");
    let set: String = overrides.iter().map(|given| format!(" --set {given}")).collect();
    format!("live '{}' --for {length} --json --no-priority --out out{set}", scene.display())
}

/// 2.5 s: hold is taken within 0.25 s, and what is left of a displacement after the rest is e^(−2.2 s/0.26 s) = 2e-4 (the scene says why).
fn session(falcons: usize, also: &[&str]) -> Session {
    let mut overrides: Vec<String> = NAMES.iter().skip(falcons).map(|name| format!("peers.{name}.kind=simulated")).collect();
    overrides.extend(also.iter().map(|given| (*given).to_owned()));
    let desk = Desk::new();
    let outcome = desk.cohaptic(&line(&overrides, "2500ms"));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    assert!(outcome.stderr.contains(&format!("homing the simulated Falcons of {}", NAMES[..falcons].join(", "))), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    let mut trajectory: BTreeMap<String, Vec<(f64, f64, f64)>> = BTreeMap::new();
    let text = desk.read("out/trajectory.csv");
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headers = reader.headers().unwrap().clone();
    let place = |name: &str| headers.iter().position(|header| header == name).unwrap();
    let (peer, device, object, force) = (place("peer"), place("xh"), place("xo"), place("fc"));
    for row in reader.records() {
        let row = row.unwrap();
        let [device, object, force] = [device, object, force].map(|place| row[place].parse().unwrap());
        trajectory.entry(row[peer].to_owned()).or_default().push((device, object, force));
    }
    Session { desk, document, overrides, trajectory }
}

impl Session {
    fn assert_all_joined(&self, falcons: usize) {
        let document = &self.document;
        assert_eq!((&document["ending"], document["ticks"].as_u64()), (&"complete".into(), Some(2500)), "{document:#}");
        for (place, name) in NAMES.iter().enumerate() {
            let peer = &document["peers"][place];
            let kind = if place < falcons { "falcon" } else { "simulated" };
            assert_eq!((&peer["name"], &peer["kind"]), (&(*name).into(), &kind.into()));
            if place < falcons {
                assert!(peer["seat"]["joined"].as_u64() >= Some(1), "{peer:#}");
                assert!(peer["seat"]["taken"].as_u64() >= Some(1), "{peer:#}");
            }
        }
    }

    /// The newest rows of all peers.
    fn last(&self) -> [(f64, f64, f64); 3] {
        NAMES.map(|name| *self.trajectory[name].last().unwrap())
    }

    /// Grips, and so copies, are between the places that hands want, but for what friction and counts leave open; and copies are as far apart as couplings and
    /// coordination hold them, given where the grips are.
    fn assert_held_together(&self) {
        let off = FRICTION / ARM + COUNTS;
        let last = self.last();
        for (device, object, _) in last {
            for x in [device, object] {
                assert!((-off..=WANTED + off).contains(&x), "{last:?}");
            }
        }
        // KC·(grip − copy) = KT·(3·copy − sum)/2, so two copies are KC/(KC + 3/2·KT) times as far apart as their grips. That is at rest: the grips were at most
        // so far from where they are now while samples of 24 ms ago still count, and a copy that follows may overshoot that once.
        let share = COUPLING / (COUPLING + 1.5 * COORDINATION);
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let recent = |place: usize| self.trajectory[NAMES[place]].iter().rev().take(300).map(|row| row.0);
            let moved = |place: usize| recent(place).map(|x| (x - last[place].0).abs()).fold(0.0, f64::max);
            let moved: f64 = (0..3).map(moved).sum();
            let (apart, expected) = (last[a].1 - last[b].1, share * (last[a].0 - last[b].0));
            assert!((apart - expected).abs() <= 2.0 * moved + 1e-5, "{a} {b}: {apart} m apart, {expected} m expected, grips moved {moved} m");
        }
    }

    /// The record gives the same session again, in virtual time.
    fn assert_replayed(&self) {
        let path = shipped("live/three-falcons.toml");
        let mut scene = Scene::read_live(&path, &self.overrides).unwrap();
        scene.duration = Duration::from_millis(2500);
        let keys = link_keys(&path, &self.overrides).unwrap().into_values().next().unwrap();
        let inputs = Inputs::read(&self.desk.read("out/inputs.csv"), &scene, &keys).unwrap();
        let again = self.desk.path("again");
        let of_the_session: Vec<String> = self.overrides.iter().cloned().chain(["scene.duration=2.5s".to_owned(), "expect={}".to_owned()]).collect();
        let content = scene_content(&path, &of_the_session).unwrap();
        let mut observer = (Recorder::create(&again, &scene).unwrap(), InputRecorder::create(&again, &scene, content).unwrap());
        let summary = replay(&scene, &inputs, &mut observer).unwrap();
        observer.0.finish(&summary).unwrap();
        observer.1.finish().unwrap();
        for file in ["trajectory.csv", "packets.csv", "links.csv", "inputs.csv"] {
            let [one, two] = ["out", "again"].map(|folder| fs::read(self.desk.path(folder).join(file)).unwrap());
            assert!(one == two, "{file} differs");
        }
    }
}

#[test]
fn one_falcon_and_two_masses() {
    let session = session(1, &[]);
    session.assert_all_joined(1);
    session.assert_held_together();
    session.assert_replayed();
}

#[test]
fn two_falcons_and_a_mass() {
    let session = session(2, &[]);
    session.assert_all_joined(2);
    session.assert_held_together();
    session.assert_replayed();
}

#[test]
fn three_falcons() {
    let session = session(3, &[]);
    session.assert_all_joined(3);
    session.assert_held_together();
    session.assert_replayed();
}

/// 0.5 N hold the hand of left, which pulls with 100 N/m, 5 mm from where it wants to be, and dry friction 2 mm more; without a limit it would be 15 mm along x.
/// The computed force is larger than the force that goes out.
#[test]
fn the_limit_of_force_in_the_scene_holds() {
    let session = session(3, &["peer.falcon.force-limit=0.5"]);
    session.assert_all_joined(3);
    let [(device, ..), _, _] = session.last();
    assert!(WANTED - device <= (0.5 + FRICTION) / ARM + COUNTS, "the grip of left is at {device} m");
    let largest = session.trajectory["left"].iter().map(|row| row.2.abs()).fold(0.0, f64::max);
    assert!(largest > 0.5, "{largest} N");
}

#[test]
fn an_interrupted_session_lets_go_of_its_falcons_and_keeps_its_records() {
    let desk = Desk::new();
    let begun = |_| desk.path("out/trajectory.csv.partial").metadata().is_ok_and(|file| file.len() > 0);
    let outcome = interrupted(&desk, &line(&[], "24h"), begun);
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_eq!(document["ending"], "interrupted");
    let ticks = document["ticks"].as_u64().unwrap();
    assert_eq!(desk.read("out/trajectory.csv").lines().count() as u64, 1 + 3 * ticks);
    let inputs = desk.read("out/inputs.csv");
    let last: Vec<&str> = inputs.lines().rev().take(2).collect();
    assert!(last[0].ends_with(&format!(",closed,,,{}", inputs.lines().count() - 2)) && last[1].ends_with(",end,,,"), "{last:?}");
}
