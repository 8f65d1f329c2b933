//! The files of a map: a table for each variant, and one picture: the outline of the region of each variant, and the region of the first one shaded.

use std::path::Path;

use cohaptic_answers::{NamedMap, map_picture};
use cohaptic_picture::Size;
use cohaptic_stability::Criterion;
use cohaptic_units::print::csv_field;

use super::{Order, VariantMap};
use crate::failure::Failure;
use crate::file::write_into;

/// Writes `map.csv`, `map-2.csv` ... and `map.svg`, and gives their paths.
pub(super) fn write(folder: &Path, order: &Order, maps: &mut [VariantMap], size: Size) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    for (number, map) in maps.iter_mut().enumerate() {
        let name = if number == 0 { "map.csv".to_owned() } else { format!("map-{}.csv", number + 1) };
        let path = write_into(folder, &name, table(order, map))?;
        map.file = Some(path.clone());
        files.push(path);
    }
    let named: Vec<NamedMap<'_>> =
        maps.iter().map(|map| NamedMap { name: &map.name, map: &map.map, criterion: map.criterion, left_out: &map.left_out }).collect();
    let picture = map_picture(&order.title, [order.x(), order.y()], &named);
    files.push(write_into(folder, "map.svg", picture.map(|picture| picture.size(size).svg()).unwrap_or_default())?);
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
                text.push_str(&format!(",{}", criterion.kind(*nominal).word()));
            }
            text.push('\n');
        }
    }
    text
}
