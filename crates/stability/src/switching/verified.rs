//! The check of shapes and multipliers, which does not depend on how they were found.
//!
//! M is computed again with a bound of every entry's error: of rounding, and of the errors that rows of a frame have. It is shown below zero, and shapes above, by a
//! factorisation that accounts for its own rounding ([`is_positive`]).

use super::inequality::{Inequality, Part, Solution};
use crate::Matrix;
use crate::worst_case::rounding::{UNDERFLOW, gamma, outward, real};
use crate::worst_case::verified::is_positive;

/// The least factor, of those looked at, by which the shapes are shown to shrink in a frame; `None` if they are not shown to shrink at all.
pub(super) fn rate(inequality: &Inequality, solution: &Solution) -> Option<f64> {
    let signs = inequality.free.iter().zip(&solution.multipliers).all(|(free, multiplier)| *free || *multiplier >= 0.0);
    let shaped =
        solution.shapes.iter().all(|shape| *shape == shape.transposed() && is_positive(shape, &Matrix::zeros(shape.rows(), shape.columns())));
    if !signs || !shaped || !shrinks(inequality, solution, 1.0) {
        return None;
    }
    // Halving: `square` shrinks, `less` is not shown to.
    let (mut less, mut square) = (0.0, 1.0);
    for _ in 0..30 {
        let middle = 0.5 * (less + square);
        if shrinks(inequality, solution, middle) {
            square = middle;
        } else {
            less = middle;
        }
    }
    // At least the root, rounded up.
    Some(outward(f64::sqrt(square)).min(1.0))
}

/// Whether every part is shown to have a shape that is multiplied by less than `square` in a frame.
fn shrinks(inequality: &Inequality, solution: &Solution, square: f64) -> bool {
    inequality.parts.iter().zip(&solution.shapes).all(|(part, shape)| {
        let (difference, error) = difference(part, shape, &solution.multipliers, square);
        is_positive(&difference, &error)
    })
}

/// square·Z₀ᵀVZ₀ − Z₁ᵀVZ₁ − Σ m·w·(u·vᵀ + v·uᵀ)/2, and a bound of the error of each entry.
fn difference(part: &Part, shape: &Matrix, multipliers: &[f64], square: f64) -> (Matrix, Matrix) {
    let size = part.unknowns;
    let stacked = |places: &[usize], more: bool| {
        Matrix::from_fn(places.len(), size, |row, column| {
            let row = &part.rows[places[row]];
            if more { row.entries[column].abs() + row.error } else { row.entries[column] }
        })
    };
    let sizes = Matrix::from_fn(shape.rows(), shape.columns(), |i, j| shape[(i, j)].abs());
    let measured = |places: &[usize]| {
        let rows = stacked(places, false);
        rows.transposed().times(&shape.times(&rows))
    };
    // What the sizes of the terms are at most, and by how much of that the errors of rows may change them.
    let reach = |places: &[usize]| {
        let (rows, more) = (Matrix::from_fn(places.len(), size, |row, column| part.rows[places[row]].entries[column].abs()), stacked(places, true));
        let (plain, wide) = (rows.transposed().times(&sizes.times(&rows)), more.transposed().times(&sizes.times(&more)));
        (Matrix::from_fn(size, size, |i, j| (wide[(i, j)] - plain[(i, j)]).max(0.0)), wide)
    };
    let (after, before) = (measured(&part.after), measured(&part.before));
    let ((after_shift, after_reach), (before_shift, before_reach)) = (reach(&part.after), reach(&part.before));
    let mut sum = Matrix::from_fn(size, size, |i, j| square * before[(i, j)] - after[(i, j)]);
    let mut shift = Matrix::from_fn(size, size, |i, j| square * before_shift[(i, j)] + after_shift[(i, j)]);
    let mut all = Matrix::from_fn(size, size, |i, j| square * before_reach[(i, j)] + after_reach[(i, j)]);
    for product in &part.products {
        let by = 0.5 * multipliers[product.multiplier] * product.weight;
        let [one, other] = product.factors.map(|factor| &part.rows[factor]);
        for i in 0..size {
            for j in 0..size {
                let entry = |one: usize, other: usize, u: &[f64], v: &[f64]| u[one] * v[other];
                let value = entry(i, j, &one.entries, &other.entries) + entry(i, j, &other.entries, &one.entries);
                let wide = |row: &super::inequality::Row, place: usize| row.entries[place].abs() + row.error;
                let most = wide(one, i) * wide(other, j) + wide(other, i) * wide(one, j);
                let least = one.entries[i].abs() * other.entries[j].abs() + other.entries[i].abs() * one.entries[j].abs();
                sum[(i, j)] -= by * value;
                shift[(i, j)] += by.abs() * (most - least).max(0.0);
                all[(i, j)] += by.abs() * most;
            }
        }
    }
    // Two sums of `rows` products each, the sum over products, and what the subtractions of `shift` lose.
    let share = gamma(2 * part.after.len() + part.products.len() + 16);
    let error = Matrix::from_fn(size, size, |i, j| {
        let rounded = 4.0 * share * all[(i.min(j), i.max(j))].max(all[(i.max(j), i.min(j))]);
        let moved = shift[(i, j)].max(shift[(j, i)]);
        outward(2.0 * moved + rounded) + real(size * part.rows.len()) * UNDERFLOW
    });
    let symmetric = Matrix::from_fn(size, size, |i, j| sum[(i.min(j), i.max(j))]);
    (symmetric, error)
}
