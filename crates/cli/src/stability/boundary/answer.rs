//! A boundary as a JSON document and in words.

use cohaptic_answers::crossing_in_words;
use cohaptic_stability::{Boundary, Cell, Kinds, Verdict, VerdictKind, nominal_head};
use cohaptic_units::print::Counted;
use serde::Serialize;

use super::Order;
use crate::document_schema::document;
use crate::interrupt;
use crate::stability::source;

/// The answer of `cohaptic stability boundary --json`.
pub(super) fn of(order: &Order, found: &Boundary, files: &[String]) -> impl Serialize {
    let crossings = found.crossings.iter();
    document! {
        title: order.title.as_str(),
        key: order.range.key.as_str(),
        unit: order.range.unit.as_str(),
        low: order.range.low,
        high: order.range.high,
        // By which radius the scene is judged.
        criterion: order.family.criterion().word(),
        // The verdict at the lower end.
        first: found.first.word(),
        crossings: crossings.map(|crossing| document! { value: crossing.value, from: crossing.from.word(), to: crossing.to.word() }).collect::<Vec<_>>(),
        marginal: found.marginal.iter().map(|stretch| document! { low: stretch.low, high: stretch.high }).collect::<Vec<_>>(),
        tolerance: order.options.tolerance,
        samples: found.samples,
        finest: found.finest,
        coarsest: found.coarsest,
        settled: found.is_settled(),
        // How many of the values looked at are nominal.
        nominal: found.nominal(),
        // The values looked at by the question that their verdicts answer.
        verdicts: kinds(order, found).present().map(|(kind, count)| source::judged(kind, count, stable_fraction(order, found, kind))).collect::<Vec<_>>(),
        // Random parts of the links that nominal values leave out; empty where there are none.
        left_out: if found.nominal() > 0 { order.family.left_out() } else { &[] },
        notes: super::notes(found),
        files: files,
    }
}

/// The numbers of values looked at, by the question that their verdicts answer.
fn kinds(order: &Order, found: &Boundary) -> Kinds {
    Kinds::of(order.family.criterion(), found.known.iter().map(|(_, cell)| cell.is_nominal))
}

/// The share of stable values among those of a kind.
#[expect(clippy::cast_precision_loss, reason = "far fewer values than 2^52")]
fn stable_fraction(order: &Order, found: &Boundary, kind: VerdictKind) -> f64 {
    let of_kind: Vec<&Cell> =
        found.known.iter().map(|(_, cell)| cell).filter(|cell| order.family.criterion().kind(cell.is_nominal) == kind).collect();
    of_kind.iter().filter(|cell| cell.radius.verdict() == Verdict::Stable).count() as f64 / of_kind.len().max(1) as f64
}

pub(super) fn describe(order: &Order, found: &Boundary) -> String {
    let range = &order.range;
    let mut text = format!("{}\n\n", order.title);
    let mut line = |line: String| text.push_str(&format!("  {line}\n"));
    let kinds = kinds(order, found);
    // Of several kinds, the verdict at the lower end has that of its own value.
    let lowest = found.known.iter().min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, cell)| order.family.criterion().kind(cell.is_nominal));
    let kind = kinds.only().or(lowest).unwrap_or(VerdictKind::Certain);
    if kinds.present().any(|(kind, _)| kind == VerdictKind::Nominal) {
        let head = nominal_head(order.family.left_out());
        line(if kinds.only().is_some() { head } else { format!("{head}: {} of {}", found.nominal(), Counted(found.known.len(), "value")) });
    }
    line(format!("{} from {}", kind.says(found.first.word()), range.text(range.low)));
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
        line(if found.samples < order.options.most && interrupt::requested() {
            "NOT SETTLED: it was ended before it had looked as closely as it should; what lies between two values is open".to_owned()
        } else {
            "NOT SETTLED: it ended after the most values that it may look at; --values allows more, and a larger tolerance or a shorter range decides"
                .to_owned()
        });
    }
    super::notes(found).iter().for_each(|note| line(format!("note: {note}")));
    text
}
