//! The files of `cohaptic stability map --out`: one table per variant, and one picture with the outline of each variant's region. The region of the first
//! variant is shaded.

use std::path::Path;

use cohaptic_answers::map::{VariantMap, csv};
use cohaptic_answers::{NamedMap, map_picture};
use cohaptic_picture::Size;

use super::Order;
use crate::failure::Failure;
use crate::file::write_into;

/// Writes `map.csv`, `map-2.csv` and so on, and `map.svg` into `folder`, and returns the paths of all files. Each map gets the path of its table.
pub(super) fn write(folder: &Path, order: &Order, maps: &mut [VariantMap], size: Size) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    for (number, map) in maps.iter_mut().enumerate() {
        let name = if number == 0 { "map.csv".to_owned() } else { format!("map-{}.csv", number + 1) };
        let path = write_into(folder, &name, csv(order.axes(), map))?;
        map.file = Some(path.clone());
        files.push(path);
    }
    let named: Vec<NamedMap<'_>> =
        maps.iter().map(|map| NamedMap { name: &map.name, map: &map.map, criterion: map.criterion, left_out: &map.left_out }).collect();
    let picture = map_picture(&order.title, order.axes(), &named);
    files.push(write_into(folder, "map.svg", picture.map(|picture| picture.size(size).svg()).unwrap_or_default())?);
    Ok(files)
}
