//! Every key of a scene with values that the key does not take: the messages are in words of scenes, and no message is one of the standard library.

use std::panic::catch_unwind;
use std::path::Path;

use cohaptic_linkfile::{RelayFile, link_from_keys};
use cohaptic_scene::{Scene, scene_content};

use crate::every_key::path;

/// Pieces of the standard library's parse errors, and of the debug form of its types, one per line.
const RAW: &str = include_str!("raw_texts.txt");

const VALUES: [&str; 32] = [
    "abc",
    "''",
    "' '",
    "-1",
    "-0.5",
    "0",
    "1.5",
    "1e300",
    "1e-300",
    "-1e300",
    "1.2345678901234567e-300",
    "nan",
    "inf",
    "99999999999999999999999999999999999999999999999",
    "0x10000000000000000",
    "8 parsecs",
    "8",
    "-8ms",
    "1.2.3s",
    "99999999999999999999h",
    "10mb",
    "101%",
    "-1%",
    "x%",
    "0 packets",
    "-1 packets",
    "99999999999999999999 packets",
    "[]",
    "[1, 2, 3, 4]",
    "{}",
    "1979-05-27",
    "'a\u{202e}b'",
];

/// Returns the length of the longest run of digits in a text.
fn digits(text: &str) -> usize {
    text.split(|c: char| !c.is_ascii_digit()).map(str::len).max().unwrap_or(0)
}

fn assert_in_words(what: &str, message: &str) {
    assert!(digits(message) <= digits(what).max(20), "{what}: more digits than anybody reads in {message}");
    for raw in RAW.lines().chain(["Some(", "Err("]) {
        assert!(!message.contains(raw), "{what}: {raw:?} in {message}");
    }
    assert!(message.contains("expected"), "{what}: {message}");
    assert!(!message.contains('\u{202e}'), "{what}: {message}");
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn a_wrong_value_of_any_key_is_refused_in_words() {
    let file = path();
    let keys: Vec<String> = scene_content(&file, &[]).unwrap().keys.into_keys().collect();
    assert!(keys.len() > 100, "only {} keys", keys.len());
    let mut refused = 0_usize;
    for key in &keys {
        for value in VALUES {
            let set = format!("{key}={value}");
            let read = catch_unwind(|| Scene::read(&file, std::slice::from_ref(&set))).unwrap_or_else(|_| panic!("{set}"));
            if let Err(error) = read {
                refused += 1;
                assert_in_words(&set, &error.to_string());
            }
        }
    }
    // A key takes some of these values at most: three quarters are wrong for each.
    assert!(refused > keys.len() * VALUES.len() * 3 / 4, "{refused} of {}", keys.len() * VALUES.len());
}

#[test]
fn a_wrong_value_of_a_link_or_of_a_relay_is_refused_in_words() {
    let relay = "programs = [{ name = \"a\", port = \"127.0.0.1:7001\", address = \"127.0.0.1:7003\" }, { name = \"b\", port = \"localhost:7002\" }]";
    for value in VALUES.into_iter().chain(["localhost", "localhost:", "host.example:7", "127.0.0.1", "127.0.0.1:65536", "[::1]"]) {
        for key in ["delay", "jitter", "loss", "duplicate", "rate", "queue", "mtu", "order", "limit", "netem", "reorder", "outages", "trace"] {
            if let Err(error) = link_from_keys(&[format!("{key}={value}")]) {
                assert_in_words(&format!("{key}={value}"), &error.to_string());
            }
        }
        for key in ["programs.a.port", "programs.a.address", "relay.seed", "relay.most-packets", "relay.most-bytes", "relay.tolerance"] {
            if let Err(error) = RelayFile::parse(relay, Path::new("relay.toml"), &[format!("{key}={value}")]) {
                assert_in_words(&format!("{key}={value}"), &error.to_string());
            }
        }
    }
    assert!(RelayFile::parse(relay, Path::new("relay.toml"), &[]).is_ok_and(|file| file.programs[1].port.to_string() == "127.0.0.1:7002"));
}
