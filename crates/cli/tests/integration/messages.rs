//! Bad inputs and the message to each: the place, the fault, the expectation, and the way out.

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

/// Text that follows every refusal of an argument.
const HELP: &str = "\n\nFor more information, try '--help'.";

struct Bad {
    line: &'static str,
    status: i32,
    /// Message without `error: ` before it and without the line break after it.
    message: &'static str,
}

const fn bad(line: &'static str, message: &'static str) -> Bad {
    Bad { line, status: 2, message }
}

/// Refusals of arguments, without [`HELP`].
const ARGUMENTS: &[Bad] = &[
    bad("check two.toml --jobs abc", "invalid value 'abc' for '--threads <N>': expected an integer from 1 to 1024"),
    bad("check two.toml --jobs 0", "invalid value '0' for '--threads <N>': expected an integer from 1 to 1024"),
    bad("check two.toml --jobs -1", "invalid value '-1' for '--threads <N>': expected an integer from 1 to 1024"),
    bad(
        "campaign two.toml --vary object.mass=1,2 --out c --part 0",
        "invalid value '0' for '--part <N>': expected an integer of at least 1, below 2^64",
    ),
    bad("admittance two.toml --peer left --points 0", "invalid value '0' for '--points <N>': expected an integer of at least 1, below 2^64"),
    bad("admittance two.toml --peer left --from low", "invalid value 'low' for '--from <HZ>': expected a number such as 0.25, 100 or 1e-3"),
    bad(
        "stability point two.toml --losses-in-a-row 4294967296",
        "invalid value '4294967296' for '--losses-in-a-row <N>': expected an integer from 0 to 4294967295",
    ),
    bad("link delay 1ms --packets many", "invalid value 'many' for '--packets <N>': expected an integer of at least 1, below 2^64"),
    bad(
        "link delay 1ms --every 8",
        "invalid value '8' for '--every <TIME>': no unit in \"8\": expected a duration such as \"8ms\", \"1.5s\" or \"250us\" (units: ns, us, ms, s, min, h)",
    ),
    bad(
        "link delay 1ms --size 64K",
        "invalid value '64K' for '--size <SIZE>': unknown unit \"K\" in \"64K\": expected a size such as \"64B\", \"1500B\" or \"64kB\" (units: B, kB, MB)",
    ),
    bad("falcon simulate --garbage 2", "invalid value '2' for '--garbage <PROBABILITY>': expected a probability such as 0.015 or 1.5%"),
    bad(
        "live two.toml --listen localhost",
        "invalid value 'localhost' for '--listen <ADDRESS>': has no port: expected an address with a port, such as 127.0.0.1:7000, [::1]:7000 or localhost:7000",
    ),
    bad(
        "relay --listen localhost:0 --to 127.0.0.1:65536",
        "invalid value '127.0.0.1:65536' for '--to <ADDRESS>': is no address: expected an address with a port, such as 127.0.0.1:7000, [::1]:7000 \
         or localhost:7000",
    ),
    bad("check two.toml --jobs 1\u{202e}0", "invalid value '1\\u{202e}0' for '--threads <N>': expected an integer from 1 to 1024"),
    bad(
        "link delay 1ms --every 8\u{202e}ms",
        "invalid value '8\\u{202e}ms' for '--every <TIME>': unknown unit \"\\u{202e}ms\" in \"8\\u{202e}ms\": expected a duration such as \"8ms\", \"1.5s\" or \
         \"250us\" (units: ns, us, ms, s, min, h)",
    ),
];

/// Refusals of all other kinds.
const OTHERS: &[Bad] = &[
    bad(
        "run two.toml --set link.delay=24parsecs",
        "--set link.delay=24parsecs: link.delay: unknown unit \"parsecs\" in \"24parsecs\": expected a duration such as \"8ms\", \"1.5s\" or \"250us\" \
         (units: ns, us, ms, s, min, h)\n |\n | link.delay=24parsecs\n |            ^^^^^^^^^",
    ),
    bad(
        "run two.toml --set link.rate=10mbit",
        "--set link.rate=10mbit: link.rate: unknown unit \"mbit\" in \"10mbit\": expected a rate above zero such as \"10Mbit\" or \"64kbit\" (bits per second) \
         (units: bit, kbit, Mbit, Gbit)\n |\n | link.rate=10mbit\n |           ^^^^^^",
    ),
    bad(
        "run two.toml --set peers.left.hand.force=[1,2]",
        "--set peers.left.hand.force=[1,2]: peers.left.hand.force: found a list of 2 numbers: expected as many as the scene has axes, 1\n |\n | \
         peers.left.hand.force=[1,2]\n |                       ^^^^^",
    ),
    bad(
        "run two.toml --set peers=[{name=\"a\"}]",
        "--set peers=[{name=\"a\"}]: peers: a scene with 1 peer: expected at least two entries [[peers]], or scene.count\n |\n | peers=[{name=\"a\"}]\n |       ^^^^^^^^^^^^",
    ),
    bad("run \u{202e}two.toml --set link.dlay=1", "\\u{202e}two.toml: cannot be read: No such file or directory (os error 2)"),
    bad(
        "run two.toml --set simulation.substep=\u{202e}1",
        "--set simulation.substep=\\u{202e}1: simulation.substep: unknown key: expected one of integrator, substeps, rotation-steps; did you mean \"substeps\"?\n |\n | \
         simulation.substep=\\u{202e}1\n |            ^^^^^^^",
    ),
    bad(
        "admittance two.toml --peer left --from 1e300",
        "--from 1e300: expected a frequency above 0 and at most 500 Hz, half the rate of the peer's ticks",
    ),
    bad(
        "admittance two.toml --peer left --from 1 --to 2 --points 1",
        "1 frequency from 1 Hz to 2 Hz: expected at least 2, the first below the last; --at takes one alone",
    ),
    bad(
        "link delay 20parsecs",
        "these words do not describe a link:\ndelay 20parsecs\n      ^^^^^^^^^ expected a time such as 10ms, 250us or 1.5s, below 292 years (units: s, ms, us, ns)",
    ),
    bad(
        "link rate 10xbit",
        "these words do not describe a link:\nrate 10xbit\n     ^^^^^^ expected a rate of at least 8bit such as 10mbit, 64kbit or 1.5mbps (units: bit, kbit, mbit, gbit, tbit and, \
         for bytes per second, bps, kbps, mbps, gbps, tbps)",
    ),
    bad(
        "link delay 20ms loss=1%",
        "a link is written either in words of tc-netem or in keys of a scene, not in both: delay 20ms is of the first kind, loss=1% of the second. Write all in one kind, such as delay 20ms loss 1%, or delay=20ms loss=1%; put a value with spaces in quotes, 'jitter={ sd = \"2ms\" }'",
    ),
    bad(
        "relay --listen localhost:0 --to localhost:9 delay 20ms --back loss=1% delay 2ms",
        "a link is written either in words of tc-netem or in keys of a scene, not in both: delay 2ms is of the first kind, loss=1% of the second. Write all in one kind, such as delay 20ms loss 1%, or delay=20ms loss=1%; put a value with spaces in quotes, 'jitter={ sd = \"2ms\" }'",
    ),
    bad(
        "relay --listen localhost:0 --to localhost:9 delay 20ms stall 2s",
        "stall is a word of links for connections of TCP, and this link carries packets: expected another word, or cohaptic relay --tcp --listen 127.0.0.1:7000 --to 127.0.0.1:8000 stall …",
    ),
    bad(
        "relay --tcp --listen localhost:0 --to localhost:9 stall x",
        "stall: found x: expected stall AFTER [LENGTH], and then for SHARE if only some connections have it, such as 10ms or 100B",
    ),
    bad("fit bin", "bin:2: not UTF-8: expected a text file"),
];

fn desk() -> Desk {
    let desk = Desk::with("two.toml", TWO);
    desk.write("bin", b"t,delay\n\xff\xfe");
    desk
}

fn assert_said(desk: &Desk, bad: &Bad, below: &str) {
    let outcome = desk.cohaptic(bad.line);
    let expected = format!("error: {}{below}\n", bad.message);
    assert_eq!((outcome.status, outcome.stdout.as_str(), outcome.stderr), (Some(bad.status), "", expected), "{}", bad.line);
}

#[test]
fn a_wrong_argument_is_named_with_what_was_expected() {
    let desk = desk();
    ARGUMENTS.iter().for_each(|bad| assert_said(&desk, bad, HELP));
}

#[test]
fn everything_else_that_is_wrong_is_named_too() {
    let desk = desk();
    let mut others: Vec<&Bad> = OTHERS.iter().collect();
    let missing = others.iter().position(|bad| bad.message.contains("os error 2")).unwrap();
    assert_said(&desk, &Bad { status: 3, ..*others.remove(missing) }, "");
    others.into_iter().for_each(|bad| assert_said(&desk, bad, ""));
}

/// The micro sign, the Greek letter and the words of other programs are units of time wherever one is read: of keys, of words for tc-netem, and of options.
#[test]
fn a_microsecond_may_be_written_in_each_of_its_ways() {
    let desk = desk();
    let mean = |link: &str| desk.json(&format!("link {link} --packets 10 --json"))["achieved"]["mean_s"].as_f64().unwrap();
    for unit in ["us", "usec", "\u{b5}s", "\u{3bc}s"] {
        assert_eq!([mean(&format!("delay 250{unit}")), mean(&format!("delay=250{unit}"))], [250e-6, 250e-6], "{unit}");
        desk.text(&format!("link delay 1ms --packets 10 --every 250{unit}"));
    }
    for (text, seconds) in [("2msec", 2e-3), ("0.5sec", 0.5), ("2ms", 2e-3)] {
        assert_eq!([mean(&format!("delay {text}")), mean(&format!("delay={text}"))], [seconds, seconds], "{text}");
    }
}

/// 23,170 is the most that is simulated with events.
#[test]
fn too_many_peers_are_shown_where_the_first_one_too_many_is() {
    let without_peers: String = TWO.split("[[peers]]").next().unwrap().to_owned();
    let before = without_peers.lines().count();
    let peers: String = (1..=23_171).map(|number| format!("[[peers]]\nname = \"p{number}\"\n")).collect();
    let desk = Desk::with("many.toml", &format!("{without_peers}{peers}"));
    // Entries have two lines each, and the first one too many comes after 23,170 of them.
    let line = before + 2 * 23_170 + 1;
    let start =
        format!("many.toml:{line}:1: peers.p23171: 23171 peers with 536872070 links between them are too many to be simulated with events, which");
    let end = format!("\n      |\n{line} | [[peers]]\n      | ^^^^^^^^^\n");
    for command in ["run many.toml", "live many.toml", "campaign many.toml --measure all --out out"] {
        let outcome = desk.cohaptic(command);
        assert!(outcome.status == Some(2) && outcome.stderr.starts_with(&format!("error: {start}")), "{}", outcome.stderr);
        assert!(outcome.stderr.ends_with(&end), "{}", outcome.stderr);
    }
    let outcome = desk.cohaptic("check many.toml");
    assert!(outcome.status == Some(2) && outcome.stdout.contains(&start), "{}", outcome.stdout);
    let outcome = desk.cohaptic("campaign many.toml --measure all --set 'peers=[]' --vary scene.count=2,23171 --out out");
    assert!(outcome.stderr.contains("scene.count=23171: scene.count: 23171 peers with 536872070 links"), "{}", outcome.stderr);
    // Made by number, they are too many where the number is.
    let outcome = desk.cohaptic("run many.toml --set 'peers=[]' --set scene.count=23171");
    assert!(outcome.stderr.starts_with("error: --set scene.count=23171: scene.count: 23171 peers with 536872070 links"), "{}", outcome.stderr);
}

#[test]
fn huge_and_tiny_numbers_have_an_exponent() {
    let desk = desk();
    let text = desk.text("explain two.toml --set object.mass=1e300 --set coordination.stiffness=1e-300");
    assert!(text.contains("2 copies of 5e299 kg") && text.contains("KT = 1e-300 N/m"), "{text}");
}

#[test]
fn one_of_something_is_not_said_to_be_many() {
    let desk = desk();
    desk.write("timed.toml", format!("{TWO}\n[[timeline]]\nat = \"50ms\"\nlink = \"all\"\nset = {{ loss = 0.5 }}\n"));
    assert!(desk.text("explain timed.toml").contains("timeline: 1 change\n"));
    assert!(desk.text("run two.toml --no-plot --set scene.duration=1ms").contains("1ms simulated, 1 tick, in "));
    assert!(desk.text("link delay 1ms --packets 1").contains("\n  1 packet sent, 1 delivered\n"));
}

#[test]
fn what_turns_the_writing_is_shown_as_an_escape() {
    let desk = desk();
    // Right-to-left override, isolate, zero-width space, soft hyphen, a tag.
    for c in ['\u{202e}', '\u{2066}', '\u{200b}', '\u{ad}', '\u{e0041}'] {
        let shown = c.escape_default().to_string();
        let text = desk.text(&format!("run two.toml --no-plot --set scene.title=a{c}b"));
        assert!(text.starts_with(&format!("a{shown}b\n")), "{text}");
        let outcome = desk.cohaptic(&format!("stability point no{c}where.toml"));
        assert!(outcome.stderr.contains(&format!("no{shown}where.toml")) && !outcome.stderr.contains(c), "{}", outcome.stderr);
        let outcome = desk.cohaptic(&format!("fit no{c}where.csv"));
        assert!(outcome.stderr.contains(&format!("no{shown}where.csv")) && !outcome.stderr.contains(c), "{}", outcome.stderr);
        // With the option that was perhaps meant, and with advice that repeats what was typed.
        for line in [format!("run two.toml --no{c}plot"), format!("run two.toml --{c}"), format!("check two.toml -{c}")] {
            let outcome = desk.cohaptic(&line);
            assert!(outcome.stderr.contains(&shown) && !outcome.stderr.contains(c), "{}", outcome.stderr);
        }
    }
}
