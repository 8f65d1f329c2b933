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
    /// At rest at the origin.
    pub const REST: Self = Self { position: [0.0; A], velocity: [0.0; A] };

    /// Both times a number.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        Self { position: self.position.map(|x| x * factor), velocity: self.velocity.map(|v| v * factor) }
    }

    /// Whether every component is a finite number.
    #[must_use]
    #[inline]
    pub fn is_finite(&self) -> bool {
        // Nothing times a finite number is nothing, times any other NaN: half of the instructions that asking each number takes.
        let mut nothing = 0.0;
        for axis in 0..A {
            nothing += 0.0 * self.position[axis] + 0.0 * self.velocity[axis];
        }
        !nothing.is_nan()
    }
}

impl<const A: usize> Default for State<A> {
    fn default() -> Self {
        Self::REST
    }
}
