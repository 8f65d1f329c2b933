//! Words shared by several answers.

use cohaptic_units::print::Counted;

/// Returns a length in words: `12.300 mm`, and in metres with an exponent from 10 km on.
#[must_use]
pub fn length(metres: f64) -> String {
    if metres.abs() < 1e4 { format!("{:.3} mm", metres * 1e3) } else { format!("{metres:.3e} m") }
}

/// Returns the note about `count` nominal verdicts, which leave random parts out because their second moment cannot be followed; `None` if `count` is 0. `one`
/// and `several` follow the number: "cell is", "cells are".
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

/// Returns a count with its noun and verb: `1 cell is`, `2 cells are`.
#[must_use]
pub fn are(number: usize, one: &str) -> String {
    format!("{} {}", Counted(number, one), if number == 1 { "is" } else { "are" })
}

/// Returns a figure with `digits` digits after the decimal point. Values from 10⁶ on and below 10⁻⁴ are written with an exponent.
#[must_use]
pub fn figure(value: f64, digits: usize) -> String {
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e6).contains(&value.abs());
    if plain { format!("{value:.digits$}") } else { format!("{value:.digits$e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_and_others_are() {
        assert_eq!([0, 1, 2].map(|number| are(number, "row")), ["0 rows are", "1 row is", "2 rows are"]);
    }

    #[test]
    fn figures_that_are_large_or_small_have_powers_of_ten() {
        for (value, shown) in
            [(0.0, "0.000000"), (1.5, "1.500000"), (-999_999.0, "-999999.000000"), (1e6, "1.000000e6"), (1e-4, "0.000100"), (-2.5e-7, "-2.500000e-7")]
        {
            assert_eq!(figure(value, 6), shown);
        }
        assert_eq!(figure(f64::INFINITY, 6), "inf");
    }
}
