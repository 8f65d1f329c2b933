//! Position and velocity.

/// Position and velocity of a body along A axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct State<const A: usize> {
    /// Position \[m\].
    pub position: [f64; A],
    /// Velocity [m/s].
    pub velocity: [f64; A],
}

impl<const A: usize> State<A> {
    /// Rest at the origin.
    pub const REST: Self = Self { position: [0.0; A], velocity: [0.0; A] };

    /// Returns position and velocity times `factor`.
    #[must_use]
    pub(crate) fn times(&self, factor: f64) -> Self {
        Self { position: self.position.map(|x| x * factor), velocity: self.velocity.map(|v| v * factor) }
    }

    /// Returns whether every component is a finite number.
    #[must_use]
    #[inline]
    pub fn is_finite(&self) -> bool {
        // 0·x is 0 for a finite x and NaN for any other x, and a sum with a NaN is NaN.
        let mut sum = 0.0;
        for axis in 0..A {
            sum += 0.0 * self.position[axis] + 0.0 * self.velocity[axis];
        }
        !sum.is_nan()
    }

    /// Adds the components of another state. A sum with a number that is not finite is not finite, so that a finite sum of many states takes the place of a
    /// test of each state.
    #[inline]
    pub fn accumulate(&mut self, other: &Self) {
        for axis in 0..A {
            self.position[axis] += other.position[axis];
            self.velocity[axis] += other.velocity[axis];
        }
    }
}

impl<const A: usize> Default for State<A> {
    fn default() -> Self {
        Self::REST
    }
}
