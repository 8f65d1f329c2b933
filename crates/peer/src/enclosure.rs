//! The enclosure that limits the object's travel: a sampled virtual wall at either end of each axis.

use crate::State;

/// Walls at either end of each axis: a spring and a damper that can push the object back and cannot pull it.
///
/// A sampled wall gives energy away: by Colgate & Schenkel (1997) a device of damping b stays passive at a wall of stiffness K and damping B sampled
/// every T only if b > K·T/2 + |B|. For a free mass m, K·T²/m must be well below 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Enclosure {
    /// The lower end of each axis \[m\].
    pub min: [f64; 3],
    /// The upper end of each axis \[m\], above the lower one.
    pub max: [f64; 3],
    /// Stiffness of the wall [N/m].
    pub stiffness: f64,
    /// Damping of the wall [N·s/m].
    pub damping: f64,
}

impl Enclosure {
    /// Returns the force of the walls on an object in the state `object` \[N\]; zero inside.
    #[must_use]
    pub fn force<const A: usize>(&self, object: &State<A>) -> [f64; A] {
        core::array::from_fn(|axis| self.force_along(axis, object.position[axis], object.velocity[axis]))
    }

    /// Returns the force of the walls of `axis` \[N\] on an object at `x` \[m\] with the velocity `v` [m/s].
    #[must_use]
    #[inline]
    pub fn force_along(&self, axis: usize, x: f64, v: f64) -> f64 {
        // Depth and force have the sign of the axis: positive beyond the upper end, negative beyond the lower end.
        let push = |depth: f64| self.stiffness * depth + self.damping * v;
        if x > self.max[axis] {
            // A wall at the upper end pushes down only.
            -push(x - self.max[axis]).max(0.0)
        } else if x < self.min[axis] {
            // A wall at the lower end pushes up only.
            -push(x - self.min[axis]).min(0.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALLS: Enclosure = Enclosure { min: [-0.02; 3], max: [0.03; 3], stiffness: 1000.0, damping: 10.0 };

    fn force(position: f64, velocity: f64) -> f64 {
        WALLS.force(&State { position: [position], velocity: [velocity] })[0]
    }

    #[test]
    fn a_wall_pushes_back_and_never_pulls() {
        assert_eq!(force(0.0, 9.0).abs(), 0.0);
        // 10 mm beyond the upper end and 20 mm beyond the lower end, at 1000 N/m.
        assert!((force(0.04, 0.0) + 10.0).abs() < 1e-12);
        assert!((force(-0.04, 0.0) - 20.0).abs() < 1e-12);
        // The object leaves fast: a damper alone would pull, the wall does not.
        assert_eq!(force(0.031, -5.0).abs(), 0.0);
        assert_eq!(force(-0.021, 5.0).abs(), 0.0);
    }
}
