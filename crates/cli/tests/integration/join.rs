//! `cohaptic join` beside `cohaptic live`: the other computer of a laboratory, over the loopback interface and between network namespaces.
#![expect(clippy::print_stdout, reason = "a test that is skipped says why")]

use std::io::{BufRead as _, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::integration::desk::{Desk, parse};
use crate::integration::router::is_inside;
use crate::integration::running::{Client, PATIENCE, Running, TOKEN};

/// Scene of a laboratory: `left` is at another computer, with a Falcon or a simulated device, and `right` is simulated by the session.
const LAB: &str = r#"
[scene]
title = "Two computers"
duration = "1h"
seed = 7

[object]
mass = 0.45

[coordination]
strategy = "average-position"
stiffness = 300.0
damping = 5.0
update = "8ms"

[peer]
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 1000.0, damping = 2.0 }

[[peers]]
name = "left"
kind = "udp"
falcon = { device = "simulated" }
hand = { arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 }, follows = { sine = { amplitude = 0.02, frequency = 0.25 } } }

[[peers]]
name = "right"

[link]
delay = "24ms"
"#;

/// Options with which nothing depends on the speed of this machine.
const UNHURRIED: &str = "--no-priority --tolerance 10min";

fn desk() -> Desk {
    let desk = Desk::with("lab.toml", LAB);
    desk.write("token", TOKEN);
    desk.set_mode("token", 0o600);
    desk.text("live --new-key session.key");
    desk
}

/// Session with a key, and the address at which it listens.
fn session(desk: &Desk, words: &str) -> (Running, SocketAddr) {
    let line = format!("live lab.toml --listen 127.0.0.1:0 --key-file session.key --token-file token --control {UNHURRIED} {words}");
    let running = Running::begin(desk.command(&line));
    let said = running.said("listening on ");
    assert!(said.contains(" for left at place 0: session 7, 1 axis, with its key, scene "), "{said}");
    (running, said.split_once(' ').unwrap().0.parse().unwrap())
}

/// Waits until the state of the session says so, and returns the state.
fn wait(control: &Client, what: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let begin = Instant::now();
    loop {
        let state = control.json("GET", "/api/state", "");
        if is_so(&state) {
            return state;
        }
        assert!(begin.elapsed() < PATIENCE, "not {what}: {state:#}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn is_present(state: &Value) -> bool {
    state["peers"][0]["status"] == "present"
}

#[test]
fn with_the_key_it_takes_part_and_after_a_loss_of_power_it_joins_again() {
    let desk = desk();
    let (session, address) = session(&desk, "--json");
    let control = Client::of(&session);
    let join = |words: &str| {
        Running::begin(desk.command(&format!("join {address} lab.toml --peer left --device simulated --key-file session.key {UNHURRIED} {words}")))
    };
    let first = join("");
    assert_eq!(first.said("the session at "), format!("{address} takes part with left"));
    let state = wait(&control, "present", is_present);
    let joined = &state["peers"][0]["joined"];
    assert_eq!(
        (joined["device"].as_str(), joined["address"].as_str(), joined["lost"].as_u64()),
        (Some("sim"), Some("127.0.0.1"), Some(0)),
        "{state:#}"
    );
    // A killed program says nothing: the session notices the silence, and the others fade.
    first.kill();
    wait(&control, "stale", |state| state["peers"][0]["status"] == "stale");
    let second = join("--out left");
    wait(&control, "present again", is_present);
    wait(&control, "in motion", |state| state["peers"][1]["position"][0].as_f64().is_some_and(|position| position.abs() > 1e-4));
    let outcome = second.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    for part in [
        &format!("Two computers: left at {address}, with the device simulated\n"),
        "\n  the run is valid\n",
        " sent in 1 joining\n",
        "\n  right: ",
        "drift not known before 20s",
        "\n  left ends at ",
    ] {
        assert!(outcome.stdout.contains(part), "no {part:?} in {}", outcome.stdout);
    }
    let trajectory = desk.read("left/trajectory.csv");
    let mut rows = trajectory.lines();
    assert_eq!(rows.next(), Some("t,peer,xh,vh,xo,vo,xd,vd,fc,ft"));
    // Tick 0 is the welcome, and every tick is a row of this peer alone.
    for (tick, row) in (0_u32..).zip(rows) {
        let (t, rest) = row.split_once(',').unwrap();
        assert!((t.parse::<f64>().unwrap() - f64::from(tick) * 1e-3).abs() < 1e-12 && rest.starts_with("left,"), "{row}");
    }
    assert!(desk.read("left/lateness.csv").contains("\ntick,"));
    let document = parse(&session.end_by("-INT").stdout);
    let seat = &document["peers"][0]["seat"];
    assert_eq!((seat["joined"].as_u64(), document["door"]["joinings"].as_u64()), (Some(2), Some(2)), "{document:#}");
}

/// Two programs as the same peer: the second one says so and ends, and takes the seat when the first one has gone.
fn a_second_join_is_told(key: &str) {
    let desk = desk();
    // A program that is kept waiting by a busy machine must not lose its seat.
    let silence = "--set peers.left.silence.after=4s";
    let session = Running::begin(desk.command(&format!("live lab.toml --listen 127.0.0.1:0 {key} {silence} --json {UNHURRIED}")));
    let said = session.said("listening on ");
    let address = said.split_once(' ').unwrap().0;
    let line = format!("join {address} lab.toml --peer left --device simulated {key} {silence} {UNHURRIED}");
    let takes_part = || {
        let join = Running::begin(desk.command(&line));
        assert_eq!(join.said("the session at "), format!("{address} takes part with left"));
        join
    };
    let first = takes_part();
    let taken = format!("the seat of left is taken: another program has joined the session at {address} as left");
    let way_out = "End that program, whose address the session's report and page show, or join another session";
    let second = desk.cohaptic(&line);
    second.assert_refused(3, &[&format!("{taken}, for 5s now. {way_out}")]);
    assert!(second.stderr.contains(&format!("{taken}; waiting")) && !second.stderr.contains("takes part"), "{}", second.stderr);
    // An end before that time is no success either.
    desk.cohaptic(&format!("{line} --for 800ms")).assert_refused(3, &[&format!("{taken}. {way_out}")]);
    // A script reads the same sentence in a document.
    let outcome = desk.cohaptic(&format!("{line} --for 800ms --json"));
    outcome.assert_refused(3, &[&taken]);
    assert_eq!(parse(&outcome.stdout)["message"], format!("{taken}. {way_out}"), "{}", outcome.stdout);
    // A killed program holds its seat for the silence. The next program waits that long.
    first.kill();
    let outcome = takes_part().end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    let document = parse(&session.end_by("-INT").stdout);
    let refused = document["door"]["refused"]["seat-taken"].as_u64();
    assert!(refused > Some(0) && document["peers"][0]["seat"]["joined"] == 2, "{document:#}");
}

#[test]
fn a_second_join_with_the_key_is_told_that_the_seat_is_taken() {
    a_second_join_is_told("--key-file session.key");
}

#[test]
fn a_second_join_without_a_key_is_told_that_the_seat_is_taken() {
    a_second_join_is_told("");
}

/// A session that ends, one that is started again, and one that comes back with another scene.
#[test]
fn a_join_outlives_its_session_and_says_how_the_session_is() {
    let desk = desk();
    let (first, address) = session(&desk, "");
    let join = Running::begin(desk.command(&format!("join {address} lab.toml --peer left --device simulated --key-file session.key {UNHURRIED}")));
    join.said("the session at ");
    first.end_by("-INT");
    let silent = join.said("nothing new from the session for 1 s: no force");
    assert!(silent.contains("it has ended, was started again with another scene or key, or the network"), "{silent}");
    let again = |words: &str| Running::begin(desk.command(&format!("live lab.toml --listen {address} --key-file session.key {UNHURRIED} {words}")));
    let other = again("--set link.delay=25ms");
    let told = other.said("127.0.0.1:");
    assert!(told.contains(" asked to be left with another scene: "), "{told}");
    other.end_by("-INT");
    let second = again("");
    join.said("the session is back: the force rises again");
    let outcome = join.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    for part in [" sent in 2 joinings\n", "the session was silent for a second or more 1 time\n"] {
        assert!(outcome.stdout.contains(part), "no {part:?} in {}", outcome.stdout);
    }
    second.end_by("-INT");
}

#[cfg(feature = "inverse3")]
#[test]
fn an_inverse3_joins_and_both_answers_tell_its_exchanges() {
    let desk = desk();
    desk.write("lab.toml", LAB.replace("falcon = {", "inverse3 = {"));
    let (session, address) = session(&desk, "");
    let control = Client::of(&session);
    let line = format!("join {address} lab.toml --peer left --device inverse3 --key-file session.key {UNHURRIED}");
    let join = Running::begin(desk.command(&line));
    let state = wait(&control, "present", is_present);
    assert_eq!(state["peers"][0]["joined"]["device"], "inverse3", "{state:#}");
    let outcome = join.end_by("-INT");
    assert_eq!(outcome.status, Some(130), "{}", outcome.stderr);
    for part in ["with the device inverse3\n", "\n  device of left: ", " exchanges per second, ", "\n  device of left: replies take "] {
        assert!(outcome.stdout.contains(part), "no {part:?} in {}", outcome.stdout);
    }

    let outcome = desk.cohaptic(&format!("{line} --for 500ms --out left --json"));
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let document = parse(&outcome.stdout);
    assert_eq!((&document["schema"], &document["title"]), (&json!("cohaptic/join"), &json!("Two computers")), "{document:#}");
    assert_eq!((&document["session"], &document["ending"]), (&json!(address.to_string()), &json!("complete")), "{document:#}");
    // Replies may be late on a busy machine, so that the run may be valid or not.
    assert!(document["valid"].is_boolean(), "{document:#}");
    assert!(outcome.stderr.contains(&format!("session 7, scene {}\n", document["scene"].as_str().unwrap())), "{}", outcome.stderr);
    // Every tick has a lateness and a time of the device.
    let ticks = &document["ticks"];
    assert!((1..=500).contains(&ticks.as_u64().unwrap()), "{document:#}");
    assert_eq!([&document["lateness_us"]["count"], &document["device_us"]["count"]], [ticks; 2], "{document:#}");
    assert_eq!((&document["late_ticks"], document["joinings"].as_u64() >= Some(1)), (&json!(0), true), "{document:#}");
    let peer = &document["peer"];
    assert_eq!((&peer["kind"], &peer["name"], &peer["device_error"]), (&json!("inverse3"), &json!("left"), &json!(null)), "{document:#}");
    assert!(peer["position_m"].is_number() && peer["device"]["position_m"].is_number() && peer["gate"]["zeroed"].is_object(), "{document:#}");
    assert!(peer["exchanges"]["readings"].as_u64() > Some(0) && peer["exchanges"]["reply_p99_us"].is_number(), "{document:#}");
    let senders = document["senders"].as_array().unwrap();
    let counts = |sender: &Value| [&sender["out_of_order"], &sender["lost"]].map(Value::as_u64);
    assert_eq!((senders.len(), &senders[0]["name"], counts(&senders[0])), (1, &json!("right"), [Some(0); 2]), "{document:#}");
    assert_eq!((senders[0]["taken"].as_u64() > Some(0), &senders[0]["drift_ppm"]), (true, &json!(null)), "{document:#}");
    let files: Vec<&str> = document["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    assert_eq!(files, ["left/trajectory.csv", "left/lateness.csv"]);
}

#[cfg(feature = "inverse3")]
#[test]
fn without_a_key_a_device_that_is_not_there_is_the_reason() {
    let desk = desk();
    // Nobody listens at port 1, so that the service of the device is not there. The session is not asked, because nothing is sent without the device.
    desk.write("lab.toml", LAB.replace(r#"falcon = { device = "simulated" }"#, r#"inverse3 = { service = "ws://127.0.0.1:1/" }"#));
    let outcome = desk.cohaptic(&format!("join 127.0.0.1:7400 lab.toml --peer left --device inverse3 --for 300ms {UNHURRIED}"));
    outcome.assert_refused(3, &["nothing is sent to 127.0.0.1:7400 yet: the inverse3 of left is not there", "cohaptic inverse3 probe says why"]);
    assert!(!outcome.stderr.contains("Possible reasons"), "{}", outcome.stderr);
}

#[test]
fn a_wrong_key_scene_place_or_kind_is_a_sentence() {
    let desk = desk();
    // The length of the session is no part of the scene that both computers must have.
    let (session, address) = session(&desk, "--for 50min");
    desk.text("live --new-key other.key");
    let join = |words: &str| desk.cohaptic(&format!("join {address} lab.toml --device simulated {UNHURRIED} {words}"));
    let left = "--peer left --key-file session.key";
    let no_welcome =
        &["no welcome from 127.0.0.1:", "Possible reasons: no session listens there", "another one than --key-file", "has another scene than"];
    let with_other_key = join("--for 2.5s --peer left --key-file other.key");
    with_other_key.assert_refused(3, no_welcome);
    // After two seconds `join` lists the reasons and goes on asking. The error at the end lists the reasons again.
    assert_eq!(with_other_key.stderr.matches("Possible reasons").count(), 2, "{}", with_other_key.stderr);
    join(&format!("{left} --for 300ms --set link.delay=25ms")).assert_refused(3, no_welcome);
    let other = session.said("127.0.0.1:");
    assert!(other.contains(" asked to be left with another scene: ") && other.contains(", and this session's is "), "{other}");
    // The length of this peer's part is its own, too, and so is the choice of the device.
    let joined = join(&format!("{left} --for 300ms --set peers.left.falcon.device=first"));
    assert_eq!(joined.status, Some(0), "{}", joined.stderr);
    // A session with a key does not answer a `join` without a key, and the key is among the possible reasons.
    join("--peer left --for 300ms").assert_refused(3, &["nothing from 127.0.0.1:", "the session has a key, which --key-file must name here, too"]);

    // A file that is not there has the status of a scene that is not there. A file without a key, and a key that others may read, are wrong inputs.
    desk.write("empty.key", "");
    desk.set_mode("empty.key", 0o600);
    desk.set_mode("other.key", 0o644);
    let open = "other.key can be opened by others than its owner (mode 644); close it with: chmod 600 other.key";
    for (file, status, part) in
        [("gone.key", 3, "cannot read the key file gone.key"), ("empty.key", 2, "empty.key is not a key file"), ("other.key", 2, open)]
    {
        join(&format!("--peer left --key-file {file}")).assert_refused(status, &[part]);
        desk.cohaptic(&format!("live lab.toml --key-file {file} {UNHURRIED}")).assert_refused(status, &[part]);
    }
    join("--peer third --key-file session.key").assert_refused(2, &["--peer third: ", "lab.toml has no such peer: expected left"]);
    let kind = "in lab.toml its kind is \"simulated\", so the session itself computes it: expected kind = \"udp\"";
    join("--peer right --key-file session.key").assert_refused(2, &["--peer right: ", kind]);
    join(&format!("{left} --set coordination.strategy=extrapolated"))
        .assert_refused(2, &["left: the coordination extrapolates samples", "one-way times"]);
    let change = "--set 'timeline=[{at=\"1s\",coordination={stiffness=1.0}}]'";
    join(&format!("{left} {change}")).assert_refused(2, &["the timeline changes the gains of the coordination"]);
    let away = desk.cohaptic("join 192.0.2.7:7400 lab.toml --peer left --device simulated");
    away.assert_refused(2, &["whoever answers at 192.0.2.7:7400 could pull at the device", "--key-file", "--allow-remote"]);

    let report = session.end_by("-INT").stdout;
    for part in [" other-scene", " asked to be left with another scene: ", ", of sim at 127.0.0.1"] {
        assert!(report.contains(part), "no {part:?} in {report}");
    }
}

/// Network of its own, as a process that does nothing in it.
struct Network(Child);

impl Network {
    fn new() -> Self {
        let mut command = Command::new("unshare");
        command.args(["-n", "--", "sh", "-c", "echo ready; exec sleep 3600"]);
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(line, "ready\n");
        Self(child)
    }

    fn path(&self) -> String {
        format!("/proc/{}/ns/net", self.0.id())
    }

    /// Begins a command of the program in this network.
    fn begin(&self, desk: &Desk, line: &str) -> Running {
        let cohaptic = desk.command(line);
        let mut command = Command::new("nsenter");
        command.arg(format!("--net={}", self.path())).arg("--").arg(cohaptic.get_program()).args(cohaptic.get_args());
        command.current_dir(cohaptic.get_current_dir().unwrap());
        Running::begin(command)
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

#[test]
fn two_computers_with_a_line_between_them_and_a_falcon_at_one_of_them() {
    if !is_inside("integration::join::two_computers_with_a_line_between_them_and_a_falcon_at_one_of_them") {
        return;
    }
    if !Command::new("nsenter").arg("-V").stdout(Stdio::null()).status().is_ok_and(|status| status.success()) {
        println!("skipped: there is no nsenter");
        return;
    }
    let desk = desk();
    let (left, right) = (Network::new(), Network::new());
    desk.write(
        "line.toml",
        format!(
            "[router]\nseed = 1\ndefault = \"wan\"\n[left]\ntun = \"left0\"\naddresses = [\"10.1.0.1/24\"]\nnamespace = \"{}\"\n\
             [right]\ntun = \"right0\"\naddresses = [\"10.1.0.2/24\"]\nnamespace = \"{}\"\n[links.wan]\ndelay = \"5ms\"\nloss = \"10%\"\n",
            left.path(),
            right.path()
        ),
    );
    let router = Running::begin(desk.command(&format!("router line.toml {UNHURRIED}")));
    router.said("between left ");
    let session = right.begin(&desk, &format!("live lab.toml --listen 10.1.0.2:7400 --key-file session.key --json --out session {UNHURRIED}"));
    session.said("listening on 10.1.0.2:7400 for left at place 0");
    let join = || {
        let words = "join 10.1.0.2:7400 lab.toml --peer left --device falcon --key-file session.key --for 3s";
        let join = left.begin(&desk, &format!("{words} {UNHURRIED}"));
        join.said("homing the simulated Falcons of left");
        assert_eq!(join.said("the session at "), "10.1.0.2:7400 takes part with left");
        join
    };
    // A killed program says nothing. The next one takes its place, from another port.
    join().kill();
    let outcome = join().end();
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    for part in ["\n  the run is valid\n", "\n  reading and holding the device took, a tick: p50 "] {
        assert!(outcome.stdout.contains(part), "no {part:?} in {}", outcome.stdout);
    }
    let outcome = session.end_by("-INT");
    let document = parse(&outcome.stdout);
    let seat = &document["peers"][0]["seat"];
    // Of 375 samples in 3 s the line loses a tenth. The killed program sent some before.
    let taken = seat["taken"].as_u64().unwrap();
    assert!((200..500).contains(&taken) && seat["joined"].as_u64() >= Some(1), "{document:#}");
    // The record of the session is replayed as any other.
    desk.text("run lab.toml --inputs session/inputs.csv --out again");
    assert_eq!(desk.read("session/trajectory.csv"), desk.read("again/trajectory.csv"));
    drop(router);
}
