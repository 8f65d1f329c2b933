//! Words shared by several answers.

use cohaptic_units::print::Counted;

/// Returns a length in words: `12.300 mm`, and in metres with an exponent from 10 km on.
#[must_use]
pub fn length(metres: f64) -> String {
    match length_unit(metres) {
        (factor, "mm") => format!("{:.3} mm", metres * factor),
        (_, unit) => format!("{metres:.3e} {unit}"),
    }
}

/// Returns the unit of a length in texts, and the factor from metres to this unit.
pub(crate) const fn length_unit(metres: f64) -> (f64, &'static str) {
    // From 10 km on, millimetres would be a long row of digits.
    if metres.abs() < 1e4 { (1e3, "mm") } else { (1.0, "m") }
}

/// Returns the note about `count` nominal verdicts, which leave random parts out because their second moment cannot be followed; `None` if `count` is 0. `one`
/// and `several` follow the number: "cell is", "cells are".
#[must_use]
pub(crate) fn nominal(count: usize, [one, several]: [&str; 2]) -> Option<String> {
    (count > 0).then(|| {
        format!(
            "{count} {} nominal: the second moment cannot be followed there, and the radius is the square of the spectral radius with every delay at its mean and no losses; stability point says why",
            if count == 1 { one } else { several }
        )
    })
}

/// Returns the name of a variant of a scene in a legend: the name of the coordination law, and then the `KEY=VALUE` texts of the variant, without the text
/// about the law.
#[must_use]
pub fn legend_name(law: &str, overrides: &[String]) -> String {
    let is_law = |text: &&String| text.split_once('=').is_some_and(|(key, _)| key.trim() == LAW);
    std::iter::once(law).chain(overrides.iter().filter(|text| !is_law(text)).map(String::as_str)).collect::<Vec<&str>>().join(", ")
}

/// Key of the coordination law of a scene.
pub(crate) const LAW: &str = "coordination.strategy";

/// Returns a count with noun and verb: `1 cell is`, `2 cells are`.
#[must_use]
pub fn are(number: usize, one: &str) -> String {
    format!("{} {}", Counted(number, one), if number == 1 { "is" } else { "are" })
}

/// Returns a figure with `digits` digits after the decimal point. Values from 10⁶ on and below 10⁻⁴ are written with an exponent.
#[must_use]
pub fn figure(value: f64, digits: usize) -> String {
    // Zero and numbers that are not finite have no power of ten.
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e6).contains(&value.abs());
    if plain { format!("{value:.digits$}") } else { format!("{value:.digits$e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_names_the_law_once_and_then_what_else_differs() {
        let name = |overrides: &[&str]| legend_name("average-position", &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>());
        assert_eq!(name(&[]), "average-position");
        assert_eq!(name(&["coordination.strategy = average-position"]), "average-position");
        assert_eq!(
            name(&["scene.count=3", "coordination.strategy=average-position", "link.delay=8ms"]),
            "average-position, scene.count=3, link.delay=8ms"
        );
    }

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
