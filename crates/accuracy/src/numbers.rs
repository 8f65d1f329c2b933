//! Numbers with three digits, for readers.

/// Returns a number with three digits; a dash for `None`.
#[must_use]
pub fn short(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(0.0) => "0".to_owned(),
        // Below 0.01 fixed notation would have fewer than three digits; above 10⁵ it would be hard to read.
        Some(value) if !(0.01..1e5).contains(&value.abs()) => format!("{value:.2e}"),
        Some(value) => {
            let magnitude = value.abs();
            let decimals = if magnitude >= 100.0 {
                0
            } else if magnitude >= 10.0 {
                1
            } else if magnitude >= 1.0 {
                2
            } else {
                3
            };
            format!("{value:.decimals$}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn three_digits_are_enough() {
        for (value, text) in [
            (None, "–"),
            (Some(0.0), "0"),
            // Numbers outside of 0.01 to 10⁵ have an exponent.
            (Some(1.234e-17), "1.23e-17"),
            (Some(0.012_34), "0.012"),
            (Some(1.234), "1.23"),
            (Some(12.34), "12.3"),
            (Some(12345.6), "12346"),
            (Some(123_456.0), "1.23e5"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
