//! Computes the cells of maps in parallel, and keeps finished rows in a file, so that the same command continues after an interruption.
//!
//! Rows of all variants share one file. The number of a row is the index of its variant times the rows per map, plus the row's index in the map.

use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use cohaptic_campaign::Shard;
use cohaptic_files::{OwnFolder, PARTIAL};
use cohaptic_stability::{Map, MapError, MapRow};

use super::{Order, files};
use crate::analysis_watch::CellWatch;
use crate::arguments::MapArguments;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::shard::{Done, Names, Piece, Sharing, Worker, all_done, owner, show};
use crate::stability::proof_blocks::on_threads;
use crate::stability::rows_file::{Kept, Row, RowsFile, fingerprint};
use crate::stability::source::fingerprint_of;
use crate::{interrupt, output};

/// Name of the files of finished rows.
const ROWS: &str = "map.rows";

/// Texts of the header: the computation, the size (empty for the size of the grid), and the explanation of the rows.
const WHAT: [&str; 3] =
    ["stability map: rows that are finished", "", "each row: its number, the radius of each cell, and for each cell 1 if it is nominal"];

const NAMES: Names = Names { piece: "row", unit: "cell" };

/// Result of a complete computation of all maps.
pub(super) struct Filled {
    /// Complete maps, indexed by variant.
    pub(super) maps: Vec<Map>,
    /// Number of cells computed in this run.
    pub(super) cells: usize,
    /// File of rows, which the caller removes after the maps are written. `None` without a folder.
    pub(super) rows: Option<RowsFile>,
    /// Ownership of the folder, which the caller holds until the maps are written.
    pub(super) own: Option<OwnFolder>,
}

/// Computes every map from the rows that are known. A merge fails unless shards have finished every row.
pub(super) fn fill(order: &Order, arguments: &MapArguments, sharing: Sharing<'_>) -> Result<Filled, Failure> {
    let header = header(order, arguments, WHAT)?;
    let kept = sharing.folder().map(|folder| Kept { folder, name: ROWS, header: &header });
    if let (Sharing::Merge(_), Some(kept)) = (sharing, kept) {
        are_all_there(order, kept)?;
    }
    let own = sharing.own_folder()?;
    let (file, known) = match kept {
        None => (None, Vec::new()),
        Some(kept) => kept.open(None).map(|(file, known)| (Some(file), known))?,
    };
    // Rows of earlier calls must survive a failure of this call.
    let begun_before = !known.is_empty();
    let keeper = Keeper { file: Mutex::new((file, None)), broken: AtomicBool::new(false), worker: None };
    let work = || in_turn(order, sorted(known, order), &keeper);
    let filled = on_threads(threads(arguments), work);
    let (rows, broken) = keeper.file.into_inner().unwrap_or_else(PoisonError::into_inner);
    if let Some(failure) = broken {
        return Err(failure);
    }
    match filled {
        Ok((maps, cells)) if maps.len() == order.variants.len() && maps.iter().all(Map::is_complete) => Ok(Filled { maps, cells, rows, own }),
        Ok((maps, _)) => Err(interrupted(&maps, order, sharing.folder())),
        Err((variant, error)) => {
            // A new file of rows is useless if the computation fails. A file that had rows before is kept.
            if let Some(rows) = rows.filter(|_| !begun_before) {
                rows.abandon();
            }
            Err(order.failure(variant, arguments, error))
        }
    }
}

/// Returns the number of threads of the arguments; 0 for one thread per core.
fn threads(arguments: &MapArguments) -> usize {
    usize::from(arguments.threads.unwrap_or(0))
}

/// Computes the rows of a shard, as a worker of the folder.
pub(super) fn shard(order: &Order, arguments: &MapArguments, shard: Shard, folder: &Path) -> Result<Done, Failure> {
    let header = header(order, arguments, WHAT)?;
    let kept = Kept { folder, name: ROWS, header: &header };
    // A folder with rows of another computation is refused before the shard writes anything.
    kept.read()?;
    std::fs::create_dir_all(folder).map_err(|error| Failure::File { verb: "create", path: folder.to_path_buf(), error })?;
    let owner = owner();
    let worker = Worker::begin(folder, shard, &owner)?;
    let done = rows_of_shard(order, arguments, shard, kept, &owner.name(), &worker);
    let done = done.map(|[pieces, units, computed]| Done {
        shard,
        folder: output::path(folder),
        names: NAMES,
        pieces,
        units,
        computed,
        wall_s: worker.wall_s(),
    });
    worker.end(done, |failure| failure)
}

/// Computes the rows of a shard that are not known yet. Returns the number of rows and of cells of the shard, and the number of cells computed now.
fn rows_of_shard(order: &Order, arguments: &MapArguments, shard: Shard, kept: Kept<'_>, name: &str, worker: &Worker) -> Result<[u64; 3], Failure> {
    let (columns, rows) = (order.grid.columns(), order.grid.rows());
    let (file, known) = kept.open(Some(name))?;
    let mut known = sorted(known, order);
    let is_mine = |variant: usize, row: usize| shard.has((variant * rows + row) as u64);
    let (mut mine, mut there) = (0, 0);
    for (variant, row) in (0..order.variants.len()).flat_map(|variant| (0..rows).map(move |row| (variant, row))) {
        let cells = &mut known[variant][row];
        if is_mine(variant, row) {
            mine += 1;
            there += usize::from(!cells.radius.is_empty());
        } else {
            // A row of another shard is marked as known, so that the row is not computed. Its values are never read.
            *cells = MapRow { radius: vec![f64::NAN; columns], nominal: vec![false; columns] };
        }
    }
    let keeper = Keeper { file: Mutex::new((Some(file), None)), broken: AtomicBool::new(false), worker: Some(worker) };
    let filled = on_threads(threads(arguments), || in_turn(order, known, &keeper));
    if let Some(failure) = keeper.file.into_inner().unwrap_or_else(PoisonError::into_inner).1 {
        return Err(failure);
    }
    let (maps, computed) = filled.map_err(|(variant, error)| order.failure(variant, arguments, error))?;
    if maps.len() < order.variants.len() || !maps.iter().all(Map::is_complete) {
        let kept = format!("{} of {} finished are kept in {}", there + computed / columns, output::are(mine, "row"), output::path(kept.folder));
        return Err(Failure::Interrupted(format!("shard {shard}: {kept}; repeat the command to go on from there")));
    }
    Ok([mine, mine * columns, computed].map(|number| number as u64))
}

/// Returns every row of every map as a piece of work, with whether the row is known.
fn pieces(order: &Order, kept: Kept<'_>) -> Result<Vec<Piece>, Failure> {
    let known = sorted(kept.read()?.0, order);
    let piece = |row: &MapRow| Piece { units: order.grid.columns() as u64, is_done: !row.radius.is_empty() };
    Ok(known.iter().flatten().map(piece).collect())
}

/// Returns a failure unless shards have finished every row.
fn are_all_there(order: &Order, kept: Kept<'_>) -> Result<(), Failure> {
    all_done(kept.folder, NAMES, &pieces(order, kept)?)
}

/// Answers with the rows that are finished, for `--status`.
pub(super) fn status(order: &Order, arguments: &MapArguments, folder: &Path) -> Result<ExitCode, Failure> {
    let header = header(order, arguments, WHAT)?;
    let kept = Kept { folder, name: ROWS, header: &header };
    let pieces = pieces(order, kept)?;
    let is_merged = files::has_result(folder, &pieces, "map.html", order, arguments);
    show(arguments.scene.json, folder, NAMES, &pieces, is_merged)
}

/// Destination of finished rows, with the first failure to write. Shared by all threads of the computation.
struct Keeper<'a> {
    file: Mutex<(Option<RowsFile>, Option<Failure>)>,
    /// `true` if a failure is kept. An atomic, so that `stops` needs no lock.
    broken: AtomicBool,
    /// Worker of the shard; `None` if the command computes all rows.
    worker: Option<&'a Worker>,
}

impl Keeper<'_> {
    fn stops(&self) -> bool {
        interrupt::requested() || self.broken.load(Ordering::Relaxed) || self.worker.is_some_and(|worker| !worker.goes_on())
    }

    fn keep(&self, number: usize, row: &MapRow) {
        // The radii of all cells come first, and then the marks: `sorted` reads the two halves of a row.
        let nominal = row.nominal.iter().map(|nominal| f64::from(u8::from(*nominal)));
        let cells: Vec<f64> = row.radius.iter().copied().chain(nominal).collect();
        let mut guard = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let (file, broken) = &mut *guard;
        if let Some(Err(failure)) = file.as_mut().map(|file| file.add(number, &cells)) {
            broken.get_or_insert(failure);
            self.broken.store(true, Ordering::Relaxed);
        } else if let Some(worker) = self.worker {
            worker.kept(number as u64, row.radius.len() as u64);
        }
    }
}

/// Computes one map after the other, up to the first incomplete map. Returns the maps with the number of cells computed now; the error has the variant's index.
fn in_turn(order: &Order, known: Vec<Vec<MapRow>>, keeper: &Keeper<'_>) -> Result<(Vec<Map>, usize), (usize, MapError)> {
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
        let stop = || keeper.stops();
        let watch = CellWatch::new(&progress, "cell", &stop);
        let filled = Map::resume_watched(family, order.grid, known, done, &watch).map_err(|error| (variant, error));
        if filled.is_err() {
            progress.clear();
        }
        let map = filled?;
        let whole = map.is_complete();
        maps.push(map);
        // A map is incomplete only after a stop, which would end the next map at once too.
        if !whole {
            break;
        }
    }
    progress.clear();
    let finished = maps.iter().flat_map(|map| &map.radius).filter(|row| !row.is_empty()).count();
    // Only whole rows count: a stop leaves the row at work empty.
    Ok((maps, (finished.saturating_sub(there)) * columns))
}

/// Sorts rows by variant and by row of the map. An unknown row is empty.
fn sorted(known: Vec<Row>, order: &Order) -> Vec<Vec<MapRow>> {
    let (columns, rows) = (order.grid.columns(), order.grid.rows());
    let mut sorted = vec![vec![MapRow::default(); rows]; order.variants.len()];
    for (number, cells) in known.into_iter().filter(|(_, cells)| cells.len() == 2 * columns) {
        // A number outside the maps can only come from an edited file, and is skipped.
        if let Some(row) = sorted.get_mut(number / rows).and_then(|variant| variant.get_mut(number % rows)) {
            let nominal = cells[columns..].iter().map(|nominal| *nominal != 0.0).collect();
            *row = MapRow { radius: cells[..columns].to_vec(), nominal };
        }
    }
    sorted
}

/// Returns the header of a file of rows, which identifies the computation. The header has the version of the program, because the last digits of numbers may
/// differ between versions.
pub(super) fn header(order: &Order, arguments: &MapArguments, [command, size, rows]: [&str; 3]) -> Result<Vec<String>, Failure> {
    let mut lines = vec![
        format!("cohaptic {} {command}; the same command goes on from here", env!("CARGO_PKG_VERSION")),
        format!("scene text {:016x}", fingerprint(&order.text)),
        format!("set {:?}", arguments.scene.overrides.set),
        format!("x {:?}", arguments.x),
        format!("y {:?}", arguments.y),
        if size.is_empty() { format!("grid {}x{}", order.grid.columns(), order.grid.rows()) } else { size.to_owned() },
        format!("maps {}", order.variants.len()),
    ];
    for (number, (variant, family)) in order.variants.iter().zip(&order.families).enumerate() {
        let scene = fingerprint_of(family).map_err(|error| order.failure(number, arguments, error.into()))?;
        lines.push(format!("map {} {:?} of the scene {scene:016x}", number + 1, variant.overrides));
    }
    lines.push(rows.to_owned());
    Ok(lines)
}

fn interrupted(maps: &[Map], order: &Order, folder: Option<&Path>) -> Failure {
    let finished = maps.iter().flat_map(|map| &map.radius).filter(|row| !row.is_empty()).count();
    let all = order.grid.rows() * order.variants.len();
    let kept = match folder {
        Some(folder) => {
            format!("they are kept in {}; repeat the command to go on from there", output::path(&folder.join(format!("{ROWS}{PARTIAL}"))))
        }
        None => "nothing is kept; with --out DIR finished rows are; repeat the command to go on from there".to_owned(),
    };
    Failure::Interrupted(format!("{finished} of {} finished: {kept}", output::are(all, "row")))
}
