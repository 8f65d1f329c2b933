//! An object that turns: its inertia, and all that follows from it.

use cohaptic_peer::coordination::Pull;
use cohaptic_peer::rotation::{Attitude, DeviceRotation, HeldAttitudes, Rotation, RotationConfig, Spin, Triple};
use cohaptic_peer::{Coordination, Gains, Signal, State};

use crate::{ChangeKind, Scene};

/// How the object of a scene turns.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationSpec {
    /// The principal moments of inertia of the whole object [kg·m²], each above zero and none above the sum of the others. Body axes are the principal axes.
    pub inertia: Triple,
    /// Viscous damping of the turn of each copy about the body axes [N·m·s/rad]; `None`: the damping of the object times inertia over mass.
    pub damping: Option<Triple>,
    /// KR [N·m/rad] and BR [N·m·s/rad] about the body axes, before scaling; `None`: KT and BT times inertia over mass.
    pub gains: Gains<Option<Triple>>,
    /// Steps of the turn in a tick, at least 1.
    pub steps: u32,
    /// The turning part of each peer, in the order of [`Scene::peers`].
    pub peers: Vec<PeerRotation>,
}

/// How a peer takes part in the turn of the object.
#[derive(Clone, PartialEq, Debug)]
pub struct PeerRotation {
    /// Where its device grasps the copy, from the centre of mass in body axes \[m\].
    pub grasp: Triple,
    /// The attitude with which its copy begins, and its device if that turns.
    pub attitude: Attitude,
    /// Its device, if that turns.
    pub device: Option<DeviceRotationSpec>,
}

/// A device with six degrees of freedom.
#[derive(Clone, PartialEq, Debug)]
pub struct DeviceRotationSpec {
    /// Its inertia and damping, in handle axes.
    pub handle: Spin,
    /// KCR [N·m/rad] and BCR [N·m·s/rad], before scaling.
    pub coupling: Gains,
    /// The torque of the hand in world axes \[N·m\]; `None`: none.
    pub torque: Option<Signal>,
}

impl Scene {
    /// The turning part of a peer, with every scaling applied; `None` if the object does not turn.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn rotation_of(&self, place: usize) -> Option<Rotation> {
        let rotation = self.rotation.as_ref()?;
        let others = rotation.peers.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, peer)| peer.attitude);
        let held = HeldAttitudes::new(others);
        Some(Rotation::new(self.rotation_config(place)?, rotation.peers[place].attitude, held, &self.peers[place].clock))
    }

    /// What the turning part of a peer is made from, with every scaling applied; `None` if the object does not turn.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn rotation_config(&self, place: usize) -> Option<RotationConfig> {
        let rotation = self.rotation.as_ref()?;
        let PeerRotation { grasp, device, .. } = &rotation.peers[place];
        let spec = &self.peers[place];
        let device = device.as_ref().map(|device| DeviceRotation {
            handle: device.handle,
            coupling: device.coupling.scaled(spec.coupling_scaling.coupling_factor(self.peers.len())),
            hand: device.torque.clone(),
        });
        Some(RotationConfig {
            copy: self.copy_spin()?,
            grasp: *grasp,
            gains: self.rotation_gains(self.coordination.gains)?,
            device,
            integrator: self.integrator,
            steps: rotation.steps,
        })
    }

    /// Inertia and damping of the turn of each copy; `None` if the object does not turn. Inertia is split as mass is.
    #[must_use]
    pub fn copy_spin(&self) -> Option<Spin> {
        let rotation = self.rotation.as_ref()?;
        let share = self.copy_mass() / self.object.mass;
        let damping = rotation.damping.unwrap_or_else(|| rotation.over_mass(self.object.mass, self.object.damping));
        Some(Spin { inertia: rotation.inertia.map(|moment| moment * share), damping })
    }

    /// KR and BR on the mean of the others about the body axes, scaled by the number of peers, where KT and BT are `gains`, those of the scene or those that
    /// the timeline sets; `None` if the object does not turn.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn rotation_gains(&self, gains: Gains) -> Option<Gains<Triple>> {
        let rotation = self.rotation.as_ref()?;
        let pull = match self.coordination.strategy.pull() {
            Pull::Mean => 1.0,
            Pull::Sum => (self.peers.len() - 1) as f64,
        };
        let factor = pull * self.coordination_factor();
        let of = |own: Option<Triple>, gain: f64| own.unwrap_or_else(|| rotation.over_mass(self.object.mass, gain)).map(|gain| gain * factor);
        Some(Gains { stiffness: of(rotation.gains.stiffness, gains.stiffness), damping: of(rotation.gains.damping, gains.damping) })
    }

    /// Where the device of a peer begins: at the grasp point of its copy.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn initial_device<const A: usize>(&self, place: usize) -> State<A> {
        let copy = self.initial_state(place);
        match &self.rotation {
            Some(rotation) => rotation.peers[place].attitude.point(rotation.peers[place].grasp, &copy),
            None => copy,
        }
    }

    /// Why the object cannot turn in this scene; `None` if it can, or if it does not turn.
    pub(crate) fn refused_rotation(&self) -> Option<String> {
        let rotation = self.rotation.as_ref()?;
        let strategy = self.coordination.strategy;
        let turns = [Coordination::AveragePosition, Coordination::ProportionalDerivative, Coordination::Extrapolated];
        if !turns.contains(&strategy) {
            let names: Vec<&str> = turns.iter().map(|strategy| strategy.name()).collect();
            return Some(format!(
                "the strategy {} has no torque for an object with an inertia: expected one of {}",
                strategy.name(),
                names.join(", ")
            ));
        }
        let turns = |place: usize| rotation.peers[place].device.is_some();
        let pushed = self.timeline.iter().find_map(|change| match &change.what {
            ChangeKind::HandTorque { peer, torque: Some(_) } if !turns(*peer) => Some(*peer),
            _ => None,
        });
        if let Some(peer) = pushed {
            let name = &self.peers[peer].name;
            return Some(format!("the timeline gives the hand of peer \"{name}\" a torque, whose device does not turn: expected device.inertia"));
        }
        self.leaves_out_samples().then(|| "dead bands say nothing of attitudes: expected no send-when with an object with an inertia".to_owned())
    }
}

impl RotationSpec {
    /// A number that belongs to a mass, for the inertia of it: as if each element of the mass had it alone.
    fn over_mass(&self, mass: f64, number: f64) -> Triple {
        self.inertia.map(|moment| number * moment / mass)
    }
}
