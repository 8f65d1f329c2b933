//! The engine against scripts of single segments, in packetdrill's language: what arrives, what must leave and when, and what the program sees.
//!
//! A script is a file `*.pkt` in this folder. Its header names its source, an RFC or a function of Linux. Times have no tolerance but the one that the script
//! gives. Windows, options and ECN are as packetdrill has them: a window that is not named is not compared, options that are not named must not be there.
#![allow(clippy::unwrap_used, clippy::cast_possible_truncation, reason = "tests fail where they stop")]

mod call;
mod check;
mod packet;
mod parse;
mod program;
mod stage;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use parse::Script;
use stage::Stage;

/// Runs the script `text`. The error begins with the name and the line.
fn run(name: &str, text: &str) -> Result<(), String> {
    let script = Script::parse(text).map_err(|fault| format!("{name}:{}: {}", fault.line, fault.text))?;
    Stage::run(&script).map_err(|(line, text)| format!("{name}:{line}: {text}"))
}

/// Returns the paths of all scripts.
fn scripts() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scripts");
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut scripts: Vec<_> = paths.filter(|path| path.extension().is_some_and(|end| end == "pkt")).collect();
    scripts.sort();
    scripts
}

fn name(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

#[test]
fn every_script_is_followed() {
    let scripts = scripts();
    let failures: Vec<_> = scripts.iter().filter_map(|path| run(&name(path), &fs::read_to_string(path).unwrap()).err()).collect();
    assert!(failures.is_empty(), "{} of {} scripts fail:\n{}", failures.len(), scripts.len(), failures.join("\n"));
    assert!(scripts.len() >= 60, "only {} scripts", scripts.len());
}

/// Kinds of scripts, by the beginnings of their names.
const KINDS: [(&str, &[&str]); 9] = [
    ("handshakes", &["handshake", "connect"]),
    ("acknowledgements, timestamps, challenges", &["ack", "timestamp", "paws", "challenge"]),
    ("selective acknowledgements and reports of duplicates", &["sack", "dsack"]),
    ("recovery: RACK-TLP, PRR, NewReno, the timeout", &["recovery", "rack", "tlp", "prr", "limited"]),
    ("undo by DSACK and Eifel", &["undo"]),
    ("congestion window, HyStart, pauses", &["slow", "hystart", "idle"]),
    ("ECN", &["ecn"]),
    ("windows, probes, Nagle's algorithm", &["window", "nagle", "nodelay"]),
    ("ends: TIME-WAIT, orphans, resets, the user timeout, keep-alive", &["close", "orphan", "reset", "time", "user", "keepalive"]),
];

/// Returns the kind of source of a script: 0 for a standard or a paper alone, 1 for both, 2 for functions of Linux alone.
fn source(text: &str) -> usize {
    let source = text.lines().find_map(|line| line.strip_prefix("// Source: ")).unwrap();
    let is_standard = |part: &str| part.starts_with("RFC") || part.starts_with("Ha & Rhee");
    let (has_standard, has_function) = (source.split("; ").any(is_standard), source.contains('_'));
    assert!(has_standard || has_function, "`{source}` is neither a standard nor a function");
    if has_standard { usize::from(has_function) } else { 2 }
}

#[test]
fn the_readme_counts_the_scripts() {
    let (mut table, scripts, mut all) = (String::new(), scripts(), [0; 3]);
    let first = |path: &Path| name(path).split(['-', '.']).next().unwrap().to_owned();
    for (kind, beginnings) in KINDS {
        let mut counts = [0; 3];
        for path in scripts.iter().filter(|path| beginnings.contains(&first(path).as_str())) {
            counts[source(&fs::read_to_string(path).unwrap())] += 1;
        }
        writeln!(table, "| {kind} | {} | {} | {} | {} |", counts.iter().sum::<usize>(), counts[0], counts[1], counts[2]).unwrap();
        all.iter_mut().zip(counts).for_each(|(all, count)| *all += count);
    }
    writeln!(table, "| all | {} | {} | {} | {} |", scripts.len(), all[0], all[1], all[2]).unwrap();
    assert_eq!(all.iter().sum::<usize>(), scripts.len(), "every script is of one kind");
    assert!(include_str!("../../README.md").contains(&table), "{table}");
}

/// A handshake and a write, on which each case below adds a line.
const BEGIN: &str = "// Source: none, this tests the interpreter.
0 socket(..., SOCK_STREAM, IPPROTO_TCP) = 3
+0 bind(3, ..., ...) = 0
+0 listen(3, 1) = 0
+0 < S 0:0(0) win 65535 <mss 1000>
+0 > S. 0:0(0) ack 1 <mss 1460>
+.1 < . 1:1(0) ack 1 win 65535
+0 accept(3, ..., ...) = 4
+0 write(4, ..., 10) = 10
";

#[test]
fn the_interpreter_finds_what_is_wrong() {
    let cases = [
        // A segment leaves that the script does not expect, or expects otherwise or at another time.
        ("+0 > P. 1:11(10) ack 1", None),
        ("+0 > P. 1:12(11) ack 1", Some("10: expected")),
        ("+0 > . 1:11(10) ack 1", Some("10: expected")),
        ("+0 > P. 1:11(10) ack 1 <TS val 1 ecr 2>", Some("10: expected")),
        ("+.01 > P. 1:11(10) ack 1", Some("10: `P. 1:11(10) ack 1 win")),
        ("+.01 < . 1:1(0) ack 11 win 65535", Some("10: nothing expects `P. 1:11(10)")),
        ("", Some("9: the script ends")),
        ("+0 > P. 1:11(10) ack 1\n+0 > . 11:11(0) ack 1", Some("11: `. 11:11(0) ack 1` does not leave")),
        // Results of calls and figures.
        ("+0 > P. 1:11(10) ack 1\n+0 read(4, ..., 10) = -1 EAGAIN (Resource temporarily unavailable)", None),
        ("+0 > P. 1:11(10) ack 1\n+0 read(4, ..., 10) = 10", Some("11: `read` gives")),
        ("+0 > P. 1:11(10) ack 1\n+0 %{ assert tcpi_unacked == 1 and tcpi_state == TCP_ESTABLISHED }%", None),
        ("+0 > P. 1:11(10) ack 1\n+0 %{ assert tcpi_unacked == 2 }%", Some("11: tcpi_unacked is 1, and not == 2")),
        // Grammar.
        ("+0 > P. 1:11(9) ack 1", Some("10:")),
        ("+0 > P. 1:11(10)", Some("10:")),
        ("+0 > Q. 1:11(10) ack 1", Some("10:")),
        ("+0 > P. 1:11(10) ack 1 <mood good>", Some("10:")),
        ("+0 sleep(3) = 0", Some("10: `sleep` is unknown")),
        ("+0 %{ assert tcpi_mood == 2 }%", Some("10:")),
        ("* read(4, ..., 10) = 10", Some("10: only a segment")),
        ("soon > P. 1:11(10) ack 1", Some("10:")),
        ("/* no end", Some("10: the comment has no end")),
    ];
    for (line, wanted) in cases {
        let text = run("case", &format!("{BEGIN}{line}\n")).err();
        let is_right = match (&text, wanted) {
            (None, None) => true,
            (Some(text), Some(wanted)) => text.starts_with(&format!("case:{wanted}")),
            _ => false,
        };
        assert!(is_right, "`{line}` gave {text:?}");
    }
}

#[test]
fn a_script_has_a_source_and_expects_something() {
    let without = |text: &str| run("case", text).unwrap_err();
    assert!(without("+0 > . 1:1(0) ack 1\n").starts_with("case:1: no comment names the source"));
    assert_eq!(without("// Source: RFC 9293\n0 socket(..., SOCK_STREAM, IPPROTO_TCP) = 3\n"), "case:1: the script expects nothing");
    assert_eq!(without("// Source: RFC 9293\n`sysctl -q net.ipv4.tcp_mood=1`\n+0 > S 0:0(0)\n"), "case:2: the setting tcp_mood=1 is unknown");
}
