//! Tests of devices that exchange late or not at each tick: the keys, and scenes in which such a device cannot be.

use cohaptic_peer::Exchange;

use super::{SCENE, parse, refused};

fn slow(keys: &str) -> String {
    SCENE.replace("damping = 5.0 }\ncoupling", &format!("damping = 5.0, {keys} }}\ncoupling"))
}

#[test]
fn exchanges_are_read_and_laid_over_those_of_all_peers() {
    let scene = parse(&slow("exchange-every = 100"), &["peers.left.device.exchange-age=1", "peers.right.device.exchange-every=1"]).unwrap();
    let exchanges: Vec<Exchange> = scene.peers.iter().map(|peer| peer.exchange).collect();
    assert_eq!(exchanges, [Exchange { every: 100, late: true }, Exchange::EACH_TICK]);
    assert_eq!(scene.peer_config(0).exchange, exchanges[0]);
}

/// Fingerprints of records are made of this text: a scene with the defaults keeps the text that it had without the keys.
#[test]
fn the_text_of_a_scene_names_slow_devices_alone() {
    let text = |scene: &str| format!("{:?}", parse(scene, &[]).unwrap());
    assert_eq!(text(&slow("exchange-every = 1, exchange-age = 0")), text(SCENE));
    for keys in ["exchange-every = 2", "exchange-age = 1"] {
        assert_ne!(text(&slow(keys)), text(SCENE), "{keys}");
    }
}

#[test]
fn a_scene_in_which_a_device_cannot_be_slow_is_refused() {
    let turns = ["scene.axes=3", "object.inertia=0.001"];
    for (keys, overrides, expected) in [
        ("exchange-every = 0", &[][..], "peer.device.exchange-every: 0 is out of range: expected a number of ticks, an integer from 1"),
        ("exchange-age = 2", &[], "peer.device.exchange-age: 2 is out of range: expected a number of exchanges, 0 or 1"),
        ("exchange-every = 101", &[], "peer.device.exchange-every: 101 ticks are 101ms: expected at most 100ms from one exchange to the next"),
        ("exchange-every = 26", &["peers.left.tick=4ms"], "peer.device.exchange-every: 26 ticks are 104ms"),
        ("exchange-every = 4294967295", &[], "peer.device.exchange-every: 4294967295 ticks are"),
        (
            "exchange-every = 2",
            &["peer.compute-delay=1"],
            "peer.device.exchange-every: readings and forces of a slow device have their delays already",
        ),
        ("exchange-age = 1", &["peers.left.compute-delay=1"], "peer.device.exchange-age: readings and forces of a slow device"),
        ("exchange-every = 2", &turns, "peer.device.exchange-every: an object that turns needs devices that exchange at each tick"),
        ("exchange-age = 1", &turns, "peer.device.exchange-age: an object that turns needs devices"),
        ("exchange-age = 1", &["coordination.strategy=client-server"], "the strategy client-server sends the state of a device at each update"),
    ] {
        let error = refused(&slow(keys), overrides).to_string();
        assert!(error.contains(expected), "{keys} {overrides:?}: {error}");
    }
    // An exchange at each tick fits everywhere, and an entry may replace what `[peer]` says.
    let each = slow("exchange-every = 1, exchange-age = 0");
    for overrides in [&["peer.compute-delay=1"][..], &turns, &["coordination.strategy=client-server"]] {
        parse(&each, overrides).unwrap();
    }
    let faster = ["peer.tick=4ms", "peers.left.tick=1ms", "peers.right.tick=500us"];
    parse(&slow("exchange-every = 100"), &faster).unwrap();
}
