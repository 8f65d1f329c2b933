//! The check of shapes and multipliers, which does not depend on how they were found.
//!
//! The check computes M again with a bound of the error of every entry. The bound covers the rounding of the computation and the errors of the rows. A
//! factorisation that accounts for its own rounding ([`is_positive`]) then shows M below zero and the shapes above zero.

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::{UNDERFLOW, gamma, is_positive, outward, real};

use super::parts::{Inequality, Measured, Part, Row, Solution};

/// Returns a factor, at most 1, by which the norms of the shapes are shown to shrink in each step, found by halving; `None` if the inequality is not shown to
/// hold.
pub(crate) fn rate(inequality: &Inequality, solution: &Solution) -> Option<f64> {
    if !holds(inequality, solution) {
        return None;
    }
    // Halving: the inequality is shown to hold with `square`, and is not shown to hold with `less`.
    let (mut less, mut square) = (0.0, 1.0);
    for _ in 0..30 {
        let middle = 0.5 * (less + square);
        if shrinks(inequality, solution, middle) {
            square = middle;
        } else {
            less = middle;
        }
    }
    // The forms shrink by `square`, hence the norms by the root, which is rounded up.
    Some(outward(f64::sqrt(square)).min(1.0))
}

/// Returns whether every part is shown to hold, with positive definite shapes, and with multipliers of at least zero except where `free` allows any sign.
pub(crate) fn holds(inequality: &Inequality, solution: &Solution) -> bool {
    let signs = inequality.free.iter().zip(&solution.multipliers).all(|(free, multiplier)| *free || *multiplier >= 0.0);
    let is_shape = |shape: &Matrix| *shape == shape.transposed() && is_positive(shape, &Matrix::zeros(shape.rows(), shape.columns()));
    signs && solution.shapes.iter().all(is_shape) && shrinks(inequality, solution, 1.0)
}

/// Returns whether every part is shown to hold with the quadratic forms before a step multiplied by `square`.
fn shrinks(inequality: &Inequality, solution: &Solution, square: f64) -> bool {
    inequality.parts.iter().all(|part| {
        let (difference, error) = difference(part, solution, square);
        is_positive(&difference, &error)
    })
}

/// Returns square·Z₀ᵀVZ₀ − Z₁ᵀVZ₁ − Σ m·w·(u·vᵀ + v·uᵀ)/2, and a bound of the error of each entry.
fn difference(part: &Part, solution: &Solution, square: f64) -> (Matrix, Matrix) {
    let size = part.unknowns;
    let stacked = |of: &Measured, entry: fn(f64, f64) -> f64| {
        Matrix::from_fn(of.rows.len(), size, |row, column| {
            let row = &part.rows[of.rows[row]];
            entry(row.entries[column], row.error)
        })
    };
    let measured = |of: &Measured| {
        let rows = stacked(of, |entry, _| entry);
        rows.transposed().times(&solution.shapes[of.shape].times(&rows))
    };
    // Returns by how much the errors of rows may change a form, and an upper bound of the sizes of the form's terms.
    let reach = |of: &Measured| {
        let shape = &solution.shapes[of.shape];
        let sizes = Matrix::from_fn(shape.rows(), shape.columns(), |i, j| shape[(i, j)].abs());
        let (rows, more) = (stacked(of, |entry, _| entry.abs()), stacked(of, |entry, error| entry.abs() + error));
        let (plain, wide) = (rows.transposed().times(&sizes.times(&rows)), more.transposed().times(&sizes.times(&more)));
        (Matrix::from_fn(size, size, |i, j| (wide[(i, j)] - plain[(i, j)]).max(0.0)), wide)
    };
    let (after, before) = (measured(&part.after), measured(&part.before));
    let ((after_shift, after_reach), (before_shift, before_reach)) = (reach(&part.after), reach(&part.before));
    let mut sum = Matrix::from_fn(size, size, |i, j| square * before[(i, j)] - after[(i, j)]);
    let mut shift = Matrix::from_fn(size, size, |i, j| square * before_shift[(i, j)] + after_shift[(i, j)]);
    let mut all = Matrix::from_fn(size, size, |i, j| square * before_reach[(i, j)] + after_reach[(i, j)]);
    for product in &part.products {
        let by = 0.5 * solution.multipliers[product.multiplier] * product.weight;
        let [one, other] = product.factors.map(|factor| &part.rows[factor]);
        for i in 0..size {
            for j in 0..size {
                let entry = |one: usize, other: usize, u: &[f64], v: &[f64]| u[one] * v[other];
                let value = entry(i, j, &one.entries, &other.entries) + entry(i, j, &other.entries, &one.entries);
                let wide = |row: &Row, place: usize| row.entries[place].abs() + row.error;
                let most = wide(one, i) * wide(other, j) + wide(other, i) * wide(one, j);
                let least = one.entries[i].abs() * other.entries[j].abs() + other.entries[i].abs() * one.entries[j].abs();
                sum[(i, j)] -= by * value;
                shift[(i, j)] += by.abs() * (most - least).max(0.0);
                all[(i, j)] += by.abs() * most;
            }
        }
    }
    // γ counts the operations of one entry: two sums of `rows` products each, the sum over products, and the subtractions of `shift`, which cancel.
    let share = gamma(2 * part.after.rows.len().max(part.before.rows.len()) + part.products.len() + 16);
    let error = Matrix::from_fn(size, size, |i, j| {
        let rounded = 4.0 * share * all[(i.min(j), i.max(j))].max(all[(i.max(j), i.min(j))]);
        let moved = shift[(i, j)].max(shift[(j, i)]);
        outward(2.0 * moved + rounded) + real(size * part.rows.len()) * UNDERFLOW
    });
    // The two triangles of `sum` round differently. The upper triangle is mirrored; `error` has the larger bound of both triangles.
    let symmetric = Matrix::from_fn(size, size, |i, j| sum[(i.min(j), i.max(j))]);
    (symmetric, error)
}
