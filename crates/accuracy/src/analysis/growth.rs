//! Estimate of the spectral radius from a simulation: the growth of a disturbance per frame.
#![expect(clippy::cast_precision_loss, reason = "peers and frames are few")]

use std::time::Duration;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_peer::Contact;
use cohaptic_scene::Scene;

/// Returns the estimate of the radius from 200 frames: see [`growth_over`].
#[must_use]
pub fn growth(scene: &Scene) -> Option<f64> {
    growth_over(scene, 200)
}

/// Returns the estimate of the radius from `frames` frames, as obtained without the matrix. All peers begin displaced. The largest relative displacement
/// between three tenths and half of the time is compared with the largest relative displacement half of the time later. `None` if the disturbance has decayed
/// below all numbers or grown beyond all numbers.
#[must_use]
pub fn growth_over(scene: &Scene, frames: u32) -> Option<f64> {
    let mut scene = scene.clone();
    scene.duration = scene.coordination.update * frames;
    // Changes during the run would not be growth of the disturbance.
    scene.timeline.clear();
    for (place, peer) in scene.peers.iter_mut().enumerate() {
        // Steps of the golden angle give every peer a different start.
        let angle = 2.399_963 * place as f64;
        (peer.position[0], peer.velocity[0]) = (1e-3 * angle.cos(), 0.1 * angle.sin());
    }
    let peers = scene.peers.len();
    let touching = scene.peers.iter().map(|peer| peer.contact != Contact::None).collect();
    let mut seen = Seen {
        frame: scene.coordination.update,
        tick: scene.peers[0].clock.tick.as_secs_f64(),
        touching,
        copies: vec![0.0; peers],
        largest: vec![0.0; frames as usize],
    };
    let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut seen);
    // The maximum over many frames hides the phase of an oscillation.
    let largest = |frames: std::ops::Range<usize>| seen.largest[frames].iter().copied().fold(0.0, f64::max);
    let all = frames as usize;
    // Before three tenths of the time, faster modes may not have decayed.
    let (begin, end) = (all * 3 / 10, all / 2);
    let apart = all / 2;
    let (early, late) = (largest(begin..end), largest(begin + apart..end + apart));
    // The two windows are `apart` frames from each other, so the root gives the growth per frame.
    let growth = (late / early).powf(1.0 / apart as f64);
    (early > 0.0 && late > 0.0 && growth.is_finite()).then_some(growth)
}

/// Observer of the largest relative displacement of each frame.
struct Seen {
    /// Length of a frame.
    frame: Duration,
    /// Period of the tick \[s\].
    tick: f64,
    /// `true` if the device of each peer touches the object.
    touching: Vec<bool>,
    /// Positions of the copies at their latest ticks \[m\].
    copies: Vec<f64>,
    /// Largest relative displacement of each frame \[m\].
    largest: Vec<f64>,
}

impl Observer for Seen {
    type Error = std::convert::Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Self::Error> {
        self.copies[row.peer] = row.object.position[0];
        // A tick belongs to the frame of the latest sampling.
        let frame = (u128::from(row.at.as_nanos()) / self.frame.as_nanos()) as usize;
        let apart = (row.object.position[0] - self.copies[0]).abs();
        // A device without contact has no position relative to the object, only a velocity.
        let device = if self.touching[row.peer] { row.device.position[0] - row.object.position[0] } else { row.device.velocity[0] * self.tick };
        // A tick at the very end, if there is one, would begin a frame without a place.
        if let Some(largest) = self.largest.get_mut(frame) {
            *largest = largest.max(apart).max(device.abs());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::references::references;

    #[test]
    fn a_disturbance_grows_by_about_the_radius() {
        for reference in references().iter().filter(|reference| reference.scene.peers.len() < 10 && !reference.name.starts_with("thousand")) {
            let found = growth(&reference.scene).unwrap();
            // After 200 frames, modes that decay nearly as slowly still count, and complex modes beat. The tolerance of two percent covers both here.
            assert!((found / reference.radius - 1.0).abs() < 0.02, "{}: {found} for {}", reference.name, reference.radius);
        }
    }
}
