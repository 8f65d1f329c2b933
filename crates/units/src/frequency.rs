//! Frequencies: hertz at interfaces, radians per second in formulas. The conversions below are the only place with the factor 2π.

/// A frequency \[Hz\].
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct Hertz(pub f64);

/// An angular frequency [rad/s].
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct RadPerSec(pub f64);

impl From<Hertz> for RadPerSec {
    fn from(frequency: Hertz) -> Self {
        Self(core::f64::consts::TAU * frequency.0)
    }
}

impl From<RadPerSec> for Hertz {
    fn from(frequency: RadPerSec) -> Self {
        Self(frequency.0 / core::f64::consts::TAU)
    }
}
