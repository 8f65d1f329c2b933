//! Formats measures: title, unit of a convenient size, and numbers with as many digits as their intervals allow.

use cohaptic_campaign::{Comparison, Estimate, MeasuredColumn, Share};

/// Form of a measure in texts and pictures.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Shown {
    /// Name of the measure without its unit: `discrepancy p95`.
    pub(super) title: String,
    /// Displayed unit; empty without a unit.
    pub(super) unit: String,
    /// Factor from the unit of the table to the displayed unit.
    pub(super) factor: f64,
}

impl Shown {
    /// Chooses the form of a measure. `place`: index of the measure in the comparison.
    pub(super) fn of(comparison: &Comparison, place: usize) -> Self {
        let measure = &comparison.measures[place];
        let means = comparison.cells.iter().filter_map(|cell| cell.figures.get(place)?.mean);
        // The median decides, so that a few large means do not choose the unit of all others.
        let mut sizes: Vec<f64> = means.map(|estimate| estimate.mean.abs()).filter(|size| *size > 0.0).collect();
        sizes.sort_by(f64::total_cmp);
        let size = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
        let (unit, factor) = scaled(&measure.unit, size);
        Self { title: title(measure), unit, factor }
    }

    /// Returns title and unit: `discrepancy p95 [mm]`.
    pub(super) fn head(&self) -> String {
        if self.unit.is_empty() { self.title.clone() } else { format!("{} [{}]", self.title, self.unit) }
    }

    /// Returns a mean with its interval in the displayed unit.
    pub(super) fn estimate(&self, estimate: &Estimate) -> String {
        interval(estimate.mean * self.factor, estimate.half_width.map(|half| half * self.factor))
    }
}

/// Returns the name of a measure in words: without its unit, and followed by the peer for a measure of a peer.
fn title(measure: &MeasuredColumn) -> String {
    let (name, peer) = match measure.name.strip_prefix("peers.").and_then(|rest| rest.rsplit_once('.')) {
        Some((peer, name)) => (name, Some(peer)),
        None => (measure.name.as_str(), None),
    };
    // Names of measures end in the unit, in lower case and with underscores.
    let suffix = match measure.unit.as_str() {
        "1/s" => "_per_s".to_owned(),
        "bit/s" if name.ends_with("_bits_per_s") => "_bits_per_s".to_owned(),
        unit => format!("_{}", unit.replace(['·', '/'], "_").replace('²', "2").to_lowercase()),
    };
    let words = name.strip_suffix(&suffix).unwrap_or(name).replace('_', " ");
    peer.map_or_else(|| words.clone(), |peer| format!("{words} of {peer}"))
}

/// Returns the displayed unit and its factor for values of this size.
fn scaled(unit: &str, size: f64) -> (String, f64) {
    match unit {
        "m" if size < 1.0 => ("mm".to_owned(), 1e3),
        "s" if size < 1.0 => ("ms".to_owned(), 1e3),
        "J" if size < 0.1 => ("mJ".to_owned(), 1e3),
        "bit/s" if size >= 1e4 => ("kbit/s".to_owned(), 1e-3),
        _ => (unit.to_owned(), 1.0),
    }
}

/// Returns a mean and the half width of its interval. The half width has two digits, and both numbers have the same number of decimals. Without a half width
/// above 0 the mean has four digits.
pub(super) fn interval(mean: f64, half: Option<f64>) -> String {
    // An interval of no width has no digits to round to.
    let certain = half.filter(|half| *half > 0.0);
    let size = mean.abs().max(half.unwrap_or(0.0));
    // Numbers of ordinary size have no exponent.
    let exponent = if (1e-3..1e6).contains(&size) || size == 0.0 || !size.is_finite() { 0 } else { power(size) };
    let unit = libm::exp10(f64::from(exponent));
    let (mean, certain) = (mean / unit, certain.map(|half| half / unit));
    // Decimals for four digits of the mean, or for two digits of the half width.
    let digits = certain.map_or_else(|| 3 - power(mean.abs()), |half| 1 - power(half)).clamp(0, 9);
    let digits = usize::try_from(digits).unwrap_or_default();
    let number = |value: f64| signed(format!("{value:.digits$}"));
    let both = match (half, certain) {
        (None, _) => number(mean),
        (Some(_), None) => format!("{} ± 0", number(mean)),
        (Some(_), Some(half)) => format!("{} ± {half:.digits$}", number(mean)),
    };
    match (exponent, half) {
        (0, _) => both,
        (exponent, None) => format!("{both}e{exponent}"),
        (exponent, Some(_)) => format!("({both})e{exponent}"),
    }
}

/// Removes the sign of a zero, and writes a minus as wide as a plus.
fn signed(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|letter| matches!(letter, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

/// Returns the power of ten of the first digit; 0 for zero and for numbers that are not finite.
#[expect(clippy::cast_possible_truncation, reason = "between -324 and 308")]
fn power(size: f64) -> i32 {
    if size > 0.0 && size.is_finite() { libm::floor(libm::log10(size)) as i32 } else { 0 }
}

/// Returns a share with its interval in percent: `3 of 20 (5.2 to 36 %)`.
pub(super) fn share(share: &Share) -> String {
    let percent = |value: f64| {
        let percent = 100.0 * value;
        if percent == 0.0 || percent >= 10.0 { format!("{percent:.0}") } else { format!("{percent:.1}") }
    };
    format!("{} of {} ({} to {} %)", share.count, share.of, percent(share.low), percent(share.high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_as_many_digits_as_its_interval_allows() {
        for (mean, half, shown) in [
            (1.23456, Some(0.0234), "1.235 ± 0.023"),
            (1.23456, Some(2.34), "1.2 ± 2.3"),
            (-123.456, Some(45.6), "−123 ± 46"),
            (-0.0001, Some(0.02), "0.000 ± 0.020"),
            (12.0, Some(0.0), "12.00 ± 0"),
            (12.0, None, "12.00"),
            (0.0, Some(0.0), "0.000 ± 0"),
            (2.5e8, Some(1.2e7), "(2.50 ± 0.12)e8"),
            (2.5e-7, None, "2.500e-7"),
            (1e6, Some(0.5), "(1.00000000 ± 0.00000050)e6"),
        ] {
            assert_eq!(interval(mean, half), shown);
        }
    }

    #[test]
    fn measures_have_titles_without_units() {
        for (name, unit, expected) in [
            ("discrepancy_p95_m", "m", "discrepancy p95"),
            ("peers.left.energy_j", "J", "energy of left"),
            ("viscosity_n_s_m", "N·s/m", "viscosity"),
            ("packets_per_s", "1/s", "packets"),
            ("sent_bits_per_s", "bit/s", "sent"),
            ("throughput_bit_s", "bit/s", "throughput"),
            ("peers.left.effort_n2_s", "N²·s", "effort of left"),
            ("max_discrepancy_m", "m", "max discrepancy"),
        ] {
            assert_eq!(title(&MeasuredColumn { name: name.to_owned(), unit: unit.to_owned(), about: String::new() }), expected);
        }
    }

    #[test]
    fn shares_are_in_percent() {
        assert_eq!(share(&Share::of(0, 10).unwrap()), "0 of 10 (0 to 28 %)");
        assert_eq!(share(&Share::of(1, 29).unwrap()), "1 of 29 (0.6 to 17 %)");
    }
}
