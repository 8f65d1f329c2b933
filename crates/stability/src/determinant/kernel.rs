//! The factor by which a delay multiplies a signal z^t, its derivative by z, and bounds of both.

use num_complex::Complex64;

/// A factor of a delay in a characteristic matrix.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kernel {
    /// z^−j: the value j steps ago.
    Delay(u32),
    /// z^−1 + … + z^−j: the sum of the last j values, (1 − z^−j)/(z − 1). Relative coordinates turn a delay into such a sum.
    Sum(u32),
}

/// The value and the derivative of a kernel at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet {
    pub(super) value: Complex64,
    pub(super) slope: Complex64,
}

/// Returns z^−j and z^−1 + … + z^−j with their derivatives, where j is `count`, by doubling along the binary digits of j: S_2m = S_m + z^−m·S_m. Unlike the
/// closed form, the sums do not cancel near z = 1.
fn jets(z: Complex64, count: u32) -> (Jet, Jet) {
    let one = z.inv();
    let one = Jet { value: one, slope: -one * one };
    let zero = Complex64::default();
    let (mut power, mut sum) = (Jet { value: Complex64::new(1.0, 0.0), slope: zero }, Jet { value: zero, slope: zero });
    for digit in (0..u32::BITS - count.leading_zeros()).rev() {
        sum = sum.plus(power.times(sum));
        power = power.times(power);
        if count >> digit & 1 == 1 {
            power = power.times(one);
            sum = sum.plus(power);
        }
    }
    (power, sum)
}

impl Jet {
    fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }

    fn times(self, other: Self) -> Self {
        Self { value: self.value * other.value, slope: self.value * other.slope + self.slope * other.value }
    }
}

impl Kernel {
    /// Returns the number of steps that the kernel reaches back.
    #[must_use]
    pub(crate) const fn steps(self) -> u32 {
        match self {
            Self::Delay(steps) | Self::Sum(steps) => steps,
        }
    }

    pub(super) fn jet(self, z: Complex64) -> Jet {
        let (power, sum) = jets(z, self.steps());
        match self {
            Self::Delay(_) => power,
            Self::Sum(_) => sum,
        }
    }

    /// Returns the largest modulus of the kernel for |z| ≥ `inner`, and the largest modulus of its derivative. Both are reached at z = `inner`.
    pub(super) fn limits(self, inner: f64) -> (f64, f64) {
        let jet = self.jet(Complex64::from(inner));
        (jet.value.re, -jet.slope.re)
    }

    /// Returns a bound of the rounding error of the value of [`Kernel::jet`], relative to the first of [`Kernel::limits`]. Each of the j factors of a power
    /// adds at most one rounding (a doubling doubles the error so far), and a complex product has √5 half-units (Brent, Percival & Zimmermann 2007).
    pub(super) fn rounding(self) -> f64 {
        (4.0 * f64::from(self.steps()) + 4.0) * f64::EPSILON
    }

    /// Returns a bound of the change of the kernel over a step of `length` from `z`, as long as |z| ≥ `inner`. `limits` are [`Kernel::limits`] of `inner`,
    /// `power` is `inner`^−j, and `size` is the modulus of the kernel at `z`.
    pub(super) fn change(self, z: Complex64, length: f64, limits: (f64, f64), power: f64, inner: f64, size: f64) -> f64 {
        let uniform = (limits.1 * length).min(limits.0 + size);
        match self {
            Self::Delay(_) => uniform,
            // Away from z = 1 the closed forms S = (1 − z^−j)/(z − 1) and S' = (j·z^−j−1 − S)/(z − 1) give smaller bounds.
            Self::Sum(steps) => {
                let away = (z - 1.0).norm() - length;
                if away <= 0.0 {
                    return uniform;
                }
                let largest = (1.0 + power) / away;
                let slope = (f64::from(steps) * power / inner + largest) / away;
                uniform.min(slope * length).min(largest + size)
            }
        }
    }
}
