//! The files of `cohaptic stability map --out`: a table per variant, a picture with the stable region of each variant, and the page. The page of `--prove` is
//! here, too.

use std::path::Path;

use cohaptic_answers::map::{Filled, VariantMap, csv, html};
use cohaptic_answers::page::{AnswerPage, Origin, range};
use cohaptic_answers::{NamedMap, map_picture};
use cohaptic_picture::page::{Html, Table};

use super::Order;
use super::prove::{GUARANTEES, Proof, lines};
use crate::arguments::MapArguments;
use crate::failure::Failure;
use crate::file::write_into;
use crate::output::figure;
use crate::shard::Piece;
use crate::shell::CommandLine;
use crate::stability::guarantee::UNFINISHED;

/// Writes `map.csv`, `map-2.csv` and so on, `map.svg` and `map.html` into `folder`, and returns the paths of all files. Each map gets the path of its table.
pub(super) fn write(folder: &Path, order: &Order, arguments: &MapArguments, maps: &mut [VariantMap]) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    for (number, map) in maps.iter_mut().enumerate() {
        // The scene as it stands has the plain name, and variants have numbers from 2 on.
        let name = if number == 0 { "map.csv".to_owned() } else { format!("map-{}.csv", number + 1) };
        let path = write_into(folder, &name, csv(order.axes(), map))?;
        map.file = Some(path.clone());
        files.push(path);
    }
    let names: Vec<String> = maps.iter().map(VariantMap::legend).collect();
    let named = maps.iter().zip(&names).map(|(map, name)| NamedMap { name, map: &map.map, criterion: map.criterion, left_out: &map.left_out });
    let named: Vec<NamedMap<'_>> = named.collect();
    // There is a picture, because the list of maps is never empty.
    let picture = map_picture(&order.title, order.axes(), &named);
    let svg = picture.map(|picture| picture.size(arguments.pictures.size()).svg()).unwrap_or_default();
    files.push(write_into(folder, "map.svg", &svg)?);
    let page =
        html(&Filled { title: &order.title, axes: order.axes(), maps }, &origin(order, arguments, &command_line(arguments), &[("map.svg", &svg)]));
    files.push(write_into(folder, "map.html", page)?);
    Ok(files)
}

/// Returns whether a folder has the merged result of these maps, of which `page` is the page.
pub(super) fn has_result(folder: &Path, pieces: &[Piece], page: &str, order: &Order, arguments: &MapArguments) -> bool {
    crate::shard::has_result(folder, pieces, page, &origin(order, arguments, &command_line(arguments), &[]))
}

/// Returns the command that makes the files, as a line for a shell.
pub(super) fn command_line(arguments: &MapArguments) -> String {
    let line = CommandLine::new("stability map", &arguments.scene.scene, &arguments.scene.overrides.set).option("--x", [&arguments.x]);
    // An open upper end has no number.
    let every = arguments.every_number.map(|(from, to)| format!("{from}..{}", to.map_or_else(String::new, |to| to.to_string())));
    line.option("--y", [&arguments.y])
        .option("--grid", arguments.grid)
        .option("--prove", arguments.prove)
        .option("--every-number", every)
        .flag("--certificate", arguments.certificate)
        .option("--curve", &arguments.curve)
        .option("--against", &arguments.against)
        .out()
        .option("--size", arguments.pictures.word())
        .text()
}

/// Returns the origin of the answer, for the page.
pub(super) fn origin<'a>(order: &'a Order, arguments: &'a MapArguments, command: &'a str, pictures: &'a [(&'a str, &'a str)]) -> Origin<'a> {
    Origin { command, file: &order.file, overrides: &arguments.scene.overrides.set, scene: &order.text, pictures }
}

/// Returns the page of the proofs with their pictures.
pub(super) fn proof_page(order: &Order, arguments: &MapArguments, proofs: &[Proof], pictures: &[(String, String)]) -> String {
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
    page.html(&origin(order, arguments, &command_line(arguments), &pictures))
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
