//! The files of `cohaptic stability map --out`: a table per variant, a picture with the stable region of each variant, and the page.

use std::path::Path;

use cohaptic_answers::map::{Filled, VariantMap, csv, html};
use cohaptic_answers::page::Origin;
use cohaptic_answers::{NamedMap, map_picture};

use super::Order;
use crate::arguments::MapArguments;
use crate::failure::Failure;
use crate::file::write_into;
use crate::shell::CommandLine;

/// Writes `map.csv`, `map-2.csv` and so on, `map.svg` and `map.html` into `folder`, and returns the paths of all files. Each map gets the path of its table.
pub(super) fn write(folder: &Path, order: &Order, arguments: &MapArguments, maps: &mut [VariantMap]) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    for (number, map) in maps.iter_mut().enumerate() {
        let name = if number == 0 { "map.csv".to_owned() } else { format!("map-{}.csv", number + 1) };
        let path = write_into(folder, &name, csv(order.axes(), map))?;
        map.file = Some(path.clone());
        files.push(path);
    }
    let names: Vec<String> = maps.iter().map(VariantMap::legend).collect();
    let named = maps.iter().zip(&names).map(|(map, name)| NamedMap { name, map: &map.map, criterion: map.criterion, left_out: &map.left_out });
    let named: Vec<NamedMap<'_>> = named.collect();
    let picture = map_picture(&order.title, order.axes(), &named);
    let svg = picture.map(|picture| picture.size(arguments.pictures.size()).svg()).unwrap_or_default();
    files.push(write_into(folder, "map.svg", &svg)?);
    let page =
        html(&Filled { title: &order.title, axes: order.axes(), maps }, &origin(order, arguments, &command_line(arguments), &[("map.svg", &svg)]));
    files.push(write_into(folder, "map.html", page)?);
    Ok(files)
}

/// Returns the command that makes the files, as a line for a shell.
pub(super) fn command_line(arguments: &MapArguments) -> String {
    let line = CommandLine::new("stability map", &arguments.scene.scene, &arguments.scene.overrides.set).option("--x", [&arguments.x]);
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
