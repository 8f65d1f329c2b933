//! Scenes and files that cannot be used: the message says where, and nothing is run or written.

use crate::integration::desk::Desk;
use crate::integration::scenes::{PLANE, TWO};

/// A scene of which one piece is replaced, and what the message must say: the place, the key, and the line with a caret below.
struct Mistake {
    of: &'static str,
    by: &'static str,
    place: &'static str,
    key: &'static str,
    line: &'static str,
}

const MISTAKES: &[Mistake] = &[
    Mistake { of: "mass = 0.3\n", by: "mass = 0.3\nmas = 0.3\n", place: ":8:1: ", key: "object.mas: unknown key", line: "8 | mas = 0.3\n  | ^^^" },
    Mistake {
        of: "\"24ms\"",
        by: "\"24 parsecs\"",
        place: ":27:9: ",
        key: "link.delay: unknown unit",
        line: "27 | delay = \"24 parsecs\"\n   |         ^^^^^^^^^^^^",
    },
    Mistake { of: "\"24ms\"", by: "24", place: ":27:9: ", key: "link.delay: ", line: "27 | delay = 24\n   |         ^^" },
    Mistake { of: "mass = 0.3\n", by: "mass = nan\n", place: ":7:8: ", key: "object.mass: ", line: "7 | mass = nan\n  |        ^^^" },
    Mistake { of: "1000.0", by: "inf", place: ":11:13: ", key: "coordination.stiffness: ", line: "11 | stiffness = inf\n   |             ^^^" },
    Mistake { of: "mass = 0.1,", by: "mass = -0.1,", place: ":16:21: ", key: "device.mass: ", line: "^^^^" },
    Mistake { of: "\"24ms\"", by: "\"24ms\"\nloss = 1.5", place: ":28:8: ", key: "link.loss: ", line: "28 | loss = 1.5\n   |        ^^^" },
    Mistake {
        of: "[link]",
        by: "[[links]]\nfrom = \"left\"\nto = \"nobody\"\n[link]",
        place: ":28:6: ",
        key: "to: ",
        line: "28 | to = \"nobody\"\n   |      ^^^^^^^^",
    },
    Mistake { of: "damping   = 20.0", by: "damping   = 20.0.0", place: ":12:", key: "", line: "12 | damping   = 20.0.0\n   | " },
    Mistake { of: "[object]", by: "[object", place: ":6:", key: "", line: "6 | [object\n  | " },
    Mistake { of: "mass = 0.3\n", by: "mass = 0.3\nmass = 0.4\n", place: ":8:1: ", key: "mass", line: "8 | mass = 0.4\n  | ^" },
    Mistake { of: "mass = 0.3\n", by: "", place: ":6:", key: "object.mass: ", line: "6 | [object]\n  | ^" },
    Mistake {
        of: "\"8ms\"",
        by: "\"8500us\"",
        place: ":13:13: ",
        key: "coordination.update: ",
        line: "13 | update    = \"8500us\"\n   |             ^^^^^^^^",
    },
    Mistake { of: "\"right\"", by: "\"left\"", place: ":24:8: ", key: "name: ", line: "24 | name = \"left\"\n   |        ^^^^^^" },
];

#[test]
fn a_mistake_is_shown_where_it_is() {
    for Mistake { of, by, place, key, line } in MISTAKES {
        assert!(TWO.contains(of), "{of}");
        let scene = TWO.replacen(of, by, 1);
        let desk = Desk::with("two.toml", &scene);
        for command in ["run two.toml --out out", "run two.toml --out out --json", "explain two.toml"] {
            let outcome = desk.cohaptic(command);
            outcome.assert_refused(2, &[&format!("error: two.toml{place}"), key, line]);
            assert!(!desk.path("out").exists(), "{command}");
        }
        let outcome = desk.cohaptic("check two.toml");
        assert_eq!(outcome.status, Some(2));
        assert!(outcome.stdout.contains(&format!("two.toml{place}")) && outcome.stdout.contains(key), "{}", outcome.stdout);
    }
}

#[test]
fn what_is_no_text_is_no_scene() {
    let desk = Desk::new();
    let garbage: Vec<u8> = (0..=255).cycle().take(4096).collect();
    for (name, content, part) in [
        ("empty.toml", &[][..], "empty.toml:1:1: "),
        ("comment.toml", b"# nothing\n", "comment.toml:1:1: "),
        ("garbage.toml", &garbage, "garbage.toml:2:118: not UTF-8"),
        ("latin.toml", b"[scene]\ntitle = \"\xe4\"\n", "latin.toml:2:10: not UTF-8"),
        ("elf.toml", b"\x7fELF\x02\x01\x01\0\0", "elf.toml:1:1: "),
    ] {
        desk.write(name, content);
        for command in ["run", "explain"] {
            let outcome = desk.cohaptic(&format!("{command} {name} --json"));
            outcome.assert_refused(2, &["error: ", part, "\n", " | ", "^"]);
            assert!(!outcome.stderr.contains(|letter: char| letter.is_control() && letter != '\n'), "{:?}", outcome.stderr);
        }
    }
}

#[test]
fn a_scene_that_is_not_there_is_an_input_error() {
    let desk = Desk::new();
    for command in ["run", "explain", "check"] {
        desk.cohaptic(&format!("{command} nowhere.toml")).assert_refused(3, &["error: nowhere.toml: cannot be read: "]);
    }
    desk.write("folder/notes.txt", "");
    desk.cohaptic("run folder").assert_refused(3, &["folder: cannot be read: "]);
}

#[test]
fn a_hand_that_is_not_there_is_named_with_its_key() {
    let desk = Desk::with("two.toml", &TWO.replace("{ force = 1.5 }", "{ file = \"gone.csv\" }"));
    desk.cohaptic("run two.toml --out out")
        .assert_refused(3, &["two.toml:21:17: ", "hand.file: ", "gone.csv", "21 | hand = { file = \"gone.csv\" }\n   |                 ^^^^^^^^^^"]);
    assert!(!desk.path("out").exists());
}

#[test]
fn a_hand_is_found_beside_its_scene() {
    let desk = Desk::new();
    desk.write("scenes/two.toml", TWO.replace("{ force = 1.5 }", "{ file = \"hand.csv\" }"));
    desk.write("scenes/hand.csv", "t,fx\n0,1.5\n1,1.5\n");
    desk.write("two.toml", TWO);
    let ends = |scene: &str| desk.json(&format!("run {scene} --json"))["peers"].clone();
    assert_eq!(ends("scenes/two.toml"), ends("two.toml"));
}

#[test]
fn a_hand_that_makes_no_sense_is_shown_in_its_own_file() {
    for (csv, place) in [
        ("t,fx\n0,1\n0.5,one\n", "hand.csv:3:5: "),
        ("t,fx\n0,1\n0,2\n", "hand.csv:3:1: "),
        ("t,fx\n0,nan\n", "hand.csv:2:3: "),
        ("t,fx\n0\n", "hand.csv:2:"),
        ("time,force\n0,1\n", "hand.csv:1:1: "),
        ("t,fx\n", "hand.csv:"),
        ("", "hand.csv:1:1: "),
    ] {
        let desk = Desk::with("two.toml", &TWO.replace("{ force = 1.5 }", "{ file = \"hand.csv\" }"));
        desk.write("hand.csv", csv);
        let outcome = desk.cohaptic("run two.toml --out out");
        outcome.assert_refused(2, &[place, "^", "two.toml:21:17"]);
        assert!(!desk.path("out").exists());
    }
}

#[test]
fn what_does_not_fit_the_axes_is_refused() {
    let desk = Desk::with("plane.toml", &PLANE.replace("[1.5, -0.5]", "1.5"));
    desk.cohaptic("run plane.toml").assert_refused(2, &["hand.force: ", "1.5", "^^^"]);
}

/// A scene may have more peers than a simulation with events: what does not simulate takes it.
#[test]
fn too_many_peers_to_simulate_are_refused_before_anything_is_written() {
    let scene = "scene = { duration = \"8ms\", count = 100000 }\nobject.mass = 1\nlink.delay = \"24ms\"\n\
                 coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }\npeer = { contact = \"none\", device.mass = 1 }\n";
    let desk = Desk::with("many.toml", scene);
    let words = "100000 peers with 9999900000 links between them are too many to be simulated with events, which takes at most 23170 peers";
    desk.cohaptic("run many.toml --out out").assert_refused(2, &["error: many.toml:1:37: scene.count: ", words, "^^^^^^"]);
    assert!(!desk.path("out").exists());
    let checked = desk.cohaptic("check many.toml");
    assert_eq!(checked.status, Some(2));
    assert!(checked.stdout.contains(words) && checked.stdout.contains("look at nothing but counters"), "{}", checked.stdout);
    assert!(desk.text("explain many.toml").contains("9999900000 links"));
}

/// A TOML file that is too long is refused before it is read, because its tree would take fifty times its length of memory.
#[test]
fn a_long_file_in_toml_is_refused_before_it_is_read() {
    let desk = Desk::new();
    // Zeros that take no room, and would be refused as no text.
    std::fs::File::create(desk.path("long.toml")).unwrap().set_len((16 << 20) + 1).unwrap();
    for line in
        ["run long.toml", "campaign long.toml --runs 2 --out runs", "explain long.toml", "live long.toml", "relay long.toml", "router long.toml"]
    {
        desk.cohaptic(line).assert_refused(3, &["long.toml", "it is longer than 16 MiB"]);
    }
}

/// Devices without an end, and a pipe that somebody fills: each is read up to the limit of its kind.
#[cfg(target_os = "linux")]
#[test]
fn what_has_no_end_is_read_up_to_a_limit() {
    let desk = Desk::with("two.toml", TWO);
    let limit = "it is longer than 256 MiB";
    for line in [
        "run two.toml --set link.trace=/dev/zero",
        "run two.toml --set link.replay=/dev/zero",
        "run two.toml --set 'link.jitter={ sd = \"1ms\", distribution = { empirical = \"/dev/zero\" } }'",
        "run two.toml --inputs /dev/zero",
        "stability point two.toml --graph /dev/zero",
        "fit /dev/zero",
    ] {
        let outcome = desk.cohaptic(line);
        assert!(matches!(outcome.status, Some(2 | 3)) && (outcome.stderr + &outcome.stdout).contains(limit), "{line}");
    }
    for line in ["run /dev/zero", "check /dev/zero", "relay /dev/zero", "router /dev/zero"] {
        let outcome = desk.cohaptic(line);
        assert!(matches!(outcome.status, Some(2 | 3)) && (outcome.stderr + &outcome.stdout).contains("it is longer than 16 MiB"), "{line}");
    }
    // A log is read line by line.
    desk.cohaptic("link --from /dev/zero").assert_refused(2, &["line 1: found", "expected the header"]);
    let pipe = desk.path("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut fill = std::process::Command::new("dd")
        .args(["if=/dev/zero", "bs=1M"])
        .arg(format!("of={}", pipe.display()))
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let outcome = desk.cohaptic("run two.toml --set link.trace=pipe");
    // Nobody reads any more, so that it has ended.
    let _ = fill.wait();
    assert!(outcome.status == Some(3) && outcome.stderr.contains(limit) && outcome.stderr.contains("link.trace"), "{outcome:?}");
}

/// A table of a scene that is the size of a galaxy fits on a screen, and no text for people has a number of more than 16 digits in a row.
#[test]
fn numbers_beyond_all_measure_are_said_in_a_few_digits() {
    let desk = Desk::with("two.toml", TWO);
    for (line, part) in [
        ("run two.toml --set peers.left.hand.force=1e300 --measure all", "e"),
        ("run two.toml --set coordination.stiffness=1e22", "e"),
        ("explain two.toml --set peer.device.mass=1.2345e-300", "1.2345e-300 kg"),
        ("explain two.toml --set object.mass=1e300", "e299 kg"),
        ("stability boundary two.toml --along coordination.stiffness=1e300..1e3", "1e300 is not below 1000"),
        ("campaign two.toml --vary coordination.stiffness=1e300..1e3/5 --out out", "1e300 is not below 1000"),
        ("check two.toml --set 'expect.position=[{ peer = \"left\", at = \"0.1s\", max = -1e300 }]'", "expected at most -1e300 m"),
        ("check two.toml --set 'expect.discrepancy={ max = 1.5e-300 }'", "expected at most 1.5e-300 m"),
    ] {
        let outcome = desk.cohaptic(line);
        let text = outcome.stdout + &outcome.stderr;
        let digits = text.split(|c: char| !c.is_ascii_digit()).map(str::len).max();
        assert!(digits <= Some(16) && text.contains(part), "{line}: {text}");
    }
}
