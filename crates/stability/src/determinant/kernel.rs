//! What a delay does to a signal z^t, and how fast that changes with z.

use num_complex::Complex64;

/// A factor that a delay brings into a characteristic matrix.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kernel {
    /// z^−j: the value of j steps ago.
    Delay(u32),
    /// z^−1 + … + z^−j: the sum of the last j values, (1 − z^−j)/(z − 1). It is what remains of a delay in relative coordinates.
    Sum(u32),
}

/// A kernel's value and derivative at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet {
    pub(super) value: Complex64,
    pub(super) slope: Complex64,
}

/// z^−j and z^−1 + … + z^−j with their derivatives, by doubling j from its leading digit: S_2m = S_m + z^−m·S_m. Nothing cancels near z = 1.
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
    /// How many steps back it reaches.
    #[must_use]
    pub const fn steps(self) -> u32 {
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

    /// The largest size for |z| ≥ `inner`, and the largest size of the derivative there: both are reached at z = `inner`.
    pub(super) fn limits(self, inner: f64) -> (f64, f64) {
        let jet = self.jet(Complex64::from(inner));
        (jet.value.re, -jet.slope.re)
    }

    /// A bound of the rounding error of [`Kernel::jet`]'s value, relative to the first of [`Kernel::limits`]: each of the j factors of a power brings
    /// at most one rounding of its own (a doubling doubles the error so far), a complex product √5 half-units (Brent, Percival & Zimmermann 2007).
    pub(super) fn rounding(self) -> f64 {
        (4.0 * f64::from(self.steps()) + 4.0) * f64::EPSILON
    }

    /// A bound of the change of the kernel over a step of `length` from `z`, while |z| ≥ `inner`; `limits` are those of `inner`, `power` is
    /// `inner`^−j, `size` is the kernel's at `z`.
    pub(super) fn change(self, z: Complex64, length: f64, limits: (f64, f64), power: f64, inner: f64, size: f64) -> f64 {
        let uniform = (limits.1 * length).min(limits.0 + size);
        match self {
            Self::Delay(_) => uniform,
            // Away from z = 1: S = (1 − z^−j)/(z − 1) and S' = (j·z^−j−1 − S)/(z − 1).
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
