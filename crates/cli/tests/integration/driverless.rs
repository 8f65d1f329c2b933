//! The program without the drivers of devices, which `.ci/nightly` builds: whatever runs in virtual time works, and the rest names the missing feature.

use crate::integration::desk::{Desk, shipped};

#[test]
fn what_needs_a_driver_names_its_feature() {
    let desk = Desk::new();
    let scene = shipped("live/three-falcons.toml");
    let way_out = "this program was built without the feature falcon. Expected a program from: cargo build -p cohaptic-cli --features falcon";
    let probe = desk.cohaptic("falcon probe --simulated");
    assert_eq!(probe.status, Some(3));
    assert!(probe.stderr.contains(&format!("cohaptic falcon: {way_out}")), "{}", probe.stderr);
    let live = desk.cohaptic(&format!("live '{}' --for 100ms --no-priority", scene.display()));
    assert_eq!(live.status, Some(2));
    assert!(live.stderr.contains(&format!("a peer of kind \"falcon\": {way_out}")), "{}", live.stderr);
    assert!(live.stderr.contains("three-falcons.toml:"), "{}", live.stderr);
}

#[test]
fn scenes_with_devices_are_read_and_run_in_virtual_time() {
    let desk = Desk::new();
    let scene = shipped("live/three-falcons.toml");
    for command in ["check", "explain", "run --no-plot"] {
        let outcome = desk.cohaptic(&format!("{command} '{}'", scene.display()));
        assert_eq!(outcome.status, Some(0), "{command}: {}", outcome.stderr);
    }
    // The keys of the device are checked too.
    let refused = desk.cohaptic(&format!("run '{}' --set peers.left.falcon.force-limit=-1", scene.display()));
    assert_eq!(refused.status, Some(2));
    assert!(refused.stderr.contains("force-limit"), "{}", refused.stderr);
    let masses = desk.cohaptic(&format!("live '{}' --for 100ms --no-priority --set peer.kind=simulated", scene.display()));
    assert_eq!(masses.status, Some(0), "{}", masses.stderr);
}
