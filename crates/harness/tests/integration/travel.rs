//! The measure of travel beside the positions that an observer sees.

use std::path::Path;

use cohaptic_harness::check::check_with;
use cohaptic_harness::measures::Measures;
use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_scene::Scene;

/// Index of a peer, and the instants \[s\] and positions \[m\] of its copy.
struct Copy(usize, Vec<(f64, f64)>);

impl Observer for Copy {
    type Error = std::convert::Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Self::Error> {
        if row.peer == self.0 {
            self.1.push((row.at.as_secs_f64(), row.object.position[0]));
        }
        Ok(())
    }
}

/// The user of a client is 5 cm away from the object, which belongs to the server and begins at 0. The client's copy travels 2 cm in the time between the
/// recorded positions, not in no time.
#[test]
fn the_copy_of_a_client_travels_from_where_it_begins() {
    let text = "scene.duration = \"2s\"\nobject.mass = 0.45\nlink.delay = \"8ms\"\ncoordination = { strategy = \"client-server\", stiffness = 0.0, update = \"8ms\" }\n\
        peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 100.0, damping = 5.0 } }\n\
        peers = [{ name = \"server\", contact = \"none\" }, { name = \"left\", position = 0.05, hand = { force = 1.5 } }]\n\
        measure.names = [\"travel_s\"]\nmeasure.travel = { peer = \"left\", distance = 0.02 }\n\
        expect.travel = [{ peer = \"left\", distance = 0.02, min = \"50ms\" }]\n";
    let scene = Scene::parse(text, Path::new("client.toml"), &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut copy = Copy(1, Vec::new());
    let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut copy);
    let (_, first) = copy.1[0];
    assert_eq!(first.to_bits(), 0.0_f64.to_bits(), "the copy begins where the server's does");
    let (reached, _) = copy.1.iter().find(|(_, position)| (position - first).abs() >= 0.02).unwrap();
    let measured = Measures::run(&scene, Model::Least).values;
    assert_eq!(measured.iter().map(|measure| measure.value).collect::<Vec<_>>(), [Some(*reached)]);
    let outcome = check_with(&scene, Model::Least, |_, _| unreachable!("stability is not expected"), || true).outcomes.remove(0);
    assert_eq!(outcome.measured, Some(*reached), "{outcome:?}");
    assert!(*reached > 0.05, "{reached}");
}
