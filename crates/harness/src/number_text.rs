//! Numbers as text in records.

/// Returns a number with the fewest digits from which the same `f64` is read back, in two parts: the sign of a positive exponent is left out between both.
/// Values that are not finite are `inf`, `-inf` and `NaN`.
pub(crate) fn parts(buffer: &mut zmij::Buffer, value: f64) -> (&str, &str) {
    let text = buffer.format(value);
    // Searched only in large numbers, because the search takes as long as formatting.
    match if value.abs() >= 1e16 { text.find("e+") } else { None } {
        Some(at) => (&text[..=at], &text[at + 2..]),
        None => (text, ""),
    }
}
