//! Keys of a link that are refused, each with the place and the reason.

use cohaptic_scene::Scene;

use crate::link_keys::{CELL, SCENE, path, refused};

/// Returns the expected beginning and the found message if the message does not begin as expected; `None` if it does.
fn misses(text: &str, expected: &str) -> Option<String> {
    let found = refused(text, &[]);
    (!found.starts_with(expected)).then(|| format!("expected {expected}\nfound    {found}\n"))
}

#[test]
fn what_cannot_be_is_refused_with_the_reason() {
    let mut wrong = Vec::new();
    // The line of `[link]` is the fifth.
    for (keys, expected) in [
        (
            "jitter = { sd = \"1ms\", distribution = \"gauss\" }",
            "6:39: link.jitter.distribution: unknown name \"gauss\": expected one of normal, uniform",
        ),
        ("jitter = { distribution = \"gamma\" }", "6:10: link.jitter.sd: missing key"),
        (
            "jitter = { sd = \"1ms\", correlation = 0.1, correlation-time = \"1s\" }",
            "6:43: link.jitter.correlation-time: \"correlation\" was given before",
        ),
        (
            "jitter = { sd = \"1ms\", correlation-share = 0.5 }",
            "6:44: link.jitter.correlation-share: correlation-share means nothing without a memory in time: expected a key correlation-time too",
        ),
        (
            "delay = \"24ms\"\njitter = { sd = \"1ms\", correlation-time = \"1s\", correlation-share = 0 }",
            "7:10: link.jitter: found the share 0 of the variance with memory: expected a number above 0 and at most 1",
        ),
        ("jitter = { sd = \"1ms\", correlation = 1 }", "6:38: link.jitter.correlation: 1 is out of range: expected a number from -1 to below 1"),
        (
            "delay = \"24ms\"\njitter = { sd = \"9ms\", distribution = \"lognormal\", correlation = -0.99 }",
            "7:10: link.jitter: delays with this law cannot have the correlation -0.99",
        ),
        ("delay = \"1ms\"\njitter = { sd = \"1ms\", floor = \"2ms\" }", "7:10: link.jitter: the mean delay of 1ms is below the least delay of 2ms"),
        ("loss = { gilbert-elliott = { p = 0.1, r = 1.5 } }", "6:43: link.loss.gilbert-elliott.r: 1.5 is out of range"),
        (
            "loss = { gilbert-elliott = { p = 0.1, mean-good = \"1s\", mean-bad = \"1s\" } }",
            "6:30: link.loss.gilbert-elliott.p: p and mean times exclude each other",
        ),
        ("loss = { gilbert-elliott = { mean-good = \"0s\", mean-bad = \"1s\" } }", "6:42: link.loss.gilbert-elliott.mean-good: zero is out of range"),
        ("loss = { states = { p13 = 0.6, p14 = 0.6 } }", "6:19: link.loss.states: p13 = 60% and p14 = 60% are more than 1 together: expected a sum"),
        ("loss = { bursts = { loss = 0.5, length = 2, density = 0.4 } }", "6:19: link.loss.bursts: bursts need 0 ≤ isolated ≤ loss < density"),
        (
            "loss = { correlated = { probability = 0.1, correlation = -0.5 } }",
            "6:58: link.loss.correlated.correlation: events of probability 10% cannot",
        ),
        ("loss = { packets = [3, \"9-8\"] }", "6:24: link.loss.packets.1: \"9-8\" is not a row of packets"),
        ("loss = { packets = [3, 1] }", "6:24: link.loss.packets.1: span 1 begins before the one listed before it has ended"),
        ("loss = { packets = [3], every = 2 }", "6:33: link.loss.every: the pattern begins anew after 2"),
        ("loss = { correlated = 0.1, every = 2 }", "6:28: link.loss.every: every means nothing with correlated"),
        ("loss = { packets = [], times = [] }", "6:24: link.loss.times: \"packets\" was given before"),
        ("corrupt = { bit-error-rate = 0.1, bits = 3 }", "6:35: link.corrupt.bits: bits and bit-error-rate exclude each other"),
        ("corrupt = { probability = 0.1, bytes = \"8\\u2013\" }", "6:40: link.corrupt.bytes: \"8–\" is not a row of bytes"),
        ("corrupt = { probability = 0.1, bits = 0 }", "6:39: link.corrupt.bits: 0 is out of range"),
        ("reorder = { probability = 0.1, behind = 1 }", "6:11: link.reorder.at-most: missing key"),
        ("reorder = { probability = 0.1, gap = 2, later = \"1s\" }", "6:41: link.reorder.later: \"gap\" was given before"),
        ("reorder = { probability = 0.1, at-most = \"1s\" }", "6:32: link.reorder.at-most: at-most says how long a packet is held"),
        (
            "rate = \"1Mbit\"\nqueue = { limit = \"9 packets\", discipline = \"red\" }",
            "7:45: link.queue.discipline: red takes its thresholds from the limit",
        ),
        (
            "rate = \"1Mbit\"\nqueue = { limit = \"9kB\", discipline = \"fifo\" }",
            "7:39: link.queue.discipline: unknown name \"fifo\": expected one of tail-drop",
        ),
        (
            "rate = \"1Mbit\"\nqueue = { limit = \"9kB\", discipline = { red = { min = \"2kB\", max = \"1kB\" } } }",
            "7:68: link.queue.discipline.red.max: RED begins to drop at 2000B and drops all at 1000B",
        ),
        ("rate = \"1Mbit\"\noverhead = \"-3GB\"", "7:12: link.overhead: unknown unit \"GB\""),
        ("rate = \"1Mbit\"\noverhead = \"-3000MB\"", "7:12: link.overhead: \"-3000MB\" is out of range"),
        ("rate = \"1Mbit\"\ncells = { payload = \"0B\" }", "7:21: link.cells.payload: 0B is out of range"),
        ("cells = { payload = \"48B\" }", "6:1: link.cells: cells means nothing on a link without a rate"),
        ("cross-traffic = { trace = \"cross.csv\" }", "6:1: link.cross-traffic: cross-traffic means nothing on a link without a rate"),
        ("rate = \"1Mbit\"\ncross-traffic = {}", "7:17: link.cross-traffic: no key is given: expected \"none\""),
        ("rate = \"1Mbit\"\ncross-traffic = { poisson = { size = \"1B\" } }", "7:29: link.cross-traffic.poisson.rate: missing key"),
        (
            "rate = \"1Mbit\"\ncross-traffic = { poisson = { rate = \"1kbit\", size = \"0B\" } }",
            "7:54: link.cross-traffic.poisson.size: cross packets without bytes",
        ),
        (
            "rate = \"1Mbit\"\ncross-traffic = { poisson = { rate = \"1Mbit\" } }",
            "7:17: link.cross-traffic: cross-traffic alone needs 100 % of the line, and a queue without a limit",
        ),
        ("trace = \"line.trace\"\ncross-traffic = { poisson = { rate = \"1Gbit\" } }", "7:17: link.cross-traffic: cross-traffic alone needs"),
        (
            "rate = \"1Mbit\"\ncross-traffic = { on-off = { sources = 1, peak = \"1Mbit\", on = \"1s\", off = \"1s\", shape = 2 } }",
            "7:90: link.cross-traffic.on-off.shape: a Pareto law of shape 2: expected a shape above 1",
        ),
        (
            "rate = \"1Mbit\"\ncross-traffic = { on-off = { sources = 1, peak = \"1Mbit\", on = \"1ms\", off = \"1s\" } }",
            "7:64: link.cross-traffic.on-off.on: a packet takes 12ms at the peak rate",
        ),
        ("rate = \"1Mbit\"\ntrace = \"line.trace\"", "7:1: link.trace: a line cannot have a rate and a recording"),
        ("token-bucket = { rate = \"1Mbit\" }", "6:16: link.token-bucket.burst: missing key"),
        ("slots = { min = \"2ms\", max = \"1ms\" }", "6:30: link.slots.max: gaps between slots of 2ms to 1ms"),
        ("slots = { min = \"2ms\", delay = \"1ms\" }", "6:24: link.slots.delay: delay and min exclude each other"),
        ("limit = \"64kB\"", "6:9: link.limit: \"64kB\" is not a number of packets"),
        ("outage = { random = { up = \"0s\", down = \"1s\" } }", "6:28: link.outage.random.up: a span that cannot be drawn"),
        ("outage = { random = { up = { uniform = [\"1s\"] }, down = \"1s\" } }", "6:40: link.outage.random.up.uniform: a list of 1"),
        ("netem = \"delay 20ms loss 250%\"", "6:26: link.netem: \"250%\" is not what loss takes here: expected a percentage"),
        ("netem = \"dealy 20ms\"", "6:10: link.netem: unknown word \"dealy\""),
        ("netem = \"loss 1% delay 1ms 2ms\"", "6:18: link.netem: delay: uniform jitter of 2ms around 1ms begins below zero"),
        ("delay = \"1ms\"\nnetem = \"delay 2ms\"", "7:1: link.netem: netem and delay exclude each other: netem says everything about this link"),
        ("netem-profile = \"exact\"", "6:1: link.netem-profile: netem-profile means nothing without words"),
        ("netem = \"delay 300s\"\nnetem-profile = \"kernel-6.6\"", "6:9: link.netem: a delay of 300s: expected less than"),
        ("replay = \"fates.csv\"\nnetem = \"delay 2ms\"", "7:1: link.netem: netem and replay exclude each other"),
        ("modulated = { by = \"nobody\" }", "6:20: link.modulated.by: there is no modulator \"nobody\": expected an entry [[modulators]]"),
        ("modulated = { good = {} }", "6:13: link.modulated: missing key by"),
    ] {
        wrong.extend(misses(&format!("[link]\n{keys}"), &format!("links.toml:{expected}")));
    }
    wrong.extend(misses(
        "[link]\nrate = \"1Mbit\"\ncross-traffic = { trace = \"path.csv\" }",
        "path.csv:1:1: link.cross-traffic.trace: no recording of cross-traffic: expected the columns t,bytes",
    ));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_modulator_that_cannot_be_is_refused() {
    let mut wrong = Vec::new();
    for (text, expected) in [
        ("modulators = [{ name = \"m\", states = [] }]", "5:38: modulators.m.states: no state: expected at least one"),
        ("modulators = [{ states = [{ name = \"a\" }] }]", "5:15: modulators.0.name: missing key"),
        (
            "modulators = [{ name = \"m\", states = [{ name = \"a\", sojourn = \"1s\" }] }]",
            "5:39: modulators.m.states.a: the state \"a\" ends, and no other",
        ),
        (
            "modulators = [{ name = \"m\", states = [{ name = \"a\", sojourn = \"1s\", next = \"b\" }] }]",
            "5:76: modulators.m.states.a.next: there is no state \"b\": expected a",
        ),
        ("modulators = [{ name = \"m\", states = [{ name = \"by\" }] }]", "5:48: modulators.m.states.by.name: \"by\" cannot be this name"),
        (
            "modulators = [{ name = \"m\", states = [{ name = \"a\" }] }, { name = \"m\", states = [{ name = \"a\" }] }]",
            "5:67: modulators.m.name: there is a modulator \"m\" already",
        ),
        (
            &format!("link.modulated = {{ by = \"cell\", goood = {{}} }}\n{CELL}"),
            "5:33: link.modulated.goood: modulator \"cell\" has no such state: expected by, or one of good, bad, worse; did you mean \"good\"?",
        ),
        (
            &format!("link.modulated = {{ by = \"cell\", good = {{ netem = \"delay 1ms\" }} }}\n{CELL}"),
            "5:42: link.modulated.good.netem: unknown key",
        ),
    ] {
        wrong.extend(misses(text, &format!("links.toml:{expected}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_word_of_tc_is_found_in_an_override_too() {
    let found = refused("", &["link.netem=delay 20ms loss 250%"]);
    let expected = "--set link.netem=delay 20ms loss 250%: link.netem: \"250%\" is not what loss takes here: expected a percentage from 0 to 100\n \
                    |\n | link.netem=delay 20ms loss 250%\n |                            ^^^^";
    assert_eq!(found, expected);
}

#[test]
fn what_is_laid_over_words_of_tc_is_refused() {
    let found = refused("link.netem = \"delay 5ms\"\n[[timeline]]\nat = \"1s\"\nlink = \"all\"\nset = { loss = 0.1 }", &[]);
    assert!(found.starts_with("links.toml:9:9: timeline.0.set.loss: loss and netem exclude each other"), "{found}");
}

#[test]
fn a_recording_that_makes_no_sense_is_shown_in_its_line() {
    let mut wrong = Vec::new();
    for (keys, expected) in [
        ("trace = \"bad.trace\"", "bad.trace:2:1: link.trace: 2 ms comes after 3 ms: expected times in order\n  |\n2 | 2\n"),
        ("trace = \"ends-at-0.trace\"", "ends-at-0.trace:1:1: link.trace: the recording ends at 0 ms: expected a last line above 0"),
        ("trace = \"bad-path.csv\"", "bad-path.csv:3:1: link.trace: column loss: expected a probability from 0 to 1"),
        ("trace = \"hand.csv\"", "hand.csv:1:1: link.trace: no recording: expected the columns t,delay"),
        (
            "trace = \"late-path.csv\"",
            "late-path.csv:3:1: link.trace: the recording begins at 9s, and the run ends at 9s: expected times since the start of the run, or start = \"first\"",
        ),
        ("trace = \"since-1970.csv\"", "since-1970.csv:2:1: link.trace: the recording begins at 1700000000s, and the run ends at 9s"),
        ("trace = { file = \"line.trace\", start = \"first\" }", "links.toml:6:32: link.trace.start: start is for a recorded path"),
        ("trace = { file = \"line.trace\", repeat = true }", "links.toml:6:32: link.trace.repeat: repeat is for a recorded path"),
        ("trace = { file = \"path.csv\", bytes = \"1B\" }", "links.toml:6:30: link.trace.bytes: bytes is for instants of delivery"),
        ("replay = \"bad-fates.csv\"", "bad-fates.csv:2:1: link.replay: column fate: found \"vanished\", expected delivered, duplicated"),
        (
            "jitter = { sd = \"1ms\", distribution = { table = \"bad.dist\" } }",
            "bad.dist:2:1: link.jitter.distribution.table: column 3: `x` is not an integer",
        ),
        ("netem = \"delay 9ms 1ms distribution bad\"", "bad.dist:2:1: link.netem: column 3: `x` is not an integer"),
        ("netem = \"delay 9ms 1ms distribution bad\"\nnetem-profile = \"kernel-6.6\"", "bad.dist:2:1: link.netem: column 3: `x` is not an integer"),
        (
            "jitter = { distribution = { empirical = \"path.csv\" } }",
            "path.csv:1:1: link.jitter.distribution.empirical: the header is \"t,delay,loss\": expected delay",
        ),
    ] {
        wrong.extend(misses(&format!("[link]\n{keys}"), expected));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let found = refused("[link]\ntrace = \"bad.trace\"", &[]);
    assert!(found.contains("note: this file is named at links.toml:6:9, by the key link.trace"), "{found}");
}

#[test]
fn a_recording_that_is_not_there_is_an_error_of_the_system() {
    for keys in
        ["trace = \"gone\"", "replay = \"gone\"", "netem = \"delay 9ms 1ms distribution gone\"", "jitter = { distribution.empirical = \"gone\" }"]
    {
        let error = Scene::parse(&format!("{SCENE}[link]\n{keys}"), path(), &[]).expect_err(keys);
        assert!(error.is_io(), "{error}");
        assert_eq!(error.diagnostic().unwrap().line(), 6);
    }
}
