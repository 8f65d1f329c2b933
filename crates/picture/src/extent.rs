//! The range that an axis shows, and places in it; counts and lengths as numbers to compute with.

/// How values lie along an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Scale {
    Linear,
    /// Values of zero and below have no place.
    Logarithmic,
}

/// The range of an axis, and how values lie in it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Extent {
    pub(crate) scale: Scale,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Extent {
    pub(crate) fn new(scale: Scale, low: f64, high: f64, margins: (f64, f64)) -> Self {
        match scale {
            Scale::Linear => {
                let least = 1e-9 * low.abs().max(high.abs()).max(1e-290);
                let (low, high) = if high - low < least { (low - 0.05 * low.abs() - 1e-12, high + 0.05 * high.abs() + 1e-12) } else { (low, high) };
                let span = high - low;
                Self { scale, low: low - margins.0 * span, high: high + margins.1 * span }
            }
            Scale::Logarithmic => {
                let (low, high) = (low.max(1e-300), high.max(1e-300));
                let (low, high) = if high / low < 1.000_001 { (low / 2.0, high * 2.0) } else { (low, high) };
                let ratio = libm::log10(high) - libm::log10(low);
                let (below, above) = (libm::pow(10.0, -margins.0 * ratio), libm::pow(10.0, margins.1 * ratio));
                Self { scale, low: (low * below).max(1e-306), high: (high * above).min(1e306) }
            }
        }
    }

    /// The span of a linear axis; `None` of a logarithmic one.
    pub(crate) fn span(self) -> Option<f64> {
        (self.scale == Scale::Linear).then_some(self.high - self.low)
    }

    /// A linear axis with another span about the same middle.
    pub(crate) fn spanning(self, span: f64) -> Self {
        let middle = 0.5 * (self.low + self.high);
        if self.scale == Scale::Linear { Self { low: middle - 0.5 * span, high: middle + 0.5 * span, ..self } } else { self }
    }

    /// Where a value lies: 0 at the low end, 1 at the high one. Not finite if it has no place.
    pub(crate) fn place(self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic if value > 0.0 => (libm::log10(value) - libm::log10(self.low)) / (libm::log10(self.high) - libm::log10(self.low)),
            Scale::Logarithmic => f64::NAN,
        }
    }
}

/// How many, as a number to compute with.
pub(crate) fn count(number: usize) -> f64 {
    f64::from(u32::try_from(number).unwrap_or(u32::MAX))
}

/// The whole part of a length; 0 of one below zero.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "lengths on a page are small and not below zero")]
pub(crate) fn whole(value: f64) -> usize {
    value.max(0.0) as usize
}
