//! Position and velocity along one axis, in any [`Number`].

use crate::{Number, State};

/// Position and velocity along one axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Motion<N = f64> {
    /// Position \[m\].
    pub position: N,
    /// Velocity [m/s].
    pub velocity: N,
}

impl<N: Number> Motion<N> {
    /// Returns the motion relative to `other`: the differences of position and velocity.
    #[must_use]
    pub fn relative_to(self, other: Self) -> Self {
        Self { position: self.position - other.position, velocity: self.velocity - other.velocity }
    }
}

impl<const A: usize> State<A> {
    /// Returns the motion along one axis.
    #[must_use]
    #[inline(always)]
    pub const fn along(&self, axis: usize) -> Motion {
        Motion { position: self.position[axis], velocity: self.velocity[axis] }
    }

    /// Replaces the motion along one axis.
    #[inline(always)]
    pub(crate) const fn set_along(&mut self, axis: usize, motion: Motion) {
        self.position[axis] = motion.position;
        self.velocity[axis] = motion.velocity;
    }
}
