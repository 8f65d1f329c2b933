//! This project: the scene as a user writes it, run as `cohaptic run` does with nothing recorded but counters.

use std::convert::Infallible;

use cohaptic_harness::{Model, Observer, PacketRow, Simulation, Summary};
use cohaptic_scene::Scene;

use super::{Mesh, Outcome, SEED};

/// The scene, of a number of ticks.
#[must_use]
pub fn scene(mesh: Mesh, ticks: u64) -> Scene {
    mesh.scene(ticks, SEED)
}

/// Runs it.
#[must_use]
pub fn run(scene: &Scene) -> Outcome {
    outcome(&Mesh::run(scene))
}

/// Runs it with an observer of every packet, so that it runs event by event.
#[must_use]
pub fn run_watched(scene: &Scene) -> Outcome {
    let mut watcher = Watcher(0);
    let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut watcher);
    std::hint::black_box(watcher.0);
    outcome(&summary)
}

/// Looks at every packet, and keeps as little of it as can be.
struct Watcher(u64);

impl Observer for Watcher {
    type Error = Infallible;

    fn wants_packets(&self) -> bool {
        true
    }

    fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
        self.0 ^= row.at.as_nanos();
        Ok(())
    }
}

fn outcome(summary: &Summary) -> Outcome {
    Outcome {
        positions: summary.peers.iter().map(|peer| peer.position[0]).collect(),
        delivered: summary.links.iter().map(|link| link.stats.delivered()).sum(),
        // Each packet has its own instant in nanoseconds: a test compares them with the draws.
        arrival_error_nanos: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::draws::Draws;

    /// Compares each packet with its draw.
    struct Compare(Mesh, u64);

    impl Observer for Compare {
        type Error = Infallible;

        fn wants_packets(&self) -> bool {
            true
        }

        fn on_packet(&mut self, row: &PacketRow) -> Result<(), Infallible> {
            let drawn = Draws::new(self.0, row.path.from.index(), row.path.to.index()).delay(row.sequence);
            let delivered = matches!(row.fate, cohaptic_wan::Fate::Delivered(_));
            assert_eq!(delivered.then(|| row.at.as_nanos() - row.offered.as_nanos()), drawn, "{row:?}");
            self.1 += 1;
            Ok(())
        }
    }

    #[test]
    fn each_packet_takes_what_the_others_draw_for_it() {
        for impaired in [false, true] {
            let mesh = Mesh { peers: 3, impaired };
            let mut compare = Compare(mesh, 0);
            let Ok(_) = Simulation::new(&scene(mesh, 2_000), Model::Least).run(&mut compare);
            // 250 frames of 6 packets, less than four of them on the way at the end.
            assert!((1_476..=1_500).contains(&compare.1), "{}", compare.1);
        }
    }
}
