//! Maps: the radius over a grid of two keys, by the criterion of the family.

pub(crate) mod contour;
#[cfg(test)]
mod tests;
mod verdicts;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::watch::Asks;
use crate::{AnalysisError, Cell, Criterion, Family, FamilyError, FamilyScratch, KeyRange, Watch};

/// More cells than this are refused.
const MOST_CELLS: usize = 100_000_000;

/// How many nodes a map has along each key, the ends of the ranges among them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Grid {
    columns: usize,
    rows: usize,
}

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// The grid has no cells, or too many.
    #[error("a grid of {columns} x {rows} cells: expected at least 1 and at most {MOST_CELLS} in all")]
    Grid {
        /// How many columns.
        columns: usize,
        /// How many rows.
        rows: usize,
    },
    /// The family has not two open keys.
    #[error("{keys} open keys: expected two for a map")]
    Keys {
        /// How many.
        keys: usize,
    },
    /// The rows that are given are not those of such a grid.
    #[error("row {row} of the rows known in advance has {cells} cells: expected {columns}, or none where the row is not known")]
    Known {
        /// The first such row.
        row: usize,
        /// How many cells it has.
        cells: usize,
        /// How many it should have.
        columns: usize,
    },
    /// A cell cannot be computed.
    #[error(transparent)]
    Family(#[from] FamilyError),
}

impl Grid {
    /// A grid with these numbers of nodes along the first key, and along the second.
    ///
    /// # Errors
    ///
    /// [`MapError::Grid`] for none, and for more than 10⁸ in all.
    pub const fn new(columns: usize, rows: usize) -> Result<Self, MapError> {
        match columns.checked_mul(rows) {
            Some(1..=MOST_CELLS) => Ok(Self { columns, rows }),
            Some(_) | None => Err(MapError::Grid { columns, rows }),
        }
    }

    /// How many nodes along the first key.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// How many nodes along the second key.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }
}

/// The radius over a grid, by the criterion of the family.
#[derive(Clone, PartialEq, Debug)]
pub struct Map {
    /// The values of the first key, ascending.
    pub x: Vec<f64>,
    /// The values of the second key, ascending.
    pub y: Vec<f64>,
    /// The radius at each value of y, for each value of x; a row is empty if the filling was stopped before it was reached.
    pub radius: Vec<Vec<f64>>,
    /// For each of them whether the cell is nominal: see [`Cell::is_nominal`](crate::Cell::is_nominal).
    pub nominal: Vec<Vec<bool>>,
}

/// The cells of one value of y, for each value of x; empty if they are not known.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MapRow {
    /// The radii.
    pub radius: Vec<f64>,
    /// For each of them whether the cell is nominal.
    pub nominal: Vec<bool>,
}

impl Map {
    /// Fills a map of a family with two open keys, the first along x, on all threads of the pool it is called in. What comes out does not depend on
    /// how many there are.
    ///
    /// `done` is called after each row, in no particular order, with its number; `stop` is asked before each row and within long ones: if it answers
    /// `true`, the rest is not computed and the rows that are not finished stay empty.
    ///
    /// # Errors
    ///
    /// [`MapError`] if the family has not two keys or a cell cannot be computed.
    pub fn fill(family: &Family, grid: Grid, done: impl Fn(usize) + Sync, stop: impl Fn() -> bool + Sync) -> Result<Self, MapError> {
        Self::resume(family, grid, Vec::new(), |row, _| done(row), stop)
    }

    /// As [`Map::fill`], with rows that are known: `known[row]` is such a row, or empty; rows beyond its end are not known. Known rows are not computed
    /// again, and `done` is not called for them; for the others it gets the row too, to be put away.
    ///
    /// # Errors
    ///
    /// As [`Map::fill`], and if a known row has not as many cells as the grid has columns.
    pub fn resume(
        family: &Family,
        grid: Grid,
        known: Vec<MapRow>,
        done: impl Fn(usize, &MapRow) + Sync,
        stop: impl Fn() -> bool + Sync,
    ) -> Result<Self, MapError> {
        Self::resume_watched(family, grid, known, done, &Asks(stop))
    }

    /// [`Map::resume`] with a watch, which sees how far cells are that take long, and ends the filling within them.
    ///
    /// # Errors
    ///
    /// As [`Map::resume`].
    pub fn resume_watched(
        family: &Family,
        grid: Grid,
        mut known: Vec<MapRow>,
        done: impl Fn(usize, &MapRow) + Sync,
        watch: &dyn Watch,
    ) -> Result<Self, MapError> {
        let [first, second] = family.keys() else {
            return Err(MapError::Keys { keys: family.keys().len() });
        };
        let fits = |cells: usize| cells == 0 || cells == grid.columns;
        let odd = |(row, cells): &(usize, &MapRow)| !fits(cells.radius.len()) || cells.nominal.len() != cells.radius.len() || *row >= grid.rows;
        if let Some((row, cells)) = known.iter().enumerate().find(odd) {
            return Err(MapError::Known { row, cells: cells.radius.len(), columns: if row < grid.rows { grid.columns } else { 0 } });
        }
        let (x, y) = (nodes(first, grid.columns), nodes(second, grid.rows));
        known.resize_with(grid.rows, MapRow::default);
        let stopped = AtomicBool::new(false);
        let stop = || {
            if watch.stops() {
                stopped.store(true, Ordering::Relaxed);
            }
            stopped.load(Ordering::Relaxed)
        };
        let pool = Scratches::default();
        let filled = known.par_iter_mut().enumerate().filter(|(_, row)| row.radius.is_empty()).try_for_each(|(number, row)| {
            if stop() {
                return Ok(());
            }
            let cells = pool.with(|scratch| cells(family, &x, y[number], scratch, &stop, watch));
            match cells {
                Ok(Some(cells)) => {
                    *row = cells;
                    done(number, row);
                    Ok(())
                }
                Ok(None) => Ok(()),
                Err(error) => Err(error),
            }
        });
        filled?;
        let (radius, nominal) = known.into_iter().map(|row| (row.radius, row.nominal)).unzip();
        Ok(Self { x, y, radius, nominal })
    }

    /// Whether every row has been computed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.radius.iter().all(|row| !row.is_empty())
    }
}

/// One row; `None` if it was stopped.
fn cells(
    family: &Family,
    x: &[f64],
    y: f64,
    scratch: &mut FamilyScratch,
    stop: &impl Fn() -> bool,
    watch: &dyn Watch,
) -> Result<Option<MapRow>, FamilyError> {
    // Cells whose second moment is followed one by one take long.
    let often = if family.criterion() == Criterion::MeanSquare { 1 } else { 256 };
    let mut row = MapRow { radius: Vec::with_capacity(x.len()), nominal: Vec::with_capacity(x.len()) };
    for (column, x) in x.iter().enumerate() {
        if (column + 1) % often == 0 && stop() {
            return Ok(None);
        }
        let Cell { radius, is_nominal } = match family.radius_watched(&[*x, y], scratch, watch) {
            Err(FamilyError::Analysis(AnalysisError::Stopped)) => return Ok(None),
            found => found?,
        };
        row.radius.push(radius);
        row.nominal.push(is_nominal);
    }
    Ok(Some(row))
}

/// As many values from the low end of the range to the high one, both included, at equal distances; of one the low end.
pub(crate) fn nodes(range: &KeyRange, count: usize) -> Vec<f64> {
    let last = crate::rounding::real(count.saturating_sub(1));
    let node = |number: usize| {
        if number + 1 == count && number > 0 {
            return range.high;
        }
        let share = if number == 0 { 0.0 } else { crate::rounding::real(number) / last };
        (range.low + (range.high - range.low) * share).min(range.high)
    };
    (0..count).map(node).collect()
}

/// Scratches that are lent to threads.
#[derive(Debug, Default)]
pub(crate) struct Scratches(Mutex<Vec<FamilyScratch>>);

impl Scratches {
    pub(crate) fn with<T>(&self, work: impl FnOnce(&mut FamilyScratch) -> T) -> T {
        let lent = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).pop();
        let mut scratch = lent.unwrap_or_default();
        let result = work(&mut scratch);
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(scratch);
        result
    }
}
