//! `cohaptic stability map`: judges the stability of a scene over a plane of two keys, for one or several variants of the scene.
//!
//! `filling` computes the cells of a grid, `files` writes the maps and their page, and `prove` decides whole boxes of the plane without a grid.

mod files;
mod filling;
mod prove;

use std::process::ExitCode;
use std::time::Instant as Clock;

use cohaptic_answers::map::{Speed, VariantMap};
use cohaptic_scene::Scene;
use cohaptic_stability::{Family, Grid, KeyRange, MapError};

use super::source::{self, Said};
use crate::arguments::MapArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::shard::Sharing;
use crate::variants::Variant;
use crate::{input, output, shard};
use filling::Filled;

/// Checked arguments of the command. Nothing is written before the check has passed.
struct Order {
    text: String,
    /// Name of the file of the scene.
    file: String,
    title: String,
    ranges: [(&'static str, KeyRange); 2],
    grid: Grid,
    variants: Vec<Variant>,
    /// Families of scenes, indexed by variant.
    families: Vec<Family>,
    /// Names of the coordination laws, indexed by variant; empty for a variant with a refused scene at the lower ends of the ranges.
    laws: Vec<String>,
}

/// Computes the maps and writes the answer, or does the part of a shard.
pub(crate) fn map(arguments: &MapArguments) -> Result<ExitCode, Failure> {
    let sharing = Sharing::of(&arguments.shards, arguments.out.as_deref())?;
    let order = Order::new(arguments)?;
    if let Some(halvings) = arguments.prove {
        return prove::prove(&order, arguments, halvings, sharing);
    }
    match sharing {
        Sharing::Whole(_) | Sharing::Merge(_) => {}
        Sharing::Shard(shard, folder) => return shard::answer(arguments.scene.json, &filling::shard(&order, arguments, shard, folder)?),
        Sharing::Status(folder) => return filling::status(&order, arguments, folder),
    }
    let start = Clock::now();
    let Filled { maps, cells, rows, own: _own } = filling::fill(&order, arguments, sharing)?;
    let named = maps.into_iter().enumerate().map(|(number, map)| {
        let Variant { name, overrides, .. } = &order.variants[number];
        let verdicts = map.verdicts(&order.families[number]).map_err(|error| order.failure(number, arguments, error.into()))?;
        let (criterion, left_out) = (order.families[number].criterion(), order.families[number].left_out().to_vec());
        let law = order.laws[number].clone();
        Ok(VariantMap { name: name.clone(), law, overrides: overrides.clone(), criterion, left_out, map, verdicts, file: None })
    });
    let mut maps = named.collect::<Result<Vec<VariantMap>, Failure>>()?;
    let speed = Speed { wall_s: start.elapsed().as_secs_f64(), cells };
    let mut files = Vec::new();
    if let Some(folder) = sharing.folder() {
        files = files::write(folder, &order, arguments, &mut maps)?;
        // The rows go only after the files are written: until then the rows are the only result.
        rows.map_or(Ok(()), super::rows_file::RowsFile::remove)?;
    }
    let filled = cohaptic_answers::map::Filled { title: &order.title, axes: order.axes(), maps: &maps };
    output::answer(
        arguments.scene.json,
        DocumentSchema::STABILITY_MAP,
        &cohaptic_answers::map::document(&filled, speed, &files),
        // Small pictures in the text stand in for the picture of a folder.
        || cohaptic_answers::map::words(&filled, speed, sharing.folder().is_none()),
        &files,
    )?;
    Ok(ExitCode::SUCCESS)
}

impl Order {
    fn new(arguments: &MapArguments) -> Result<Self, Failure> {
        let ranges = [("--x", source::range("--x", &arguments.x)?), ("--y", source::range("--y", &arguments.y)?)];
        let variants = Variant::all(&arguments.curve, &arguments.against)?;
        // A proof has no grid; the single cell is never computed.
        let size = arguments.grid.unwrap_or(crate::arguments::GridSize { width: 1, height: 1 });
        // Saturates, because the sides come from the command line.
        if size.width.saturating_mul(size.height).saturating_mul(variants.len()) > crate::arguments::GridSize::MOST_CELLS {
            let most = crate::arguments::GridSize::MOST_CELLS;
            return Err(Failure::Input(format!("{} maps of {size} cells: expected at most {most} cells in all", variants.len())));
        }
        let grid = Grid::new(size.width, size.height).map_err(|error| Failure::Input(format!("--grid {size}: {error}")))?;
        let (file, set) = (&arguments.scene.scene, &arguments.scene.overrides.set);
        let text = input::text(file)?;
        let keys = || ranges.iter().map(|(_, range)| range.clone()).collect::<Vec<_>>();
        let mut families = Vec::new();
        for variant in &variants {
            let said = Said { file, ranges: &ranges, overrides: (variant.option, &variant.overrides) };
            families.push(Family::new(&text, file, &variant.on_top_of(set), keys()).map_err(|error| said.failure(error))?);
        }
        // A scene refused here is refused again, with a message, by the computation of the first cell.
        let scenes: Vec<Option<Scene>> = families.iter().map(|family| source::at_low(family).ok()).collect();
        let title = scenes.first().and_then(Option::as_ref).map_or_else(|| output::path(input::named(file)), |scene| scene.title.clone());
        let laws =
            scenes.iter().map(|scene| scene.as_ref().map_or_else(String::new, |scene| scene.coordination.strategy.name().to_owned())).collect();
        Ok(Self { text, file: output::path(input::named(file)), title, ranges, grid, variants, families, laws })
    }

    /// Converts an error of the map with index `variant` to a failure that names the user's option.
    fn failure(&self, variant: usize, arguments: &MapArguments, error: MapError) -> Failure {
        let variant = &self.variants[variant];
        let said = Said { file: &arguments.scene.scene, ranges: &self.ranges, overrides: (variant.option, &variant.overrides) };
        match error {
            MapError::Family(error) => said.failure(error),
            error @ (MapError::Grid { .. } | MapError::Keys { .. } | MapError::Known { .. } | _) => Failure::Input(error.to_string()),
        }
    }

    /// Returns the name of a variant in a legend.
    fn legend(&self, variant: usize) -> String {
        cohaptic_answers::legend_name(&self.laws[variant], &self.variants[variant].overrides)
    }

    /// Returns the ranges of the keys along x and y.
    fn axes(&self) -> [&KeyRange; 2] {
        [self.x(), self.y()]
    }

    fn x(&self) -> &KeyRange {
        &self.ranges[0].1
    }

    fn y(&self) -> &KeyRange {
        &self.ranges[1].1
    }
}
