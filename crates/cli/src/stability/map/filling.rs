//! Fills maps in parallel, and keeps finished rows, so that the same command goes on where it was interrupted.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use cohaptic_stability::{Map, MapError, MapRow};

use super::Order;
use crate::analysis_watch::CellWatch;
use crate::arguments::MapArguments;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::stability::rows_file::{Row, RowsFile, fingerprint};
use crate::stability::source::fingerprint_of;
use crate::{interrupt, output};

/// The file in which finished rows are kept.
const ROWS: &str = "map.rows.partial";

/// All maps, whole.
pub(super) struct Filled {
    /// One for each variant.
    pub(super) maps: Vec<Map>,
    /// How many cells were computed now.
    pub(super) cells: usize,
    /// The file of rows, to be removed when the maps are written.
    pub(super) rows: Option<RowsFile>,
}

/// Fills every map.
pub(super) fn fill(order: &Order, arguments: &MapArguments) -> Result<Filled, Failure> {
    let (file, known) = match &arguments.out {
        None => (None, Vec::new()),
        Some(folder) => RowsFile::open(folder.join(ROWS), &header(order, arguments)?).map(|(file, known)| (Some(file), known))?,
    };
    let begun_before = !known.is_empty();
    let keeper = Keeper { file: Mutex::new((file, None)), broken: AtomicBool::new(false) };
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let work = || in_turn(order, sorted(known, order), &keeper);
    let filled = match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(work),
        // Without threads of its own it uses those that there are.
        Err(_) => work(),
    };
    let (rows, broken) = keeper.file.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(failure) = broken {
        return Err(failure);
    }
    match filled {
        Ok((maps, cells)) if maps.len() == order.variants.len() && maps.iter().all(Map::is_complete) => Ok(Filled { maps, cells, rows }),
        Ok((maps, _)) => Err(interrupted(&maps, order, arguments)),
        Err((variant, error)) => {
            if let Some(rows) = rows.filter(|_| !begun_before) {
                rows.abandon();
            }
            Err(order.failure(variant, arguments, error))
        }
    }
}

/// Where finished rows go, and what went wrong there.
struct Keeper {
    file: Mutex<(Option<RowsFile>, Option<Failure>)>,
    broken: AtomicBool,
}

impl Keeper {
    fn keep(&self, number: usize, row: &MapRow) {
        let nominal = row.nominal.iter().map(|nominal| f64::from(u8::from(*nominal)));
        let cells: Vec<f64> = row.radius.iter().copied().chain(nominal).collect();
        let mut guard = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let (file, broken) = &mut *guard;
        if let Some(Err(failure)) = file.as_mut().map(|file| file.add(number, &cells)) {
            broken.get_or_insert(failure);
            self.broken.store(true, Ordering::Relaxed);
        }
    }
}

/// Fills one map after the other, up to the first that is not whole; and how many cells that took.
fn in_turn(order: &Order, known: Vec<Vec<MapRow>>, keeper: &Keeper) -> Result<(Vec<Map>, usize), (usize, MapError)> {
    let (columns, rows) = (order.grid.columns(), order.grid.rows());
    let there: usize = known.iter().flatten().filter(|row| !row.radius.is_empty()).count();
    let progress = Progress::new((rows * order.families.len()) as u64, "{bar:30} {percent:>3} %  {pos}/{len} rows, {eta} left{msg}");
    progress.reach_number(there as u64);
    progress.tick();
    let mut maps = Vec::new();
    for (variant, (family, known)) in order.families.iter().zip(known).enumerate() {
        let done = |row: usize, cells: &MapRow| {
            keeper.keep(variant * rows + row, cells);
            progress.one_more();
        };
        let stop = || interrupt::requested() || keeper.broken.load(Ordering::Relaxed);
        let watch = CellWatch::new(&progress, "cell", &stop);
        let filled = Map::resume_watched(family, order.grid, known, done, &watch).map_err(|error| (variant, error));
        if filled.is_err() {
            progress.clear();
        }
        let map = filled?;
        let whole = map.is_complete();
        maps.push(map);
        if !whole {
            break;
        }
    }
    progress.clear();
    let finished = maps.iter().flat_map(|map| &map.radius).filter(|row| !row.is_empty()).count();
    Ok((maps, (finished.saturating_sub(there)) * columns))
}

/// The rows of each variant by their places; empty where they are not known.
fn sorted(known: Vec<Row>, order: &Order) -> Vec<Vec<MapRow>> {
    let (columns, rows) = (order.grid.columns(), order.grid.rows());
    let mut sorted = vec![vec![MapRow::default(); rows]; order.variants.len()];
    for (number, cells) in known.into_iter().filter(|(_, cells)| cells.len() == 2 * columns) {
        if let Some(row) = sorted.get_mut(number / rows).and_then(|variant| variant.get_mut(number % rows)) {
            let nominal = cells[columns..].iter().map(|nominal| *nominal != 0.0).collect();
            *row = MapRow { radius: cells[..columns].to_vec(), nominal };
        }
    }
    sorted
}

/// What the rows belong to. Numbers of another version of the program may differ in their last digits, and are not mixed.
fn header(order: &Order, arguments: &MapArguments) -> Result<Vec<String>, Failure> {
    let mut lines = vec![
        format!("cohaptic {} stability map: rows that are finished; the same command goes on from here", env!("CARGO_PKG_VERSION")),
        format!("scene text {:016x}", fingerprint(&order.text)),
        format!("set {:?}", arguments.scene.overrides.set),
        format!("x {:?}", arguments.x),
        format!("y {:?}", arguments.y),
        format!("grid {}x{}", order.grid.columns(), order.grid.rows()),
        format!("maps {}", order.variants.len()),
    ];
    for (number, (variant, family)) in order.variants.iter().zip(&order.families).enumerate() {
        let scene = fingerprint_of(family).map_err(|error| order.failure(number, arguments, error.into()))?;
        lines.push(format!("map {} {:?} of the scene {scene:016x}", number + 1, variant.overrides));
    }
    lines.push("each row: its number, the radius of each cell, and for each cell 1 if it is nominal".to_owned());
    Ok(lines)
}

fn interrupted(maps: &[Map], order: &Order, arguments: &MapArguments) -> Failure {
    let finished = maps.iter().flat_map(|map| &map.radius).filter(|row| !row.is_empty()).count();
    let all = order.grid.rows() * order.variants.len();
    let kept = match &arguments.out {
        Some(folder) => format!("they are kept in {}, and the same command goes on from there", output::path(&folder.join(ROWS))),
        None => "nothing is kept; with --out DIR finished rows are, and the same command goes on from there".to_owned(),
    };
    Failure::Interrupted(format!("{finished} of {} finished: {kept}", output::are(all, "row")))
}
