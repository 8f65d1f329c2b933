//! The page `map.html`.

use cohaptic_picture::page::{Html, Table};
use cohaptic_stability::Verdict;
use cohaptic_units::print::six_digits;

use super::{Filled, VariantMap, words};
use crate::figure;
use crate::page::{AnswerPage, Origin, clauses, headed, range};

/// Returns the page. The bytes of the page depend on the maps and on the picture alone, not on how many of the cells this call has computed.
#[must_use]
pub fn html(filled: &Filled<'_>, origin: &Origin<'_>) -> String {
    let Filled { title, axes, maps } = *filled;
    let mut asked: Vec<(&str, Html)> = ["Along x", "Along y"].into_iter().zip(axes.map(range)).collect();
    if let Some(VariantMap { map, .. }) = maps.first() {
        asked.push(("Grid", format!("{} × {} cells", map.x.len(), map.y.len()).into()));
    }
    if maps.len() > 1 {
        asked.push(("Other maps in the picture", Html::lines(maps.iter().skip(1).map(|map| Html::code(&map.name)))));
    }
    let sentences = maps.iter().map(|map| {
        let said = clauses(&words::headlines(axes, map, six_digits));
        if maps.len() > 1 { format!("{}: {said}", map.name) } else { said }
    });
    AnswerPage {
        title: format!("{title}: stability over {} and {}", axes[0].key, axes[1].key),
        sentences: sentences.collect(),
        asked,
        tables: headed("Cells", &cells(filled)),
        notes: filled.notes(),
        ..AnswerPage::default()
    }
    .html(origin)
}

/// Returns the table of verdicts: a row for each map and each kind of verdict in the map.
fn cells(filled: &Filled<'_>) -> Table {
    let [x, y] = filled.axes;
    let head = Table::new().column("map").column("judged by").number("cells");
    let verdicts = [Verdict::Stable, Verdict::Unstable, Verdict::Marginal, Verdict::Overflow];
    // Marginal and overflowing cells are rare, and empty columns would make the table wide.
    let is_there = |verdict: Verdict| filled.maps.iter().flat_map(|map| map.verdicts.iter().flatten()).any(|other| *other == verdict);
    let verdicts: Vec<Verdict> = verdicts.into_iter().filter(|verdict| *verdict == Verdict::Stable || is_there(*verdict)).collect();
    let head = verdicts.iter().fold(head, |table, verdict| table.number(verdict.word()));
    let head = head.number("least radius").column("where");
    let rows = filled.maps.iter().flat_map(|map| map.kinds().present().map(move |(kind, count)| (map, kind, count)));
    rows.fold(head, |table, (map, kind, count)| {
        let counts = verdicts.iter().map(|verdict| map.verdicts_of(kind).filter(|other| other == verdict).count());
        let counts = std::iter::once(count).chain(counts).map(|count| Html::text(&count.to_string()));
        let (radius, place) = map.least(kind).map_or_else(
            || ("–".to_owned(), Html::default()),
            |[radius, at_x, at_y]| (figure(radius, 6), Html::lines([x.text(six_digits(at_x)), y.text(six_digits(at_y))].map(Html::from))),
        );
        let names = [Html::text(&map.name), kind.radius_name().into()];
        table.row(names.into_iter().chain(counts).chain([radius.into(), place]))
    })
}
