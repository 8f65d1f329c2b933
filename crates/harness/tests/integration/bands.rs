//! Extremes of positions over time, eight peers at a time and one by one.

use std::convert::Infallible;

use cohaptic_harness::record::Bands;
use cohaptic_harness::{Model, Observer, Simulation, TickRow, Ticks};
use cohaptic_scene::Scene;

/// Plots positions along the second axis.
struct Plotter {
    bands: Bands,
    /// Looks at samples held as well, for which a run has events and ticks come one by one.
    has_events: bool,
    rows: usize,
}

impl Observer for Plotter {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn wants_holds(&self) -> bool {
        self.has_events
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        self.rows += 1;
        self.bands.add(row.peer, row.at, row.object.position[1]);
        Ok(())
    }

    fn on_ticks(&mut self, ticks: &Ticks<'_>) -> Result<(), Infallible> {
        self.bands.add_positions(ticks, 1);
        Ok(())
    }
}

fn scene(peers: usize) -> Scene {
    let text = format!(
        r#"
        scene = {{ duration = "2s", count = {peers}, axes = 2 }}
        object = {{ mass = 0.45 }}
        coordination = {{ strategy = "average-position", stiffness = 200.0, damping = 5.0, update = "8ms" }}
        peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 3500.0, damping = 5.0 }} }}
        link = {{ delay = "24ms", jitter = "2ms" }}
        peers = [{{ name = "peer1", hand = {{ force = [0.5, 1.5] }} }}]
        "#
    );
    Scene::parse(&text, "bands.toml".as_ref(), &[]).unwrap()
}

#[test]
fn eight_peers_at_a_time_have_the_extremes_of_one_by_one() {
    for peers in [2, 8, 9, 17] {
        let scene = scene(peers);
        let plot = |has_events| {
            let mut plotter = Plotter { bands: Bands::new(scene.duration, 37, peers), has_events, rows: 0 };
            let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut plotter);
            plotter
        };
        let (together, one_by_one) = (plot(false), plot(true));
        assert_eq!((together.rows, one_by_one.rows), (0, 2000 * peers));
        let halves = together.bands.split(2);
        let half = halves[0].curves();
        for peer in 0..peers {
            let curve: Vec<_> = together.bands.curve(peer).collect();
            assert_eq!(curve.len(), 37);
            assert_eq!(curve, one_by_one.bands.curve(peer).collect::<Vec<_>>(), "peer {peer} of {peers}");
            assert_eq!(curve, halves[peer / half].curve(peer % half).collect::<Vec<_>>(), "peer {peer} of {peers}");
        }
        assert_eq!(together.bands.range(1.0), one_by_one.bands.range(1.0));
        // The hand moves its own copy most.
        let reach = |peer: usize| together.bands.curve(peer).map(|(_, _, high)| high).fold(0.0, f64::max);
        assert!(reach(0) > reach(1) && reach(1) > 0.0);
    }
}
