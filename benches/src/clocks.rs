//! Peers with clocks of their own.

use std::time::Duration;

use cohaptic_peer::Drift;
use cohaptic_scene::Scene;

/// The largest drift either way \[ppm\]: that of ordinary quartz.
pub const PPM: u16 = 50;

/// The scene with an offset within a tick and a drift for each peer.
///
/// # Panics
///
/// With a drift that is none, which a test would show.
#[must_use]
pub fn with_own_clocks(mut scene: Scene) -> Scene {
    for (peer, place) in scene.peers.iter_mut().zip(0_u32..) {
        peer.clock.offset = Duration::from_nanos(u64::from(place) * 7_919_317 % 1_000_000);
        let parts = f64::from(place * 37 % (2 * u32::from(PPM) + 1)) - f64::from(PPM);
        peer.clock.drift = Drift::from_fraction(parts * 1e-6).expect("some parts per million are a drift");
    }
    scene
}

#[cfg(test)]
mod tests {
    use cohaptic_harness::{Model, NoObserver, Simulation, same_shape};

    use super::*;
    use crate::Mesh;
    use crate::watched::WithEvents;

    /// What the table compares is one result in two ways, the first of them in arrays.
    #[test]
    fn clocks_of_their_own_run_in_arrays_to_what_events_come_to() {
        for mesh in Mesh::ALL {
            let scene = with_own_clocks(mesh.scene(100, 1));
            assert!(same_shape(&scene, &scene));
            let Ok(in_arrays) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
            let Ok(with_events) = Simulation::new(&scene, Model::Least).run(&mut WithEvents);
            assert_eq!(in_arrays, with_events, "{mesh:?}");
        }
    }
}
