//! Rest under the constant forces and torques of the hands, and the equations of small motions about that rest.
//!
//! Under a load each copy has its own pose, p in world axes and θ in body axes, R = R₀Exp(δθ), and the effect of a force depends on the turn. With
//! f₀ = R₀ᵀFC the coupling force in body axes, Q = R₀ᵀM̄₀P, S = R₀ᵀRH₀ and C = R₀\[r\], where tr A stands for tr A·I,
//!
//! ```text
//! δxg = δp − C·δθ,   δ(r×RᵀFC) = −Cᵀ·δFC + [r][f₀]·δθ,   −δτT = −(tr Q − Q)·δθ + Σ wⱼ·2·vee sk(R₀ᵀRⱼ[δθⱼ]P) − BR∘(δω − Σ wⱼ·R₀ᵀRⱼ·δωⱼ)
//! δτC = ½KCR·((tr S − Sᵀ)·δθH − (tr S − S)·δθ) + BCR·(S·δωH − δω),   δ(RHᵀτh) = [RHᵀτh]·δθH
//! −δ(SᵀτC) = −Sᵀ·δτC + Sᵀ[τC]·δθ − [SᵀτC]·δθH
//! ```
//!
//! At rest the sum of torques is zero, so the step maps are the same as without a load. Coinciding copies, S = I and no load give the equations of [`super`].

use cohaptic_peer::rotation::{Attitude, Matrix3, Triple, aligning_torque, turning_torque};
use cohaptic_peer::{Gains, Hand, Signal};
use cohaptic_scene::Scene;

use super::algebra::{IDENTITY, add, apply, cross, product, skew, sum, trace_less, transposed, twice_axial, unit};
use super::levenberg::zero;
use super::node::{Node, Stress, Twist};
use crate::AnalysisError;
use crate::rounding::real;

/// Pose of a copy and of its device, in world axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Pose {
    /// Position of the copy's centre \[m\].
    pub(super) centre: Triple,
    /// Attitude of the copy.
    pub(super) attitude: Attitude,
    /// Position of the device \[m\].
    pub(super) device: Triple,
    /// Attitude of the device's handle.
    pub(super) handle: Attitude,
}

/// Constant load by a hand, in world axes.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Load {
    /// Force on the device \[N\].
    force: Triple,
    /// Torque on the device \[N·m\].
    torque: Triple,
    /// Stiffness of the arm that holds the device [N/m]; 0 without an arm.
    spring: f64,
    /// Point towards which the arm pulls the device \[m\].
    towards: Triple,
}

impl Load {
    /// Returns the load of the peer with the index `place`, or [`AnalysisError::NoRest`] if its hand varies.
    fn of(scene: &Scene, place: usize) -> Result<Self, AnalysisError> {
        let spec = &scene.peers[place];
        let varies = || AnalysisError::NoRest { why: format!("the hand of {} does not stay as it is", spec.name) };
        let constant = |signal: &Signal| match signal {
            Signal::Constant(value) => Ok(*value),
            Signal::Sine { .. } | Signal::Table(_) => Err(varies()),
        };
        let rotation = scene.rotation.as_ref().and_then(|rotation| rotation.peers[place].device.as_ref());
        let torque = rotation.and_then(|device| device.torque.as_ref()).map_or(Ok([0.0; 3]), constant)?;
        let none = Self { force: [0.0; 3], torque, spring: 0.0, towards: [0.0; 3] };
        Ok(match &spec.hand {
            None => none,
            Some(Hand::Force(force)) => Self { force: constant(force)?, ..none },
            Some(Hand::Arm { arm, follows }) => Self { spring: arm.stiffness, towards: constant(follows)?, ..none },
            Some(Hand::Operator { .. }) => return Err(varies()),
        })
    }
}

/// Scene with constant forces of the hands, with one node and one load per peer.
pub(super) struct Loaded<'a> {
    scene: &'a Scene,
    nodes: &'a [Node],
    loads: Vec<Load>,
}

/// Forces and torques on a peer at a pose. The sums `on_copy` and `on_device` are zero at rest.
struct Forces {
    /// Force in world axes \[N\] and torque in body axes \[N·m\] on the copy.
    on_copy: [Triple; 2],
    /// Force in world axes \[N\] and torque in the axes of the handle \[N·m\] on the device.
    on_device: [Triple; 2],
    /// Coupling force FC in body axes \[N\].
    grip: Triple,
    /// Coupling torque τC in body axes \[N·m\].
    twist: Triple,
}

impl<'a> Loaded<'a> {
    pub(super) fn new(scene: &'a Scene, nodes: &'a [Node]) -> Result<Self, AnalysisError> {
        Ok(Self { scene, nodes, loads: (0..nodes.len()).map(|place| Load::of(scene, place)).collect::<Result<_, _>>()? })
    }

    /// Returns the initial poses of the scene, each handle aligned with its copy.
    fn start(&self) -> Vec<Pose> {
        let rotation = self.scene.rotation.as_ref().expect("the object turns");
        let pose = |place: usize| {
            let attitude = Attitude { rate: [0.0; 3], ..rotation.peers[place].attitude };
            let (centre, device) = (self.scene.peers[place].position, self.scene.initial_device::<3>(place).position);
            Pose { centre, attitude, device, handle: attitude }
        };
        (0..self.nodes.len()).map(pose).collect()
    }

    /// Returns M̄, the mean of the attitude matrices of all other peers.
    fn mean(&self, poses: &[Pose], place: usize) -> Matrix3 {
        let weight = 1.0 / real(poses.len() - 1);
        let others = || poses.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, pose)| pose.attitude.matrix());
        std::array::from_fn(|row| std::array::from_fn(|column| others().map(|matrix| weight * matrix[row][column]).sum()))
    }

    fn gains(&self, place: usize) -> Gains<Triple> {
        self.scene.rotation_config(place).expect("the object turns").gains
    }

    /// Returns the gains KCR and BCR of the coupling of turns; `None` if the device has no attitude or touches nothing.
    fn coupling(&self, place: usize) -> Option<Gains> {
        let device = self.scene.rotation_config(place).and_then(|config| config.device);
        device.filter(|_| self.nodes[place].touching).map(|device| device.coupling)
    }

    /// Returns the forces and torques on a peer at rest in these poses. Dampers are left out, because all velocities are zero.
    fn forces(&self, poses: &[Pose], place: usize) -> Forces {
        let (node, load, pose) = (&self.nodes[place], &self.loads[place], &poses[place]);
        let (matrix, others) = (pose.attitude.matrix(), real(poses.len() - 1));
        let arm = apply(&matrix, node.grasp);
        let coupling = if node.touching { node.coupling[0].stiffness } else { 0.0 };
        let force: Triple = std::array::from_fn(|axis| coupling * (pose.device[axis] - pose.centre[axis] - arm[axis]));
        let drawn: Triple = std::array::from_fn(|axis| {
            let mean: f64 = (0..poses.len()).filter(|other| *other != place).map(|other| poses[other].centre[axis]).sum::<f64>() / others;
            node.heard[0].stiffness * mean - node.own[0].stiffness * pose.centre[axis]
        });
        let grip = apply(&transposed(&matrix), force);
        let twist = self.coupling(place).map_or([0.0; 3], |gains| turning_torque((&matrix, [0.0; 3]), (&pose.handle.matrix(), [0.0; 3]), &gains));
        let aligned = aligning_torque((&matrix, [0.0; 3]), (&self.mean(poses, place), [0.0; 3]), &self.gains(place));
        let (lever, back) = (cross(node.grasp, grip), transposed(&pose.handle.matrix()));
        let hand = apply(&back, load.torque);
        let returned = apply(&back, apply(&matrix, twist));
        Forces {
            on_copy: [add(force, drawn), std::array::from_fn(|axis| lever[axis] + twist[axis] - aligned[axis])],
            on_device: [
                std::array::from_fn(|axis| load.force[axis] + load.spring * (load.towards[axis] - pose.device[axis]) - force[axis]),
                std::array::from_fn(|axis| hand[axis] - returned[axis]),
            ],
            grip,
            twist,
        }
    }

    /// Returns all forces and torques as lengths \[m\]: divided by the stiffest spring, and torques also by the length of their node.
    fn residual(&self, poses: &[Pose]) -> Vec<f64> {
        let mut residual = Vec::new();
        for (place, node) in self.nodes.iter().enumerate() {
            let forces = self.forces(poses, place);
            let stiff = self.stiffest();
            let [force, torque] = forces.on_copy;
            residual.extend(force.map(|force| force / stiff).into_iter().chain(torque.map(|torque| torque / (stiff * node.length))));
            let [force, torque] = forces.on_device;
            let both = force.map(|force| force / stiff).into_iter().chain(torque.map(|torque| torque / (stiff * node.length)));
            // A loose device is not part of the equations of rest, since its motion is independent of the copies.
            residual.extend(both.take(self.unknowns(place) - 6));
        }
        residual
    }

    /// Returns the largest stiffness of a coordination, coupling or arm [N/m].
    fn stiffest(&self) -> f64 {
        let springs = self.nodes.iter().zip(&self.loads).flat_map(|(node, load)| [node.own[0].stiffness, node.coupling[0].stiffness, load.spring]);
        springs.fold(f64::MIN_POSITIVE, f64::max)
    }

    /// Returns the number of unknown coordinates of a peer's pose in the equations of the state of rest: six of the copy, and the coordinates of a device that
    /// touches the object.
    fn unknowns(&self, place: usize) -> usize {
        let node = &self.nodes[place];
        6 + if node.touching { node.device.len() } else { 0 }
    }

    /// Returns the poses moved by the coordinates `by`, in the order of peers. Angles are multiplied by the length of the node.
    fn moved(&self, poses: &[Pose], by: &[f64]) -> Vec<Pose> {
        let mut next = 0;
        let mut take = |poses: &Pose, place: usize| {
            let (node, by) = (&self.nodes[place], &by[next..next + self.unknowns(place)]);
            next += by.len();
            let length = |first: usize| -> Triple { std::array::from_fn(|axis| by.get(first + axis).copied().unwrap_or(0.0)) };
            let mut pose = *poses;
            pose.centre = add(pose.centre, length(0));
            pose.attitude.turn(length(3).map(|angle| angle / node.length));
            pose.device = add(pose.device, length(6));
            pose.handle.turn(length(9).map(|angle| angle / node.length));
            pose
        };
        poses.iter().enumerate().map(|(place, pose)| take(pose, place)).collect()
    }

    /// Returns the poses at rest found by Levenberg's (1944) method from the initial poses; [`AnalysisError::NoRest`] if forces are left.
    pub(super) fn rest(&self) -> Result<Vec<Pose>, AnalysisError> {
        let size: usize = (0..self.nodes.len()).map(|place| self.unknowns(place)).sum();
        let (poses, left) = zero(self.start(), size, |poses| self.residual(poses), |poses, by| self.moved(poses, by));
        // The tolerance leaves room for rounding beside the stiffest spring.
        if left <= 1e-12 {
            return Ok(poses);
        }
        Err(AnalysisError::NoRest { why: format!("forces of the hands are left over: about {:.2e} N", left * self.stiffest()) })
    }

    /// Returns the nodes of small motions about these poses.
    pub(super) fn stressed(&self, poses: &[Pose]) -> Vec<Node> {
        (0..self.nodes.len()).map(|place| self.node(poses, place)).collect()
    }

    /// Returns the node of a peer with the equations of the module, in the units of the node's states.
    fn node(&self, poses: &[Pose], place: usize) -> Node {
        let (mut node, pose, forces) = (self.nodes[place].clone(), &poses[place], self.forces(poses, place));
        let (matrix, gains, square) = (pose.attitude.matrix(), self.gains(place), node.length * node.length);
        // P = diag(½·Σk − k): the torque per small turn about an axis is then the sum of the other two weights, which is the stiffness k of the axis.
        let half = 0.5 * gains.stiffness.iter().sum::<f64>();
        let weights = gains.stiffness.map(|stiffness| half - stiffness);
        let [x, y, z] = node.grasp;
        let lever = product(&matrix, &skew([x, y, z]));
        for (axis, grip) in node.grip.iter_mut().enumerate().take(3) {
            for column in 0..3 {
                grip[3 + column] = -lever[axis][column] / node.length;
            }
        }
        let drawn = product(&transposed(&matrix), &self.mean(poses, place));
        let drawn: Matrix3 = drawn.map(|row| std::array::from_fn(|column| row[column] * weights[column]));
        let levered = product(&skew(node.grasp), &skew(forces.grip));
        let over = |matrix: Matrix3| matrix.map(|row| row.map(|entry| entry / square));
        let own = over(sum(&levered, &trace_less(&drawn).map(|row| row.map(|entry| -entry))));
        let heard = poses.iter().map(|other| {
            let apart = product(&transposed(&matrix), &other.attitude.matrix());
            let column = |axis: usize| {
                let turned = product(&apart, &skew(unit(axis))).map(|row| std::array::from_fn(|column| row[column] * weights[column]));
                twice_axial(&turned)
            };
            let columns = [column(0), column(1), column(2)];
            let damped = std::array::from_fn(|row| apart[row].map(|entry| gains.damping[row] * entry));
            [over(transposed(&columns)), over(damped)]
        });
        let heard = heard.collect();
        // The four matrices of δτC and the three of −δ(SᵀτC) from the module head, divided by the squared length, since angles and torques count as lengths.
        let twist = self.coupling(place).map(|coupling| {
            let apart = product(&transposed(&matrix), &pose.handle.matrix());
            let back = transposed(&apart);
            let scaled = |matrix: &Matrix3, by: f64| matrix.map(|row| row.map(|entry| by * entry));
            let (spring, damper) = (0.5 * coupling.stiffness, coupling.damping);
            let hand = apply(&transposed(&pose.handle.matrix()), self.loads[place].torque);
            Twist {
                by: [
                    over(scaled(&trace_less(&apart), -spring)),
                    over(scaled(&trace_less(&back), spring)),
                    over(scaled(&IDENTITY, -damper)),
                    over(scaled(&apart, damper)),
                ],
                back: [scaled(&back, -1.0), over(product(&back, &skew(forces.twist))), over(scaled(&skew(apply(&back, forces.twist)), -1.0))],
                hand: over(skew(hand)),
            }
        });
        // `stress` replaces the springs of turns and all effects of samples on turns. The damping of the copy's own turn stays in the node.
        let none = Gains { stiffness: 0.0, damping: 0.0 };
        for axis in 3..6 {
            (node.own[axis].stiffness, node.heard[axis]) = (0.0, none);
        }
        for coupling in node.coupling.iter_mut().skip(3) {
            *coupling = none;
        }
        node.stress = Some(Box::new(Stress { own, heard, twist }));
        node
    }

    /// Returns the six displacements of everything together, as displacements of each copy and its device: three along the axes, then three turns about the
    /// first copy.
    pub(super) fn together(&self, poses: &[Pose]) -> Vec<Vec<([f64; 6], Vec<f64>)>> {
        let motion = |axis: usize| {
            let each = self.nodes.iter().zip(poses).map(|(node, pose)| {
                let moved = |point: Triple| {
                    if axis < 3 {
                        unit(axis)
                    } else {
                        let arm = std::array::from_fn(|axis| point[axis] - poses[0].centre[axis]);
                        cross(unit(axis - 3), arm).map(|way| way / node.length)
                    }
                };
                let turned = |attitude: &Attitude| if axis < 3 { [0.0; 3] } else { apply(&transposed(&attitude.matrix()), unit(axis - 3)) };
                let ([x, y, z], [a, b, c]) = (moved(pose.centre), turned(&pose.attitude));
                // A loose device does not move with the copies, so its displacement is zero.
                let device = moved(pose.device).into_iter().chain(turned(&pose.handle)).take(node.device.len());
                let device = if node.touching { device.collect() } else { vec![0.0; node.device.len()] };
                ([x, y, z, a, b, c], device)
            });
            each.collect()
        };
        (0..6).map(motion).collect()
    }
}
