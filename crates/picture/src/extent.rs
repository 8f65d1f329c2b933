//! Ranges of axes and positions in them, and conversions of counts and lengths.

/// Scale of an axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Scale {
    Linear,
    /// Logarithmic scale. Values of zero and below have no position.
    Logarithmic,
}

/// Range of an axis with its scale. `low` is below `high`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Extent {
    pub(crate) scale: Scale,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Extent {
    /// Creates a range with margins, given as shares of the range. A range that is too narrow for distinct positions is widened.
    pub(crate) fn new(scale: Scale, low: f64, high: f64, margins: (f64, f64)) -> Self {
        match scale {
            Scale::Linear => {
                // Below this length, neighbouring positions would differ by rounding only. The last bound keeps the length positive at zero.
                let least = 1e-9 * low.abs().max(high.abs()).max(1e-290);
                let (low, high) = if high - low < least { (low - 0.05 * low.abs() - 1e-12, high + 0.05 * high.abs() + 1e-12) } else { (low, high) };
                let span = high - low;
                Self { scale, low: low - margins.0 * span, high: high + margins.1 * span }
            }
            Scale::Logarithmic => {
                let (low, high) = (low.max(1e-300), high.max(1e-300));
                let (low, high) = if high / low < 1.000_001 { (low / 2.0, high * 2.0) } else { (low, high) };
                // A logarithmic margin is a share of the decades, so it multiplies the ends.
                let ratio = libm::log10(high) - libm::log10(low);
                let (below, above) = (libm::pow(10.0, -margins.0 * ratio), libm::pow(10.0, margins.1 * ratio));
                Self { scale, low: (low * below).max(1e-306), high: (high * above).min(1e306) }
            }
        }
    }

    /// Returns the length of a linear range; `None` for a logarithmic one.
    pub(crate) fn span(self) -> Option<f64> {
        (self.scale == Scale::Linear).then_some(self.high - self.low)
    }

    /// Returns a linear range of another length around the same middle. A logarithmic range stays unchanged.
    pub(crate) fn spanning(self, span: f64) -> Self {
        let middle = 0.5 * (self.low + self.high);
        if self.scale == Scale::Linear { Self { low: middle - 0.5 * span, high: middle + 0.5 * span, ..self } } else { self }
    }

    /// Returns the position of a value: 0 at the low end, 1 at the high end, not finite without a position.
    pub(crate) fn place(self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic if value > 0.0 => (libm::log10(value) - libm::log10(self.low)) / (libm::log10(self.high) - libm::log10(self.low)),
            Scale::Logarithmic => f64::NAN,
        }
    }
}

/// Converts a count to a floating-point number.
pub(crate) fn count(number: usize) -> f64 {
    f64::from(u32::try_from(number).unwrap_or(u32::MAX))
}

/// Returns the whole part of a length; 0 for a negative length.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "lengths on a page are small and not below zero")]
pub(crate) fn whole(value: f64) -> usize {
    value.max(0.0) as usize
}
