//! What the parts of a peer are made from, with every scaling applied: how masses and gains depend on the number of peers.

use cohaptic_peer::coordination::Pull;
use cohaptic_peer::{CopyConfig, Gains, PeerConfig, Plant, State};

use crate::{Scaling, Scene};

impl Scene {
    /// The peer in that place, apart from its device, copy and strategy.
    ///
    /// # Panics
    ///
    /// If there is no such peer, or its place is beyond 2^32.
    #[must_use]
    pub fn peer_config(&self, place: usize) -> PeerConfig {
        let spec = &self.peers[place];
        PeerConfig {
            session: self.seed,
            place: u32::try_from(place).expect("a scene has fewer than 2^32 peers"),
            axes: self.axes.count(),
            contact: spec.contact,
            coupling: self.coupling(place),
            tick: spec.clock.tick,
            compute_delay: spec.compute_delay,
            own_damping: self.own_damping(place),
            enclosure: self.object.enclosure,
        }
    }

    /// KC and BC between the device and the copy of the peer in that place.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn coupling(&self, place: usize) -> Gains {
        let spec = &self.peers[place];
        spec.coupling.scaled(spec.coupling_scaling.coupling_factor(self.number()))
    }

    /// KT and BT of a peer: `gains`, those of the scene or those that the timeline sets, times [`Scene::coordination_factor`].
    ///
    /// # Panics
    ///
    /// If the scene has a topology, and no such peer.
    #[must_use]
    pub fn coordination_gains(&self, gains: Gains, peer: usize) -> Gains {
        gains.scaled(self.coordination_factor(peer))
    }

    /// What KT and BT of a peer are multiplied by for the number of peers, and of those that it hears. A law that sums over the others counts N − 1 of them itself
    /// where the scene has no topology.
    ///
    /// # Panics
    ///
    /// If the scene has a topology, and no such peer.
    #[must_use]
    pub fn coordination_factor(&self, peer: usize) -> f64 {
        let scaling = self.coordination.scaling.coordination_factor(self.number());
        let summed = match self.coordination.pull {
            Pull::Mean => scaling,
            Pull::Sum => scaling * self.heard_by(peer),
        };
        match self.coordination.strategy.pull() {
            Pull::Sum if self.topology.is_some() => summed * self.heard_by(peer),
            Pull::Sum | Pull::Mean => summed,
        }
    }

    /// The device of the peer in that place along one axis, with the arm that holds it.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn device_plant(&self, place: usize) -> Plant {
        let spec = &self.peers[place];
        spec.device.plant(spec.hand.as_ref())
    }

    /// The copy of the object of the peer in that place, with the damping that the coordination law adds.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn copy_config(&self, place: usize) -> CopyConfig {
        CopyConfig { mass: self.copy_mass(), damping: self.object.damping + self.own_damping(place) }
    }

    /// Where the copy and the device of that peer begin.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn initial_state<const A: usize>(&self, place: usize) -> State<A> {
        let spec = &self.peers[place];
        let take = |values: &[f64; 3]| core::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
        State { position: take(&spec.position), velocity: take(&spec.velocity) }
    }
}

impl Scaling {
    /// What the coordination gains are multiplied by among this number of peers: 4(N−1)/N² for [`Scaling::InverseN`].
    ///
    /// Over an ideal network the difference modes of average-position coordination with split mass have the squared frequency (N/mO)·KT·N/(N−1)
    /// (Rakhsha & Constantinescu 2015, equation 6); scaled, it is 4·KT/mO for every N.
    #[must_use]
    pub fn coordination_factor(self, peers: usize) -> f64 {
        let n = count(peers);
        match self {
            Self::None => 1.0,
            Self::InverseN => 4.0 * (n - 1.0) / (n * n),
        }
    }

    /// What the coupling gains are multiplied by among this number of peers: 2/N for [`Scaling::InverseN`].
    #[must_use]
    pub fn coupling_factor(self, peers: usize) -> f64 {
        match self {
            Self::None => 1.0,
            Self::InverseN => 2.0 / count(peers),
        }
    }
}

impl Scene {
    /// The mass of each copy of the object \[kg\]; the whole mass where one peer alone has the object.
    #[must_use]
    pub fn copy_mass(&self) -> f64 {
        if self.object.split_mass && self.server().is_none() { self.object.mass / count(self.number()) } else { self.object.mass }
    }
}

#[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
pub(crate) fn count(peers: usize) -> f64 {
    peers as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_peers_are_left_unchanged() {
        for scaling in [Scaling::None, Scaling::InverseN] {
            assert!((scaling.coordination_factor(2) - 1.0).abs() < f64::EPSILON);
            assert!((scaling.coupling_factor(2) - 1.0).abs() < f64::EPSILON);
        }
    }

    /// (N/m)·factor·N/(N−1) = 4/m: the coordination mode of every N has the frequency of N = 2.
    #[test]
    fn scaled_modes_have_one_frequency() {
        for peers in [2, 3, 5, 8, 50] {
            let n = count(peers);
            let stiffness = n * Scaling::InverseN.coordination_factor(peers) * n / (n - 1.0);
            assert!((stiffness - 4.0).abs() < 1e-12, "N = {peers}");
        }
    }
}
