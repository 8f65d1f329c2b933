//! Words that several answers share.

/// Returns a length in words: `12.300 mm`, and in metres with an exponent from 10 km on.
#[must_use]
pub fn length(metres: f64) -> String {
    if metres.abs() < 1e4 { format!("{:.3} mm", metres * 1e3) } else { format!("{metres:.3e} m") }
}

/// Returns what the verdicts of so many combinations, cells or values leave out, because their second moment cannot be followed; `None` if there are none. `one` and
/// `several` follow the number: "cell is", "cells are".
#[must_use]
pub fn nominal(count: usize, [one, several]: [&str; 2]) -> Option<String> {
    (count > 0).then(|| {
        format!(
            "{count} {} nominal: the second moment cannot be followed there, and the radius is the square of the spectral radius with every delay its mean and \
             nothing lost; stability point says why",
            if count == 1 { one } else { several }
        )
    })
}
