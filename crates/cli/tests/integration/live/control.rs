//! Live control of a real session: the shown state is right, and each change stands in the record and in its replay.

use std::collections::BTreeMap;

use serde_json::json;

use super::http::Control;
use super::records::{assert_replays, inputs, packets};
use super::session::Session;
use super::wait_for;
use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

fn milliseconds(count: u64) -> u64 {
    count * 1_000_000
}

fn refuses(control: &Control, body: &str, part: &str) {
    let (status, answer) = control.ask("PATCH", "/api/links/0", body);
    assert_eq!(status, 422, "{answer}");
    assert!(answer.contains(part), "{answer}");
}

#[test]
fn a_link_that_is_changed_is_another_link_from_then_on() {
    let desk = Desk::with("two.toml", TWO);
    let mut session = Session::begin(&desk, "two.toml --json --out out --for 1h --control");
    let control = session.control();
    control.wait("packets", |state| state["links"][0]["delivered"].as_u64() > Some(10));
    let before = control.get("/api/links/0");
    assert_eq!(before["keys"]["delay"], "24ms");
    refuses(&control, r#"{"dlay": "50ms"}"#, "delay");
    refuses(&control, r#"{"delay": "-1ms"}"#, "delay");
    refuses(&control, "{}", "");
    assert_eq!(control.get("/api/links/0")["keys"], before["keys"], "what is refused changes nothing");
    let stranger = Control { token: "0".repeat(40), ..control.clone() };
    for (method, path, body) in
        [("GET", "/api/state", ""), ("GET", "/metrics", ""), ("GET", "/", ""), ("PATCH", "/api/links/0", r#"{"delay":"1ms"}"#)]
    {
        assert_eq!(stranger.ask(method, path, body).0, 401, "{method} {path}");
    }
    let (status, answer) = control.ask("PATCH", "/api/links/0", r#"{"delay": "60ms"}"#);
    assert_eq!(status, 200, "{answer}");
    assert!(answer.contains("60ms"), "{answer}");
    wait_for("packets of the changed link", || {
        // Of the link's latest packets, none is from before.
        (control.get("/api/histograms").to_string().len() > 2 && control.state()["links"][0]["recent_delay"]["p50_s"] == json!(0.06)).then_some(())
    });
    assert_metrics(&control);
    let document = session.end();
    assert_eq!(document["ending"], "interrupted");
    has_changed_once(&desk);
    assert_replays(&desk, "two.toml", "--set scene.duration=1h");
}

/// Checks that `inputs.csv` has one change, and that each packet sent from then on has the new delay, and each earlier packet the old delay, to the nanosecond.
fn has_changed_once(desk: &Desk) {
    let inputs = inputs(desk, "out");
    assert_eq!(inputs.iter().map(|row| row.kind.as_str()).collect::<Vec<_>>(), ["link", "end"]);
    let change = &inputs[0];
    assert!(change.peer == "left" && change.value.contains("60ms"), "{change:?}");
    let mut delays: BTreeMap<(String, bool), Vec<u64>> = BTreeMap::new();
    for packet in packets(desk, "out") {
        // What comes from outside at an instant counts before all else at it.
        delays.entry((packet.link, packet.sent >= change.at)).or_default().push(packet.arrived.unwrap() - packet.sent);
    }
    for ((link, later), delays) in delays {
        let expected = if link == "left->right" && later { 60 } else { 24 };
        assert!(delays.iter().all(|delay| *delay == milliseconds(expected)), "{link}, {}", if later { "later" } else { "before" });
        assert!(delays.len() > 5, "{link} had packets");
    }
}

/// Prometheus text: every line is a comment or a name, labels and a number, and says what the state says.
fn assert_metrics(control: &Control) {
    let before = control.delivered(0);
    let (status, text) = control.ask("GET", "/metrics", "");
    let after = control.delivered(0);
    assert_eq!(status, 200);
    let mut values = BTreeMap::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let (series, value) = line.rsplit_once(' ').unwrap_or_else(|| panic!("{line}"));
        let name = series.split('{').next().unwrap();
        assert!(
            name.starts_with("cohaptic_") && name.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_'),
            "{line}"
        );
        assert!(series.len() == name.len() || series.ends_with('}'), "{line}");
        assert!(values.insert(series.to_owned(), value.parse::<f64>().unwrap()).is_none(), "{line} stands twice");
    }
    let delivered = values[r#"cohaptic_link_delivered_packets_total{link="left->right",from="left",to="right"}"#];
    #[expect(clippy::cast_precision_loss, reason = "some hundred packets")]
    let (before, after) = (before as f64, after as f64);
    assert!(before <= delivered && delivered <= after, "{before} {delivered} {after}");
    assert_eq!(values[r#"cohaptic_run_info{kind="live",title="Two users"}"#], 1.0);
    assert_eq!(values[r#"cohaptic_peer_status{peer="left",status="here"}"#], 1.0);
}

/// Keys that name files are refused without a folder. With a folder, only the files of the folder can be read, and no content of a file is shown.
#[test]
fn a_change_names_files_of_the_folder_alone_and_is_shown_none_of_them() {
    let scene = format!("{TWO}\n[[links]]\nfrom = \"right\"\nto = \"left\"\ntrace = \"own.trace\"\n");
    let desk = Desk::with("two.toml", &scene);
    for file in ["own.trace", "given/up.trace", "beside/secret.trace"] {
        desk.write(file, "0\n20\n40\n");
    }
    desk.write("given/shadow", "root:secret:19000\n");
    assert!(std::process::Command::new("mkfifo").arg(desk.path("given/pipe")).status().unwrap().success());
    let change = |control: &Control, link: usize, key: &str, value: &str| {
        control.ask("PATCH", &format!("/api/links/{link}"), &json!({ (key): value }).to_string())
    };
    let mut session = Session::begin(&desk, "two.toml --json --for 1h --control");
    let control = session.control();
    for (key, value) in
        [("replay", "/etc/passwd"), ("trace", "given/pipe"), ("jitter", "{ sd = \"1ms\", distribution = { table = \"given/shadow\" } }")]
    {
        let (status, answer) = change(&control, 0, key, value);
        assert_eq!(status, 422, "{answer}");
        assert!(answer.contains("--control-files DIR") && !answer.contains("secret") && !answer.contains("root"), "{answer}");
    }
    assert_eq!(change(&control, 1, "delay", "5ms").0, 200, "the file that the scene names is not named by the change");
    assert_eq!(change(&control, 1, "trace", "own.trace").0, 200, "what is shown can be sent back");
    session.end();
    let mut session = Session::begin(&desk, "two.toml --json --for 1h --control --control-files given");
    let control = session.control();
    let (status, answer) = change(&control, 0, "trace", "given/up.trace");
    assert_eq!(status, 200, "{answer}");
    for path in ["beside/secret.trace", "given/../beside/secret.trace", "/etc/passwd", "given/none"] {
        let (status, answer) = change(&control, 0, "trace", path);
        assert!(status == 422 && answer.contains("--control-files"), "{path}: {answer}");
    }
    // Without a writer at its other end, a pipe that is waited for stops the server for ever.
    let (status, answer) = change(&control, 0, "trace", "given/pipe");
    assert!(status == 422 && answer.contains("not a regular file"), "{answer}");
    let (status, answer) = change(&control, 0, "replay", "given/shadow");
    assert!(status == 422 && answer.contains("line 1") && !answer.contains("secret"), "{answer}");
    session.end();
    desk.cohaptic("live two.toml --control --control-files none").assert_refused(2, &["--control-files none", "expected a folder"]);
}

#[test]
fn the_token_may_be_ones_own() {
    let desk = Desk::with("two.toml", TWO);
    desk.write("token", "a-token-of-our-own-0123456789\n");
    // As the file of a session key: whoever can read it can change the links.
    desk.set_mode("token", 0o644);
    for line in ["live two.toml", "play two.toml"] {
        let line = format!("{line} --no-priority --for 1ms --control --token-file token");
        desk.cohaptic(&line).assert_refused(2, &["the token file token can be opened by others than its owner (mode 644)", "chmod 600 token"]);
    }
    desk.set_mode("token", 0o600);
    let mut session = Session::begin(&desk, "two.toml --json --for 1h --control 127.0.0.1:0 --token-file token");
    let control = session.control();
    assert_eq!(control.token, "a-token-of-our-own-0123456789");
    assert_eq!(control.state()["kind"], "live");
    session.end();
    desk.write("short", "abc");
    desk.set_mode("short", 0o600);
    desk.cohaptic("live two.toml --control --token-file short").assert_refused(2, &["short"]);
}

/// Without a word about control nothing listens.
#[test]
fn nothing_is_served_unless_asked_for() {
    let desk = Desk::with("two.toml", TWO);
    assert!(desk.cohaptic("live two.toml --for 50ms").stderr.is_empty());
}
