//! Replays of a live session with a scene that differs from the scene of the session.

use serde_json::json;

use crate::integration::desk::{Desk, parse};
use crate::integration::scenes::TWO;

/// Returns a scene with a hand whose force is in a file.
fn with_hand() -> String {
    TWO.replace("{ force = 1.5 }", "{ file = \"hand.csv\" }")
}

/// Returns a desk with a recorded session of 40 ms in `out`.
fn session() -> Desk {
    let desk = Desk::with("two.toml", &with_hand());
    desk.write("hand.csv", "t,fx\n0,1.5\n1,1.5\n");
    desk.text("live two.toml --for 40ms --no-priority --out out --set link.loss=10%");
    desk
}

/// Overrides of the recorded session.
const SET: &str = "--set link.loss=10% --set scene.duration=40ms";

const WAY_OUT: &str = "expected the scene and every --set of the session, which its summary ends with; --force replays it all the same\n";

fn message(differences: &str) -> String {
    format!(
        "error: out/inputs.csv is the record of a session with another scene than two.toml with these overrides. What differs:\n{differences}{WAY_OUT}"
    )
}

#[test]
fn a_scene_that_says_the_same_is_the_same() {
    let desk = session();
    // What changes nothing that happens: expectations, the title, comments, the way in which a value is written, the name of the file.
    let same = with_hand().replace("\"24ms\"", "\"24000us\" # as before").replace("Two users", "Others") + "\n[expect]\nstable = true\n";
    desk.write("same.toml", same);
    desk.text(&format!("run same.toml {SET} --inputs out/inputs.csv --no-plot"));
}

/// The records of a session are in logical time, and a replay writes the same bytes. So the pictures, which are drawn from the records, are equal too.
#[test]
fn pictures_of_a_session_are_those_of_its_replay() {
    let desk = session();
    desk.text(&format!("run two.toml {SET} --inputs out/inputs.csv --out again"));
    for file in ["positions.svg", "forces.svg", "network.svg"] {
        let picture = desk.read(&format!("out/{file}"));
        assert_eq!(cohaptic_picture::testing::faults(&picture), [""; 0], "{file}");
        assert!(picture.contains("<path class=\"line s0\""), "{file} shows something");
        assert_eq!(picture, desk.read(&format!("again/{file}")), "{file}");
    }
    // Other inputs are other pictures.
    desk.text("run two.toml --set link.delay=8ms --set scene.duration=40ms --out other");
    assert_ne!(desk.read("out/network.svg"), desk.read("other/network.svg"));
}

#[test]
fn another_scene_is_refused_key_by_key() {
    for (change, set, differences) in [
        (("", ""), "--set link.loss=10%", "  scene.duration: \"40ms\" in the record, \"200ms\" now\n"),
        (("", ""), "--set scene.duration=40ms", "  link.loss: \"10%\" in the record, not there now\n"),
        (("\"24ms\"", "\"25ms\""), SET, "  link.delay: \"24ms\" in the record, \"25ms\" now\n"),
        (("name = \"right\"", "name = \"right\"\ncontact = \"none\""), SET, "  peers.right.contact: not in the record, \"none\" now\n"),
        (
            ("mass = 0.3", "mass = 0.4"),
            "--set scene.duration=40ms",
            "  link.loss: \"10%\" in the record, not there now\n  object.mass: 0.3 in the record, 0.4 now\n",
        ),
        (
            ("[link]", "[[timeline]]\nat = \"10ms\"\nlink = \"all\"\nset = { loss = 0.5 }\n\n[link]"),
            SET,
            "  timeline.0.at: not in the record, \"10ms\" now\n  timeline.0.link: not in the record, \"all\" now\n  \
               timeline.0.set.loss: not in the record, 0.5 now\n",
        ),
    ] {
        let desk = session();
        desk.write("two.toml", with_hand().replacen(change.0, change.1, 1));
        let outcome = desk.cohaptic(&format!("run two.toml {set} --inputs out/inputs.csv --out again"));
        assert_eq!((outcome.status, outcome.stdout.as_str(), outcome.stderr), (Some(2), "", message(differences)));
        assert!(!desk.path("again").exists());
    }
}

#[test]
fn a_file_that_the_scene_names_counts() {
    let desk = session();
    desk.write("hand.csv", "t,fx\n0,1.5\n1,1.25\n");
    let outcome = desk.cohaptic(&format!("run two.toml {SET} --inputs out/inputs.csv"));
    assert_eq!((outcome.status, outcome.stderr), (Some(2), message("  the file hand.csv: something else in the record than now\n")));
}

/// Two peers turn an object, one by torques in a file: the replay is that of the session to the last bit, and with other torques it is another.
#[test]
fn torques_of_a_file_are_replayed() {
    let desk = Desk::with(
        "turn.toml",
        "scene = { duration = \"1s\", axes = 3 }\nobject = { mass = 0.3, inertia = 1e-4 }\nlink = { delay = \"8ms\" }\n\
         coordination = { strategy = \"average-position\", stiffness = 1000, damping = 5, update = \"8ms\" }\n\
         peer = { device = { mass = 0.1, damping = 5, inertia = 1e-5 }, coupling = { stiffness = 3500, damping = 5, rotational-stiffness = 1 } }\n\
         peers = [{ name = \"left\", hand = { file = \"hand.csv\" } }, { name = \"right\" }]\n",
    );
    desk.write("hand.csv", "t,fx,fy,fz,tx,ty,tz\n0,0,0,0,0,0,0\n0.04,0,1,0,0.01,0,0.02\n");
    desk.text("live turn.toml --for 40ms --no-priority --out out");
    let again = "run turn.toml --set scene.duration=40ms --inputs out/inputs.csv --no-plot --out";
    desk.text(&format!("{again} again"));
    let session = desk.read("out/trajectory.csv");
    assert_eq!(session, desk.read("again/trajectory.csv"));
    desk.write("hand.csv", "t,fx,fy,fz,tx,ty,tz\n0,0,0,0,0,0,0\n0.04,0,1,0,0.01,0,0.03\n");
    assert_eq!(desk.cohaptic(&format!("{again} other --force")).status, Some(0));
    assert_ne!(session, desk.read("other/trajectory.csv"));
}

#[test]
fn force_replays_it_and_says_what_differs() {
    let desk = session();
    let line = format!("run two.toml {SET} --set link.delay=8ms --inputs out/inputs.csv --force --no-plot");
    let outcome = desk.cohaptic(&line);
    let warning = "warning: out/inputs.csv is the record of a session with another scene than two.toml with these overrides. What differs:\n  \
                   link.delay: \"24ms\" in the record, \"8ms\" now\n";
    assert_eq!((outcome.status, outcome.stderr.as_str()), (Some(0), warning));
    assert!(outcome.stdout.contains("40ms simulated, 40 ticks"), "{}", outcome.stdout);
    let document = parse(&desk.cohaptic(&format!("{line} --json")).stdout);
    assert_eq!(document["replayed_otherwise"], serde_json::json!(["link.delay: \"24ms\" in the record, \"8ms\" now"]));
    // The same scene says nothing.
    let document = desk.json(&format!("run two.toml {SET} --inputs out/inputs.csv --json --force"));
    assert!(document.get("replayed_otherwise").is_none());
}

/// Records of earlier versions do not contain the scene of the session, so they cannot be checked.
#[test]
fn a_record_that_does_not_know_its_scene_is_refused_without_force() {
    let desk = session();
    let record: String = desk
        .read("out/inputs.csv")
        .lines()
        .filter(|line| !["0,program", "0,scene", "0,file", "0,key"].iter().any(|row| line.starts_with(row)))
        .map(|line| if line.starts_with("0,closed") { "0,closed,,,0\n".to_owned() } else { format!("{line}\n") })
        .collect();
    desk.write("out/inputs.csv", record);
    let line = format!("run two.toml {SET} --inputs out/inputs.csv --no-plot");
    let unknown = "  unknown: the record is of an older version, which did not keep the scene that it was made with\n";
    let outcome = desk.cohaptic(&line);
    assert_eq!((outcome.status, outcome.stderr), (Some(2), message(unknown)));
    let outcome = desk.cohaptic(&format!("{line} --force"));
    assert_eq!(outcome.status, Some(0));
    assert!(outcome.stderr.starts_with("warning: ") && outcome.stderr.ends_with(unknown), "{}", outcome.stderr);
}

/// The record of a session in which somebody changed a link at 9 ms and ended it at 12 ms.
fn cut_at_12_ms(desk: &Desk) -> Vec<String> {
    let mut lines: Vec<String> = desk.read("out/inputs.csv").lines().map(str::to_owned).collect();
    let closing = lines.pop().unwrap();
    assert_eq!(closing, format!("0,closed,,,{}", lines.len() - 1), "nothing came in");
    lines.extend(["9000000,link,left,right,\"{ delay = \"\"8ms\"\" }\"".to_owned(), "12000000,end,,,".to_owned()]);
    let rows = lines.len() - 1;
    lines.push(format!("12000000,closed,,,{rows}"));
    lines
}

#[test]
fn a_record_that_is_cut_short_is_refused_without_force() {
    let desk = session();
    let lines = cut_at_12_ms(&desk);
    let line = format!("run two.toml {SET} --inputs out/inputs.csv --no-plot --json");
    let replayed = |lines: &[String], force: &str| {
        desk.write("out/inputs.csv", lines.join("\n"));
        desk.cohaptic(&format!("{line}{force}"))
    };
    let whole = replayed(&lines, "");
    assert_eq!((whole.status, whole.stderr.as_str(), &parse(&whole.stdout)["duration_s"]), (Some(0), "", &json!(0.012)));
    // Without its last two lines, and with half of the line before.
    let last = lines.len() - 3;
    let mut cut = lines[..=last].to_vec();
    cut[last].pop();
    let said =
        format!("it is cut short: its last whole line, {last}, at 0s of the session, does not close it. Expected 0,closed,,,{} behind it", last - 1);
    replayed(&cut, "").assert_refused(2, &["error: out/inputs.csv: ", &said, "; --force replays it up to its last whole line\n"]);
    let forced = replayed(&cut, " --force");
    assert!(forced.status == Some(0) && forced.stderr.starts_with("warning: out/inputs.csv: it is cut short"), "{forced:?}");
    let document = parse(&forced.stdout);
    assert_eq!((&document["ending"], &document["duration_s"]), (&json!("interrupted"), &json!(0.0)));
    assert!(document["replayed_otherwise"][0].as_str().unwrap().starts_with("it is cut short"), "{document:#}");
    // A line in the middle is missing.
    let mut holed = lines;
    holed.remove(3);
    let said = format!("it is not complete: the last line says that {} rows stand before it, and there are {}", last + 1, last);
    replayed(&holed, "").assert_refused(2, &[&said, "; --force replays the rows that are there\n"]);
    let forced = replayed(&holed, " --force");
    assert_eq!((forced.status, &parse(&forced.stdout)["duration_s"]), (Some(0), &json!(0.012)));
}

#[test]
fn a_record_that_is_damaged_is_refused_at_its_line() {
    let desk = session();
    desk.write("out/inputs.csv", desk.read("out/inputs.csv").replacen("0,scene,,,", "0,scene,,,x", 1));
    let outcome = desk.cohaptic(&format!("run two.toml {SET} --inputs out/inputs.csv"));
    outcome.assert_refused(2, &["error: out/inputs.csv: line 3, column value: found \"x", "expected 16 hexadecimal digits"]);
}
