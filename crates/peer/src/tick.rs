//! The tick of a peer along one axis: equations (7) to (10) of Rakhsha & Constantinescu (2015), in any [`Number`]. Equations (9) and (10) are forces of
//! [`Gains`](crate::Gains), and stand beside them.
//!
//! If the desired motion (xd, vd) is the mean of the held samples, equation (10) is the law of the paper,
//! [`AveragePosition`](crate::coordination::AveragePosition). Other laws have other desired motions or gains.

use crate::coordination::{Law, Observation};
use crate::{Motion, Number};

pub use crate::gains::{coordinate, grasp};

/// Returns the force on a copy \[N\] without its damping and without walls.
#[must_use]
#[inline(always)]
pub fn on_object<N: Number>(coupling: N, coordination: N) -> N {
    //= Rakhsha & Constantinescu 2015, eq. (8): mO·aO = FC − FT − bO·vO
    coupling - coordination
}

/// Returns the force on a device \[N\] without its damping and without the arm that holds the device.
#[must_use]
#[inline(always)]
pub fn on_device<N: Number>(hand: N, coupling: N) -> N {
    //= Rakhsha & Constantinescu 2015, eq. (7): mH·aH = Fh − FC − bH·vH
    hand - coupling
}

/// Returns FC and FC − FT \[N\], where `coupling` computes FC from the motion of the device relative to the copy.
#[must_use]
#[inline(always)]
pub fn forces<N: Number>(
    device: Motion<N>,
    coupling: impl FnOnce(Motion<N>) -> N,
    seen: &Observation<N>,
    law: &impl Law<N>,
    memory: &mut [N],
) -> (N, N) {
    let coupling = coupling(device.relative_to(seen.own));
    (coupling, on_object(coupling, law.force(seen, memory)))
}
