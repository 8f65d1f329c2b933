//! Relay files: the configuration that a file describes, and the message of each refusal.

use std::path::Path;
use std::time::Duration;

use cohaptic_linkfile::{FileError, RelayFile, RelayLimits, relay_link_keys_of_text};
use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};

const WHOLE: &str = r#"
[relay]
title = "three in a room"
seed = 7
most-packets = 1000
most-bytes = "1MB"
forget-after = "5s"
tolerance = "2ms"

[[programs]]
name = "a"
port = "127.0.0.1:7001"
address = "127.0.0.1:9001"

[[programs]]
name = "b"
port = "127.0.0.1:7002"

[[programs]]
name = "c"
port = "127.0.0.1:0"

[[modulators]]
name = "cell"
states = [{ name = "good", sojourn = "2s" }, { name = "bad", sojourn = "1s" }]

[link]
delay = "24ms"

[[links]]
from = "c"
to = "a"
modulated = { by = "cell", bad = { loss = "50%" } }

[[timeline]]
at = "10s"
link = "all"
set = { delay = "30ms" }

[[timeline]]
at = "5s"
link = { from = "a", to = "b" }
set = { loss = "1%" }
"#;

fn parse(text: &str) -> Result<RelayFile, FileError> {
    RelayFile::parse(text, Path::new("relay.toml"), &[])
}

#[test]
fn every_key_says_what_it_says() {
    let file = parse(WHOLE).unwrap();
    assert_eq!((file.title.as_str(), file.seed), ("three in a room", 7));
    let limits =
        RelayLimits { packets: 1000, bytes: Bytes::new(1_000_000), forget_after: Duration::from_secs(5), tolerance: Duration::from_millis(2) };
    assert_eq!(file.limits, limits);
    let programs: Vec<_> = file.programs.iter().map(|program| (program.name.as_str(), program.port.port(), program.address.is_some())).collect();
    assert_eq!(programs, [("a", 7001, true), ("b", 7002, false), ("c", 0, false)]);
    assert_eq!(file.links.between(0, 1).mean_delay(), Duration::from_millis(24));
    assert!(file.links.between(2, 0).as_fixed().is_none());
    // One change at 5 s, then one for each of the six links at 10 s; the loss of the first is still there.
    let changes: Vec<_> = file.timeline.iter().map(|change| (change.at.as_nanos() / 1_000_000_000, change.link.from, change.link.to)).collect();
    assert_eq!(changes, [(5, 0, 1), (10, 0, 1), (10, 0, 2), (10, 1, 0), (10, 1, 2), (10, 2, 0), (10, 2, 1)]);
    let after = file.timeline[1].link.config.as_fixed().unwrap();
    assert_eq!((after.loss.mean(), after.delay.mean()), (Some(0.01), Duration::from_millis(30)));
    assert_eq!(file.timeline[0].at, Instant::from_nanos(5_000_000_000));
}

#[test]
fn what_is_not_written_has_a_default_and_overrides_replace_what_is() {
    let text = "programs = [{ name = \"a\", port = \"[::1]:1\" }, { name = \"b\", port = \"[::1]:2\" }]";
    let file = RelayFile::parse(text, Path::new("two.toml"), &["link.delay=8ms".to_owned(), "programs.b.port=[::1]:3".to_owned()]).unwrap();
    assert_eq!((file.title.as_str(), file.seed, file.limits), ("two", 0, RelayLimits::default()));
    assert_eq!(file.links.between(1, 0).mean_delay(), Duration::from_millis(8));
    assert_eq!(file.programs[1].port, "[::1]:3".parse().unwrap());
    assert!(file.links.is_uniform() && file.timeline.is_empty());
}

#[test]
fn a_fault_names_line_key_and_what_was_expected() {
    for (found, replaced, line, key, words) in [
        ("\"127.0.0.1:7002\"", "\"192.0.2.1:7002\"", 17, "programs.b.port", "192.0.2.1:7002 is not on this machine: expected a loopback"),
        (
            "\"127.0.0.1:7002\"",
            "\"host.example:7002\"",
            17,
            "programs.b.port",
            "\"host.example:7002\" names a host that would need a look-up: expected",
        ),
        ("\"127.0.0.1:7002\"", "\"127.0.0.1:7001\"", 17, "programs.b.port", "127.0.0.1:7001 stands for program \"a\" already"),
        ("\"127.0.0.1:7002\"", "\"[::1]:7002\"", 13, "programs.a.address", "cannot be reached from [::1]:7002, the port of program \"b\""),
        ("\"127.0.0.1:9001\"", "\"127.0.0.1:0\"", 13, "programs.a.address", "no program can be reached at 127.0.0.1:0"),
        ("name = \"b\"", "name = \"a\"", 16, "programs.a.name", "there is a program \"a\" already"),
        ("name = \"b\"", "name = \"b c\"", 16, "programs.b c.name", "cannot be the name of a program"),
        ("from = \"c\"", "from = \"d\"", 31, "links.d.a.from", "there is no program \"d\": expected one of a, b, c"),
        ("from = \"c\"", "from = \"a\"", 32, "links.a.a.to", "a program has no link to itself"),
        ("seed = 7", "sed = 7", 4, "relay.sed", "did you mean \"seed\"?"),
        ("seed = 7", "seed = -7", 4, "relay.seed", "out of range"),
        ("\"1MB\"", "\"1kB\"", 6, "relay.most-bytes", "expected at least \"65535B\""),
        ("\"24ms\"", "\"24 parsecs\"", 28, "link.delay", "unknown unit \"parsecs\""),
        ("set = { loss = \"1%\" }", "set = {}", 43, "timeline.1.set", "nothing changes"),
        ("set = { loss = \"1%\" }", "peer = \"a\"", 43, "timeline.1.peer", "unknown key"),
    ] {
        assert!(WHOLE.contains(found));
        let error = parse(&WHOLE.replacen(found, replaced, 1)).unwrap_err();
        let diagnostic = error.diagnostic().unwrap();
        assert_eq!((diagnostic.line(), diagnostic.key()), (line, key), "{error}");
        assert!(diagnostic.message().contains(words) && diagnostic.message().contains("expected") || words.contains("mean"), "{error}");
    }
    let one = "programs = [{ name = \"a\", port = \"[::1]:1\" }]";
    assert!(parse(one).unwrap_err().to_string().contains("a relay with 1 program: expected at least two"));
    assert!(parse("").unwrap_err().to_string().contains("programs: missing key"));
}

#[test]
fn the_file_of_the_manual_says_what_it_says_it_does() {
    let page = include_str!("../../../../docs/relay.md");
    let text = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let file = parse(text).unwrap();
    assert_eq!((file.title.as_str(), file.programs.len(), file.timeline.len()), ("three programs", 3, 1));
    // What the page calls defaults are defaults.
    assert_eq!(file.limits, RelayLimits::default());
    assert_eq!(file.links.between(0, 2).mean_delay(), Duration::from_millis(40));
}

#[test]
fn remote_addresses_are_taken_where_they_are_allowed() {
    let text = WHOLE.replace("seed = 7", "allow-remote = true").replace("127.0.0.1:7", "192.0.2.1:7");
    assert_eq!(parse(&text).unwrap().programs[0].port, "192.0.2.1:7001".parse().unwrap());
}

properties! {
    /// The parser panics neither at arbitrary text nor at a relay file with a piece cut out or put in.
    #[test]
    fn no_text_makes_it_panic(noise in "\\PC{0,60}", at in 0_usize..WHOLE.len(), cut in 0_usize..40) {
        let _ = parse(&noise);
        let end = (at + cut).min(WHOLE.len());
        let _ = parse(&format!("{}{noise}{}", &WHOLE[..at], &WHOLE[end..]));
    }
}

#[test]
fn the_keys_of_its_links_make_its_links() {
    let (file, overrides) = (Path::new("x.toml"), ["link.loss=1%".to_owned()]);
    let relay = RelayFile::parse(WHOLE, file, &overrides).unwrap();
    let keys = relay_link_keys_of_text(WHOLE, file, &overrides).unwrap();
    assert_eq!(keys.len(), 6);
    for ((from, to), keys) in &keys {
        assert_eq!(&keys.model(Path::new("")).unwrap(), relay.links.between(*from, *to), "{from} {to}: {keys}");
    }
    assert_eq!(keys[&(0, 1)].to_string(), "{ delay = \"24ms\", loss = \"1%\" }");
}
