//! Owned copies of the rows that observers get borrowed, so that another thread can write the rows. All copies have a fixed size, except for changes of a
//! link.

use cohaptic_harness::live::{Input, InputRow};
use cohaptic_harness::{StateRow, TickRow, TurnRow};
use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::MAX_LEN;
use cohaptic_scene::LinkKeys;
use cohaptic_units::Instant;

/// Position \[m\] and velocity [m/s], in this order. Axes that the scene does not have are zero.
type Numbers = [[f64; 3]; 2];

/// Owned copy of a [`TickRow`].
#[derive(Debug)]
pub(crate) struct TickCopy {
    at: Instant,
    peer: usize,
    device: Numbers,
    object: Numbers,
    target: Numbers,
    /// Coupling force and coordination force \[N\], in this order.
    forces: Numbers,
    turn: Option<TurnCopy>,
}

/// Owned copy of a [`TurnRow`].
#[derive(Debug)]
struct TurnCopy {
    object: Attitude,
    device: Option<Attitude>,
    /// Coupling torque and coordination torque \[N·m\], in this order.
    torques: [[f64; 3]; 2],
}

impl TickCopy {
    pub(crate) fn of(row: &TickRow<'_>) -> Self {
        Self {
            at: row.at,
            peer: row.peer,
            device: state(row.device),
            object: state(row.object),
            target: state(row.target),
            forces: [padded(row.coupling_force), padded(row.coordination_force)],
            turn: row.turn.map(|turn| TurnCopy {
                object: *turn.object,
                device: turn.device.copied(),
                torques: [*turn.coupling_torque, *turn.coordination_torque],
            }),
        }
    }

    /// Returns the row as the recorders take it. `axes`: number of axes of the scene, at most 3.
    pub(crate) fn borrowed(&self, axes: usize) -> TickRow<'_> {
        TickRow {
            at: self.at,
            peer: self.peer,
            device: row(&self.device, axes),
            object: row(&self.object, axes),
            target: row(&self.target, axes),
            coupling_force: &self.forces[0][..axes],
            coordination_force: &self.forces[1][..axes],
            turn: self.turn.as_ref().map(|turn| TurnRow {
                object: &turn.object,
                device: turn.device.as_ref(),
                coupling_torque: &turn.torques[0],
                coordination_torque: &turn.torques[1],
            }),
        }
    }
}

/// Owned copy of an [`InputRow`].
#[derive(Debug)]
pub(super) struct InputCopy {
    at: Instant,
    what: What,
}

#[derive(Debug)]
enum What {
    Sample {
        peer: usize,
        bytes: [u8; MAX_LEN],
        len: usize,
    },
    Device {
        peer: usize,
        state: Option<Numbers>,
    },
    /// Boxed, because keys are large and a link changes only when somebody changes the link by hand. No other input allocates.
    Link {
        from: usize,
        to: usize,
        keys: Box<LinkKeys>,
    },
    End,
}

impl InputCopy {
    pub(super) fn of(row: &InputRow<'_>) -> Self {
        let what = match row.what {
            Input::Sample { peer, datagram } => {
                // A sample that the scene has taken is never longer than `MAX_LEN`; `min` keeps the slice in range.
                let (mut bytes, len) = ([0; MAX_LEN], datagram.len().min(MAX_LEN));
                bytes[..len].copy_from_slice(&datagram[..len]);
                What::Sample { peer, bytes, len }
            }
            Input::Device { peer, state: read } => What::Device { peer, state: read.map(state) },
            Input::Link { from, to, keys } => What::Link { from, to, keys: Box::new(keys.clone()) },
            Input::End => What::End,
        };
        Self { at: row.at, what }
    }

    /// Returns the row as the recorder takes it. `axes`: number of axes of the scene, at most 3.
    pub(super) fn borrowed(&self, axes: usize) -> InputRow<'_> {
        let what = match &self.what {
            What::Sample { peer, bytes, len } => Input::Sample { peer: *peer, datagram: &bytes[..*len] },
            What::Device { peer, state } => Input::Device { peer: *peer, state: state.as_ref().map(|numbers| row(numbers, axes)) },
            What::Link { from, to, keys } => Input::Link { from: *from, to: *to, keys },
            What::End => Input::End,
        };
        InputRow { at: self.at, what }
    }
}

/// Copies position and velocity of a row.
fn state(row: StateRow<'_>) -> Numbers {
    [padded(row.position), padded(row.velocity)]
}

/// Returns the first `axes` components of position and velocity.
fn row(numbers: &Numbers, axes: usize) -> StateRow<'_> {
    StateRow { position: &numbers[0][..axes], velocity: &numbers[1][..axes] }
}

/// Returns `values` with zeros for missing axes.
fn padded(values: &[f64]) -> [f64; 3] {
    std::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0))
}
