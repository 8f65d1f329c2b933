//! Force on the hand of a joined peer with a device: direction and size by the laws of springs.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_units::Instant;

use crate::join::{at, pass, peer};

/// Device that a hand holds still, and the force on the hand \[N\].
struct Still {
    position: [f64; 3],
    force: Arc<Mutex<[f64; 3]>>,
}

impl Device for Still {
    fn description(&self) -> Description {
        Description { name: "still".to_owned(), motions: 3, force: 20.0, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        Stopper::default()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        Some(Reading { position: self.position, velocity: [0.0; 3] })
    }

    fn hold(&mut self, _now: Instant, _span: Duration, force: GatedForce) {
        *self.force.lock().unwrap() = force.newtons();
    }
}

/// In rest the object hangs between two springs in a row: the coupling of 1000 N/m to the hand, and the coordination of 500 N/m to the other peer, which the
/// scene holds at 0. Both springs together have 1000·500/(1000 + 500) = 1000/3 N/m, so a hand at 9 mm is pulled back by 3 N, and the object rests at 6 mm.
#[test]
fn a_still_hand_is_pulled_towards_the_object_by_the_spring_between_them() {
    let force = Arc::default();
    let device = Still { position: [0.009, -0.006, 0.003], force: Arc::clone(&force) };
    let overrides = [
        "scene.axes=3",
        "peers.left.kind=falcon",
        "peers.left.hand.force=[0.0, 0.0, 0.0]",
        "peers.left.silence.fade=100ms",
        "peers.left.coupling={ stiffness = 1000.0, damping = 5.0 }",
    ];
    let mut left = peer(&overrides, None, Some(Box::new(device)));
    // Oscillations of the object die out by 10/(2·0.225) = 22 1/s after the rise of the coupling. After a second without samples the coupling would end.
    pass(&mut left, at(999_000), &mut |_| ());
    let (status, found) = (left.status(at(999_000)), *force.lock().unwrap());
    for (axis, [on_hand, rests]) in [[-3.0, 0.006], [2.0, -0.004], [-1.0, 0.002]].into_iter().enumerate() {
        assert!((found[axis] - on_hand).abs() < 1e-6, "{found:?}");
        assert!((status.object.position[axis] - rests).abs() < 1e-8, "{status:?}");
        // The coupling force of the status acts on the object.
        assert!((status.force[axis] + on_hand).abs() < 1e-6, "{status:?}");
    }
}
