//! `cohaptic stability boundary`: finds the values of a key at which the stability of a scene changes.
//!
//! Without `--prove` the spectral radius is sampled, and each crossing of the limit is located to a tolerance. `prove` decides whole stretches of the range,
//! and `sharing` divides the search among shards.

mod files;
mod prove;
mod sharing;

use std::io::Write as _;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant as Clock};

use cohaptic_answers::boundary::Searched;
use cohaptic_stability::{Boundary, BoundaryError, BoundaryOptions, Cell, Criterion, Family, KeyRange, Radius};

use cohaptic_units::print::Counted;

use super::rows_file::{Kept, Row, RowsFile, fingerprint};
use super::source::{self, Said};
use crate::analysis_watch::{CellWatch, OPERATIONS_A_SECOND, estimate};
use crate::arguments::BoundaryArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::shard::{Sharing, all_done, show};
use crate::{input, interrupt, output, shard};

/// Time after which a search without a visible progress bar prints an estimate of its length.
const TOLD: Duration = Duration::from_secs(1);

/// Name of the files of rows with checked values.
const ROWS: &str = "boundary.rows";

/// Checked arguments of the command. Nothing is written before the check has passed.
struct Order {
    text: String,
    title: String,
    range: KeyRange,
    options: BoundaryOptions,
    family: Family,
    /// Header of the file of rows. The header identifies the search.
    header: Vec<String>,
}

/// Finds the crossings along a key and writes the answer, or does the part of a shard.
pub(crate) fn boundary(arguments: &BoundaryArguments) -> Result<ExitCode, Failure> {
    let sharing = Sharing::of(&arguments.shards, arguments.out.as_deref())?;
    let order = Order::new(arguments)?;
    if arguments.prove {
        return prove::prove(&order, arguments, sharing);
    }
    let kept = sharing.folder().map(|folder| Kept { folder, name: ROWS, header: &order.header });
    match (sharing, kept) {
        (Sharing::Shard(shard, _), Some(kept)) => return shard::answer(arguments.scene.json, &sharing::shard(&order, arguments, shard, kept)?),
        (Sharing::Status(folder), Some(kept)) => {
            let pieces = sharing::pieces(&order, kept)?;
            let is_merged = files::with_origin(&order, arguments, &[], |origin| shard::has_result(folder, &pieces, "boundary.html", origin));
            return show(arguments.scene.json, folder, sharing::NAMES, &pieces, is_merged);
        }
        (Sharing::Merge(folder), Some(kept)) => all_done(folder, sharing::NAMES, &sharing::pieces(&order, kept)?)?,
        (Sharing::Whole(_), Some(_)) | (_, None) => {}
    }
    let _own = sharing.own_folder()?;
    let (rows, known) = match kept {
        None => (None, Vec::new()),
        Some(kept) => kept.open(None).map(|(rows, known)| (Some(rows), known))?,
    };
    let found = look(&order, &known);
    interrupt::has_results();
    let found = match found {
        Ok(found) => found,
        Err(error) => {
            // A new file of rows is useless if the search fails. A file with earlier rows is kept.
            if let Some(rows) = rows.filter(|_| known.is_empty()) {
                rows.abandon();
            }
            return Err(failure(arguments, &order.range, error));
        }
    };
    let is_interrupted = !found.is_settled() && interrupt::requested();
    if is_interrupted {
        let ended = interrupted(&found, rows, &known, kept);
        if found.samples > 0 {
            // The crossings found so far are answered; the answer says that the search is not settled.
            say(&order, arguments, &found, &[])?;
        }
        return Err(ended);
    }
    let mut written = Vec::new();
    if let Some(folder) = sharing.folder() {
        written = files::write(folder, &order, arguments, &order.searched(&found))?;
        rows.map_or(Ok(()), RowsFile::remove)?;
    }
    say(&order, arguments, &found, &written)?;
    Ok(ExitCode::SUCCESS)
}

fn say(order: &Order, arguments: &BoundaryArguments, found: &Boundary, written: &[String]) -> Result<(), Failure> {
    let searched = order.searched(found);
    let words = || cohaptic_answers::boundary::words(&searched, interrupt::requested());
    let document = cohaptic_answers::boundary::document(&searched, written);
    output::answer(arguments.scene.json, DocumentSchema::STABILITY_BOUNDARY, &document, words, written)
}

impl Order {
    fn new(arguments: &BoundaryArguments) -> Result<Self, Failure> {
        let range = source::range("--along", &arguments.along)?;
        let mut options = BoundaryOptions::of(&range);
        options.tolerance = arguments.tolerance.unwrap_or(options.tolerance);
        options.samples = arguments.samples.unwrap_or(options.samples);
        if !(options.tolerance > 0.0 && options.tolerance.is_finite()) {
            return Err(Failure::Input(format!("--tolerance {}: expected a finite number above zero", options.tolerance)));
        }
        options.most = arguments.values;
        if options.samples > options.most && arguments.samples.is_none() {
            // The limit of --values is below the default number of first samples: all values are samples then.
            options.samples = options.most;
        }
        if options.samples < 2 || options.samples > options.most {
            return Err(Failure::Input(format!("--samples {}: expected from 2 to {}, the number of --values", options.samples, options.most)));
        }
        let (file, set) = (&arguments.scene.scene, &arguments.scene.overrides.set);
        let text = input::text(file)?;
        let refused = |error| failure(arguments, &range, BoundaryError::Radius(error));
        let family = Family::new(&text, file, set, vec![range.clone()]).map_err(refused)?;
        if let (Criterion::MeanSquare, None) = (family.criterion(), arguments.tolerance) {
            options.tolerance = BoundaryOptions::of_mean_square(&range).tolerance;
        }
        // Rows are continued only by a search with the same scene, overrides and range, and by the same version of the program.
        let title = source::at_low(&family).map_err(refused)?.title;
        let header = vec![
            format!("cohaptic {} stability boundary: values looked at; the same command goes on from here", env!("CARGO_PKG_VERSION")),
            format!("scene text {:016x}", fingerprint(&text)),
            format!("set {set:?}"),
            format!("along {:?} of the scene {:016x}", arguments.along, source::fingerprint_of(&family).map_err(refused)?),
            "each row: its number, the value, the radius, its error, and 1 if it is nominal".to_owned(),
        ];
        Ok(Self { text, title, range, options, family, header })
    }

    fn searched<'a>(&'a self, found: &'a Boundary) -> Searched<'a> {
        let Self { title, range, options, family, .. } = self;
        Searched { title, range, options: *options, family, found }
    }
}

/// Returns the value of each row with the cell found at the value. Too short rows are skipped.
fn cells(rows: &[Row]) -> Vec<(f64, Cell)> {
    let cell = |row: &[f64]| Some(Cell { radius: Radius { value: *row.get(1)?, error: *row.get(2)? }, is_nominal: *row.get(3)? != 0.0 });
    rows.iter().filter_map(|(_, row)| Some((*row.first()?, cell(row)?))).collect()
}

/// Returns the numbers of the row for `value` and a cell; the inverse of [`cells`].
fn row(value: f64, Cell { radius, is_nominal }: &Cell) -> [f64; 4] {
    [value, radius.value, radius.error, f64::from(u8::from(*is_nominal))]
}

/// Searches the range from the values that `known` holds, with a progress bar or, without one, a note about the length.
fn look(order: &Order, known: &[Row]) -> Result<Boundary, BoundaryError<cohaptic_stability::FamilyError>> {
    let known = cells(known);
    let most = order.options.most;
    let progress = Progress::new(most as u64, "{spinner} {pos} values looked at, of {len} at most, {elapsed} passed, {eta} left at most{msg}");
    progress.tick();
    let watch = CellWatch::new(&progress, "value", &interrupt::requested);
    let (begun, is_told) = (Clock::now(), AtomicBool::new(false));
    let looked_at = |count: usize| {
        progress.reach_number(count as u64);
        let passed = begun.elapsed();
        if passed >= TOLD && !progress.is_seen() && !is_told.swap(true, Ordering::Relaxed) {
            #[expect(clippy::cast_precision_loss, reason = "an estimate")]
            let all = passed.as_secs_f64() * most as f64 / count as f64;
            // A closed standard error must not end the search.
            let words = estimate(all * OPERATIONS_A_SECOND);
            let _ = writeln!(
                std::io::stderr(),
                "note: {} looked at in {:.0} s: the search ends after {most} at the latest, {words} in all; --values sets another limit, and Ctrl-C ends the \
                 search with the crossings found by then",
                Counted(count, "value"),
                passed.as_secs_f64()
            );
        }
    };
    let found = Boundary::find_watched(&order.family, order.options, &known, looked_at, &watch);
    progress.clear();
    found
}

/// Converts an error of the search to a failure that names the user's option.
fn failure(arguments: &BoundaryArguments, range: &KeyRange, error: BoundaryError<cohaptic_stability::FamilyError>) -> Failure {
    match error {
        BoundaryError::Radius(error) => {
            Said { file: &arguments.scene.scene, ranges: &[("--along", range.clone())], overrides: ("--set", &[]) }.failure(error)
        }
        error @ (BoundaryError::Options { .. } | BoundaryError::Keys { .. } | _) => Failure::Input(error.to_string()),
    }
}

/// Adds the values checked in this run to the file of rows, and returns the failure with advice on how to continue.
fn interrupted(found: &Boundary, rows: Option<RowsFile>, known: &[Row], kept: Option<Kept<'_>>) -> Failure {
    let kept = match (kept, rows) {
        (Some(kept), Some(mut rows)) => {
            // Bits are compared, because equal numbers may differ in the sign of zero.
            let is_known = |value: f64| known.iter().any(|(_, row)| row.first().is_some_and(|known| known.to_bits() == value.to_bits()));
            let mut new = found.known.iter().filter(|(value, _)| !is_known(*value)).enumerate();
            if let Err(failure) = new.try_for_each(|(number, (value, cell))| rows.add(known.len() + number, &row(*value, cell))) {
                return failure;
            }
            format!("they are kept in {}; repeat the command to go on from there", output::path(&kept.path(None)))
        }
        _ => "nothing is kept; with --out DIR they are; repeat the command to go on from there".to_owned(),
    };
    Failure::Interrupted(format!("{} looked at: {kept}", Counted(found.samples, "value")))
}
