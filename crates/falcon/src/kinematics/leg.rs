//! One leg: an arm, a shin, and what holds them together.

use libm::{acos, atan2, cos, hypot, sin, sqrt};

use super::Triple;
use super::geometry::{ARM, C, DIRECTIONS, ENDS, F, R, S, SHIN};

/// The grip as one leg sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    /// Along the leg, from the arm's axis to the shin's end on the grip \[m\].
    across: f64,
    /// Out of the device \[m\].
    out: f64,
    /// Cosine of the angle of the shin out of the leg's plane.
    cos_tilt: f64,
    cos_azimuth: f64,
    sin_azimuth: f64,
}

impl Leg {
    pub(super) fn at(place: usize, [x, y, z]: Triple) -> Self {
        let (cos_azimuth, sin_azimuth) = DIRECTIONS[place];
        let u = cos_azimuth * x + sin_azimuth * y - R;
        let v = -sin_azimuth * x + cos_azimuth * y - S;
        Self { across: u + C, out: z, cos_tilt: (v + F) / SHIN, cos_azimuth, sin_azimuth }
    }

    /// Sine of the tilt; NaN if the shin is too short to reach so far out of its plane.
    fn sin_tilt(&self) -> f64 {
        sqrt(1.0 - self.cos_tilt * self.cos_tilt)
    }

    /// How long the shin is within the leg's plane \[m\].
    fn reach(&self) -> f64 {
        ENDS + SHIN * self.sin_tilt()
    }

    /// The angle of the arm \[rad\]; `None` if the shin does not reach.
    pub(super) fn arm_angle(&self) -> Option<f64> {
        let reach = self.reach();
        let distance = hypot(self.across, self.out);
        // Law of cosines in the triangle of arm, shin and the line between their ends.
        let cosine = (distance * distance + ARM * ARM - reach * reach) / (2.0 * ARM * distance);
        let angle = atan2(self.out, self.across) - acos(cosine);
        angle.is_finite().then_some(angle)
    }

    /// How far the constraint is from being met at an arm angle \[m²\], and how that changes with the position \[m\].
    ///
    /// The shin's end is at its length from the knee: (u + c − a cos θ1)² + (w − a sin θ1)² = L².
    pub(super) fn constraint(&self, angle: f64) -> (f64, Triple) {
        let reach = self.reach();
        let (along, out) = (self.across - ARM * cos(angle), self.out - ARM * sin(angle));
        let value = along * along + out * out - reach * reach;
        // dL/dv = −cos θ3 / sin θ3.
        self.turned(value, 2.0 * along, 2.0 * reach * self.cos_tilt / self.sin_tilt(), 2.0 * out)
    }

    /// How the angle of the arm changes with the position \[rad/m\], at that angle.
    pub(super) fn row(&self, angle: f64) -> Triple {
        let (_, slope) = self.constraint(angle);
        // The constraint holds along any motion: dg/dp · dp + dg/dθ · dθ = 0.
        let (along, out) = (self.across - ARM * cos(angle), self.out - ARM * sin(angle));
        let turning = 2.0 * ARM * (along * sin(angle) - out * cos(angle));
        slope.map(|slope| -slope / turning)
    }

    /// A slope in the leg's own axes, turned into those of the device.
    fn turned(&self, value: f64, u: f64, v: f64, w: f64) -> (f64, Triple) {
        let Self { cos_azimuth, sin_azimuth, .. } = *self;
        (value, [cos_azimuth * u - sin_azimuth * v, sin_azimuth * u + cos_azimuth * v, w])
    }
}
