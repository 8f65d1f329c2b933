//! The files of a map: a table for each variant, and one picture.

use std::path::Path;

use cohaptic_picture::Size;
use cohaptic_stability::Criterion;
use cohaptic_units::print::csv_field;

use super::picture::{Axis, Outline, Picture};
use super::{Order, VariantMap};
use crate::failure::Failure;
use crate::file::write_file;
use crate::output;
use crate::stability::quantity::axis_of;
use crate::stability::source;

/// Writes `map.csv`, `map-2.csv` ... and `map.svg`, and gives their paths.
pub(super) fn write(folder: &Path, order: &Order, maps: &mut [VariantMap], size: Size) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    for (number, map) in maps.iter_mut().enumerate() {
        let path = folder.join(if number == 0 { "map.csv".to_owned() } else { format!("map-{}.csv", number + 1) });
        write_file(&path, table(order, map))?;
        map.file = Some(output::path(&path));
        files.push(output::path(&path));
    }
    let path = folder.join("map.svg");
    write_file(&path, picture(order, maps).map(|picture| picture.size(size).svg()).unwrap_or_default())?;
    files.push(output::path(&path));
    Ok(files)
}

/// One row a cell, x running fastest.
fn table(order: &Order, VariantMap { map, criterion, verdicts, .. }: &VariantMap) -> String {
    let keys = format!("{},{}", csv_field(&order.x().key), csv_field(&order.y().key));
    let mut text = match criterion {
        Criterion::SpectralRadius => format!("{keys},spectral_radius,verdict\n"),
        Criterion::MeanSquare => format!("{keys},mean_square_radius,verdict,judged\n"),
    };
    for (((y, row), verdicts), nominal) in map.y.iter().zip(&map.radius).zip(verdicts).zip(&map.nominal) {
        for (((x, radius), verdict), nominal) in map.x.iter().zip(row).zip(verdicts).zip(nominal) {
            text.push_str(&format!("{x:?},{y:?},{radius:?},{}", verdict.word()));
            if *criterion == Criterion::MeanSquare {
                text.push_str(&format!(",{}", source::judged(*criterion, *nominal)));
            }
            text.push('\n');
        }
    }
    text
}

fn picture(order: &Order, maps: &[VariantMap]) -> Option<cohaptic_picture::Picture> {
    let first = maps.first()?;
    let outline = |map: &VariantMap| Outline { name: map.name.clone(), lines: map.map.contour() };
    let radius = source::name(first.criterion);
    let title = format!("{}: {radius} 1", order.title);
    let picture = Picture {
        title: &title,
        stable: if first.criterion == Criterion::MeanSquare { "stable in the mean square" } else { "stable" },
        x: Axis { shown: axis_of(order.x()), values: &first.map.x },
        y: Axis { shown: axis_of(order.y()), values: &first.map.y },
        outlines: maps.iter().map(outline).collect(),
        regions: first.map.regions(),
        nominal: &first.map.nominal,
    };
    Some(picture.drawn())
}
