//! A radius of a family of scenes, which may be nominal.

use crate::Radius;

/// A radius of a family.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cell<R = Radius> {
    /// By the criterion of the family.
    pub radius: R,
    /// Whether the links leave something to chance that the radius leaves out, because the second moment cannot be followed: it is then the square of
    /// the nominal spectral radius, the scene with every delay its mean and nothing lost.
    pub is_nominal: bool,
}

impl<R> Cell<R> {
    /// A radius that leaves nothing out.
    pub const fn certain(radius: R) -> Self {
        Self { radius, is_nominal: false }
    }
}
