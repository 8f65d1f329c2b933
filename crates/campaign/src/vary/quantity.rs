//! A number with a unit behind it.

/// The longest finite number that the text begins with, and what is left as its unit; `None` unless that is all there is.
pub(super) fn quantity(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let ends = (1..=text.len()).rev().filter(|end| text.is_char_boundary(*end));
    let (end, value) = ends.filter_map(|end| text[..end].parse::<f64>().ok().map(|value| (end, value))).next()?;
    let unit = text[end..].trim();
    let is_unit = unit.chars().all(|c| c.is_alphabetic() || c == '%');
    (value.is_finite() && is_unit).then_some((value, unit))
}

/// A number so that it is read back the same; whole ones as integers, because keys that take an integer are content with nothing else. With a unit never in
/// powers of ten, which quantities are not written in.
pub(super) fn written(value: f64, unit: &str) -> String {
    // Beyond 2^53 no number is written as an integer.
    if !unit.is_empty() || (libm::trunc(value) - value).abs() == 0.0 && value.abs() < 9_007_199_254_740_992.0 {
        format!("{}{unit}", value + 0.0)
    } else {
        format!("{value:?}")
    }
}
