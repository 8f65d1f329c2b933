//! The reduction by symmetry against the general path.

use cohaptic_stability::{Method, analyse};

use crate::anchors::scene;

#[track_caller]
fn agree(overrides: &[&str]) {
    let scene = scene(overrides);
    let (reduced, full) = (analyse(&scene, Method::Reduced).unwrap(), analyse(&scene, Method::Full).unwrap());
    let apart = (reduced.radius.value - full.radius.value).abs();
    assert!(apart < 1e-10 * full.radius.value.max(1.0), "{overrides:?}: reduced {:?}, full {:?}", reduced.radius, full.radius);
    assert_eq!((reduced.rigid_modes, reduced.dimension), (full.rigid_modes, full.dimension), "{overrides:?}");
}

#[test]
fn equal_peers() {
    for strategy in ["average-position", "proportional-derivative"] {
        for delay in ["0ms", "3ms", "8ms", "11.3ms", "24ms"] {
            for count in ["2", "3", "5"] {
                agree(&[&format!("coordination.strategy={strategy}"), &format!("link.delay={delay}"), &format!("scene.count={count}")]);
            }
        }
    }
}

#[test]
fn some_touch_and_some_do_not() {
    agree(&["peers.peer3.contact=none"]);
    agree(&["peers.peer2.contact=none", "peers.peer3.contact=none", "scene.count=4", "link.delay=24ms"]);
    agree(&["peer.contact=none"]);
    agree(&["peers.peer1.hand={ arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } }", "peers.peer3.contact=none"]);
    agree(&["peers.peer3.hand={ arm = { mass = 0.3, damping = 10.0, stiffness = 100.0 } }", "peers.peer3.contact=none"]);
}

#[test]
fn all_peers_are_different() {
    agree(&[
        "peers.peer1.device.mass=0.2",
        "peers.peer2.coupling.stiffness=2000.0",
        "peers.peer3.phase=3",
        "links.peer1.peer2.delay=13ms",
        "links.peer3.peer1.delay=40.5ms",
    ]);
    agree(&["peers.peer1.tick=2ms", "peers.peer2.tick=0.5ms", "peers.peer3.clock={ offset = '0.3ms' }"]);
    agree(&["peers.peer2.clock={ drift = 0.05 }"]);
    agree(&["peer.clock={ drift = -0.01 }", "peers.peer1.clock={ offset = '2.5ms', drift = -0.01 }"]);
    agree(&["peer.compute-delay=1"]);
    agree(&["peers.peer1.compute-delay=1", "scene.axes=3"]);
}
