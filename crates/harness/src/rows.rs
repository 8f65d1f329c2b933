//! Rows that observers of a run see.

use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::LinkKeys;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{PacketRecord, Path};

/// Position and velocity along the axes of the scene.
#[derive(Clone, Copy, Debug)]
pub struct StateRow<'a> {
    /// Position \[m\].
    pub position: &'a [f64],
    /// Velocity [m/s].
    pub velocity: &'a [f64],
}

/// State of one peer at a tick and the forces computed at this tick. Slices have as many entries as the scene has axes.
#[derive(Clone, Copy, Debug)]
pub struct TickRow<'a> {
    /// Instant of the tick.
    pub at: Instant,
    /// Index of the peer.
    pub peer: usize,
    /// State of the device.
    pub device: StateRow<'a>,
    /// State of the copy of the object.
    pub object: StateRow<'a>,
    /// State at which the strategy wants the copy to be.
    pub target: StateRow<'a>,
    /// Coupling force FC \[N\].
    pub coupling_force: &'a [f64],
    /// Coordination force FT \[N\].
    pub coordination_force: &'a [f64],
    /// Attitudes and torques; `None` if the object does not turn.
    pub turn: Option<TurnRow<'a>>,
}

/// Attitudes and torques of one peer at one tick.
#[derive(Clone, Copy, Debug)]
pub struct TurnRow<'a> {
    /// Attitude of the copy.
    pub object: &'a Attitude,
    /// Attitude of the device; `None` for a device that does not turn.
    pub device: Option<&'a Attitude>,
    /// Torque of device and coupling on the copy, r×RᵀFC + τC, in body axes of the copy \[N·m\].
    pub coupling_torque: &'a [f64; 3],
    /// Coordination torque τT in body axes of the copy \[N·m\]. Acts on the copy with the opposite sign.
    pub coordination_torque: &'a [f64; 3],
}

/// Step of one peer's copy, from a tick to the next tick of this peer. Slices have as many entries as the scene has axes.
///
/// For a client of a server, which has no copy, this is the step of the device, and F is the coupling force that the server returns or the client computes.
#[derive(Clone, Copy, Debug)]
pub struct StepRow<'a> {
    /// Instant of the tick at which the step begins.
    pub at: Instant,
    /// Index of the peer.
    pub peer: usize,
    /// State of the copy at the beginning of the step.
    pub before: StateRow<'a>,
    /// State of the copy at the end of the step.
    pub after: StateRow<'a>,
    /// Sum of all forces held on the copy over the step \[N\]: FC − F and the walls. Damping is no held force.
    pub held_force: &'a [f64],
    /// Held part F of the coordination force as applied \[N\]: FT without the strategy's own damping. Acts on the copy with the opposite sign.
    pub coordination_force: &'a [f64],
    /// Damping β of the copy by the strategy over the step [N·s/m].
    pub own_damping: f64,
    /// Turn of the copy over the step; `None` if the object does not turn.
    pub turn: Option<TurnStepRow>,
}

/// Turn of a copy over a step, in body axes.
#[derive(Clone, Copy, Debug)]
pub struct TurnStepRow {
    /// Duration of the step.
    pub span: std::time::Duration,
    /// Angular velocity at the beginning [rad/s].
    pub before: [f64; 3],
    /// Angular velocity at the end [rad/s].
    pub after: [f64; 3],
    /// Integral of the angular velocity over the step \[rad\].
    pub travel: [f64; 3],
    /// Sum of all torques held on the copy over the step \[N·m\]. Damping is no held torque.
    pub held_torque: [f64; 3],
    /// Held part of the coordination torque as applied \[N·m\]. Acts on the copy with the opposite sign.
    pub coordination_torque: [f64; 3],
    /// Damping β of the turn by the strategy, about each axis [N·m·s/rad].
    pub own_damping: [f64; 3],
}

/// An instant at which at least one peer has ticked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InstantRow {
    /// The instant.
    pub at: Instant,
    /// Largest distance along an axis between two copies of the object at their latest ticks \[m\].
    pub discrepancy: f64,
}

/// A sample sent by a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SendRow {
    /// Instant of sending.
    pub at: Instant,
    /// Index of the sender.
    pub peer: usize,
    /// Number of packets offered to the network, each with the sample.
    pub packets: u64,
    /// Size of each packet.
    pub size: Bytes,
}

/// A sample that a peer holds from now on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HoldRow {
    /// Instant at which the receiver took the sample: a tick of some peer, at or after the arrival.
    pub at: Instant,
    /// Index of the sender.
    pub from: usize,
    /// Index of the receiver.
    pub to: usize,
    /// Instant at which the sample was taken and sent.
    pub sampled: Instant,
}

/// Fate of one packet between two peers, or of one copy of a packet. Nodes of the path are indices of peers.
pub type PacketRow = PacketRecord<Path>;

/// Input of a session and the instant at which it takes effect.
#[derive(Clone, Copy, Debug)]
pub struct InputRow<'a> {
    /// Instant of the input, at or after the instant of the previous row.
    pub at: Instant,
    /// The input.
    pub what: Input<'a>,
}

/// Input of a session. Peers are indices of [`Scene::peers`](cohaptic_scene::Scene::peers).
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// Datagram from the process of a peer.
    Sample {
        /// Index of the peer.
        peer: usize,
        /// Bytes as received.
        datagram: &'a [u8],
    },
    /// Reading of the device in a person's hand at a tick.
    Device {
        /// Index of the peer.
        peer: usize,
        /// Position and velocity along each axis of the scene; `None` if there was no reading.
        state: Option<StateRow<'a>>,
    },
    /// Change of a link.
    Link {
        /// Index of the sender.
        from: usize,
        /// Index of the receiver.
        to: usize,
        /// Complete keys of the link after the change.
        keys: &'a LinkKeys,
    },
    /// End of the session by a person, after everything at this instant. A session that reaches the end of its scene has no such row.
    End,
}
