//! Tests of the explanation: the texts for links (each configured stage with its numbers, and the simulation of queues), and the expected cost of a run by the
//! way of running.

use std::path::Path;

use cohaptic_scene::Scene;

use super::explain;

/// Returns a scene of two peers with samples of 64 bytes every 8 ms, over links with the given keys.
fn scene(keys: &str) -> Scene {
    let text = format!(
        "modulators = [{{ name = \"cell\", states = [{{ name = \"a\", sojourn = \"2s\" }}, {{ name = \"b\", sojourn = {{ fixed = \"1s\" }} }}] }}]\n\
         scene = {{ duration = \"1s\", count = 2 }}\nobject.mass = 1\npeer.contact = \"none\"\npeer.device.mass = 1\n\
         coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\n[link]\n{keys}"
    );
    Scene::parse(&text, Path::new("x.toml"), &[]).unwrap_or_else(|error| panic!("{error}"))
}

fn described(keys: &str) -> String {
    scene(keys).links.between(0, 1).words()
}

/// A line of 64 kbit/s takes 8 ms for a sample, just the time until the next sample.
#[test]
fn queues_in_which_no_sample_waits_are_left_out() {
    let queues = |keys: &str| {
        let found = explain(&scene(keys)).models;
        let row = |part: &str| found.iter().find(|row| row.part == part).map(|row| (row.model.clone(), row.reason.clone()));
        (row("queues in arrays"), row("packets on the way").map(|(model, _)| model))
    };
    let told = |keys: &str, model: &str, reason: &str, way: &str| {
        let expected = (Some((model.to_owned(), reason.to_owned())), Some(way.to_owned()));
        assert_eq!(queues(keys), expected, "{keys}");
    };
    let no_wait = "samples of a link come at least 8ms apart, and each has left by then";
    let codel = "queue = { limit = \"9 packets\", discipline = \"codel\" }";
    told(&format!("rate = \"64kbit\"\n{codel}"), "none: no sample waits", no_wait, "a ring");
    told("token-bucket = { rate = \"64kbit\", burst = \"64B\" }", "none: no sample waits", no_wait, "a ring");
    told(&format!("rate = \"64kbit\"\njitter = \"1ms\"\ndelay = \"9ms\"\n{codel}"), "none: no sample waits", no_wait, "a calendar queue");
    let one_size = "samples have one size, and the newest is dropped where there is no room";
    told("rate = \"63kbit\"", "when the sample before left the line", one_size, "a calendar queue");
    let until = "samples of a link come at least 8ms apart: until then nothing new can be known";
    told(&format!("rate = \"63kbit\"\n{codel}"), "from one sample of a link to its next", until, "a calendar queue");
    // Samples that would never wait for each other wait for cross packets.
    let beside = format!("{until}; cross packets are computed one by one when a sample meets them");
    told("rate = \"64Mbit\"\ncross-traffic.poisson.rate = \"6Mbit\"", "from one sample of a link to its next", &beside, "a calendar queue");
    assert_eq!(queues("delay = \"9ms\"").0, None);
    // A limit needs events, and runs with events have no such row.
    assert_eq!(queues("rate = \"64kbit\"\nlimit = \"9 packets\""), (None, Some("a calendar queue".to_owned())));
}

#[test]
fn the_analysis_of_persons_is_that_of_their_law() {
    let stability = |task: &str| {
        let text = format!(
            "scene.duration = \"9s\"\nscene.count = 2\nobject.mass = 1\npeer = {{ coupling.stiffness = 9, device.mass = 1, hand.operator = {{}} }}\n\
             coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"8ms\" }}\n[task]\n{task}"
        );
        let scene = Scene::parse(&text, Path::new("x.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
        let rows = explain(&scene).models.into_iter().filter(|row| row.part.starts_with("stability"));
        rows.map(|row| (row.part.clone(), row.model)).collect::<Vec<_>>()
    };
    let told = |part: &str, model: &str| vec![(format!("stability with operators who {part}"), model.to_owned())];
    let tracks = "kind = \"track\"\nsines = [{ amplitude = 0.02, frequency = 0.1 }]";
    assert_eq!(stability(tracks), told("track", "wanted and seen places are states of a frame"));
    assert_eq!(stability("kind = \"reach\"\ntargets = [0.1]\nradius = 0.01"), told("make movements", "their arms alone"));
}

#[test]
fn every_stage_is_described_with_its_numbers() {
    for (keys, expected) in [
        ("mtu = \"100B\"", "packets of at most 100B, then delay 0s"),
        ("outage.random = { up = \"30s\", down = { fixed = \"1s\" } }", "random outages (up exponential, 30s, down always 1s), then delay 0s"),
        ("outage.idle = { after = \"10s\", down = \"2s\" }", "an outage of 2s after 10s without a packet, then delay 0s"),
        ("loss.correlated = { probability = \"5%\", correlation = 0.5 }", "loss of 5% (correlation 0.5), then delay 0s"),
        (
            "loss.gilbert-elliott = { mean-good = \"160ms\", mean-bad = \"40ms\" }",
            "Gilbert-Elliott loss in time (good 160ms, bad 40ms), 20% on average, then delay 0s",
        ),
        ("loss = \"1%\"\nmark-instead-of-loss = true", "independent loss 1% (marked, not lost), then delay 0s"),
        ("loss = { packets = [0], every = 10 }", "loss of chosen packets, 10% on average, then delay 0s"),
        ("duplicate = 0.25", "25% sent twice, then delay 0s"),
        (
            "corrupt = { probability = \"1%\", bits = 3, bytes = \"8-15\", checksum = \"passes\" }",
            "3 bits flipped in 1%, bytes 8 to 15 (handed over), then delay 0s",
        ),
        ("limit = \"9 packets\"", "at most 9 packets inside, then delay 0s"),
        (
            "token-bucket = { rate = \"1Mbit\", burst = \"10kB\", limit = \"50ms\" }",
            "queue (50ms) before a token bucket of 10000B at 1Mbit, then delay 0s",
        ),
        (
            "rate = \"1Mbit\"\noverhead = \"-14B\"\ncells.payload = \"48B\"\nqueue = { limit = \"9 packets\", discipline = \"codel\" }",
            "queue (9 packets, CoDel 5ms in 100ms) before 1Mbit, -14 bytes a packet, in cells of 48+0 bytes, then delay 0s",
        ),
        (
            "rate = \"10Mbit\"\ncross-traffic = { on-off = { sources = 10, peak = \"2Mbit\", on = \"200ms\", off = \"800ms\" } }",
            "queue (unlimited) before 10Mbit, shared with cross-traffic (10 on-off sources, 2Mbit in packets of 1500B for 200ms, then silent for 800ms on average, \
             Pareto of shape 1.5), then delay 0s",
        ),
        ("slots = { min = \"10ms\", packets = 2 }", "slots every 10ms for 2 packets, then delay 0s"),
        ("reorder = { probability = \"5%\", behind = 1, at-most = \"50ms\" }", "5% held until 1 have passed, at most 50ms, then delay 0s"),
        (
            "delay = \"24ms\"\njitter = { sd = \"2ms\", distribution = \"gamma\", floor = \"20ms\", correlation-time = \"1s\" }",
            "delay 24ms, gamma jitter of 2ms, never below 20ms, correlated over 1s",
        ),
        ("netem = \"delay 20ms\"", "delay 20ms (rate and slots behind the delay, as in netem)"),
        ("netem = \"delay 20ms\"\nnetem-profile = \"kernel-6.6\"", "netem of Linux 6.6, to the bit: delay 20ms"),
        (
            "modulated = { by = \"cell\", b = { delay = \"9ms\" } }",
            "as \"cell\" goes; state 1 (exponential, 2s): delay 0s; state 2 (always 1s): delay 9ms",
        ),
    ] {
        assert_eq!(described(keys), expected);
    }
}

/// Links of the library are named with their versions, also those without a modulator and those of changes.
#[test]
fn links_of_the_library_are_named() {
    let row = |text: &str| explain(&scene(text)).models.into_iter().find(|row| row.part == "links of the library").map(|row| row.model);
    assert_eq!(row("delay = \"1ms\""), None);
    assert_eq!(row("profile = \"transatlantic\"").as_deref(), Some("transatlantic@1"));
    let change = "profile = \"dsl/down\"\n[[timeline]]\nat = \"100ms\"\nlink = \"all\"\nset = { profile = \"starlink/up\" }";
    assert_eq!(row(change).as_deref(), Some("dsl@1/down, starlink@1/up"));
    let access = "delay = \"1ms\"\n[[peers]]\nname = \"peer1\"\naccess = \"dsl\"\nuplink.profile = \"cable/up\"";
    assert_eq!(row(access).as_deref(), Some("cable@1, dsl@1/down"));
}

/// Returns the processor time of a simulated second of ten peers [ms].
fn busy(link: &str, clock: &str) -> f64 {
    let text = format!(
        "scene = {{ duration = \"1s\", count = 10 }}\nobject.mass = 1\npeer = {{ contact = \"none\", device.mass = 1 }}\nlink = {{ {link} }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 1, update = \"10ms\" }}\npeers = [{{ name = \"peer1\"{clock} }}]\n"
    );
    let scene = Scene::parse(&text, Path::new("x.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
    1e3 / explain(&scene).cost.realtime_factor
}

/// Each second has 10,000 ticks and 9,000 packets.
#[test]
fn lockstep_costs_less_than_events() {
    for (link, clock, nanos) in [
        ("delay = \"24ms\"", "", 10_000.0 * 8.0 + 9000.0),
        ("delay = \"24ms\"", ", clock.drift = \"10ppm\"", 10_000.0 * 12.0 + 9000.0 * 20.0),
        ("delay = \"24ms\", jitter = \"2ms\"", "", 10_000.0 * 8.0 + 9000.0 * 25.0),
        ("delay = \"24ms\", jitter = \"2ms\"", ", clock.drift = \"10ppm\"", 10_000.0 * 12.0 + 9000.0 * 45.0),
        ("delay = \"24ms\", jitter = \"2ms\", corrupt = \"1%\"", "", 10_000.0 * 12.0 + 9000.0 * 45.0),
    ] {
        let found = busy(link, clock);
        assert!((found - nanos * 1e-6).abs() < 1e-9, "{link}, {clock}: {found} ms");
    }
}

/// A person is described with all parameters, and equal persons share a row.
#[test]
fn operators_are_described_with_their_parameters() {
    let found = |overrides: &[&str]| {
        let text = "scene = { duration = \"1s\", count = 2 }\nobject.mass = 1\nlink.delay = \"24ms\"\n\
                    coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }\n\
                    peer = { device.mass = 1, coupling.stiffness = 1, hand = { operator = { sees = \"peer2\" } } }\n\
                    task = { kind = \"reach\", targets = [0.1], radius = 0.01 }";
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let scene = Scene::parse(text, Path::new("x.toml"), &overrides).unwrap_or_else(|error| panic!("{error}"));
        let explanation = explain(&scene);
        assert!(explanation.left_out.iter().any(|row| row == "arrays: an operator sees and moves at each tick; the run has events"));
        let draws = !explanation.left_out.iter().any(|row| row.starts_with("random numbers"));
        assert_eq!(draws, explanation.models.iter().any(|row| row.model.contains("noise 0.1")));
        let rows = explanation.models.into_iter().filter(|row| row.part.starts_with("operator"));
        rows.map(|row| (row.part, row.model)).collect::<Vec<_>>()
    };
    let arm = "an arm of 0.5 kg, 20 N·s/m and 300 N/m";
    let usual = "movements of 250ms, the first after 250ms, noise 0.1 of the length; learns the gain by 0.2 of each movement; waits for a delay of";
    let row = |part: &str, model: String| (part.to_owned(), model);
    assert_eq!(
        found(&[]),
        [
            row("operator of peer1", format!("{usual} 48ms; sees the newest sample of peer2, 200ms late; {arm}")),
            row("operator of peer2", format!("{usual} 0s; sees the own copy, 200ms late; {arm}")),
        ]
    );
    let plain = "peer.hand.operator={ speed = 0.5, step = 0.02, noise = 0, learns = 0 }";
    let limited =
        "movements of 250ms, the first after 250ms, with at most 0.5 m/s, at most 0.02 m long; takes the gain for 1; waits for a delay of 0s";
    assert_eq!(found(&[plain]), [row("operator of peer1, peer2", format!("{limited}; sees the own copy, 200ms late; {arm}"))]);
    let tracks = ["task={ kind = \"track\", sines = [{ amplitude = 0.1, frequency = 0.5 }] }", "peer.hand.operator={ visual-delay = \"150ms\" }"];
    let crossover = "crossover: the velocity of the hand is 3 rad/s times the error; sees the own copy, 150ms late";
    assert_eq!(found(&tracks), [row("operator of peer1, peer2", format!("{crossover}; {arm}"))]);
}

/// `explain` names the use of displacements by a server, and the forces of its clients, only where a scene changes the defaults.
#[test]
fn displacements_and_missing_forces_are_said() {
    let of = |sends: &str, returns: &str| {
        let changes = [
            "coordination.strategy=client-server".to_owned(),
            format!("coordination.client-server={{ sends = \"{sends}\", returns = \"{returns}\" }}"),
        ];
        let text = "scene = { duration = \"1s\", count = 2 }\nobject.mass = 1\npeer = { device.mass = 1, coupling.stiffness = 9 }\n\
                    coordination = { strategy = \"average-position\", stiffness = 1, update = \"8ms\" }";
        let scene = Scene::parse(text, Path::new("x.toml"), &changes).unwrap_or_else(|error| panic!("{error}"));
        let explanation = explain(&scene);
        let sums = explanation
            .models
            .iter()
            .any(|row| row.part == "positions of clients at the server" && row.reason.contains("a lost sample loses motion"));
        (sums, explanation.left_out.iter().any(|what| what.contains("returns = \"none\"")))
    };
    assert_eq!((of("states", "force"), of("increments", "object"), of("states", "none")), ((false, false), (true, false), (false, true)));
}
