//! Rotation of the object: inertia, and the gains, damping and initial states derived from the inertia.

use cohaptic_peer::coordination::{Pull, UsedGains};
use cohaptic_peer::rotation::{Attitude, DeviceRotation, HeldAttitudes, Rotation, RotationConfig, Spin, Triple};
use cohaptic_peer::{Coordination, Gains, Signal, State};

use crate::{Change, ChangeKind, Scene};

/// Rotation of the object of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationSpec {
    /// Principal moments of inertia of the whole object [kg·m²], each above zero and at most the sum of the two others. Body axes are the principal axes.
    pub inertia: Triple,
    /// Viscous damping of the rotation of each copy about the body axes [N·m·s/rad]; `None`: the damping of the object times inertia over mass.
    pub damping: Option<Triple>,
    /// KR [N·m/rad] and BR [N·m·s/rad] about the body axes, before scaling; `None`: KT and BT times inertia over mass.
    pub gains: Gains<Option<Triple>>,
    /// Integration steps of the rotation per tick, at least 1.
    pub steps: u32,
    /// Rotational part of each peer, in the order of [`Scene::peers`].
    pub peers: Vec<PeerRotation>,
}

/// Rotational part of a peer.
#[derive(Clone, PartialEq, Debug)]
pub struct PeerRotation {
    /// Point at which the device grasps the copy, from the centre of mass in body axes \[m\].
    pub grasp: Triple,
    /// Initial attitude of the copy, and of the device if the device turns.
    pub attitude: Attitude,
    /// Rotational part of the device; `None` if the device does not turn.
    pub device: Option<DeviceRotationSpec>,
}

/// Rotational part of a device with six degrees of freedom.
#[derive(Clone, PartialEq, Debug)]
pub struct DeviceRotationSpec {
    /// Inertia and damping of the handle, in handle axes.
    pub handle: Spin,
    /// KCR [N·m/rad] and BCR [N·m·s/rad] between the attitudes of device and copy, before scaling.
    pub coupling: Gains,
    /// Torque of the hand in world axes \[N·m\]; `None` for no torque.
    pub torque: Option<Signal>,
}

impl Scene {
    /// Returns the rotational part of a peer with every scaling applied; `None` if the object does not turn. `place` is the index in [`Scene::peers`].
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn rotation_of(&self, place: usize) -> Option<Rotation> {
        let rotation = self.rotation.as_ref()?;
        let others = rotation.peers.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, peer)| peer.attitude);
        // Before the first sample, a peer holds the initial attitudes of the other peers.
        let held = HeldAttitudes::new(others);
        let turning = Rotation::new(self.rotation_config(place)?, rotation.peers[place].attitude, held, &self.peers[place].clock);
        Some(turning.with_law(&self.turn_law(place)?, self.own_rotational_damping(place)))
    }

    /// Returns the configuration of a peer's rotational part with every scaling applied; `None` if the object does not turn. `place` is the index in
    /// [`Scene::peers`].
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
            // Scaled as the coupling of translations is.
            coupling: device.coupling.scaled(spec.coupling_scaling.coupling_factor(self.number())),
            hand: device.torque.clone(),
        });
        Some(RotationConfig {
            copy: self.damped_spin(place)?,
            grasp: *grasp,
            gains: self.rotation_gains(self.coordination.gains, &rotation.gains)?,
            device,
            integrator: self.integrator,
            steps: rotation.steps,
        })
    }

    /// Returns [`Scene::copy_spin`] plus the rotational damping of the strategy at a peer; `None` if the object does not turn.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn damped_spin(&self, place: usize) -> Option<Spin> {
        let (Spin { inertia, damping }, own) = (self.copy_spin()?, self.own_rotational_damping(place));
        Some(Spin { inertia, damping: std::array::from_fn(|axis| damping[axis] + own[axis]) })
    }

    /// Returns inertia and damping of the rotation of each copy, without the damping of the strategy; `None` if the object does not turn. The inertia is
    /// split as the mass is.
    #[must_use]
    pub fn copy_spin(&self) -> Option<Spin> {
        let rotation = self.rotation.as_ref()?;
        // 1/N where the mass is split, otherwise 1. The damping belongs to each copy, and is not split.
        let share = self.copy_mass() / self.object.mass;
        let damping = rotation.damping.unwrap_or_else(|| rotation.over_mass(self.object.mass, self.object.damping));
        Some(Spin { inertia: rotation.inertia.map(|moment| moment * share), damping })
    }

    /// Returns √(tr J/3m), the radius of gyration over √(3/2) \[m\]; `None` if the object does not turn. An angle times this length is comparable with a
    /// displacement of the object.
    #[must_use]
    pub fn gyration(&self) -> Option<f64> {
        let rotation = self.rotation.as_ref()?;
        Some((rotation.inertia.iter().sum::<f64>() / (3.0 * self.object.mass)).sqrt())
    }

    /// Returns the edges of the box of even density with the mass and the inertia of the object, along the body axes \[m\]: a = √(6·(Jy + Jz − Jx)/m), b and c
    /// likewise. The object is drawn as this box. `None` if the object does not turn.
    #[must_use]
    pub fn even_box(&self) -> Option<Triple> {
        let inertia = self.rotation.as_ref()?.inertia;
        let twice: f64 = inertia.iter().sum();
        // A plate has an edge of 0. Rounding may make the sum below the root slightly negative.
        Some(inertia.map(|moment| (6.0 * (twice - 2.0 * moment).max(0.0) / self.object.mass).sqrt()))
    }

    /// Returns the gains KR and BR about the body axes on the difference to the mean of the other peers, scaled by the number of peers. Returns `None` if the
    /// object does not turn. `gains` are KT and BT, and `given` are KR and BR as written. Both come from the scene, or from an event of the timeline. A gain
    /// that is not given follows from KT or BT.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub(crate) fn rotation_gains(&self, gains: Gains, given: &Gains<Option<Triple>>) -> Option<Gains<Triple>> {
        let rotation = self.rotation.as_ref()?;
        let pull = match self.coordination.strategy.pull() {
            Pull::Mean => 1.0,
            Pull::Sum => (self.number() - 1) as f64,
        };
        // Peer 0 stands for all peers: an object that turns has no topology, so that the factor is the same at every peer.
        let factor = pull * self.coordination_factor(0);
        let of = |own: Option<Triple>, gain: f64| own.unwrap_or_else(|| rotation.over_mass(self.object.mass, gain)).map(|gain| gain * factor);
        // A strategy that does not use BT does not use BR either.
        let damping = match self.coordination.strategy.gains() {
            UsedGains::Both => of(given.damping, gains.damping),
            UsedGains::Stiffness | UsedGains::Neither => [0.0; 3],
        };
        Some(Gains { stiffness: of(given.stiffness, gains.stiffness), damping })
    }

    /// Iterates over the rotational gains at the beginning and after each change of KT and BT or of KR and BR in the timeline. Empty if the object does
    /// not turn.
    ///
    /// Default gains follow KT and BT. A gain in the timeline is a given gain from then on. Each component of KR is at most the sum of the two others, whether
    /// KR is given or is J times a number.
    pub fn rotation_gains_in_time(&self) -> impl Iterator<Item = Gains<Triple>> {
        // `None` if the object does not turn: both iterators below are empty then.
        let begins = self.rotation.as_ref().map(|rotation| (self.coordination.gains, rotation.gains));
        let changes = begins.into_iter().flat_map(|begins| {
            self.timeline.iter().scan(begins, |(gains, given), change| {
                let changed = match change.what {
                    ChangeKind::Coordination(changed) => {
                        *gains = changed;
                        true
                    }
                    ChangeKind::RotationalGains(changed) => {
                        // A gain absent from the change stays as before: given, or following KT and BT.
                        *given = Gains { stiffness: changed.stiffness.or(given.stiffness), damping: changed.damping.or(given.damping) };
                        true
                    }
                    ChangeKind::Link(_)
                    | ChangeKind::AllLinks(_)
                    | ChangeKind::Contact { .. }
                    | ChangeKind::Hand { .. }
                    | ChangeKind::HandTorque { .. }
                    | ChangeKind::Parameters(_)
                    | ChangeKind::SendWhen(_) => false,
                };
                // `Some` continues the scan. `flatten` below drops the changes without a gain.
                Some(changed.then_some((*gains, *given)))
            })
        });
        begins.into_iter().chain(changes.flatten()).filter_map(|(gains, given)| self.rotation_gains(gains, &given))
    }

    /// Returns the initial state of a peer's device: at the grasp point of the copy, unless the peer has its own initial position or velocity of the device.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn initial_device<const A: usize>(&self, place: usize) -> State<A> {
        let copy = self.initial_state(place);
        let with_copy = match &self.rotation {
            // The grasp point turns with the copy, so that its velocity contains the angular velocity.
            Some(rotation) => rotation.peers[place].attitude.point(rotation.peers[place].grasp, &copy),
            None => copy,
        };
        let spec = &self.peers[place];
        let said = |start: Option<[f64; 3]>, otherwise| {
            start.map_or(otherwise, |start| core::array::from_fn(|axis| start.get(axis).copied().unwrap_or(0.0)))
        };
        State { position: said(spec.device_position, with_copy.position), velocity: said(spec.device_velocity, with_copy.velocity) }
    }

    /// Returns why the object cannot turn in this scene; `None` if the object can turn, or does not turn.
    pub(crate) fn refused_rotation(&self) -> Option<String> {
        let rotation = self.rotation.as_ref()?;
        let strategy = self.coordination.strategy;
        if let Some(why) = why_no_torque(strategy) {
            let turning = Coordination::ALL.iter().filter(|strategy| why_no_torque(**strategy).is_none());
            let names: Vec<&str> = turning.map(|strategy| strategy.name()).collect();
            let name = strategy.name();
            return Some(format!(
                "the strategy {name} has no torque for an object with an inertia, because {why}: expected one of {}",
                names.join(", ")
            ));
        }
        let turns = |place: usize| rotation.peers[place].device.is_some();
        // The hand at the beginning was checked by the readers. Only the timeline is left.
        let pushes = |change: &&Change| matches!(change.what, ChangeKind::HandTorque { peer, torque: Some(_) } if !turns(peer));
        if let Some(Change { what: ChangeKind::HandTorque { peer, .. }, .. }) = self.timeline.iter().find(pushes) {
            let name = &self.peers[*peer].name;
            return Some(format!("the timeline gives the hand of peer \"{name}\" a torque, whose device does not turn: expected device.inertia"));
        }
        self.leaves_out_samples().then(|| "dead bands say nothing of attitudes: expected no send-when with an object with an inertia".to_owned())
    }
}

/// Returns why a strategy has no torque; `None` if the strategy has a torque.
const fn why_no_torque(strategy: Coordination) -> Option<&'static str> {
    match strategy {
        Coordination::AveragePosition
        | Coordination::ProportionalDerivative
        | Coordination::SmoothedAveragePosition
        | Coordination::Extrapolated
        | Coordination::LocalDamping
        | Coordination::LocalLag => None,
        Coordination::PassivityControl | Coordination::SetPosition => {
            Some("it keeps energies along axes that all copies share, and copies that turn share no axis")
        }
        Coordination::Wave => Some("both ends of a wave line share its axis, and copies that turn share no axis"),
        Coordination::ClientServer => Some("its clients send the states of their devices, without orientations"),
    }
}

impl RotationSpec {
    /// Returns `number` times inertia over mass. A gain or damping of translations becomes the gain or damping of rotations that results if each element of
    /// the mass has its share of `number`.
    pub(crate) fn over_mass(&self, mass: f64, number: f64) -> Triple {
        self.inertia.map(|moment| number * moment / mass)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cohaptic_peer::wire::SampleKind;

    use super::*;

    const TEXT: &str = "\
scene = { duration = \"1s\", axes = 3, count = 4 }
object = { mass = 2, damping = 4, inertia = [0.1, 0.2, 0.3], orientation = [2, 0, 0, 0], angular-velocity = [0, 0, 3] }
coordination = { strategy = \"proportional-derivative\", stiffness = 100, damping = 20, update = \"8ms\" }
peer = { device = { mass = 0.1 }, coupling = { stiffness = 100 }, grasp = [0.1, 0, 0] }
";

    fn scene(overrides: &[&str]) -> Result<Scene, String> {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        Scene::parse(TEXT, Path::new("x.toml"), &overrides).map_err(|error| error.to_string())
    }

    #[test]
    fn each_element_of_the_mass_is_coordinated_and_damped_as_if_alone() {
        let scene = scene(&[]).unwrap();
        let config = scene.rotation_config(0).unwrap();
        // Inertia is split as the mass is. Damping is the damping of each copy. KT and BT count once for each other peer.
        assert_eq!(config.copy, Spin { inertia: [0.1 / 4.0, 0.05, 0.3 / 4.0], damping: [0.2, 0.4, 0.3 * 4.0 / 2.0] });
        assert_eq!(config.gains, Gains { stiffness: [15.0, 30.0, 45.0], damping: [3.0, 6.0, 9.0] });
        let scaled = self::scene(&["coordination.scaling=inverse-n", "coordination.rotational-stiffness=8"]).unwrap();
        // 4·3/16 for the scaling, times three other peers.
        assert_eq!(scaled.rotation_gains_in_time().next().map(|gains| gains.stiffness), Some([18.0; 3]));
        assert_eq!(scene.sample_kind(), SampleKind::Attitude);
    }

    /// A box of 0.3 m × 0.2 m × 0.1 m with 2 kg has Jx = m/12·(b² + c²), and Jy and Jz likewise.
    #[test]
    fn a_box_has_the_inertia_of_the_object() {
        let edges: [f64; 3] = [0.3, 0.2, 0.1];
        let of = |one: usize, other: usize| 2.0 / 12.0 * (edges[one] * edges[one] + edges[other] * edges[other]);
        let scene = scene(&[&format!("object.inertia=[{}, {}, {}]", of(1, 2), of(0, 2), of(0, 1))]).unwrap();
        let found = scene.even_box().unwrap();
        assert!((0..3).all(|axis| (found[axis] - edges[axis]).abs() < 1e-15), "{found:?}");
        let plate = self::scene(&["object.inertia=[0.1, 0.2, 0.3]"]).unwrap().even_box().unwrap();
        assert!(plate[2] < 1e-7 && plate[0] > plate[1], "{plate:?}");
    }

    #[test]
    fn a_law_damps_turns_as_it_damps_translations() {
        let damped = |overrides: &[&str]| {
            let scene = scene(&[&["coordination.strategy=local-damping"], overrides].concat()).unwrap();
            let (config, own) = (scene.rotation_config(0).unwrap(), scene.own_rotational_damping(0));
            let ground = scene.copy_spin().unwrap().damping;
            let gains = Gains { stiffness: config.gains.stiffness, damping: [0.0; 3] };
            let copy = Spin { inertia: config.copy.inertia, damping: std::array::from_fn(|axis| ground[axis] + own[axis]) };
            assert_eq!((config.gains, config.copy), (gains, copy));
            own
        };
        // J/m = (0.05, 0.1, 0.15). KR is at most 15, and samples are at most 8 ms and one tick old.
        let close = |found: [f64; 3], expected: [f64; 3]| (0..3).all(|axis| (found[axis] - expected[axis]).abs() <= 1e-15 * expected[axis]);
        let given = damped(&["coordination.local-damping.damping=8"]);
        assert!(close(given, [0.4, 0.8, 1.2]), "{given:?}");
        let found = damped(&["coordination.local-damping.age=8ms"]);
        assert!(close(found, [15.0 * 9e-3; 3]), "{found:?}");
        let split = damped(&["coordination.local-damping.age=8ms", "coordination.rotational-stiffness=[4, 2, 3]", "coordination.scaling=inverse-n"]);
        assert!(close(split, [0.75 * 4.0 * 9e-3; 3]), "{split:?}");
        assert!(close(scene(&["coordination.strategy=local-lag", "link={delay=\"8ms\"}"]).unwrap().own_rotational_damping(0), [0.0; 3]));
    }

    #[test]
    fn gains_of_turns_follow_those_of_translations_until_they_are_given() {
        let scene = scene(&["timeline=[{at=\"0.1s\", coordination={stiffness=200}}, {at=\"0.2s\", coordination={rotational-stiffness=[1, 2, 3]}}, \
             {at=\"0.3s\", coordination={stiffness=400, damping=40}}, {at=\"0.4s\", coordination={damping=80, rotational-damping=5}}]"])
        .unwrap();
        // Three other peers; J/m = (0.05, 0.1, 0.15).
        let found: Vec<_> = scene.rotation_gains_in_time().map(|gains| (gains.stiffness, gains.damping)).collect();
        let expected = [
            ([15.0, 30.0, 45.0], [3.0, 6.0, 9.0]),
            ([30.0, 60.0, 90.0], [3.0, 6.0, 9.0]),
            ([3.0, 6.0, 9.0], [3.0, 6.0, 9.0]),
            ([3.0, 6.0, 9.0], [6.0, 12.0, 18.0]),
            ([3.0, 6.0, 9.0], [12.0, 24.0, 36.0]),
            ([3.0, 6.0, 9.0], [15.0; 3]),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_device_begins_at_its_grasp_point() {
        let scene = scene(&["peers=[{name=\"peer1\", orientation=[1, 0, 0, 1]}]"]).unwrap();
        // A quarter turn about z takes x to y. ω×r has the length 3 rad/s · 0.1 m and points to −x.
        let State { position, velocity } = scene.initial_device::<3>(0);
        let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).abs()).fold(0.0, f64::max);
        assert!(apart(position, [0.0, 0.1, 0.0]) < 1e-16 && apart(velocity, [-0.3, 0.0, 0.0]) < 1e-15, "{position:?} {velocity:?}");
        assert!(apart(scene.initial_device::<3>(1).position, [0.1, 0.0, 0.0]) < 1e-16);
    }

    #[test]
    fn scenes_that_cannot_turn_are_refused() {
        let refused = |overrides: &[&str], expected: &str| {
            let error = scene(overrides).unwrap_err();
            assert!(error.contains(expected), "{overrides:?}: {error}");
        };
        refused(&["object.inertia=[1, 1, 3]"], "object.inertia: a moment of inertia is above the sum of the two others");
        refused(&["object.inertia=[1, 1, 0]"], "object.inertia");
        refused(&["object.inertia=[1, 1]"], "expected a number [kg·m²], or a list of three");
        refused(&["scene.axes=2", "peer.grasp=0"], "expected scene.axes = 3, or no object.inertia");
        refused(&["object.orientation=[0, 0, 0, 0]"], "is not a quaternion");
        refused(&["object.orientation=[1, 0, 0]"], "is not a quaternion");
        refused(&["coordination.rotational-stiffness=[1, 1, 3]"], "a stiffness is above the sum of the two others");
        for (strategy, why) in
            [("wave", "share no axis"), ("set-position", "energies"), ("passivity-control", "energies"), ("client-server", "clients")]
        {
            let name = format!("coordination.strategy={strategy}");
            refused(&[&name], &format!("the strategy {strategy} has no torque for an object with an inertia, because "));
            refused(&[&name], why);
            refused(
                &[&name],
                "expected one of average-position, proportional-derivative, smoothed-average-position, extrapolated, local-damping, local-lag",
            );
        }
        refused(&["coordination.send-when={position=0.001}"], "dead bands say nothing of attitudes");
        refused(&["peer.device.inertia=0.001"], "expected coupling.rotational-stiffness");
        refused(&["peer.device.rotational-damping=0.001"], "expected device.inertia too");
        refused(&["peer.coupling.rotational-damping=0.001"], "expected rotational-stiffness too");
        refused(&["peer.hand={torque=[0, 0, 1]}"], "the torque of a hand needs a device that turns");
        refused(&["peer.kind=falcon", "peer.device.inertia=0.001", "peer.coupling.rotational-stiffness=1"], "a Falcon turns nothing");
        refused(&["timeline=[{at=\"0s\", coordination={rotational-stiffness=[1, 1, 3]}}]"], "a stiffness is above the sum of the two others");
        refused(&["simulation.rotation-steps=0"], "rotation-steps");
    }

    #[test]
    fn keys_of_turns_need_an_inertia() {
        let text = TEXT
            .replace("inertia = [0.1, 0.2, 0.3], orientation = [2, 0, 0, 0], angular-velocity = [0, 0, 3]", "velocity = 0")
            .replace(", grasp = [0.1, 0, 0]", "");
        assert!(Scene::parse(&text, Path::new("x.toml"), &[]).unwrap().rotation.is_none());
        for key in [
            "object.rotational-damping=1",
            "object.orientation=[1, 0, 0, 0]",
            "object.angular-velocity=1",
            "coordination.rotational-stiffness=1",
            "simulation.rotation-steps=2",
            "peer.grasp=[0, 0, 1]",
            "peer.device.inertia=1",
            "peer.hand={torque=[0, 0, 1]}",
            "expect.rotation-discrepancy={max=1}",
            "timeline=[{at=\"0s\", coordination={rotational-damping=1}}]",
        ] {
            let error = Scene::parse(&text, Path::new("x.toml"), &[key.to_owned()]).unwrap_err().to_string();
            assert!(error.contains("this is about an object that turns: expected object.inertia, or no such key"), "{key}: {error}");
        }
    }
}
