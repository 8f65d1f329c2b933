//! Numbers followed by a unit, as overrides write the values of keys.

/// Splits a text such as `24ms`, `5 %` or `1000` into a finite number and a unit, possibly empty. Returns `None` for any other text. The unit is not checked
/// against the units of a key.
#[must_use]
pub fn number_and_unit(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    // The longest beginning that is a number counts, so that "1e-3ms" is 0.001 ms and not 1 with the unit "e-3ms".
    let ends = (1..=text.len()).rev().filter(|end| text.is_char_boundary(*end));
    let (end, value) = ends.filter_map(|end| text[..end].parse::<f64>().ok().map(|value| (end, value))).next()?;
    let unit = text[end..].trim();
    let is_unit = unit.chars().all(|c| c.is_alphabetic() || c == '%');
    (value.is_finite() && is_unit).then_some((value, unit))
}

/// Writes a number with a unit such that a key reads back the same number. A whole number is written as an integer, because keys of integers take only
/// integers. A number with a unit is never written with a power of ten, because the readers of quantities refuse powers of ten.
#[must_use]
pub fn text_of_quantity(value: f64, unit: &str) -> String {
    // From 2^53 on a double stands for several integers, so the number is not written as an integer. Adding zero below makes -0 an ordinary 0.
    if !unit.is_empty() || (value % 1.0).abs() == 0.0 && value.abs() < 9_007_199_254_740_992.0 {
        format!("{}{unit}", value + 0.0)
    } else {
        format!("{value:?}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_as_long_as_it_can_be() {
        assert_eq!(number_and_unit(" 24ms "), Some((24.0, "ms")));
        assert_eq!(number_and_unit("5 %"), Some((5.0, "%")));
        assert_eq!(number_and_unit("-1e-3s"), Some((-1e-3, "s")));
        assert_eq!(number_and_unit(".5µs"), Some((0.5, "µs")));
        for text in ["", "ms", "inf", "nan", "1e999", "1_000", "1 2", "5m/s", "5ms;"] {
            assert_eq!(number_and_unit(text), None, "{text}");
        }
    }

    #[test]
    fn a_quantity_is_read_back_the_same() {
        for value in [0.1 + 0.2, 1e-300, 1.0 / 3.0, 1e300, 5e-324, 123_456.789, -7.0, 9_007_199_254_740_992.0] {
            for unit in ["", "ms"] {
                let (read, read_unit) = number_and_unit(&text_of_quantity(value, unit)).map(|(value, unit)| (value, unit.to_owned())).unwrap();
                assert_eq!((read.to_bits(), read_unit.as_str()), (value.to_bits(), unit));
            }
        }
        assert_eq!(
            [(6000.0, ""), (-0.0, ""), (1e-7, "ms"), (1e16, "")].map(|(value, unit)| text_of_quantity(value, unit)),
            ["6000", "0", "0.0000001ms", "1e16"]
        );
    }
}
