//! The files of `cohaptic stability boundary --out`: a table of the crossings, a table of all checked values, a picture of the radius along the key with the
//! crossings marked, and the page.

use std::path::Path;

use cohaptic_answers::boundary::{Searched, crossings_csv, html, samples_csv};
use cohaptic_answers::boundary_picture;
use cohaptic_answers::page::Origin;

use super::Order;
use crate::arguments::BoundaryArguments;
use crate::failure::Failure;
use crate::file::write_into;
use crate::shell::CommandLine;
use crate::{input, output};

/// Writes `boundary.csv`, `samples.csv`, `boundary.svg` and `boundary.html` into `folder`, and returns their paths.
pub(super) fn write(folder: &Path, order: &Order, arguments: &BoundaryArguments, searched: &Searched<'_>) -> Result<Vec<String>, Failure> {
    let Searched { title, range, family, found, .. } = searched;
    let picture = boundary_picture(title, range, family.criterion(), family.left_out(), found);
    let svg = picture.size(arguments.pictures.size()).svg();
    let page = with_origin(order, arguments, &[("boundary.svg", &svg)], |origin| html(searched, origin));
    let tables = [("boundary.csv", crossings_csv(searched)), ("samples.csv", samples_csv(searched))];
    let files = tables.into_iter().chain([("boundary.svg", svg), ("boundary.html", page)]);
    files.map(|(name, content)| write_into(folder, name, content)).collect()
}

/// Calls `page` with the origin of the answer.
pub(super) fn with_origin<T>(order: &Order, arguments: &BoundaryArguments, pictures: &[(&str, &str)], page: impl FnOnce(&Origin<'_>) -> T) -> T {
    let (scene, overrides) = (&arguments.scene.scene, &arguments.scene.overrides.set);
    let command = CommandLine::new("stability boundary", scene, overrides)
        .option("--along", [&arguments.along])
        .option("--tolerance", arguments.tolerance)
        .flag("--prove", arguments.prove)
        .flag("--certificate", arguments.certificate)
        .option("--samples", arguments.samples)
        // A value at its default is left out of the command.
        .option("--values", (arguments.values != BoundaryArguments::VALUES).then_some(arguments.values))
        .out()
        .option("--size", arguments.pictures.word())
        .text();
    page(&Origin { command: &command, file: &output::path(input::named(scene)), overrides, scene: &order.text, pictures })
}
