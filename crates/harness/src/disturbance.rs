//! A small displacement of all initial states, to see whether the displacement dies out.

use cohaptic_peer::State;
use cohaptic_peer::rotation::{Attitude, Rotation};

/// Offset of the indices of turns, beyond the indices of all peers, so that no turn equals a displacement.
const TURNS: usize = 1 << 24;

/// Displacement of each device and each copy by up to `size`, different for each body, so that every mode of the relative motion is excited.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Disturbance {
    /// Largest displacement along an axis \[m\].
    pub(crate) size: f64,
}

impl Disturbance {
    /// Returns the displaced state of a peer's device (`body` 0) or copy (`body` 1), along the first `axes` axes.
    ///
    /// Multiples of the golden angle cover the circle without repetition, so all bodies have different displacements.
    pub(crate) fn displace<const A: usize>(self, state: State<A>, axes: usize, place: usize, body: usize) -> State<A> {
        const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
        let mut displaced = state;
        for (axis, position) in displaced.position.iter_mut().enumerate().take(axes) {
            let number = u32::try_from(6 * place + 2 * axis + body).unwrap_or(u32::MAX);
            *position += self.size * libm::cos(GOLDEN_ANGLE * f64::from(number));
        }
        displaced
    }

    /// Turns a peer's copy and device by angles of up to `size` / `length` \[rad\].
    pub(crate) fn turn(self, rotation: &mut Rotation, length: f64, place: usize) {
        let turned = |mut attitude: Attitude, body: usize| {
            let State { position, .. } = self.displace(State::<3>::REST, 3, TURNS + place, body);
            attitude.turn(position.map(|angle| angle / length));
            attitude
        };
        let (copy, device) = (*rotation.copy(), rotation.device().copied());
        rotation.set_copy(turned(copy, 1));
        if let Some(device) = device {
            rotation.set_device(turned(device, 0));
        }
    }
}
