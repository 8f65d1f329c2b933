//! A small displacement of where everything begins, to see whether it dies out.

use cohaptic_peer::State;
use cohaptic_peer::rotation::{Attitude, Rotation};

/// Beyond the places of all peers, so that no turn is like a displacement.
const TURNS: usize = 1 << 24;

/// Displaces each device and each copy by up to `size`, each differently, so that every mode of the relative motion is excited.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Disturbance {
    /// \[m\]
    pub(crate) size: f64,
}

impl Disturbance {
    /// The displaced state of a peer's device (`body` 0) or copy (`body` 1), along the first `axes` axes.
    ///
    /// Steps of the golden angle spread over the circle without repeating, so no two bodies of any number move alike.
    pub(crate) fn displace<const A: usize>(self, state: State<A>, axes: usize, place: usize, body: usize) -> State<A> {
        const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
        let mut displaced = state;
        for (axis, position) in displaced.position.iter_mut().enumerate().take(axes) {
            let number = u32::try_from(6 * place + 2 * axis + body).unwrap_or(u32::MAX);
            *position += self.size * libm::cos(GOLDEN_ANGLE * f64::from(number));
        }
        displaced
    }

    /// Turns a peer's copy and device; angles times `length` are lengths \[m\].
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
