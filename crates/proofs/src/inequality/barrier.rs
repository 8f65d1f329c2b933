//! The search for shapes and multipliers by the method of barriers. Nothing here has to be right: what it finds is checked ([`super::verified`]).
//!
//! The margin t of −M(V, m) >= t·I is made as large as it goes, with V > 0, m > 0 and a bound of the sum of all, from the minimum of
//!
//! ```text
//! −η·t − Σ ln det(−M − t·I) − Σ ln det V − Σ ln m − ln(R − Σ tr V − Σ m)
//! ```
//!
//! for a growing η (Nesterov & Nemirovskii 1994). With W = S⁻¹, the derivatives of −ln det S along sums of (u·vᵀ + v·uᵀ)/2 take nothing but the numbers uᵀWv.

use cohaptic_stability::numerics::{cholesky, real, triangle_inverse};
use cohaptic_stability::{Matrix, Watch};

use super::parts::{Inequality, Measured, Part, Solution};
use crate::newton::{Barrier, Shortest, Steps, centre, log_determinant, upper};

/// By how much η grows from one centre to the next.
const STEP: f64 = 4.0;
const STEPS: Steps = Steps { most: 40, centred: 0.2, shortest: Shortest::Share(1e-6) };
/// Once the margin can be no more than this, for shapes of about 1, there is none.
const NOTHING: f64 = 1e-7;

/// Searches until `checked` accepts; `None` if the watch ends it or nothing is left to find.
pub(crate) fn search<T>(inequality: &Inequality, watch: &dyn Watch, checked: impl Fn(&Solution) -> Option<T>) -> Option<(Solution, T)> {
    let mut barrier = Margin::new(inequality);
    let mut point = barrier.start();
    while barrier.parameter / barrier.pull > NOTHING {
        // Rounding may get the better of a centre; the next is looked for from where that left it.
        point = centre(&barrier, point, STEPS, watch)?.point;
        if point.margin > 0.0 {
            if let Some(found) = checked(&point.solution) {
                return Some((point.solution, found));
            }
        } else if point.margin + barrier.parameter / barrier.pull < NOTHING {
            return None;
        }
        barrier.pull *= STEP;
    }
    None
}

/// Where the search is.
#[derive(Clone, Debug)]
struct Point {
    solution: Solution,
    margin: f64,
}

/// A symmetric matrix as a sum of products of rows, which an unknown multiplies: weight, and the two rows.
type Slope = Vec<(f64, usize, usize)>;

/// The margin, with a barrier for all that must not be below zero.
struct Margin<'a> {
    inequality: &'a Inequality,
    /// For each part its unknowns: their number among all, and how M depends on them.
    slopes: Vec<Vec<(usize, Slope)>>,
    /// The number of the first unknown of each shape; of the first multiplier; and of all, the margin last.
    first: Vec<usize>,
    multipliers: usize,
    unknowns: usize,
    /// R.
    bound: f64,
    /// By how much the optimum may be better than a centre, times η.
    parameter: f64,
    /// η.
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

    fn start(&self) -> Point {
        let shapes = self.inequality.shapes.iter().map(|size| Matrix::identity(*size)).collect();
        let multipliers = self.inequality.free.iter().map(|free| f64::from(u8::from(!free))).collect();
        let solution = Solution { shapes, multipliers };
        let largest = (0..self.inequality.parts.len()).map(|part| self.middle(part, &solution).frobenius_norm()).fold(0.0, f64::max);
        Point { solution, margin: -1.0 - largest }
    }

    /// M of a part.
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

    /// The triangle R of −M − t·I = RᵀR.
    fn slack(&self, part: usize, point: &Point) -> Option<Matrix> {
        let mut slack = self.middle(part, &point.solution).scaled(-1.0);
        (0..slack.rows()).for_each(|place| slack[(place, place)] -= point.margin);
        cholesky(&slack)
    }

    /// R less the sum of all.
    fn left(&self, solution: &Solution) -> f64 {
        let trace = |shape: &Matrix| (0..shape.rows()).map(|place| shape[(place, place)]).sum::<f64>();
        let signed = self.inequality.free.iter().zip(&solution.multipliers).filter(|(free, _)| !**free).map(|(_, multiplier)| multiplier);
        self.bound - solution.shapes.iter().map(trace).sum::<f64>() - signed.sum::<f64>()
    }

    /// Adds what −ln det(−M − t·I) of a part has, with the inverse of its triangle.
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
        // A multiplier that nothing depends on has no second derivative.
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
