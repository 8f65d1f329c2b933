//! One leg: an arm, a shin, and the constraint between them.

use libm::{acos, atan2, cos, hypot, sin, sqrt};

use super::Triple;
use super::geometry::{ARM, C, DIRECTIONS, ENDS, F, R, S, SHIN};

/// Position of the grip in the coordinates of one leg.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    /// Coordinate u + c along the leg, from the arm's axis to the shin's end on the grip \[m\].
    across: f64,
    /// Coordinate w out of the device \[m\].
    out: f64,
    /// Cosine of the angle θ3 between the shin and the normal of the leg's plane.
    cos_tilt: f64,
    cos_azimuth: f64,
    sin_azimuth: f64,
}

impl Leg {
    /// Returns the coordinates of the grip at (x, y, z) \[m\] for the leg `place`: 0 is top, 1 right, 2 left.
    pub(super) fn at(place: usize, [x, y, z]: Triple) -> Self {
        let (cos_azimuth, sin_azimuth) = DIRECTIONS[place];
        let u = cos_azimuth * x + sin_azimuth * y - R;
        let v = -sin_azimuth * x + cos_azimuth * y - S;
        Self { across: u + C, out: z, cos_tilt: (v + F) / SHIN, cos_azimuth, sin_azimuth }
    }

    /// Returns the sine of θ3. NaN if the shin is too short to reach so far out of the leg's plane.
    fn sin_tilt(&self) -> f64 {
        sqrt(1.0 - self.cos_tilt * self.cos_tilt)
    }

    /// Returns the length L of the shin within the leg's plane \[m\].
    fn reach(&self) -> f64 {
        ENDS + SHIN * self.sin_tilt()
    }

    /// Returns the angle θ1 of the arm \[rad\]; `None` if the shin does not reach.
    pub(super) fn arm_angle(&self) -> Option<f64> {
        let reach = self.reach();
        let distance = hypot(self.across, self.out);
        // Law of cosines in the triangle of arm, shin and the line between their outer ends.
        let cosine = (distance * distance + ARM * ARM - reach * reach) / (2.0 * ARM * distance);
        let angle = atan2(self.out, self.across) - acos(cosine);
        // The arc cosine is NaN if the triangle does not close, and `reach` is NaN if the shin is too short.
        angle.is_finite().then_some(angle)
    }

    /// Returns the error of the constraint at an arm angle \[m²\], and its derivative with respect to the position \[m\].
    ///
    /// The constraint sets the shin's end at the length L from the knee: (u + c − a cos θ1)² + (w − a sin θ1)² = L².
    pub(super) fn constraint(&self, angle: f64) -> (f64, Triple) {
        let reach = self.reach();
        let (along, out) = (self.across - ARM * cos(angle), self.out - ARM * sin(angle));
        let value = along * along + out * out - reach * reach;
        // L depends on v by dL/dv = −cos θ3 / sin θ3.
        self.turned(value, 2.0 * along, 2.0 * reach * self.cos_tilt / self.sin_tilt(), 2.0 * out)
    }

    /// Returns the derivative of the arm's angle with respect to the position \[rad/m\], at that angle.
    pub(super) fn row(&self, angle: f64) -> Triple {
        let (_, slope) = self.constraint(angle);
        // The constraint holds along any motion: dg/dp · dp + dg/dθ · dθ = 0.
        let (along, out) = (self.across - ARM * cos(angle), self.out - ARM * sin(angle));
        let turning = 2.0 * ARM * (along * sin(angle) - out * cos(angle));
        slope.map(|slope| -slope / turning)
    }

    /// Turns a derivative from the leg's axes into the axes of the device.
    fn turned(&self, value: f64, u: f64, v: f64, w: f64) -> (f64, Triple) {
        let Self { cos_azimuth, sin_azimuth, .. } = *self;
        (value, [cos_azimuth * u - sin_azimuth * v, sin_azimuth * u + cos_azimuth * v, w])
    }
}
