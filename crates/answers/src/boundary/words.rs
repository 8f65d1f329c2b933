//! The text about a boundary.

use cohaptic_stability::{Crossing, VerdictKind, nominal_head};
use cohaptic_units::print::{Counted, SixDigits};

use super::Searched;
use crate::crossing_in_words;

/// Returns the text about a boundary. `is_ended`: whether the user stopped the search.
#[must_use]
pub fn words(searched: &Searched<'_>, is_ended: bool) -> String {
    let notes = searched.notes().into_iter().map(|note| format!("note: {note}"));
    let mut text = format!("{}\n\n", searched.title);
    for line in verdicts(searched, |value| value).into_iter().chain(limits(searched, is_ended)).chain(notes) {
        text.push_str(&format!("  {line}\n"));
    }
    text
}

/// Returns a line for the verdict at the lower end, for each crossing, and for each stretch without a verdict. `rounded` rounds the values of
/// the crossings.
pub(super) fn verdicts(searched: &Searched<'_>, rounded: fn(f64) -> f64) -> Vec<String> {
    let found = searched.found;
    let range = searched.range;
    let mut lines = Vec::new();
    let mut line = |line: String| lines.push(line);
    let kinds = searched.kinds();
    // If the values are of several kinds, the first line has the kind of the value at the lower end.
    let lowest = found.known.iter().min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, cell)| searched.family.criterion().kind(cell.is_nominal));
    let kind = kinds.only().or(lowest).unwrap_or(VerdictKind::Certain);
    if kinds.present().any(|(kind, _)| kind == VerdictKind::Nominal) {
        let head = nominal_head(searched.family.left_out());
        line(if kinds.only().is_some() { head } else { format!("{head}: {} of {}", found.nominal(), Counted(found.known.len(), "value")) });
    }
    line(format!("{} from {}", kind.says(found.first.word()), range.text(range.low)));
    for crossing in &found.crossings {
        line(crossing_in_words(range, &Crossing { value: rounded(crossing.value), ..*crossing }));
    }
    if found.crossings.is_empty() {
        line(format!("no crossing up to {}", range.text(range.high)));
    }
    for stretch in &found.marginal {
        // A stretch of one value is a touch: the radius reaches 1 there and turns back, as far as the analysis can tell.
        if stretch.low < stretch.high {
            line(format!("too close to 1 for a verdict from {} to {}", range.text(stretch.low), range.text(stretch.high)));
        } else {
            line(format!("touches 1, or comes too close to it for a verdict, at {}", range.text(stretch.low)));
        }
    }
    lines
}

/// Returns a line about the resolution of the search, and a second line if the search ended before the resolution was reached.
pub(super) fn limits(searched: &Searched<'_>, is_ended: bool) -> Vec<String> {
    let found = searched.found;
    let mut lines = Vec::new();
    let mut line = |line: String| lines.push(line);
    let unit = &searched.range.unit;
    line(format!(
        "{} checked, with neighbours {}{unit} to {}{unit} apart; each crossing is located to {}{unit}. An island narrower than this spacing can be missed",
        Counted(found.samples, "value"),
        SixDigits(found.finest),
        SixDigits(found.coarsest),
        SixDigits(searched.options.tolerance)
    ));
    if !found.is_settled() {
        // With the limit of samples reached, a request of the user did not shorten the search.
        line(if found.samples < searched.options.most && is_ended {
            "NOT SETTLED: the search was stopped early, and may have missed crossings between two values; repeat the command to go on".to_owned()
        } else {
            "NOT SETTLED: the search reached its limit of values, and may have missed crossings; allow more with --values, or take a larger --tolerance or a shorter range"
                .to_owned()
        });
    }
    lines
}
