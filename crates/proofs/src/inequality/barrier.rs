//! The search for shapes and multipliers by the method of barriers. No proof depends on the search, because [`super::verified`] checks each solution.
//!
//! The search maximises the margin t of −M(V, m) >= t·I, with V > 0, m > 0 and a bound R of the sum of all traces and multipliers, by minimising
//!
//! ```text
//! −η·t − Σ ln det(−M − t·I) − Σ ln det V − Σ ln m − ln(R − Σ tr V − Σ m)
//! ```
//!
//! for a growing η (Nesterov & Nemirovskii 1994). With W = S⁻¹, the derivatives of −ln det S along sums of (u·vᵀ + v·uᵀ)/2 are sums of products of the numbers
//! uᵀWv. Multipliers of any sign (`free`) enter M alone.

use cohaptic_stability::numerics::{cholesky, real, triangle_inverse};
use cohaptic_stability::{Matrix, Watch};

use super::parts::{Inequality, Measured, Part, Solution};
use crate::newton::{Barrier, Shortest, Steps, centre, log_determinant, upper};

/// Factor by which η grows from one centre to the next.
const STEP: f64 = 4.0;
const STEPS: Steps = Steps { most: 40, centred: 0.2, shortest: Shortest::Share(1e-6) };
/// Upper bound of the margin below which the search ends, for shapes with entries of about 1.
const NOTHING: f64 = 1e-7;

/// Searches until `checked` accepts a solution, and returns the solution with the result of `checked`; `None` if the watch ends the search or no margin above
/// zero can be expected.
pub(crate) fn search<T>(inequality: &Inequality, watch: &dyn Watch, checked: impl Fn(&Solution) -> Option<T>) -> Option<(Solution, T)> {
    let mut barrier = Margin::new(inequality);
    let mut point = barrier.start();
    while barrier.parameter / barrier.pull > NOTHING {
        // Rounding may stop the steps before the centre (`is_stuck`). The next centre is then searched from the last point, which lies within the domain.
        point = centre(&barrier, point, STEPS, watch)?.point;
        if point.margin > 0.0 {
            if let Some(found) = checked(&point.solution) {
                return Some((point.solution, found));
            }
        // The largest margin is at most `parameter / pull` above the margin of a centre.
        } else if point.margin + barrier.parameter / barrier.pull < NOTHING {
            return None;
        }
        barrier.pull *= STEP;
    }
    None
}

/// A point of the search: values of all unknowns.
#[derive(Clone, Debug)]
struct Point {
    solution: Solution,
    margin: f64,
}

/// The derivative of M with respect to one unknown: a sum of weight·(u·vᵀ + v·uᵀ)/2. Each entry holds the weight and the indices of the rows u and v.
type Slope = Vec<(f64, usize, usize)>;

/// The margin times −η, with a barrier for each matrix and number that must be above zero.
struct Margin<'a> {
    inequality: &'a Inequality,
    /// Indexed by part: each unknown on which the part's M depends, by the index of the unknown, with the derivative of M.
    slopes: Vec<Vec<(usize, Slope)>>,
    /// Index of the first unknown of each shape.
    first: Vec<usize>,
    /// Index of the unknown of the first multiplier.
    multipliers: usize,
    /// Number of unknowns; the margin is the last unknown.
    unknowns: usize,
    /// Bound R of the sum of the traces of the shapes and of the multipliers that must be positive.
    bound: f64,
    /// Upper bound of η times the amount by which the largest margin exceeds the margin of a centre.
    parameter: f64,
    /// Weight η of the margin against the barriers. Grows from centre to centre.
    pull: f64,
}

impl<'a> Margin<'a> {
    fn new(inequality: &'a Inequality) -> Self {
        let mut first = Vec::new();
        let mut next = 0;
        for size in &inequality.shapes {
            first.push(next);
            next += size * (size + 1) / 2;
        }
        let multipliers = next;
        let slopes = inequality.parts.iter().map(|part| {
            let mut all: Vec<(usize, Slope)> = Vec::new();
            // An unknown can occur in the form before the step, in the form after it and in products; M has one slope per unknown.
            let mut add = |number: usize, term: (f64, usize, usize)| match all.iter_mut().find(|(own, _)| *own == number) {
                Some((_, slope)) => slope.push(term),
                None => all.push((number, vec![term])),
            };
            for (measured, sign) in [(&part.after, 1.0), (&part.before, -1.0)] {
                for (number, (i, j)) in upper(measured.rows.len()).enumerate() {
                    let by = if i == j { sign } else { 2.0 * sign };
                    add(first[measured.shape] + number, (by, measured.rows[i], measured.rows[j]));
                }
            }
            for product in &part.products {
                add(multipliers + product.multiplier, (product.weight, product.factors[0], product.factors[1]));
            }
            all
        });
        let slopes = slopes.collect();
        let shapes: usize = inequality.shapes.iter().sum();
        let sizes: usize = inequality.parts.iter().map(|part| part.unknowns).sum::<usize>() + shapes;
        let signed = inequality.free.iter().filter(|free| !**free).count();
        let unknowns = multipliers + inequality.free.len() + 1;
        Self { inequality, slopes, first, multipliers, unknowns, bound: 2.0 * real(shapes + signed), parameter: real(sizes + signed + 1), pull: 1.0 }
    }

    /// Returns a point of the domain: identities as shapes, signed multipliers of one and free multipliers of zero, whose sum is half of R, with a margin below
    /// every eigenvalue of −M.
    fn start(&self) -> Point {
        let shapes = self.inequality.shapes.iter().map(|size| Matrix::identity(*size)).collect();
        let multipliers = self.inequality.free.iter().map(|free| f64::from(u8::from(!free))).collect();
        let solution = Solution { shapes, multipliers };
        let largest = (0..self.inequality.parts.len()).map(|part| self.middle(part, &solution).frobenius_norm()).fold(0.0, f64::max);
        Point { solution, margin: -1.0 - largest }
    }

    /// Returns M of the part with that index.
    fn middle(&self, number: usize, solution: &Solution) -> Matrix {
        let part = &self.inequality.parts[number];
        let measured = |of: &Measured| {
            let rows = Matrix::from_fn(of.rows.len(), part.unknowns, |row, column| part.rows[of.rows[row]].entries[column]);
            rows.transposed().times(&solution.shapes[of.shape].times(&rows))
        };
        let (after, before) = (measured(&part.after), measured(&part.before));
        let mut middle = Matrix::from_fn(part.unknowns, part.unknowns, |i, j| after[(i, j)] - before[(i, j)]);
        for product in &part.products {
            let by = 0.5 * solution.multipliers[product.multiplier] * product.weight;
            let [one, other] = product.factors.map(|factor| &part.rows[factor].entries);
            for (place, (u, v)) in one.iter().zip(other).enumerate() {
                for (entry, (w, x)) in middle.row_mut(place).iter_mut().zip(other.iter().zip(one)) {
                    *entry += by * (u * w + v * x);
                }
            }
        }
        middle
    }

    /// Returns the triangle R of −M − t·I = RᵀR, or `None` if the matrix is not positive definite.
    fn slack(&self, part: usize, point: &Point) -> Option<Matrix> {
        let mut slack = self.middle(part, &point.solution).scaled(-1.0);
        (0..slack.rows()).for_each(|place| slack[(place, place)] -= point.margin);
        cholesky(&slack)
    }

    /// Returns the bound R less the sum of all traces and of all multipliers that must not be below zero.
    fn left(&self, solution: &Solution) -> f64 {
        let trace = |shape: &Matrix| (0..shape.rows()).map(|place| shape[(place, place)]).sum::<f64>();
        let signed = self.inequality.free.iter().zip(&solution.multipliers).filter(|(free, _)| !**free).map(|(_, multiplier)| multiplier);
        self.bound - solution.shapes.iter().map(trace).sum::<f64>() - signed.sum::<f64>()
    }

    /// Adds the derivatives of −ln det(−M − t·I) of a part to `gradient` and `hessian`; `inverse` is the inverse of the triangle of −M − t·I.
    fn of_slack(&self, number: usize, part: &Part, inverse: &Matrix, gradient: &mut [f64], hessian: &mut Matrix) {
        let last = self.unknowns - 1;
        // With R⁻¹ = Z, uᵀWv is the product of Zᵀu and Zᵀv.
        let rows = Matrix::from_fn(part.rows.len(), part.unknowns, |row, column| part.rows[row].entries[column]);
        let along = rows.times(inverse);
        let once = along.times(&along.transposed());
        let w = inverse.times(&inverse.transposed());
        let twice = {
            let along = rows.times(&w);
            along.times(&along.transposed())
        };
        for (place, (unknown, slope)) in self.slopes[number].iter().enumerate() {
            gradient[*unknown] += slope.iter().map(|(by, i, j)| by * once[(*i, *j)]).sum::<f64>();
            hessian[(*unknown, last)] += slope.iter().map(|(by, i, j)| by * twice[(*i, *j)]).sum::<f64>();
            for (other, with) in &self.slopes[number][place..] {
                let mut second = 0.0;
                for (by, i, j) in slope {
                    for (of, k, l) in with {
                        second += 0.5 * by * of * (once[(*i, *k)] * once[(*j, *l)] + once[(*i, *l)] * once[(*j, *k)]);
                    }
                }
                hessian[(*unknown.min(other), *unknown.max(other))] += second;
            }
        }
        let trace: f64 = (0..w.rows()).map(|place| w[(place, place)]).sum();
        gradient[last] += trace;
        hessian[(last, last)] += w.entries().iter().map(|entry| entry * entry).sum::<f64>();
    }
}

impl Barrier for Margin<'_> {
    type Point = Point;

    fn value(&self, point: &Point) -> Option<f64> {
        let mut value = -self.pull * point.margin;
        for part in 0..self.inequality.parts.len() {
            value -= log_determinant(&self.slack(part, point)?);
        }
        for shape in &point.solution.shapes {
            value -= log_determinant(&cholesky(shape)?);
        }
        let signed = self.inequality.free.iter().zip(&point.solution.multipliers).filter(|(free, _)| !**free).map(|(_, multiplier)| *multiplier);
        // A sum of traces and multipliers without a bound would let the margin grow for ever, because M is linear in all of them.
        for positive in signed.chain([self.left(&point.solution)]) {
            // Written so that NaN fails.
            if !(positive > 0.0 && positive.is_finite()) {
                return None;
            }
            value -= libm::log(positive);
        }
        Some(value)
    }

    fn derivatives(&self, point: &Point) -> Option<(Vec<f64>, Matrix)> {
        let last = self.unknowns - 1;
        let mut gradient = vec![0.0; self.unknowns];
        let mut hessian = Matrix::zeros(self.unknowns, self.unknowns);
        gradient[last] = -self.pull;
        for (number, part) in self.inequality.parts.iter().enumerate() {
            let inverse = triangle_inverse(&self.slack(number, point)?);
            self.of_slack(number, part, &inverse, &mut gradient, &mut hessian);
        }
        for (number, shape) in point.solution.shapes.iter().enumerate() {
            let triangle = triangle_inverse(&cholesky(shape)?);
            let inverse = triangle.times(&triangle.transposed());
            let places: Vec<(usize, usize)> = upper(inverse.rows()).collect();
            let by = |(i, j): (usize, usize)| if i == j { 1.0 } else { 2.0 };
            for (one, (i, j)) in places.iter().copied().enumerate() {
                gradient[self.first[number] + one] -= by((i, j)) * inverse[(i, j)];
                for (other, (k, l)) in places.iter().copied().enumerate().skip(one) {
                    let second = 0.5 * by((i, j)) * by((k, l)) * (inverse[(i, k)] * inverse[(j, l)] + inverse[(i, l)] * inverse[(j, k)]);
                    hessian[(self.first[number] + one, self.first[number] + other)] += second;
                }
            }
        }
        let left = self.left(&point.solution);
        // The unknowns on which `left` depends: the diagonals of shapes and the multipliers that must not be below zero.
        let mut summed: Vec<usize> = Vec::new();
        for (shape, first) in point.solution.shapes.iter().zip(&self.first) {
            summed.extend(upper(shape.rows()).enumerate().filter(|(_, (i, j))| i == j).map(|(number, _)| first + number));
        }
        for (number, (free, multiplier)) in self.inequality.free.iter().zip(&point.solution.multipliers).enumerate() {
            if *free {
                continue;
            }
            let place = self.multipliers + number;
            gradient[place] -= 1.0 / multiplier;
            hessian[(place, place)] += 1.0 / (multiplier * multiplier);
            summed.push(place);
        }
        for (number, one) in summed.iter().enumerate() {
            gradient[*one] += 1.0 / left;
            for other in &summed[number..] {
                hessian[(*one, *other)] += 1.0 / (left * left);
            }
        }
        // A multiplier on which no part depends has no second derivative, and the Hessian would not be positive definite.
        for place in 0..self.unknowns {
            hessian[(place, place)] += 1e-13 * (1.0 + hessian[(place, place)]);
        }
        Some((gradient, hessian))
    }

    fn moved(&self, point: &Point, direction: &[f64], length: f64) -> Point {
        let mut moved = point.clone();
        for (shape, first) in moved.solution.shapes.iter_mut().zip(&self.first) {
            for (number, (i, j)) in upper(shape.rows()).enumerate() {
                shape[(i, j)] += length * direction[first + number];
                shape[(j, i)] = shape[(i, j)];
            }
        }
        for (multiplier, change) in moved.solution.multipliers.iter_mut().zip(&direction[self.multipliers..]) {
            *multiplier += length * change;
        }
        moved.margin += length * direction[self.unknowns - 1];
        moved
    }
}
