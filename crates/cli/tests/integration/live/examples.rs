//! The example programs in a session of the real command, with and without a key, alone and together.

#[path = "../../../../live/tests/integration/examples/programs.rs"]
#[allow(dead_code, reason = "the tests of the door ask the programs for more")]
mod programs;

use serde_json::Value;

use self::programs::{Language, Running, Summary, summary};
use super::http::Control;
use super::peer::SESSION;
use super::session::Session;
use super::wait_for;
use crate::integration::desk::Desk;

/// Returns a scene of a user who holds the object at 0, the programs, and with one program a third user whose hand is free. All parameters but the damping are
/// the defaults of the programs.
fn scene(programs: usize) -> String {
    let kinds = ["", "kind = \"udp\"", if programs > 1 { "kind = \"udp\"" } else { "" }];
    let [_, right, third] = kinds;
    format!(
        "scene = {{ duration = \"1h\", seed = {SESSION} }}\nobject = {{ mass = 0.45 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = {STIFFNESS}, damping = {DAMPING}, update = \"8ms\" }}\n\
         peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = {COUPLING}, damping = 5.0 }}, silence = {{ after = \"20s\" }} }}\n\
         link = {{ delay = \"4ms\", jitter = \"1ms\", loss = \"2%\" }}\n\
         [[peers]]\nname = \"left\"\nhand = {{ arm = {{ mass = 0.4, damping = 10.0, stiffness = {ARM} }} }}\n\
         [[peers]]\nname = \"right\"\n{right}\n[[peers]]\nname = \"third\"\n{third}\n"
    )
}

const STIFFNESS: f64 = 300.0;
/// Damping BT [N·s/m], so high that no copy overshoots. Then no peer amplifies a motion at any frequency, and all peers come to rest, however long a busy
/// machine lets a program wait.
const DAMPING: f64 = 20.0;
const COUPLING: f64 = 3500.0;
const ARM: f64 = 300.0;
/// Constant force of the hand of the program at place 1 [N].
const FORCE: f64 = 0.5;
/// Largest distance [m] of a copy from its place of rest when the copies are compared: about a hundredth of their motion.
const SETTLED: f64 = 2e-5;

/// Returns the positions at which the copies come to rest [m]. The arm alone holds against the push, F = ka·xd; so F passes through the coupling there,
/// F = KC·(xo − xd), and through the coordination of its copy with the mean of the others. The third copy feels nothing when it is midway between the two. So
/// F = KT·((xr + xt)/2 − xl) = KT·¾·(xr − xl).
fn at_rest() -> [f64; 3] {
    let left = FORCE / ARM + FORCE / COUPLING;
    let right = left + FORCE / (0.75 * STIFFNESS);
    [left, right, f64::midpoint(left, right)]
}

fn is_settled(state: &Value) -> bool {
    // Before the session has published anything there are no positions.
    let position = |peer: usize| state["peers"][peer]["position"][0].as_f64();
    at_rest().iter().enumerate().all(|(peer, rest)| position(peer).is_some_and(|x| (x - rest).abs() < SETTLED))
}

/// Runs the programs in one session for this many seconds. Returns whether all copies came to rest at their positions, the summaries that the programs printed,
/// and the document of the session.
fn taken_part(desk: &Desk, languages: &[Language], with_key: bool, seconds: f64) -> Option<(bool, Vec<Summary>, Value)> {
    let programs: Vec<_> = languages.iter().map(|language| language.program()).collect::<Option<_>>()?;
    let key = if with_key { " --key-file session.key" } else { "" };
    let mut session = Session::begin(desk, &format!("scene.toml --json --listen 127.0.0.1:0 --control{key}"));
    let (door, control) = (session.address(), session.control());
    let mut running = Vec::new();
    for (place, program) in (1..).zip(programs) {
        let mut command = program.command();
        let force = if place == 1 { FORCE } else { 0.0 };
        command.arg(door.to_string()).args(["--session", &SESSION.to_string(), "--place", &place.to_string()]);
        command.args(["--coordination", &format!("{STIFFNESS},{DAMPING}")]);
        command.args(["--duration", &seconds.to_string(), "--force", &force.to_string(), "--patience", "60"]);
        if with_key {
            // Axes, peers and periods are told by the door.
            command.arg("--key-file").arg(desk.path("session.key"));
        } else {
            command.args(["--peers", "3"]);
        }
        running.push(Running::new(command.spawn().unwrap()));
    }
    let settled = settles(&control, &mut running);
    let summaries: Vec<Summary> = running.into_iter().map(summary).collect();
    Some((settled, summaries, session.end()))
}

/// Returns whether everything comes to rest before the first of the programs ends.
fn settles(control: &Control, running: &mut [Running]) -> bool {
    wait_for("the programs to come to rest or to end", || {
        let settled = is_settled(&control.state());
        let ended = running.iter_mut().any(|program| !program.is_running());
        (settled || ended).then_some(settled)
    })
}

/// On a busy machine a program may end before everything is at rest. Then it gets more time; nothing is checked before.
fn come_to_rest(languages: &[Language], with_key: bool) {
    let desk = Desk::with("scene.toml", &scene(languages.len()));
    if with_key {
        let said = desk.text("live --new-key session.key");
        assert!(said.starts_with("this is a new session key"), "{said}");
    }
    for seconds in [2.0, 8.0, 40.0] {
        let Some((settled, summaries, document)) = taken_part(&desk, languages, with_key, seconds) else { return };
        // What each program itself says of its copy at its end.
        let rest = &at_rest()[1..];
        let at_rest = summaries.iter().zip(rest).all(|(summary, rest)| (summary.position[0] - rest).abs() < SETTLED);
        if settled && at_rest {
            for (place, summary) in (1..).zip(&summaries) {
                let heard: Vec<u64> = summary.others.iter().map(|other| other.sender).collect();
                assert_eq!(heard, (0..3).filter(|other| *other != place).collect::<Vec<u64>>());
                assert!(summary.others.iter().all(|other| other.received > 50), "{summary:?}");
                assert!(document["peers"][usize::try_from(place).unwrap()]["seat"]["taken"].as_u64().unwrap() > 50, "{document:#}");
            }
            let door = &document["door"];
            super::records::assert_counted(door);
            assert_eq!(door["welcomed"].as_u64() > Some(0), with_key, "{door}");
            return;
        }
    }
    panic!("they did not come to rest where they must");
}

#[test]
fn the_python_peer_comes_to_rest_with_the_others() {
    come_to_rest(&[Language::Python], false);
}

#[test]
fn the_python_peer_with_a_key_comes_to_rest_with_the_others() {
    come_to_rest(&[Language::Python], true);
}

#[test]
fn the_cpp_peer_comes_to_rest_with_the_others() {
    come_to_rest(&[Language::Cpp], false);
}

#[test]
fn the_cpp_peer_with_a_key_comes_to_rest_with_the_others() {
    come_to_rest(&[Language::Cpp], true);
}

#[test]
fn both_in_one_session_come_to_rest() {
    come_to_rest(&[Language::Python, Language::Cpp], true);
}
