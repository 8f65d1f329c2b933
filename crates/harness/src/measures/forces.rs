//! Size and roughness of the coordination force and of the coupling force. Each component along an axis counts separately.

use std::time::Duration;

use cohaptic_scene::Measure;

use super::{Accumulator, Asked, Rows, mean_square_root};
use crate::TickRow;
use crate::arrays::larger;

/// Coordination force F_T on the copies.
#[derive(Clone, Debug)]
pub(super) struct CoordinationForce(Force);

/// Coupling force F_C, felt by hands.
#[derive(Clone, Debug)]
pub(super) struct FeltForce(Force);

/// Figures of one kind of force over all peers and ticks.
#[derive(Clone, Debug)]
struct Force {
    /// Largest magnitude of a component \[N\].
    peak: f64,
    /// Σ of the squared components \[N²\].
    squares: f64,
    /// Number of components.
    count: u64,
    /// Largest change of a component from one tick of a peer to the next \[N\].
    jump: f64,
    /// Components at the latest tick of each peer \[N\], indexed by peer. NaN before the first tick, so the first force is no jump.
    latest: Vec<[f64; 3]>,
}

impl Force {
    fn new(asked: &Asked<'_>) -> Self {
        Self { peak: 0.0, squares: 0.0, count: 0, jump: 0.0, latest: vec![[f64::NAN; 3]; asked.scene.peers.len()] }
    }

    fn add(&mut self, peer: usize, force: &[f64]) {
        self.count += force.len() as u64;
        for (component, latest) in force.iter().zip(&mut self.latest[peer]) {
            // `larger` returns its second argument if the first is NaN.
            self.peak = larger(component.abs(), self.peak);
            self.squares += component * component;
            self.jump = larger((component - *latest).abs(), self.jump);
            *latest = *component;
        }
    }

    fn value(&self, of: Figure) -> Option<f64> {
        match of {
            Figure::Peak => (self.count > 0).then_some(self.peak),
            Figure::Rms => mean_square_root(self.squares, self.count),
            Figure::Jump => (self.count > 0).then_some(self.jump),
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Figure {
    Peak,
    Rms,
    Jump,
}

impl Accumulator for CoordinationForce {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] =
        &[(Measure::ForcePeak, Figure::Peak), (Measure::ForceRms, Figure::Rms), (Measure::ForceJump, Figure::Jump)];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        Self(Force::new(asked))
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        self.0.add(row.peer, row.coordination_force);
    }

    fn value(&self, figure: Figure, _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        self.0.value(figure)
    }
}

impl Accumulator for FeltForce {
    type Figure = Figure;

    const GIVES: &'static [(Measure, Figure)] =
        &[(Measure::FeltPeak, Figure::Peak), (Measure::FeltRms, Figure::Rms), (Measure::FeltJump, Figure::Jump)];
    const ROWS: Rows = Rows { ticks: true, ..Rows::NONE };

    fn new(asked: &Asked<'_>) -> Self {
        Self(Force::new(asked))
    }

    fn on_tick(&mut self, row: &TickRow<'_>) {
        self.0.add(row.peer, row.coupling_force);
    }

    fn value(&self, figure: Figure, _peer: Option<usize>, _elapsed: Duration) -> Option<f64> {
        self.0.value(figure)
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_scene::{MeasureSettings, Scene};

    use super::*;

    #[test]
    fn the_first_force_of_a_peer_is_no_jump() {
        let text = r#"
            scene = { duration = "1s", count = 2 }
            object = { mass = 1.0 }
            coordination = { strategy = "average-position", stiffness = 1.0, damping = 1.0, update = "8ms" }
            peer = { device = { mass = 1.0, damping = 1.0 }, coupling = { stiffness = 1.0, damping = 1.0 } }
            link = { delay = "8ms" }
        "#;
        let scene = Scene::parse(text, "scene.toml".as_ref(), &[]).unwrap();
        let mut force = Force::new(&Asked { scene: &scene, names: &[], settings: &MeasureSettings::default() });
        for (peer, components) in [(0, [5.0, 1.0]), (1, [-9.0, 0.0]), (0, [4.0, 3.0])] {
            force.add(peer, &components);
        }
        assert_eq!(force.value(Figure::Jump), Some(2.0));
        assert_eq!(force.value(Figure::Peak), Some(9.0));
        assert_eq!(force.value(Figure::Rms), Some((132.0_f64 / 6.0).sqrt()));
    }
}
