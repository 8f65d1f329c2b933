//! Why a text is no variation of a key.

use cohaptic_units::print::SixDigits;

/// Greatest number of values of one key.
pub(crate) const MOST_VALUES: usize = 1_000_000;

/// Why a text is no variation of a key.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VaryError {
    /// The text has no `=`, or no key before the `=`.
    #[error(
        "no key in \"{text}\": expected KEY=LOW..HIGH/COUNT, KEY=LOW..HIGH/COUNT:log or KEY=A,B,C, such as coordination.stiffness=0..6000/13 or link.delay=8ms,24ms"
    )]
    NoKey {
        /// The text of the user.
        text: String,
    },
    /// A range has no number of values, or something else in its place.
    #[error(
        "the number of values is missing in \"{text}\": expected a slash and a whole number of at least 2 after the range, and :log for equal ratios, such as coordination.stiffness=0..6000/13 or coordination.stiffness=10..1000/5:log"
    )]
    NoCount {
        /// The text of the user.
        text: String,
    },
    /// A range of no value or of one value.
    #[error("a range of {count} in \"{text}\": expected at least 2 values, which are the two ends; for a single one, KEY=VALUE")]
    TooFew {
        /// The text of the user.
        text: String,
        /// Number of values asked for.
        count: usize,
    },
    /// The variation has more than a million values.
    #[error("too many values in \"{text}\": expected at most {MOST_VALUES}")]
    TooMany {
        /// The text of the user.
        text: String,
    },
    /// An end of the range is not finite, or is no number with a unit.
    #[error("\"{end}\" in \"{text}\" is not an end of a range: expected a finite number, with a unit where the key takes one")]
    End {
        /// The text of the user.
        text: String,
        /// The end.
        end: String,
    },
    /// The ends have different units.
    #[error("the ends of \"{text}\" have the units \"{low}\" and \"{high}\": expected the same unit at both")]
    Units {
        /// The text of the user.
        text: String,
        /// Unit of the lower end; empty without a unit.
        low: String,
        /// Unit of the upper end; empty without a unit.
        high: String,
    },
    /// The lower end is not below the upper end.
    #[error(
        "the range of \"{text}\" is empty: {} is not below {}; expected a range whose first end is below its second",
        SixDigits(*low),
        SixDigits(*high)
    )]
    Empty {
        /// The text of the user.
        text: String,
        /// The lower end, in its unit.
        low: f64,
        /// The upper end, in its unit.
        high: f64,
    },
    /// A range of equal ratios does not begin above zero.
    #[error("{} in \"{text}\" is not above zero: expected ends above zero for equal ratios (:log)", SixDigits(*low))]
    NoRatio {
        /// The text of the user.
        text: String,
        /// The lower end, in its unit.
        low: f64,
    },
    /// A list has an empty value.
    #[error("a value of \"{text}\" is missing: expected values with commas between them, such as link.delay=8ms,24ms")]
    NoValue {
        /// The text of the user.
        text: String,
    },
    /// The braces after a strategy's name do not hold settings.
    #[error(
        "\"{value}\" in \"{text}\" is not a strategy with settings: expected NAME{{KEY=VALUE,...}}, such as local-damping{{damping=58}}, with parameters of that \
         strategy or other keys of the scene by their dotted paths"
    )]
    Settings {
        /// The text of the user.
        text: String,
        /// The value with the braces.
        value: String,
    },
    /// A list has a value twice.
    #[error("{value} stands twice in \"{text}\": expected different values; for more runs of each, use --runs")]
    Twice {
        /// The text of the user.
        text: String,
        /// The value.
        value: String,
    },
}
