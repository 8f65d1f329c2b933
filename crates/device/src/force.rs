//! Force that has passed a gate.

/// Force on the hand \[N\] that has passed a [`Gate`](crate::Gate).
///
/// The only values are zero and results of a gate, so a driver that takes nothing else gives no force that a gate has not admitted. x points to the user's
/// right, y up, z towards the user. For a coupling force FC on the copy of an object, the force on the hand is −FC.
///
/// ```compile_fail
/// let force = cohaptic_device::GatedForce([8.0, 0.0, 0.0]);
/// ```
///
/// ```
/// let force = cohaptic_device::GatedForce::ZERO;
/// assert_eq!(force.newtons(), [0.0; 3]);
/// ```
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct GatedForce(pub(crate) [f64; 3]);

impl GatedForce {
    /// Zero force, which needs no gate.
    pub const ZERO: Self = Self([0.0; 3]);

    /// Returns the components \[N\]. Each component is finite.
    #[must_use]
    pub const fn newtons(self) -> [f64; 3] {
        self.0
    }
}
