//! The page `proof.html` of `cohaptic stability map --prove`.

use cohaptic_answers::page::{AnswerPage, range};
use cohaptic_picture::page::{Html, Table};

use super::prove::{GUARANTEES, Proof, lines};
use super::{Order, files};
use crate::arguments::MapArguments;
use crate::output::figure;
use crate::stability::guarantee::UNFINISHED;

/// Returns the page of the proofs with their pictures.
pub(super) fn html(order: &Order, arguments: &MapArguments, proofs: &[Proof], pictures: &[(String, String)]) -> String {
    let is_whole = proofs.iter().all(|proof| proof.region.is_whole);
    let asked = ["Along x", "Along y"].into_iter().zip(order.axes().map(range));
    let halvings = arguments.prove.map(|halvings| ("Halvings of each side at most", Html::text(&halvings.to_string())));
    let page = AnswerPage {
        title: format!("{}: proven stability over {} and {}", order.title, order.x().key, order.y().key),
        warnings: if is_whole { Vec::new() } else { vec![UNFINISHED.to_owned()] },
        sentences: lines(arguments, proofs).iter().map(|line| line.trim_start().to_owned()).collect(),
        asked: asked.chain(halvings).collect(),
        tables: Html::heading(2, "Areas").and(Html::table(&areas(proofs))),
        notes: Vec::new(),
    };
    let pictures: Vec<(&str, &str)> = pictures.iter().map(|(name, svg)| (name.as_str(), svg.as_str())).collect();
    page.html(&files::origin(order, arguments, &files::command_line(arguments), &pictures))
}

/// Returns the table of shares of the area, one row per proof.
fn areas(proofs: &[Proof]) -> Table {
    let head = Table::new().column("map").number("proven stable [%]").number("proven unstable [%]").number("undecided [%]");
    proofs.iter().fold(head.number("pieces").number("pieces looked at"), |table, Proof { name, region, .. }| {
        let shares = GUARANTEES.map(|guarantee| figure(100.0 * region.share(guarantee), 4));
        let counts = [region.boxes.len(), region.attempts].map(|count| count.to_string());
        table.row(std::iter::once(name.clone()).chain(shares).chain(counts).map(Html::from))
    })
}
