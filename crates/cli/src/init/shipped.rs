//! The texts of the shipped scenes, compiled into the program. Scenes with a data file are left out, because a written scene would lack the file.

/// Alias names of shipped scenes, each with the scene's own name.
const OTHER_NAMES: [(&str, &str); 2] = [("paper/5-1", "paper/5-1-ap-2100"), ("paper/5-2", "paper/5-2-ap")];

/// Returns the own name and the text of the scene with the own name or alias `name`; `None` if no shipped scene has the name.
pub(super) fn find(name: &str) -> Option<(&'static str, &'static str)> {
    let name = OTHER_NAMES.iter().find(|(other, _)| *other == name).map_or(name, |(_, own)| own);
    SCENES.iter().copied().find(|(own, _)| *own == name)
}

/// Returns the names of all shipped scenes, aliases first.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    OTHER_NAMES.iter().map(|(other, _)| *other).chain(SCENES.iter().map(|(own, _)| *own))
}

macro_rules! shipped {
    ($($name:literal),* $(,)?) => {
        /// Name and text of each shipped scene. The name is the path of the file within `scenarios/`, without the extension.
        const SCENES: &[(&str, &str)] = &[$(($name, include_str!(concat!("../../scenarios/", $name, ".toml")))),*];
    };
}

shipped![
    "paper/5-1-ap-1000-no-arm",
    "paper/5-1-ap-1000",
    "paper/5-1-ap-2100-no-arm",
    "paper/5-1-ap-2100",
    "paper/5-1-pd-1000-no-arm",
    "paper/5-1-pd-1000",
    "paper/5-1-pd-2100-no-arm",
    "paper/5-1-pd-2100",
    "paper/5-2-ap",
    "paper/5-2-enclosure",
    "paper/5-2-pd",
    "coordination/client-server",
    "coordination/difference-mode-pd",
    "coordination/difference-mode",
    "coordination/extrapolated",
    "coordination/local-damping-throw",
    "coordination/local-damping",
    "coordination/local-lag",
    "coordination/measures",
    "coordination/momentum",
    "coordination/n2-pd",
    "coordination/n2",
    "coordination/n3-pd",
    "coordination/n3",
    "coordination/n5-pd",
    "coordination/n5",
    "coordination/n50",
    "coordination/n8",
    "coordination/passivity-control-throw",
    "coordination/passivity-control",
    "coordination/send-when",
    "coordination/set-position-throw",
    "coordination/set-position",
    "coordination/slow-device",
    "coordination/smoothed-average-position",
    "coordination/topology-relay",
    "coordination/topology-ring",
    "coordination/topology-star",
    "coordination/two-people",
    "coordination/wave-throw",
    "coordination/wave",
    "network/cells",
    "network/clock-offset-and-drift",
    "network/compute-delay",
    "network/constant-delay",
    "network/corrupt",
    "network/cross-traffic",
    "network/duplicate",
    "network/handover-spikes",
    "network/ideal",
    "network/in-order",
    "network/jitter-correlated",
    "network/jitter-normal",
    "network/jitter-uniform",
    "network/limit-and-mtu",
    "network/loss-correlated",
    "network/loss-four-state",
    "network/loss-gilbert-elliott",
    "network/loss-in-time",
    "network/loss-independent",
    "network/loss-pattern",
    "network/mark-instead-of-loss",
    "network/modulated",
    "network/netem-kernel",
    "network/netem",
    "network/outage-idle",
    "network/outage-random",
    "network/outage",
    "network/per-pair-links",
    "network/phases",
    "network/push-contact",
    "network/queue-codel",
    "network/queue-disciplines",
    "network/queue-fq-codel",
    "network/queue-red",
    "network/rate-and-queue",
    "network/reorder",
    "network/shared-access-line",
    "network/slots",
    "network/three-axes",
    "network/timeline",
    "network/token-bucket",
    "network/two-axes",
    "live/play",
    "live/three-falcons",
    "live/two-inverse3s",
    "live/two-and-a-program",
    "rigid/damped-spin",
    "rigid/damping-bound",
    "rigid/free-top",
    "rigid/half-turn",
    "rigid/precession",
    "rigid/tray",
    "tasks/any",
    "tasks/carry",
    "tasks/hold",
    "tasks/operator-reach",
    "tasks/operator-track",
    "tasks/path",
    "tasks/reach",
    "tasks/stop",
    "tasks/telesurgery",
    "tasks/together",
    "tasks/track",
    "counterexamples/ap-unaffected",
    "counterexamples/below-the-bound",
    "counterexamples/both-stable",
    "counterexamples/client-server-coupling",
    "counterexamples/damage-passes",
    "counterexamples/extrapolated-five",
    "counterexamples/healing-jump",
    "counterexamples/heals-and-diverges",
    "counterexamples/held-velocity",
    "counterexamples/local-lag-three",
    "counterexamples/passivity-by-velocity",
    "counterexamples/pd-decreases",
    "counterexamples/region-contains",
    "counterexamples/region-larger",
    "counterexamples/send-when-springs",
    "counterexamples/set-position-undamped",
    "counterexamples/stability-tests",
    "counterexamples/tick-counts",
    "counterexamples/turning-half-damping",
    "counterexamples/two-fingers",
    "counterexamples/wave-held",
];

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Compares [`SCENES`] with the files in `scenarios/`. Scenes that read a file of `scenarios/network/data` are not expected.
    #[test]
    fn every_scene_that_stands_alone_is_here() {
        let mut expected = Vec::new();
        let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        for file in cohaptic_scene::scene_files(&scenarios).unwrap() {
            if !std::fs::read_to_string(&file).unwrap().contains("data/") {
                let name = file.strip_prefix(&scenarios).unwrap().with_extension("");
                expected.push(name.to_str().unwrap().replace('\\', "/"));
            }
        }
        let mut here: Vec<String> = SCENES.iter().map(|(name, _)| (*name).to_owned()).collect();
        here.sort();
        expected.sort();
        assert_eq!(here, expected);
        assert!(OTHER_NAMES.iter().all(|(other, own)| find(other) == find(own) && find(own).is_some()));
    }
}
