//! Measures in words.

use cohaptic_harness::measures::MeasuredValue;
use cohaptic_scene::Scene;
use cohaptic_units::print::SixDigits;

/// The text for people has this many measures at most; the document has all.
const MOST_MEASURES: usize = 40;

/// A line for each measure: its name and its value, aligned.
pub(crate) fn measured_lines(scene: &Scene, measured: &[MeasuredValue]) -> Vec<String> {
    let named: Vec<(String, &MeasuredValue)> = measured.iter().take(MOST_MEASURES).map(|measured| (measured.name.text(scene), measured)).collect();
    let width = named.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let line = |(name, measured): &(String, &MeasuredValue)| {
        let value = measured.value.map_or_else(|| "no value".to_owned(), |value| SixDigits(value).to_string());
        format!("{name:<width$}  {value}")
    };
    let mut lines: Vec<String> = named.iter().map(line).collect();
    if measured.len() > MOST_MEASURES {
        lines.push(format!("... and {} more", measured.len() - MOST_MEASURES));
    }
    lines
}
