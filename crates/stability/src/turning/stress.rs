//! The changes that a load makes to the equations of a node.

use cohaptic_peer::rotation::Matrix3;

/// How a load changes the equations of a node, in the units of its states.
#[derive(Clone, Debug)]
pub(super) struct Stress {
    /// The torque on the copy by its own turn, but for that of the device.
    pub(super) own: Matrix3,
    /// For each peer, the torque on the copy by the turn of its samples and by their angular velocity.
    pub(super) heard: Vec<[Matrix3; 2]>,
    pub(super) twist: Option<Twist>,
}

/// The torque τC and what becomes of it on a device that turns.
#[derive(Clone, Debug)]
pub(super) struct Twist {
    /// δτC by the turn of the copy and of the device, by their angular velocities.
    pub(super) by: [Matrix3; 4],
    /// The torque on the device by δτC, by the turn of the copy and by its own.
    pub(super) back: [Matrix3; 3],
    /// The torque of the hand by the turn of the device.
    pub(super) hand: Matrix3,
}
