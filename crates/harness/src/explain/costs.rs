//! Tests of the expected cost of a run, by the way of running.

use std::path::Path;

use cohaptic_scene::Scene;

use super::explain;

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
