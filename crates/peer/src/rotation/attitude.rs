//! Orientation and angular velocity of a body.

use super::algebra::{apply, cross, dot, scale};
use super::{Matrix3, Real, Triple};
use crate::State;

/// Greatest difference from 1 of the squared norm of a received quaternion.
const NORM_TOLERANCE: f64 = 1.0 / (1 << 20) as f64;

/// Orientation and angular velocity of a body.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Attitude<N = f64> {
    /// Unit quaternion (w, x, y, z) that turns body axes into world axes. q and −q are the same orientation.
    pub orientation: [N; 4],
    /// Angular velocity in body axes [rad/s].
    pub rate: Triple<N>,
}

impl Attitude {
    /// Body axes along world axes, at rest.
    pub const REST: Self = Self { orientation: [1.0, 0.0, 0.0, 0.0], rate: [0.0; 3] };

    /// Returns the motion of a point of the body: x = p + R·r, v = v + R(ω×r). `centre` is the motion of the centre of mass, and `arm` the vector from the
    /// centre of mass to the point, in body axes \[m\].
    #[must_use]
    pub fn point<const A: usize>(&self, arm: Triple, centre: &State<A>) -> State<A> {
        point_of(&self.matrix(), self.rate, arm, centre)
    }

    /// Returns whether every component is a finite number.
    #[must_use]
    #[inline]
    pub fn is_finite(&self) -> bool {
        self.orientation.iter().chain(&self.rate).all(|number| number.is_finite())
    }

    /// Returns whether the quaternion has the norm 1, within 2⁻²⁰ of its square.
    #[must_use]
    #[inline]
    pub fn is_unit(&self) -> bool {
        (squared_norm(&self.orientation) - 1.0).abs() <= NORM_TOLERANCE
    }

    /// Returns the rotation vector of the orientation in world axes \[rad\]: its direction is the axis, its length the angle, 0 to π.
    #[must_use]
    pub fn rotation_vector(&self) -> Triple {
        // q and −q are the same orientation; the one with w ≥ 0 has the angle of at most π.
        let sign = if self.orientation[0] < 0.0 { -1.0 } else { 1.0 };
        let [w, x, y, z] = self.orientation.map(|q| sign * q);
        let sine = libm::sqrt(x * x + y * y + z * z);
        // Angle divided by the sine of its half; 2 in the limit of no rotation.
        let factor = if sine > 0.0 { 2.0 * libm::atan2(sine, w) / sine } else { 2.0 };
        [x, y, z].map(|u| factor * u)
    }

    /// Returns the rotation vector in world axes that turns the orientation `other` into this orientation \[rad\], of length 0 to π.
    #[must_use]
    pub fn rotation_from(&self, other: &[f64; 4]) -> Triple {
        let ([w, u @ ..], [a, b @ ..]) = (self.orientation, *other);
        let turned = cross(u, b);
        // q·p* with the conjugate p* = (a, −b).
        let vector: Triple = core::array::from_fn(|axis| a * u[axis] - w * b[axis] - turned[axis]);
        Self { orientation: [w * a + dot(u, b), vector[0], vector[1], vector[2]], rate: [0.0; 3] }.rotation_vector()
    }

    /// Returns the angle of the rotation from this orientation to `other`, 0 to π \[rad\].
    #[must_use]
    pub fn angle_to(&self, other: &[f64; 4]) -> f64 {
        // The chord between unit quaternions is 2·sin(angle/4), which is accurate for small angles where a cosine is not.
        let chord = |sign: f64| self.orientation.iter().zip(other).map(|(q, p)| (q - sign * p) * (q - sign * p)).sum::<f64>();
        4.0 * libm::asin((0.5 * libm::sqrt(chord(1.0).min(chord(-1.0)))).min(1.0))
    }
}

impl<N: Real> Attitude<N> {
    /// Returns R, which turns vectors in body axes into world axes. The norm of the quaternion cancels.
    ///
    /// R = I + 2/|q|²·(w·\[u\] + \[u\]²) with q = (w, u).
    #[must_use]
    #[inline(always)]
    pub fn matrix(&self) -> Matrix3<N> {
        let [w, x, y, z] = self.orientation;
        // Divided by |q|², so that a quaternion with rounding errors still gives a rotation.
        let factor = N::of(2.0) * squared_norm(&self.orientation).recip();
        let one = N::of(1.0);
        [
            [one - factor * (y * y + z * z), factor * (x * y - w * z), factor * (x * z + w * y)],
            [factor * (x * y + w * z), one - factor * (x * x + z * z), factor * (y * z - w * x)],
            [factor * (x * z - w * y), factor * (y * z + w * x), one - factor * (x * x + y * y)],
        ]
    }

    /// Returns the angular velocity in world axes [rad/s].
    #[must_use]
    #[inline(always)]
    pub fn world_rate(&self) -> Triple<N> {
        apply(&self.matrix(), self.rate)
    }

    /// Turns the attitude by a rotation vector σ in body axes \[rad\], and restores the quaternion's norm of 1 to first order.
    #[inline(always)]
    pub fn turn(&mut self, sigma: Triple<N>) {
        let (cosine, sine) = N::half_turn(dot(sigma, sigma));
        // The rotation is in body axes, so its quaternion multiplies from the right.
        let (w, u) = (self.orientation[0], [self.orientation[1], self.orientation[2], self.orientation[3]]);
        let by = scale(sigma, sine);
        let turned = cross(u, by);
        // Product of the quaternions (w, u) and (cos(½|σ|), sin(½|σ|)·σ/|σ|).
        let q = [
            w * cosine - dot(u, by),
            w * by[0] + u[0] * cosine + turned[0],
            w * by[1] + u[1] * cosine + turned[1],
            w * by[2] + u[2] * cosine + turned[2],
        ];
        // First-order Newton step for 1/√|q|² near 1: ½·(3 − |q|²).
        let unit = N::of(0.5) * (N::of(3.0) - squared_norm(&q));
        self.orientation = q.map(|component| component * unit);
    }
}

/// Like [`Attitude::point`], for a body with the matrix R and the angular velocity ω in body axes.
#[must_use]
#[inline(always)]
pub(super) fn point_of<const A: usize>(matrix: &Matrix3, rate: Triple, arm: Triple, centre: &State<A>) -> State<A> {
    // Both vectors are turned into world axes, in which `centre` is given.
    let (reach, swing) = (apply(matrix, arm), apply(matrix, cross(rate, arm)));
    let moved = |own: &[f64; A], by: Triple| core::array::from_fn(|axis| own[axis] + by.get(axis).copied().unwrap_or(0.0));
    State { position: moved(&centre.position, reach), velocity: moved(&centre.velocity, swing) }
}

#[inline(always)]
pub(super) fn squared_norm<N: Real>([w, x, y, z]: &[N; 4]) -> N {
    *w * *w + *x * *x + *y * *y + *z * *z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let mut attitude = Attitude::REST;
        attitude.turn([0.0, 0.0, core::f64::consts::FRAC_PI_2]);
        let turned = apply(&attitude.matrix(), [1.0, 0.0, 0.0]);
        assert!(turned[0].abs() < 1e-15 && (turned[1] - 1.0).abs() < 1e-15 && turned[2] == 0.0, "{turned:?}");
        assert!((Attitude::REST.angle_to(&attitude.orientation) - core::f64::consts::FRAC_PI_2).abs() < 1e-15);
        assert!((Attitude::REST.angle_to(&attitude.orientation.map(|q| -q)) - core::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn a_rotation_vector_is_the_turn() {
        for sigma in [[0.0; 3], [1e-12, 0.0, 0.0], [0.3, -1.0, 2.0], [-2.9, 0.1, 0.0]] {
            let mut attitude = Attitude::REST;
            attitude.turn(sigma);
            // q and −q are the same orientation, so both must give the same vector.
            for orientation in [attitude.orientation, attitude.orientation.map(|q| -q)] {
                let found = Attitude { orientation, ..attitude }.rotation_vector();
                assert!(found.iter().zip(&sigma).all(|(found, sigma)| (found - sigma).abs() < 1e-14), "{found:?} {sigma:?}");
            }
        }
    }

    #[test]
    fn a_rotation_between_two_is_in_world_axes() {
        let turned = |sigma: Triple| {
            let mut attitude = Attitude::REST;
            attitude.turn(sigma);
            attitude
        };
        let from = turned([0.4, 2.0, -0.7]);
        // A rotation in body axes equals a rotation in world axes about the turned axis.
        let mut to = from;
        to.turn([0.01, -0.02, 0.03]);
        let expected = apply(&from.matrix(), [0.01, -0.02, 0.03]);
        let found = to.rotation_from(&from.orientation);
        assert!(found.iter().zip(&expected).all(|(found, expected)| (found - expected).abs() < 1e-15), "{found:?} {expected:?}");
    }

    #[test]
    fn a_matrix_has_no_norm_of_the_quaternion() {
        // A factor of 4 is a power of two, so all quotients are equal to the bit.
        let of = |scale: f64| Attitude { orientation: [0.5 * scale, -0.1 * scale, 0.7 * scale, 0.2 * scale], rate: [0.0; 3] }.matrix();
        assert_eq!(of(1.0), of(4.0));
    }

    #[test]
    fn an_angle_is_half_a_turn_at_most() {
        let half = [0.0, 1.0, 0.0, 0.0];
        assert!((Attitude::REST.angle_to(&half) - core::f64::consts::PI).abs() < 1e-15);
    }
}
