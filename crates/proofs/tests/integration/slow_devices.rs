//! Proofs of scenes with devices that exchange late or not at each tick.

use cohaptic_proofs::{Effort, Links, Patterns, ProvenRegion, prove_every_number, prove_switching, worst_case};
use cohaptic_scene::Scene;
use cohaptic_stability::{Family, KeyRange, Unwatched};

const SCENE: &str = r#"
    scene = { duration = "1s", count = 2 }
    object = { mass = 0.45 }
    coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link = { delay = "8ms" }
"#;

/// Boxes and numbers of peers follow slow devices. Other proofs refuse slow devices by name, and so do certificates, whose checker does not derive such frames.
#[test]
fn what_does_not_follow_slow_devices_says_so() {
    const SLOW: &str = "peer.device.exchange-every=2";
    let refused = |what: &str, found: String| {
        let expected = format!("{what} does not follow the device of peer1, which exchanges late or not at each tick: ");
        assert!(found.starts_with(&expected), "{what}: {found}");
    };
    let of = |set: &[&str]| {
        let overrides: Vec<String> = [&[SLOW], set].concat().into_iter().map(str::to_owned).collect();
        Scene::parse(SCENE, "two.toml".as_ref(), &overrides).unwrap()
    };
    refused("the mean square", prove_every_number(&of(&["link.loss=10%"]), 2, Some(3), &Unwatched).unwrap_err().to_string());
    refused(
        "a proof of wave coordination",
        prove_every_number(&of(&["coordination.strategy=wave"]), 2, Some(3), &Unwatched).unwrap_err().to_string(),
    );
    let pushed = of(&["peers=[{ name = \"peer2\", contact = { push = \"+x\" } }]"]);
    refused("the proof of contacts that switch", prove_switching(&pushed, &Unwatched).unwrap_err().to_string());
    let patterns = Patterns { losses_in_a_row: 1, delay: None, links: Links::Together };
    refused("the worst case", worst_case(&of(&[]), &patterns, &Effort::default()).unwrap_err().to_string());
    let without = |found: String| assert!(found.starts_with("a device that exchanges late or not at each tick has no certificate"), "{found}");
    without(prove_every_number(&of(&[]), 2, Some(3), &Unwatched).unwrap().certify(&of(&[]), &Unwatched).unwrap_err().to_string());
    let keys = ["coordination.stiffness=100..6000", "coordination.damping=0..60"].map(|key| KeyRange::parse(key).unwrap());
    let family = Family::new(SCENE, "two.toml".as_ref(), &[SLOW.to_owned()], keys.to_vec()).unwrap();
    without(ProvenRegion::prove(&family, 1, None, &Unwatched).unwrap().certify(&family, &Unwatched).unwrap_err().to_string());
}
