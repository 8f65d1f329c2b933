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

/// The largest number of cells of a map.
const MOST_CELLS: usize = 100_000_000;

/// The numbers of nodes of a map along each key, the ends of the ranges among them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Grid {
    columns: usize,
    rows: usize,
}

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The grid has no cells, or too many.
    #[error("a grid of {columns} x {rows} cells: expected at least 1 and at most {MOST_CELLS} in all")]
    Grid {
        /// Number of columns.
        columns: usize,
        /// Number of rows.
        rows: usize,
    },
    /// The family has not two open keys.
    #[error("{keys} open keys: expected two for a map")]
    Keys {
        /// Number of open keys.
        keys: usize,
    },
    /// The rows known in advance do not fit the grid.
    #[error("row {row} of the rows known in advance has {cells} cells: expected {columns}, or none where the row is not known")]
    Known {
        /// Index of the first row that does not fit.
        row: usize,
        /// Number of cells of that row.
        cells: usize,
        /// Number of cells that the grid has in that row; 0 beyond the last row of the grid.
        columns: usize,
    },
    /// A cell cannot be computed.
    #[error(transparent)]
    Family(#[from] FamilyError),
}

impl Grid {
    /// Returns a grid with `columns` nodes along the first key and `rows` nodes along the second.
    ///
    /// # Errors
    ///
    /// [`MapError::Grid`] for a grid without cells, and for more than 10⁸ cells.
    pub const fn new(columns: usize, rows: usize) -> Result<Self, MapError> {
        match columns.checked_mul(rows) {
            Some(1..=MOST_CELLS) => Ok(Self { columns, rows }),
            Some(_) | None => Err(MapError::Grid { columns, rows }),
        }
    }

    /// Returns the number of nodes along the first key.
    #[must_use]
    pub const fn columns(&self) -> usize {
        self.columns
    }

    /// Returns the number of nodes along the second key.
    #[must_use]
    pub const fn rows(&self) -> usize {
        self.rows
    }
}

/// The radius over a grid, by the criterion of the family.
#[derive(Clone, PartialEq, Debug)]
pub struct Map {
    /// Values of the first key, ascending.
    pub x: Vec<f64>,
    /// Values of the second key, ascending.
    pub y: Vec<f64>,
    /// Radius of each cell, indexed by y, then by x. A row is empty if the filling was stopped before the row was finished.
    pub radius: Vec<Vec<f64>>,
    /// `true` if each cell is nominal, indexed as `radius`: see [`Cell::is_nominal`](crate::Cell::is_nominal).
    pub nominal: Vec<Vec<bool>>,
}

/// The cells of one value of y, one for each value of x; empty if the row is not known.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MapRow {
    /// Radius of each cell.
    pub radius: Vec<f64>,
    /// `true` if each cell is nominal.
    pub nominal: Vec<bool>,
}

impl Map {
    /// Fills a map of a family with two open keys, the first along x, on all threads of the pool that calls this function. The result does not depend on the
    /// number of threads.
    ///
    /// `done` is called after each row with the index of the row, in no particular order. `stop` is called before each row and within long rows: if it returns
    /// `true`, the rest is not computed and the rows that are not finished stay empty.
    ///
    /// # Errors
    ///
    /// [`MapError`] if the family has not two keys or a cell cannot be computed.
    pub fn fill(family: &Family, grid: Grid, done: impl Fn(usize) + Sync, stop: impl Fn() -> bool + Sync) -> Result<Self, MapError> {
        Self::resume_watched(family, grid, Vec::new(), |row, _| done(row), &Asks(stop))
    }

    /// Fills a map as [`Map::fill`], with rows that are known: `known[row]` is a known row, or empty; rows beyond the end of `known` are not known. Known rows
    /// are not computed again, and `done` is not called for known rows. For every other row `done` also gets the cells, so that they can be stored. The watch
    /// sees the progress of cells that take long and can stop the filling within a cell.
    ///
    /// # Errors
    ///
    /// As [`Map::fill`], and [`MapError::Known`] if a known row does not have as many cells as the grid has columns.
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
        // Empty rows are unknown rows, so missing rows at the end of `known` become unknown.
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
            // Threads may see the flag late. A row begun late is not wrong, and `cells` asks again within the row.
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

    /// Returns whether every row has been computed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.radius.iter().all(|row| !row.is_empty())
    }
}

/// Computes one row; `None` if the computation was stopped.
fn cells(
    family: &Family,
    x: &[f64],
    y: f64,
    scratch: &mut FamilyScratch,
    stop: &impl Fn() -> bool,
    watch: &dyn Watch,
) -> Result<Option<MapRow>, FamilyError> {
    // A cell with a second moment takes long, so `stop` is called after each. Other cells are quick.
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

/// Returns `count` values at equal distances from the low end of the range to the high end, both included; the low end alone if `count` is 1.
pub(crate) fn nodes(range: &KeyRange, count: usize) -> Vec<f64> {
    let last = crate::rounding::real(count.saturating_sub(1));
    let node = |number: usize| {
        // The sum below may miss the high end by rounding, and the end of the range must be a node.
        if number + 1 == count && number > 0 {
            return range.high;
        }
        let share = if number == 0 { 0.0 } else { crate::rounding::real(number) / last };
        (range.low + (range.high - range.low) * share).min(range.high)
    };
    (0..count).map(node).collect()
}

/// Scratches that threads borrow for a computation.
#[derive(Debug, Default)]
pub(crate) struct Scratches(Mutex<Vec<FamilyScratch>>);

impl Scratches {
    pub(crate) fn with<T>(&self, work: impl FnOnce(&mut FamilyScratch) -> T) -> T {
        // The lock is held only while a scratch is taken or given back, never during the computation.
        let lent = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).pop();
        let mut scratch = lent.unwrap_or_default();
        let result = work(&mut scratch);
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(scratch);
        result
    }
}
