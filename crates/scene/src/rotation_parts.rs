//! Exact split of the motion of a turning object, linearised at rest, into one-axis scenes.
//!
//! A copy has the coordinates y = (δp, δθ) in body axes and the mass matrix M = diag(m·I, J), and is grasped at z = G·y with G = \[I, −\[r\]\]: M·ÿ = Gᵀ·FC +
//! (0, τC) − diag(KT·I, KR)·(y − ȳ) − … (docs/stability.md).
//!
//! **Grasped at the centre**, r = 0, no term mixes two of the six components: each component is a scene of one axis.
//!
//! **One grasp r, default gains.** Gains and damping are then multiples of M, diag(KT·I, KR) = KT/m·M and so on, and Gᵀ·FC alone drives the copies. With W =
//! G·M⁻¹·Gᵀ = I/m − \[r\]·J⁻¹·\[r\] the grasp point obeys z̈ = W·FC − KT/m·(z − z̄) − BT/m·(ż − ż̄) − bO/m·ż. Device and coupling are equal along all
//! directions, so that along an eigenvector of W with the eigenvalue μ this is a scene of mass 1/μ with KT, BT and bO divided by m·μ. Three components N·y of
//! y remain, with N·M⁻¹·Gᵀ = 0: no hand drives these components, and each component obeys the equation of an untouched copy of mass m. Held samples, means and
//! step maps act on all components alike, so that the split holds for any links, clocks and delays.

use cohaptic_peer::coordination::LawValue;
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::{Contact, Coordination, DeviceConfig, Direction, Enclosure, Gains, Hand, Integrator, Signal};

use crate::{Axes, CoordinationSpec, ObjectSpec, PeerKind, PeerSpec, RotationSpec, Scene};

/// Split of the motion of a turning object into one-axis scenes.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationParts {
    /// Reason why the motion splits, in words.
    pub reason: &'static str,
    /// The one-axis scenes, each with the described components. No two parts are equal.
    pub parts: Vec<RotationPart>,
}

/// Equal components of the motion of a turning object, as a one-axis scene at rest.
///
/// If the component is a rotation, the fields of `scene` hold rotational quantities in rotational units: the mass is an inertia [kg·m²], and so on.
#[derive(Clone, PartialEq, Debug)]
pub struct RotationPart {
    /// Names of the equal components: `x`, `y`, `z`, `rx`, `ry`, `rz`; or `touched 1` to `touched 3` and `pivot 1` to `pivot 3`.
    pub components: Vec<String>,
    /// Scene of each component.
    pub scene: Scene,
    /// True for each peer with a device in this component, indexed as [`Scene::peers`]. If false, the peer's device in `scene` is a placeholder without
    /// meaning.
    pub devices: Vec<bool>,
}

impl RotationPart {
    /// Returns the names of the components, separated by commas.
    #[must_use]
    pub fn name(&self) -> String {
        self.components.join(", ")
    }
}

impl Scene {
    /// Returns the exact split of the motion near rest into one-axis scenes, or the reason why the motion does not split; `None` if the object does not turn.
    ///
    /// Forces of hands without an arm, the timeline and initial motions are left out. The samples of the whole scene are longer than the samples of a part.
    #[must_use]
    pub fn rotation_parts(&self) -> Option<Result<RotationParts, &'static str>> {
        let rotation = self.rotation.as_ref()?;
        // A part has one step map. With this integrator, translations and rotations have different step maps.
        if matches!(self.integrator, Integrator::SemiImplicitEuler { .. }) {
            return Some(Err("with semi-implicit-euler turns move by another step than translations"));
        }
        // The grasp of a peer that touches nothing has no influence.
        let grasps = || rotation.peers.iter().zip(&self.peers).filter(|(_, spec)| spec.contact != Contact::None).map(|(peer, _)| peer.grasp);
        if grasps().all(is_zero) {
            // `turn` gives every peer of a part the damping of peer 0.
            let damped = self.own_rotational_damping(0);
            if (1..self.peers.len()).any(|peer| !same(self.own_rotational_damping(peer), damped)) {
                return Some(Err("the strategy damps the turns of copies with other ticks by other numbers"));
            }
            let parts = merged((0..3).map(|axis| self.translation(axis)).chain((0..3).map(|axis| self.turn(rotation, axis))));
            return Some(Ok(RotationParts { reason: "the object is held at its centre alone, so no force turns it", parts }));
        }
        // Some peer touches: without such a peer, `all` above is true.
        let grasp = grasps().next()?;
        Some(self.why_not_pivots(rotation, grasp).map_or_else(
            || {
                let touched = effective_masses(self.object.mass, rotation.inertia, grasp).into_iter().enumerate();
                // Masses 1/μ along the eigenvectors, driven by the hands, then three times the mass of the object, driven by no hand.
                let touched = touched.map(|(place, mass)| self.with_mass(format!("touched {}", place + 1), mass, true));
                let pivots = (1..=3).map(|place| self.with_mass(format!("pivot {place}"), self.object.mass, false));
                let reason = "all who touch the object do so at one point, and gains and damping of turns are the default ones";
                Ok(RotationParts { reason, parts: merged(touched.chain(pivots)) })
            },
            Err,
        ))
    }

    /// Returns true if the motion of a turning object is small and near rest: copies begin together and at rest, and no hand pushes. Also true if the object
    /// does not turn.
    #[must_use]
    pub fn turns_about_rest(&self) -> bool {
        let Some(rotation) = &self.rotation else { return true };
        let (first, peers) = (rotation.peers[0].attitude, rotation.peers.iter().zip(&self.peers));
        // A sine or a table counts as a push, also with all values zero.
        let is_idle = |signal: &Signal| matches!(signal, Signal::Constant(constant) if is_zero(*constant));
        peers.enumerate().all(|(place, (peer, spec))| {
            let together = same(spec.position, self.peers[0].position) && peer.attitude.angle_to(&first.orientation) == 0.0;
            let start = self.initial_device::<3>(place).position;
            let idle = match &spec.hand {
                None => true,
                Some(Hand::Force(force)) => is_idle(force),
                Some(Hand::Operator { .. }) => false,
                // An arm with the initial position of the device as its wanted position does not pull.
                Some(Hand::Arm { follows, .. }) => matches!(follows, Signal::Constant(wanted) if same(*wanted, start)),
            };
            let untwisted = peer.device.as_ref().and_then(|device| device.torque.as_ref()).is_none_or(is_idle);
            together && is_zero(spec.velocity) && is_zero(peer.attitude.rate) && idle && untwisted
        })
    }

    /// Returns why the scene does not split into touched scenes and pivots; `None` if the scene splits. `grasp` is the grasp of the first touching peer.
    fn why_not_pivots(&self, rotation: &RotationSpec, grasp: Triple) -> Option<&'static str> {
        let mut peers = rotation.peers.iter().zip(&self.peers);
        let touches = |spec: &PeerSpec| spec.contact != Contact::None;
        if peers.clone().any(|(peer, spec)| touches(spec) && !same(peer.grasp, grasp)) {
            Some("the object is held at different points")
        } else if peers.any(|(peer, spec)| peer.device.is_some() || matches!(spec.contact, Contact::Push(_))) {
            Some("a device turns, or a finger pushes, off the centre")
        } else if rotation.damping.is_some() || rotation.gains.stiffness.is_some() || rotation.gains.damping.is_some() {
            Some("gains or damping of turns are not the default ones")
        } else if self.coordination.strategy == Coordination::Extrapolated {
            Some("positions are extrapolated and orientations are not")
        } else if self.has_automatic_damping() && !same(rotation.inertia, [rotation.inertia[0]; 3]) {
            Some("the strategy damps turns about all axes alike, and moments of inertia differ")
        } else if self.object.enclosure.is_some() {
            Some("walls act on the centre and hands do not")
        } else if rotation.steps > 1 && self.integrator != Integrator::Exact {
            Some("turns take other steps than translations")
        } else {
            None
        }
    }

    /// Returns the part of the translation along an axis, 0 for x.
    fn translation(&self, axis: usize) -> RotationPart {
        let along = |number: f64| [number, 0.0, 0.0];
        // The walls along this axis become the walls along the only axis of the part.
        let enclosure = self.object.enclosure.map(|wall| Enclosure { min: along(wall.min[axis]), max: along(wall.max[axis]), ..wall });
        let object = ObjectSpec { enclosure, ..self.object_at_rest() };
        let peers = self.peers.iter().map(|spec| {
            let contact = match spec.contact {
                Contact::Push(direction) if direction.axis == axis => Contact::Push(Direction { axis: 0, ..direction }),
                // A finger that pushes along another axis exerts no force along this axis.
                Contact::Push(_) | Contact::None => Contact::None,
                Contact::Grasp => Contact::Grasp,
            };
            PeerSpec { contact, ..at_rest(spec) }
        });
        let scene = Self { object, peers: peers.collect(), ..self.without_turns(self.coordination) };
        RotationPart { components: vec![["x", "y", "z"][axis].to_owned()], scene, devices: vec![true; self.peers.len()] }
    }

    /// Returns the part of the rotation about an axis, 0 for x, of an object held at the centre.
    fn turn(&self, rotation: &RotationSpec, axis: usize) -> RotationPart {
        // As in `RotationSpec::over_mass`, about one axis.
        let over_mass = |number: f64| number * rotation.inertia[axis] / self.object.mass;
        let of = |own: Option<Triple>, usual: f64| own.map_or_else(|| over_mass(usual), |own| own[axis]);
        let damping = of(rotation.damping, self.object.damping);
        // Walls act on the centre and exert no torque.
        let object = ObjectSpec { mass: rotation.inertia[axis], damping, enclosure: None, ..self.object_at_rest() };
        let (usual, own) = (self.coordination.gains, &rotation.gains);
        let gains = Gains { stiffness: of(own.stiffness, usual.stiffness), damping: of(own.damping, usual.damping) };
        // The strategy extrapolates positions and holds orientations as received, as average-position does.
        let is_extrapolated = self.coordination.strategy == Coordination::Extrapolated;
        let strategy = if is_extrapolated { Coordination::AveragePosition } else { self.coordination.strategy };
        let peers = rotation.peers.iter().zip(&self.peers).map(|(peer, spec)| {
            let spec = PeerSpec { hand: None, ..at_rest(spec) };
            match &peer.device {
                // A frictionless finger exerts no torque.
                Some(device) => {
                    let contact = if spec.contact == Contact::Grasp { Contact::Grasp } else { Contact::None };
                    let handle = DeviceConfig { mass: device.handle.inertia[axis], damping: device.handle.damping[axis] };
                    PeerSpec { contact, device: handle, coupling: device.coupling, ..spec }
                }
                None => untouched(spec),
            }
        });
        let coordination = self.coordination.with_own_damping(|_| self.own_rotational_damping(0)[axis]);
        let mut scene = Self { object, peers: peers.collect(), ..self.without_turns(CoordinationSpec { strategy, gains, ..coordination }) };
        // The integrator of a scene has one number of steps, so that the steps of the rotation are multiplied in.
        if let Integrator::RungeKutta4 { steps } = self.integrator {
            scene.integrator = Integrator::RungeKutta4 { steps: steps.saturating_mul(rotation.steps) };
        }
        // A device that does not turn has no part in this component.
        let devices = rotation.peers.iter().map(|peer| peer.device.is_some()).collect();
        RotationPart { components: vec![["rx", "ry", "rz"][axis].to_owned()], scene, devices }
    }

    /// Returns the scene with an object of this mass, and with gains and damping in proportion. `touched` is false for a component without a driving hand.
    fn with_mass(&self, component: String, mass: f64, touched: bool) -> RotationPart {
        let share = mass / self.object.mass;
        let object = ObjectSpec { mass, damping: self.object.damping * share, ..self.object_at_rest() };
        // An automatic damping follows from the stiffness, which is scaled below, and must not be scaled twice.
        let coordination = if self.has_automatic_damping() { self.coordination } else { self.coordination.with_own_damping(|own| own * share) };
        let coordination = CoordinationSpec { gains: self.coordination.gains.scaled(share), ..coordination };
        let peers = self.peers.iter().map(|spec| if touched { at_rest(spec) } else { untouched(at_rest(spec)) });
        let scene = Self { object, peers: peers.collect(), ..self.without_turns(coordination) };
        RotationPart { components: vec![component], scene, devices: vec![touched; self.peers.len()] }
    }

    fn object_at_rest(&self) -> ObjectSpec {
        ObjectSpec { position: [0.0; 3], velocity: [0.0; 3], ..self.object.clone() }
    }

    /// Returns the scene along one axis with this coordination, without timeline, measures and expectations.
    fn without_turns(&self, coordination: CoordinationSpec) -> Self {
        Self { axes: Axes::One, rotation: None, coordination, timeline: Vec::new(), measure: None, expect: None, ..self.clone() }
    }
}

impl CoordinationSpec {
    /// Returns the coordination with the damping β of each copy by the strategy replaced by `other(β)` [N·s/m], if the strategy has a given damping.
    fn with_own_damping(mut self, other: impl FnOnce(f64) -> f64) -> Self {
        let own = self.settings.of_mut(Coordination::LocalDamping);
        if self.strategy == Coordination::LocalDamping {
            // Parameter 0 of local-damping is the damping.
            own.set(0, LawValue::Number(other(own.number(0))));
        }
        self
    }
}

/// Returns true if two vectors have equal components; 0 and −0 are equal.
fn same(one: Triple, other: Triple) -> bool {
    is_zero(std::array::from_fn(|axis| one[axis] - other[axis]))
}

fn is_zero(vector: Triple) -> bool {
    vector.iter().all(|component| *component == 0.0)
}

/// Returns the peer at rest at the origin. A hand with an arm keeps the arm and wants the origin; any other hand is left out.
fn at_rest(spec: &PeerSpec) -> PeerSpec {
    let hand = spec.hand.as_ref().and_then(Hand::arm).map(|arm| Hand::Arm { arm, follows: Signal::Constant([0.0; 3]) });
    let (position, velocity) = ([0.0; 3], [0.0; 3]);
    PeerSpec { kind: PeerKind::Simulated, hand, position, velocity, device_position: None, device_velocity: None, ..spec.clone() }
}

/// Returns the peer without contact, with a placeholder device. The placeholder is the same for all peers.
fn untouched(spec: PeerSpec) -> PeerSpec {
    PeerSpec { contact: Contact::None, device: DeviceConfig { mass: 1.0, damping: 0.0 }, hand: None, ..spec }
}

/// Merges parts with equal scenes, in the order of the first of each.
fn merged(parts: impl Iterator<Item = RotationPart>) -> Vec<RotationPart> {
    let mut merged: Vec<RotationPart> = Vec::new();
    for part in parts {
        // Equal scenes are not enough: the device of a peer may be real in one scene and a placeholder in the other.
        match merged.iter_mut().find(|one| one.scene == part.scene && one.devices == part.devices) {
            Some(one) => one.components.extend(part.components),
            None => merged.push(part),
        }
    }
    merged
}

/// Returns 1/μ for the eigenvalues μ of W = I/m − \[r\]·J⁻¹·\[r\], r ≠ 0 \[kg\]: along r first, then across r, the larger mass first.
///
/// Along r, μ = 1/m. With unit vectors u, v across it, uᵀWu = 1/m + r²·vᵀJ⁻¹v, vᵀWv = 1/m + r²·uᵀJ⁻¹u and uᵀWv = −r²·uᵀJ⁻¹v.
fn effective_masses(mass: f64, inertia: Triple, grasp: Triple) -> [f64; 3] {
    let cross = |a: Triple, b: Triple| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    // A root of a sum of squares is the same on all platforms; `hypot` of the standard library is not.
    let hypot = |a: f64, b: f64| (a * a + b * b).sqrt();
    let length = |a: Triple| hypot(hypot(a[0], a[1]), a[2]);
    let unit = |a: Triple| a.map(|component| component / length(a));
    let radius = length(grasp);
    let along = unit(grasp);
    // The axis least parallel to r has the longest cross product with r, and so gives the most accurate vector across r.
    let least = (0..3).min_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs())).unwrap_or(0);
    let axis = std::array::from_fn(|component| if component == least { 1.0 } else { 0.0 });
    let u = unit(cross(along, axis));
    let v = cross(along, u);
    let weighed = |a: Triple, b: Triple| radius * radius * (0..3).map(|axis| a[axis] * b[axis] / inertia[axis]).sum::<f64>();
    // Eigenvalues of the symmetric matrix of W across r, from the mean and half the difference of the diagonal.
    let (of_u, of_v, of_both) = (weighed(v, v), weighed(u, u), -weighed(u, v));
    let (middle, apart) = (1.0 / mass + 0.5 * (of_u + of_v), hypot(0.5 * (of_u - of_v), of_both));
    // W is positive definite, so that `middle` exceeds `apart`.
    [mass, 1.0 / (middle - apart), 1.0 / (middle + apart)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
        scene        = { duration = "1s", count = 3, axes = 3 }
        object       = { mass = 0.5, damping = 2, inertia = [1.2e-4, 2e-4, 2.6e-4] }
        coordination = { strategy = "proportional-derivative", stiffness = 1000, damping = 5, update = "8ms" }
        peer         = { device = { mass = 0.1, damping = 5 }, coupling = { stiffness = 3500, damping = 5 } }
        link         = { delay = "8ms" }
    "#;

    fn scene(overrides: &[&str]) -> Scene {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        Scene::parse(TEXT, "turns.toml".as_ref(), &overrides).unwrap_or_else(|error| panic!("{error}"))
    }

    fn names(scene: &Scene) -> Vec<String> {
        scene.rotation_parts().unwrap().unwrap().parts.iter().map(RotationPart::name).collect()
    }

    /// The eigenvalues have the trace, the sum of the squares of all entries, and the determinant of W, which is computed here entry by entry.
    #[test]
    fn the_effective_masses_are_those_of_the_matrix() {
        let (mass, inertia) = (0.45, [1.2e-4, 2e-4, 2.6e-4]);
        for r in [[0.03, 0.0, 0.0], [0.01, -0.02, 0.025], [-0.02, 0.02, 0.02], [0.0, 1e-4, 3.0]] {
            let bracket = [[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]];
            let entry = |i: usize, j: usize| {
                let turned: f64 = (0..3).map(|k| bracket[i][k] * bracket[k][j] / inertia[k]).sum();
                (if i == j { 1.0 / mass } else { 0.0 }) - turned
            };
            let w: [[f64; 3]; 3] = core::array::from_fn(|i| core::array::from_fn(|j| entry(i, j)));
            let found = effective_masses(mass, inertia, r).map(|mass| 1.0 / mass);
            let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b.abs(), "{r:?}: {a} is not {b}");
            close(found.iter().sum(), w[0][0] + w[1][1] + w[2][2]);
            close(found.iter().map(|mu| mu * mu).sum(), w.iter().flatten().map(|entry| entry * entry).sum());
            let minor = |a: usize, b: usize| w[1][a] * w[2][b] - w[1][b] * w[2][a];
            let determinant = w[0][0] * minor(1, 2) - w[0][1] * minor(0, 2) + w[0][2] * minor(0, 1);
            assert!((found.iter().product::<f64>() / determinant - 1.0).abs() < 1e-9, "{r:?}");
        }
    }

    #[test]
    fn held_at_the_centre_translations_and_turns_are_apart() {
        assert_eq!(names(&scene(&[])), ["x, y, z", "rx", "ry", "rz"]);
        // The grasp of a peer that touches nothing has no influence.
        assert_eq!(names(&scene(&["peers.peer1.grasp=[0.1, 0, 0]", "peers.peer1.contact=none", "object.inertia=1e-4"])), ["x, y, z", "rx, ry, rz"]);
        let split = scene(&["object.split-mass=true", "coordination.rotational-damping=0.25", "coordination.scaling=inverse-n"]);
        let parts = split.rotation_parts().unwrap().unwrap().parts;
        let rx = &parts[1].scene;
        assert_eq!((rx.copy_mass(), rx.object.damping), (0.4e-4, 2.0 * 1.2e-4 / 0.5));
        let whole = split.rotation_gains_in_time().next().unwrap();
        // The law of the strategy contains the factor N − 1.
        let gains = rx.coordination_gains(rx.coordination.gains, 0);
        assert!((2.0 * gains.stiffness / whole.stiffness[0] - 1.0).abs() < 1e-15 && (2.0 * gains.damping / whole.damping[0] - 1.0).abs() < 1e-15);
        assert_eq!(parts.iter().map(|part| part.devices[0]).collect::<Vec<_>>(), [true, false, false, false]);
    }

    #[test]
    fn parts_have_the_law_of_the_whole() {
        let own = |part: &RotationPart| part.scene.own_damping(0);
        let centre = scene(&["coordination.strategy=local-damping", "object.split-mass=true"]);
        let parts = centre.rotation_parts().unwrap().unwrap().parts;
        // β of translations is KT·(m + 1)·Tc; β of every rotation follows from the largest KR.
        assert_eq!(own(&parts[0]).to_bits(), centre.own_damping(0).to_bits());
        assert!(parts[1..].iter().all(|part| (own(part) / centre.own_damping(0) / (2.6e-4 / 0.5) - 1.0).abs() < 1e-14));
        let held = |more: &[&str]| {
            let scene = scene(&[&["peer.grasp=[0.01, -0.02, 0.025]", "coordination.strategy=local-damping"], more].concat());
            let parts = scene.rotation_parts().unwrap().unwrap().parts;
            for part in &parts {
                let share = part.scene.copy_mass() / scene.copy_mass();
                assert!((own(part) / scene.own_damping(0) / share - 1.0).abs() < 1e-14, "{}", part.name());
            }
            parts.len()
        };
        assert_eq!(held(&["coordination.local-damping.damping=4"]), 4);
        assert_eq!(held(&["object.inertia=2e-4"]), 3);
        for strategy in ["smoothed-average-position", "local-lag"] {
            let set = format!("coordination.strategy={strategy}");
            let parts = scene(&[&set]).rotation_parts().unwrap().unwrap().parts;
            assert!(parts.len() == 4 && parts.iter().all(|part| part.scene.coordination.strategy.name() == strategy));
        }
        let ticks =
            scene(&["coordination.strategy=local-damping", "coordination.local-damping.age=20ms", "peers.peer2.tick=2ms"]).rotation_parts().unwrap();
        assert!(ticks.unwrap_err().contains("other ticks"));
    }

    #[test]
    fn a_finger_pushes_along_its_axis_alone() {
        let found = scene(&["peers.peer2.contact.push=-y"]).rotation_parts().unwrap().unwrap();
        assert_eq!(found.parts.iter().map(RotationPart::name).collect::<Vec<_>>(), ["x, z", "y", "rx", "ry", "rz"]);
        assert_eq!(found.parts[0].scene.peers[1].contact, Contact::None);
        assert_eq!(found.parts[1].scene.peers[1].contact, Contact::Push(Direction { axis: 0, positive: false }));
    }

    #[test]
    fn held_at_one_point_there_are_touched_scenes_and_pivots() {
        let held = |more: &[&str]| scene(&[&["peer.grasp=[0.01, -0.02, 0.025]"], more].concat());
        assert_eq!(names(&held(&[])), ["touched 1", "touched 2", "touched 3", "pivot 1, pivot 2, pivot 3"]);
        for (more, why) in [
            ("peers.peer3.grasp=[0.01, -0.02, 0.02]", "different points"),
            ("coordination.rotational-stiffness=1", "default"),
            ("object.rotational-damping=1", "default"),
            ("coordination.strategy=extrapolated", "extrapolated"),
            ("simulation.integrator=semi-implicit-euler", "another step"),
            ("coordination.strategy=local-damping", "moments of inertia differ"),
            ("peers.peer3.contact.push=-y", "finger"),
        ] {
            let error = held(&[more]).rotation_parts().unwrap().unwrap_err();
            assert!(error.contains(why), "{more}: {error}");
        }
    }
}
