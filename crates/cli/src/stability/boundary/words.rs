//! A boundary in words.

use cohaptic_stability::{Boundary, Criterion, Crossing, KeyRange};

use cohaptic_units::print::Counted;

use super::Order;

pub(super) fn describe(order: &Order, found: &Boundary) -> String {
    let range = &order.range;
    let mut text = format!("{}\n\n", order.title);
    let mut line = |line: String| text.push_str(&format!("  {line}\n"));
    let judged = if order.family.criterion() == Criterion::MeanSquare { " in the mean square" } else { "" };
    line(format!("{}{judged} from {}", found.first.word(), range.text(range.low)));
    for crossing in &found.crossings {
        line(crossing_in_words(range, crossing));
    }
    if found.crossings.is_empty() {
        line(format!("no crossing up to {}", range.text(range.high)));
    }
    for stretch in &found.marginal {
        if stretch.low < stretch.high {
            line(format!("cannot be told from 1 from {} to {}", range.text(stretch.low), range.text(stretch.high)));
        } else {
            line(format!("touches 1, or comes closer than can be told, at {}", range.text(stretch.low)));
        }
    }
    let unit = &range.unit;
    line(format!(
        "{} looked at, {:.3e}{unit} to {:.3e}{unit} apart; crossings to {:.1e}{unit}. What comes and goes between two of them without a trace is not seen",
        Counted(found.samples, "value"),
        found.finest,
        found.coarsest,
        order.options.tolerance
    ));
    if !found.is_settled() {
        line("NOT SETTLED: it ended after the most values that it may look at; a larger tolerance or a shorter range decides".to_owned());
    }
    super::notes(found).iter().for_each(|note| line(format!("note: {note}")));
    text
}

/// One crossing.
pub(super) fn crossing_in_words(range: &KeyRange, crossing: &Crossing) -> String {
    format!("{} from {} (before: {})", crossing.to.word(), range.text(crossing.value), crossing.from.word())
}
