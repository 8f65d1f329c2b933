//! The names of the states of a scene.

use std::fmt;

/// A state of a scene. Positions are in metres, relative to a copy ([`Monodromy::relative`](crate::Monodromy::relative)) where nothing ties them to ground;
/// velocities are multiplied by a common time, forces by a compliance, waves by the root of a time over a mass, times the time between samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StateName {
    /// Peer to which the state belongs, as an index of [`Scene::peers`](cohaptic_scene::Scene::peers).
    pub peer: usize,
    /// Quantity that the state is.
    pub kind: StateKind,
}

/// Quantity that a state is. `axis` is 0 for x, 1 for y, 2 for z.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(missing_docs, reason = "axis is said above")]
pub enum StateKind {
    /// Position of the device.
    DevicePosition { axis: usize },
    /// Velocity of the device.
    DeviceVelocity { axis: usize },
    /// Position of the copy.
    ObjectPosition { axis: usize },
    /// Velocity of the copy.
    ObjectVelocity { axis: usize },
    /// The coupling force that acts next, if forces are applied a tick late.
    PendingCoupling { axis: usize },
    /// The force on the copy that acts next, if forces are applied a tick late.
    PendingForce { axis: usize },
    /// Position of the device at the latest exchange, if readings are late.
    LatestPosition { axis: usize },
    /// Velocity of the device at the latest exchange, if readings are late.
    LatestVelocity { axis: usize },
    /// Position in the reading that the coupling uses, if the device does not exchange at each tick.
    ReadingPosition { axis: usize },
    /// Velocity in the reading that the coupling uses, if the device does not exchange at each tick.
    ReadingVelocity { axis: usize },
    /// Coupling force that the device keeps, if the device does not exchange at each tick.
    KeptCoupling { axis: usize },
    /// A number that the strategy remembers.
    Memory { number: usize },
    /// Position at which the arm of an operator wants the device at the next tick.
    WantedPosition { axis: usize },
    /// Position that an operator has seen and that has not come to the hand.
    SeenPosition {
        axis: usize,
        /// Number of ticks back: 1 for the last tick before the frame.
        age: usize,
    },
    /// Position of the copy at an earlier sampling.
    SamplePosition {
        axis: usize,
        /// 1 for the last sample before the frame, 2 for the sample before that.
        age: usize,
    },
    /// Velocity of the copy at an earlier sampling.
    SampleVelocity {
        axis: usize,
        /// Number of samplings back: 1 for the last sample before the frame.
        age: usize,
    },
    /// The force that a server computed for a client at an earlier sampling.
    SampleForce {
        axis: usize,
        /// Number of samplings back: 1 for the last sample before the frame.
        age: usize,
        /// The place of the client.
        receiver: usize,
    },
    /// The wave that was sent to a peer at an earlier sampling.
    SampleWave {
        axis: usize,
        /// Number of samplings back: 1 for the last sample before the frame.
        age: usize,
        /// The place of that peer.
        receiver: usize,
    },
}

impl fmt::Display for StateKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |axis: usize| ["x", "y", "z"].get(axis).copied().unwrap_or("?");
        match *self {
            Self::DevicePosition { axis: a } => write!(f, "device position {}", axis(a)),
            Self::DeviceVelocity { axis: a } => write!(f, "device velocity {}", axis(a)),
            Self::ObjectPosition { axis: a } => write!(f, "copy position {}", axis(a)),
            Self::ObjectVelocity { axis: a } => write!(f, "copy velocity {}", axis(a)),
            Self::PendingCoupling { axis: a } => write!(f, "coupling force to come {}", axis(a)),
            Self::PendingForce { axis: a } => write!(f, "force on the copy to come {}", axis(a)),
            Self::LatestPosition { axis: a } => write!(f, "device position at the latest exchange {}", axis(a)),
            Self::LatestVelocity { axis: a } => write!(f, "device velocity at the latest exchange {}", axis(a)),
            Self::ReadingPosition { axis: a } => write!(f, "device position as read {}", axis(a)),
            Self::ReadingVelocity { axis: a } => write!(f, "device velocity as read {}", axis(a)),
            Self::KeptCoupling { axis: a } => write!(f, "coupling force that the device keeps {}", axis(a)),
            Self::Memory { number } => write!(f, "memory {number} of the strategy"),
            Self::WantedPosition { axis: a } => write!(f, "wanted position {}", axis(a)),
            Self::SeenPosition { axis: a, age } => write!(f, "position {} seen {age} ticks before", axis(a)),
            Self::SamplePosition { axis: a, age } => write!(f, "position {} sampled {age} before", axis(a)),
            Self::SampleVelocity { axis: a, age } => write!(f, "velocity {} sampled {age} before", axis(a)),
            Self::SampleForce { axis: a, age, receiver } => write!(f, "force {} for peer {receiver} sampled {age} before", axis(a)),
            Self::SampleWave { axis: a, age, receiver } => write!(f, "wave {} for peer {receiver} sampled {age} before", axis(a)),
        }
    }
}
