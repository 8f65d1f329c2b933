//! Every option that takes a number, a time, a size or an address, with values that it does not take: the answer is in words, and never what Rust says.

use crate::integration::desk::Desk;
use crate::integration::scenes::TWO;

/// Errors of the standard library for texts that it does not read.
const RAW: &str = include_str!("../../../scene/tests/integration/raw_texts.txt");

/// No option takes any of these.
const WRONG: [&str; 9] =
    ["abc", "''", "1.2.3", "0x1z", "--5", "'5 parsecs'", "1,,2", "99999999999999999999999999999999999999999999999x", "''\u{202e}5''"];

/// Integers besides: too large for every type of integer, and not whole.
const NO_INTEGERS: [&str; 4] = ["-1", "1.5", "1e3", "99999999999999999999999999999999999999999999999"];

const INTEGERS: [&str; 18] = [
    "check two.toml --jobs ",
    "campaign two.toml --out c --vary object.mass=1,2 --threads ",
    "campaign two.toml --out c --vary object.mass=1,2 --runs ",
    "campaign two.toml --out c --vary object.mass=1,2 --part ",
    "compare two.toml --strategies average-position,extrapolated --out c --threads ",
    "compare two.toml --strategies average-position,extrapolated --out c --runs ",
    "compare two.toml --strategies average-position,extrapolated --out c --part ",
    "stability map two.toml --x object.mass=1..2 --y coordination.stiffness=1..2 --grid 2x2 --jobs ",
    "stability boundary two.toml --along object.mass=1..2 --samples ",
    "stability point two.toml --losses-in-a-row ",
    "stability point two.toml --products ",
    "admittance two.toml --peer left --points ",
    "link delay 1ms --packets ",
    "link delay 1ms --seed ",
    "fit a.csv b.csv --port ",
    "relay --listen localhost:0 --to localhost:9 --seed ",
    "relay --listen localhost:0 --to localhost:9 --packets ",
    "falcon simulate --seed ",
];

const OTHERS: [&str; 26] = [
    "stability point two.toml --accuracy ",
    "stability point two.toml --losses-in-a-row 1 --delay-within ",
    "stability boundary two.toml --along object.mass=1..2 --tolerance ",
    "stability boundary two.toml --along object.mass=",
    "stability map two.toml --x object.mass=1..2 --y coordination.stiffness=1..2 --grid ",
    "admittance two.toml --peer left --from ",
    "admittance two.toml --peer left --to ",
    "admittance two.toml --peer left --at ",
    "campaign two.toml --out c --vary object.mass=",
    "compare two.toml --strategies average-position,extrapolated --out c --vary object.mass=",
    "compare two.toml --out c --strategies average-position,extrapolated{horizon=7},",
    "link delay 1ms --every ",
    "link delay 1ms --size ",
    "link delay ",
    "link delay=",
    "link loss ",
    "link rate ",
    "relay --listen localhost:0 --to ",
    "relay --to localhost:9 --listen ",
    "relay --listen localhost:0 --to localhost:9 --for ",
    "relay --listen localhost:0 --to localhost:9 --bytes ",
    "live two.toml --listen ",
    "live two.toml --control=",
    "live two.toml --for ",
    "falcon simulate --limit ",
    "falcon simulate --for 1ms --garbage ",
];

fn assert_in_words(desk: &Desk, line: &str) {
    let outcome = desk.cohaptic(line);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""), "{line}: {}", outcome.stderr);
    for raw in RAW.lines() {
        assert!(!outcome.stderr.contains(raw), "{line}: {raw:?} in {}", outcome.stderr);
    }
    assert!(!outcome.stderr.contains('\u{202e}'), "{line}: {}", outcome.stderr);
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_wrong_value_of_any_option_is_refused_in_words() {
    let desk = Desk::with("two.toml", TWO);
    for option in INTEGERS {
        WRONG.into_iter().chain(NO_INTEGERS).for_each(|value| assert_in_words(&desk, &format!("{option}{value}")));
    }
    for option in OTHERS {
        WRONG.into_iter().for_each(|value| assert_in_words(&desk, &format!("{option}{value}")));
    }
}

#[test]
fn a_file_that_is_no_text_is_refused_in_words() {
    let desk = Desk::with("two.toml", TWO);
    let no_text = |header: &str| [header.as_bytes(), b"\n1,\xff\xfe\x80"].concat();
    desk.write("bin", no_text("t,delay"));
    desk.write("log", no_text("sequence,copy,offered_ns,size,at_ns,fate,marked,damaged"));
    // A token file that is open to others would be refused for that fault first.
    desk.set_mode("bin", 0o600);
    for line in [
        "run two.toml --inputs bin",
        "link --from log",
        "fit bin",
        "run bin",
        "relay bin",
        "router bin",
        "stability point two.toml --graph bin",
        "live two.toml --control --token-file bin --for 1ms",
    ] {
        assert_in_words(&desk, line);
        let message = desk.cohaptic(line).stderr;
        let file = if line.ends_with("log") { "log" } else { "bin" };
        assert!(message.starts_with(&format!("error: {file}:2:")) && message.contains("not UTF-8: expected a text file"), "{line}: {message}");
    }
}
