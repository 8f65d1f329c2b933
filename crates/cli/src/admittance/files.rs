//! Files of `cohaptic admittance --out`: a table and a Bode plot of all curves, and the page.

use std::path::Path;

use cohaptic_answers::admittance::{Curve, csv, html};
use cohaptic_answers::page::Origin;
use cohaptic_answers::{AdmittanceCurve, admittance_picture};
use cohaptic_stability::PushedAxis;

use crate::arguments::AdmittanceArguments;
use crate::failure::Failure;
use crate::file::write_into;
use crate::shell::CommandLine;
use crate::{input, output};

/// Writes `admittance.csv` and, if `is_whole`, `admittance.svg` and `admittance.html` into `folder`, and returns the paths of the written files.
///
/// An interrupted analysis gets only the table: drawing the picture takes longer than users wait after Ctrl-C. `text`: text of the scene.
pub(super) fn write(folder: &Path, arguments: &AdmittanceArguments, text: &str, curves: &[Curve], is_whole: bool) -> Result<Vec<String>, Failure> {
    let mut written = vec![write_into(folder, "admittance.csv", csv(curves))?];
    if is_whole {
        let title = curves.first().map_or("", |curve| curve.title.as_str());
        let names: Vec<String> = curves.iter().map(Curve::legend).collect();
        let named = curves.iter().zip(&names).map(|(Curve { admittance, response, .. }, name)| AdmittanceCurve { name, admittance, response });
        let named: Vec<AdmittanceCurve<'_>> = named.collect();
        let picture = admittance_picture(title, &arguments.peer, &named);
        let picture = picture.map_err(|error| Failure::Input(error.to_string()))?;
        let svg = picture.size(arguments.pictures.size()).svg();
        written.push(write_into(folder, "admittance.svg", &svg)?);
        written.push(write_into(folder, "admittance.html", page(arguments, text, curves, &svg))?);
    }
    Ok(written)
}

/// Returns the page of the curves with their picture.
fn page(arguments: &AdmittanceArguments, scene: &str, curves: &[Curve], svg: &str) -> String {
    let (file, overrides) = (&arguments.scene.scene, &arguments.scene.overrides.set);
    // `--at` takes all frequencies as a single value, separated by commas.
    let frequencies: Vec<String> = arguments.at.iter().map(f64::to_string).collect();
    let command = CommandLine::new("admittance", file, overrides)
        .option("--peer", [&arguments.peer])
        .option("--axis", arguments.axis.map(|axis| PushedAxis::from(axis).word()))
        .option("--seen", arguments.seen.map(|axis| PushedAxis::from(axis).word()))
        .option("--from", arguments.from)
        .option("--to", arguments.to)
        .option("--points", arguments.points)
        .option("--at", (!frequencies.is_empty()).then(|| frequencies.join(",")))
        .option("--curve", &arguments.curve)
        .out()
        .option("--size", arguments.pictures.word())
        .text();
    let file = output::path(input::named(file));
    html(&arguments.peer, curves, &Origin { command: &command, file: &file, overrides, scene, pictures: &[("admittance.svg", svg)] })
}
