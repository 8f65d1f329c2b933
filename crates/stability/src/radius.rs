//! A spectral radius that says how sure it is, and the verdict that follows from it.

/// A spectral radius with a bound of its error: the true one lies within `value ± error`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Radius {
    /// The largest modulus of an eigenvalue, as computed; infinite where the numbers overflowed.
    pub value: f64,
    /// How far the true radius may be from it; zero or more, possibly infinite.
    pub error: f64,
}

/// What a spectral radius says.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Verdict {
    /// The radius is below 1: every disturbance of the relative motion dies out.
    Stable,
    /// The radius cannot be told from 1 within its error.
    Marginal,
    /// The radius is above 1: some disturbance grows.
    Unstable,
}

impl Radius {
    /// The verdict: [`Verdict::Marginal`] where the error reaches 1.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        if self.value + self.error < 1.0 {
            Verdict::Stable
        } else if self.value - self.error > 1.0 {
            Verdict::Unstable
        } else {
            // Also where a number is NaN.
            Verdict::Marginal
        }
    }

    /// The radius over that many frames: the power, with the error that follows.
    #[must_use]
    pub fn over(self, frames: u32) -> Self {
        if frames == 1 {
            return self;
        }
        let power = |base: f64| libm::pow(base, f64::from(frames));
        let value = power(self.value);
        let rounding = f64::EPSILON * f64::from(frames) * value;
        Self { value, error: (power(self.value + self.error) - value).max(value - power((self.value - self.error).max(0.0))) + rounding }
    }

    /// The radius of two systems side by side: the larger, with an error that covers both.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let low = (self.value - self.error).max(other.value - other.error);
        let high = (self.value + self.error).max(other.value + other.error);
        let value = self.value.max(other.value);
        Self { value, error: (high - value).max(value - low) }
    }
}

impl Verdict {
    /// The word in JSON and CSV: `stable`, `marginal` or `unstable`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Marginal => "marginal",
            Self::Unstable => "unstable",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_needs_the_whole_interval_on_one_side() {
        let verdict = |value, error| Radius { value, error }.verdict();
        assert_eq!(verdict(0.9, 0.05), Verdict::Stable);
        assert_eq!(verdict(0.9, 0.1), Verdict::Marginal);
        assert_eq!(verdict(1.1, 0.05), Verdict::Unstable);
        assert_eq!(verdict(1.0, 0.0), Verdict::Marginal);
        assert_eq!(verdict(f64::INFINITY, 1.0), Verdict::Unstable);
        assert_eq!(verdict(f64::NAN, 0.0), Verdict::Marginal);
    }

    #[test]
    fn side_by_side_the_interval_covers_both() {
        let both = Radius { value: 0.9, error: 0.01 }.or(Radius { value: 0.89, error: 0.05 });
        assert!((both.value - 0.9).abs() < 1e-15 && (both.error - 0.04).abs() < 1e-15);
    }
}
