//! Steps of bodies under forces, as operations of a [program](super::program). Forces are multiplied by a compliance, so registers hold lengths \[m\].

use std::time::Duration;

use cohaptic_peer::Gains;
use cohaptic_stability::frames::{Body, Scale};

use super::program::{Operation, Register, Sum};

/// The registers of position and velocity.
pub(super) type StateRegisters = [Register; 2];

pub(super) fn state(of: impl Fn(bool) -> Register) -> StateRegisters {
    [false, true].map(of)
}

/// Returns the registers of the device of a class.
pub(super) fn device(class: usize) -> StateRegisters {
    state(|velocity| Register::Body { class, of_copy: false, velocity })
}

/// Returns the registers of the copy of a class.
pub(super) fn copy(class: usize) -> StateRegisters {
    state(|velocity| Register::Body { class, of_copy: true, velocity })
}

/// Returns the force of a coupling on the object, K·(x_device − x_object) + B·(v_device − v_object), times the compliance. A body `None` has no part in
/// the motion and is at rest.
pub(super) fn coupling(gains: Gains, device: Option<StateRegisters>, object: Option<StateRegisters>, scale: Scale) -> Sum {
    let gains = scale.gains(gains);
    let of = |bodies: Option<StateRegisters>, sign: f64| {
        let by = [gains.stiffness, gains.damping].map(|gain| sign * (gain * scale.compliance));
        bodies.into_iter().flatten().zip(by)
    };
    of(device, 1.0).chain(of(object, -1.0)).collect()
}

pub(super) fn negative(sum: Sum) -> Sum {
    sum.into_iter().map(|(register, by)| (register, -by)).collect()
}

/// A body and the force on that body.
pub(super) struct Pushed {
    pub(super) body: Body,
    pub(super) is_copy: bool,
    pub(super) force: Sum,
}

/// Returns the operations of a tick of the bodies of a class. `is_late`: the class computes for a whole tick, and forces act one tick later.
pub(super) fn moved(class: usize, bodies: &[Pushed], is_late: bool, span: Duration, scale: Scale) -> Vec<Operation> {
    // All forces come first: they depend on the states of the bodies before any body moves.
    let forces = bodies.iter().map(|pushed| force_of(class, pushed, is_late));
    forces.chain(bodies.iter().map(|pushed| step_of(class, pushed, span, scale))).collect()
}

/// Returns the step of a body by the coefficients of its step map under the force of this tick.
fn step_of(class: usize, Pushed { body, is_copy, .. }: &Pushed, span: Duration, scale: Scale) -> Operation {
    let (e, g) = body.scaled_map(span, scale.time).coefficients();
    let [x, v] = if *is_copy { copy(class) } else { device(class) };
    let force = Register::Force { class, on_copy: *is_copy };
    let by = |row: usize| g[row] / scale.compliance;
    vec![(x, vec![(x, 1.0 + e[0][0]), (v, e[0][1]), (force, by(0))]), (v, vec![(x, e[1][0]), (v, 1.0 + e[1][1]), (force, by(1))])]
}

fn force_of(class: usize, Pushed { is_copy, force, .. }: &Pushed, is_late: bool) -> Operation {
    let (acting, pending) = (Register::Force { class, on_copy: *is_copy }, Register::Pending { class, on_copy: *is_copy });
    // A late class applies the force of the tick before and keeps the new force. Both happen at once, so the old force is not overwritten first.
    if is_late { vec![(acting, vec![(pending, 1.0)]), (pending, force.clone())] } else { vec![(acting, force.clone())] }
}
