//! The changes that a load makes to the equations of a node.

use cohaptic_peer::rotation::Matrix3;

/// Changes of a node's equations by a load, in the units of the node's states.
#[derive(Clone, Debug)]
pub(super) struct Stress {
    /// Torque on the copy per turn of the copy, without the coupling torque of the device.
    pub(super) own: Matrix3,
    /// Torque on the copy per turn and per angular velocity of a held sample, indexed by the peer that sent the sample.
    pub(super) heard: Vec<[Matrix3; 2]>,
    /// Coupling torque; `None` if the device has no attitude or touches nothing.
    pub(super) twist: Option<Twist>,
}

/// Coupling torque τC between copy and device, and its reaction on a device that turns.
#[derive(Clone, Debug)]
pub(super) struct Twist {
    /// Change of τC per turn of the copy, turn of the device, angular velocity of the copy, and angular velocity of the device.
    pub(super) by: [Matrix3; 4],
    /// Torque on the device per change of τC, turn of the copy, and turn of the device.
    pub(super) back: [Matrix3; 3],
    /// Torque of the hand on the device per turn of the device.
    pub(super) hand: Matrix3,
}
