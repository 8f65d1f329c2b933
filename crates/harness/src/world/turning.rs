//! What a running scene keeps of an object that turns.

use cohaptic_peer::Gains;
use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_scene::Scene;

/// The attitudes of all copies, and changes of the gains on them.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    /// The attitude of each copy at its latest tick.
    pub(super) latest: Vec<Attitude>,
    /// The largest angle between two copies so far \[rad\].
    pub(super) max_discrepancy: f64,
    /// KR and BR after each change of the coordination gains, the next one last.
    gains: Vec<Gains<Triple>>,
    /// The angle of each copy to the first \[rad\].
    angles: Vec<f64>,
    /// √(tr J/3m): angles times this are lengths \[m\].
    length: f64,
}

impl Turning {
    /// That of a scene at its beginning; `None` if its object does not turn.
    pub(super) fn new(scene: &Scene) -> Option<Box<Self>> {
        let rotation = scene.rotation.as_ref()?;
        let mut gains: Vec<_> = scene.rotation_gains_in_time().skip(1).collect();
        gains.reverse();
        let latest: Vec<Attitude> = rotation.peers.iter().map(|peer| peer.attitude).collect();
        let length = scene.gyration()?;
        Some(Box::new(Self { gains, angles: vec![0.0; latest.len()], latest, max_discrepancy: 0.0, length }))
    }

    /// Angles times this are lengths \[m\].
    pub(super) fn length(&self) -> f64 {
        self.length
    }

    /// KR and BR from the change on that is due now.
    pub(super) fn next_gains(&mut self) -> Option<Gains<Triple>> {
        self.gains.pop()
    }

    /// Takes the angles between the copies that are there, at their latest ticks, into the largest one.
    ///
    /// An angle between two copies is at most the sum of their angles to the first one: only pairs of which that is above the largest so far are looked at.
    pub(super) fn measure(&mut self, is_there: impl Fn(usize) -> bool) {
        let Some(first) = (0..self.latest.len()).find(|place| is_there(*place)).map(|place| self.latest[place]) else { return };
        for (place, (angle, attitude)) in self.angles.iter_mut().zip(&self.latest).enumerate() {
            *angle = if is_there(place) { first.angle_to(&attitude.orientation) } else { 0.0 };
            self.max_discrepancy = self.max_discrepancy.max(*angle);
        }
        for one in 0..self.latest.len() {
            if 2.0 * self.angles[one] <= self.max_discrepancy {
                continue;
            }
            // One of a pair that is that far apart is at least half of it from the first.
            for other in (0..self.latest.len()).filter(|other| *other != one && is_there(*other)) {
                if self.angles[one] + self.angles[other] > self.max_discrepancy {
                    let angle = self.latest[one].angle_to(&self.latest[other].orientation);
                    self.max_discrepancy = self.max_discrepancy.max(angle);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_angle_is_that_of_all_pairs() {
        let turned = |sigma: Triple| {
            let mut attitude = Attitude::REST;
            attitude.turn(sigma);
            attitude
        };
        let latest: Vec<Attitude> = [[0.1, 0.0, 0.0], [0.0, 0.9, 0.3], [-1.2, 0.1, 0.0], [1.0, 0.4, 2.0], [0.0; 3]].map(turned).to_vec();
        let mut turning = Turning { gains: Vec::new(), angles: vec![0.0; 5], latest: latest.clone(), max_discrepancy: 0.0, length: 1.0 };
        turning.measure(|_| true);
        let all = latest.iter().flat_map(|one| latest.iter().map(|other| one.angle_to(&other.orientation)));
        assert_eq!(turning.max_discrepancy.to_bits(), all.fold(0.0, f64::max).to_bits());
    }
}
