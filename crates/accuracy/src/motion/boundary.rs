//! Boundary of stability of the loop, as predicted by each method of motion.
//!
//! The matrix of one frame, from one sampling to the next, is made by pushing unit vectors through the loop of [`super::world`]. Its states are the two
//! devices, the two copies, the two held samples, and the samples on the way. The boundary is the first stiffness K at which an eigenvalue reaches the unit
//! circle. It is found with doubles by bisection, and then as the root of
//!
//! ```text
//! det(M(K) − λ·I) = 0,   λ = (1 − t² + 2t·i)/(1 + t²)
//! ```
//!
//! in the two unknowns K and t = tan(θ/2), by Newton's method with 100 bits, so that the remaining error belongs to the integrator and not to the solver. If
//! a real eigenvalue reaches the circle, λ is 1 or −1, and K is the only unknown.

use cohaptic_peer::{Motion, Number as _, StepMap};
use cohaptic_stability::{Matrix, eigenvalues};
use qd::Quad;

use super::advance::Advance;
use super::number::{Complex, Number, absolute};
use super::scenes::Along;
use super::world::{Loop, Pair, World};

/// Returns the matrix of a frame, row by row.
fn frame<T: Number>(gains: &Loop<T>, movers: &[impl Advance<T>; 4]) -> Vec<Vec<T>> {
    let flying = gains.delay / gains.update;
    let size = 12 + 4 * flying;
    let mut matrix = vec![vec![T::of(0.0); size]; size];
    for column in 0..size {
        let mut world = World::rest(gains);
        *entry(&mut world, column, 0) = T::of(1.0);
        // Samples 0 to flying − 1 are on the way at the begin of the frame.
        let first = flying * gains.update;
        for tick in first..first + gains.update {
            world.tick(gains, movers, tick, [T::of(0.0); 2]);
        }
        // At the end of the frame, samples 1 to flying are on the way.
        for (row, values) in matrix.iter_mut().enumerate() {
            values[column] = *entry(&mut world, row, 1);
        }
    }
    matrix
}

/// Returns a component of the state: four bodies, two held samples, and the samples on the way from number `first` on, each with position and velocity.
fn entry<T>(world: &mut World<T>, number: usize, first: usize) -> &mut T {
    let (whose, which) = (number / 2, number % 2);
    let places = world.sent.len();
    let body: &mut Motion<T> = match whose {
        0..4 => &mut world.bodies[whose],
        4..6 => &mut world.held[whose - 4],
        _ => &mut world.sent[(first + (whose - 6) / 2) % places][(whose - 6) % 2],
    };
    if which == 0 { &mut body.position } else { &mut body.velocity }
}

/// Returns the eigenvalue with the largest modulus.
fn outermost(gains: &Loop<f64>, movers: &[StepMap<f64>; 4]) -> Option<Complex<f64>> {
    let rows = frame(gains, movers);
    let matrix = Matrix::from_fn(rows.len(), rows.len(), |row, column| rows[row][column]);
    eigenvalues(&matrix).first().map(|value| Complex { re: value.re, im: value.im })
}

/// Returns det(M − λ·I), by elimination with partial pivoting.
fn determinant(rows: &[Vec<Quad>], eigenvalue: Complex<Quad>) -> Complex<Quad> {
    let size = rows.len();
    let mut matrix: Vec<Vec<Complex<Quad>>> = rows.iter().map(|row| row.iter().map(|entry| Complex::real(*entry)).collect()).collect();
    for (place, row) in matrix.iter_mut().enumerate() {
        // The diagonal of M − λ·I.
        row[place] = row[place] - eigenvalue;
    }
    let mut product = Complex::real(Quad::ONE);
    for place in 0..size {
        // The largest pivot limits the growth of rounding errors.
        let mut best = place;
        for row in place + 1..size {
            if matrix[row][place].norm_squared() > matrix[best][place].norm_squared() {
                best = row;
            }
        }
        // A swap of rows changes the sign of the determinant.
        if best != place {
            matrix.swap(best, place);
            product = Complex::real(-Quad::ONE) * product;
        }
        let (above, below) = matrix.split_at_mut(place + 1);
        let pivot = &above[place];
        product = product * pivot[place];
        // The whole column is zero, and so is the determinant.
        if pivot[place].norm_squared() == Quad::ZERO {
            return product;
        }
        for row in below {
            let factor = row[place] / pivot[place];
            for (entry, from) in row.iter_mut().zip(pivot).skip(place + 1) {
                *entry = *entry - factor * *from;
            }
        }
    }
    product
}

/// Returns the first stiffness within the range at which the loop becomes unstable \[N/m\]. `None` if the loop is unstable at the begin of the range, or
/// stable in the whole range.
pub(crate) fn critical(pair: &Pair, (along, low, high): (Along, f64, f64), maps: &[StepMap<Quad>; 4]) -> Option<Quad> {
    // The search with doubles gives a start in the neighbourhood of the first boundary.
    let (stiffness, eigenvalue) = rough(pair, (along, low, high), &maps.map(|map| map.map(|coefficient| coefficient.rounded())))?;
    let residue = |stiffness: Quad, eigenvalue: Complex<Quad>| determinant(&frame(&pair.with(along, stiffness), maps), eigenvalue);
    let start = Quad::of(stiffness);
    let root = if eigenvalue.im.abs() < REAL {
        let side = Complex::real(Quad::of(eigenvalue.re.signum()));
        real_root(start, |k| residue(k, side).re)
    } else {
        pair_root(start, Quad::of(eigenvalue.im.abs() / (1.0 + eigenvalue.re)), residue)
    };
    // Newton's method may converge to another root, which is not the first boundary.
    root.filter(|root| (root.rounded() / stiffness - 1.0).abs() < 1e-6)
}

/// Distance from the real axis below which an eigenvalue counts as real with a rounding error.
const REAL: f64 = 1e-6;
/// Greatest number of steps of Newton's method.
const STEPS: u32 = 20;
/// Relative step below which Newton's method has converged.
const ENOUGH: f64 = 1e-26;
/// Relative step of the difference quotients for slopes. A slope has about as many correct digits as this step, and so has the gain of a Newton step.
const SHARE: f64 = 1e-15;

/// Returns the zero of a function of K.
fn real_root(start: Quad, residue: impl Fn(Quad) -> Quad) -> Option<Quad> {
    let mut k = start;
    for _ in 0..STEPS {
        let (here, dk) = (residue(k), k * Quad::of(SHARE));
        // Secant over a tiny step: with 100 bits the difference quotient has about 15 correct digits.
        let step = here * dk / (residue(k + dk) - here);
        k -= step;
        if absolute(step) < absolute(k) * Quad::of(ENOUGH) {
            return Some(k);
        }
    }
    None
}

/// Returns the K at which a complex function of K and of λ on the unit circle is zero.
fn pair_root(start: Quad, tangent: Quad, residue: impl Fn(Quad, Complex<Quad>) -> Complex<Quad>) -> Option<Quad> {
    // λ = (1 − t² + 2t·i)/(1 + t²) stays on the unit circle for every real t.
    let residue = |k: Quad, t: Quad| {
        let (square, one) = (t * t, Quad::ONE);
        residue(k, Complex { re: (one - square) / (one + square), im: (t + t) / (one + square) })
    };
    let (mut k, mut t) = (start, tangent);
    for _ in 0..STEPS {
        let here = residue(k, t);
        let (dk, dt) = (k * Quad::of(SHARE), t * Quad::of(SHARE));
        let slope = |there: Complex<Quad>, step: Quad| Complex { re: (there.re - here.re) / step, im: (there.im - here.im) / step };
        let (by_k, by_t) = (slope(residue(k + dk, t), dk), slope(residue(k, t + dt), dt));
        // Cramer's rule for the two real equations of the complex function.
        let area = by_k.re * by_t.im - by_k.im * by_t.re;
        let step = (here.re * by_t.im - here.im * by_t.re) / area;
        t -= (by_k.re * here.im - by_k.im * here.re) / area;
        k -= step;
        if absolute(step) < absolute(k) * Quad::of(ENOUGH) {
            return Some(k);
        }
    }
    None
}

/// Returns the first stiffness and its eigenvalue, with doubles.
fn rough(pair: &Pair, (along, low, high): (Along, f64, f64), maps: &[StepMap<f64>; 4]) -> Option<(f64, Complex<f64>)> {
    let outermost = |stiffness: f64| outermost(&pair.with(along, stiffness), maps);
    let unstable = |stiffness: f64| outermost(stiffness).is_none_or(|value| value.norm_squared() > 1.0);
    /// Ratio of neighbouring values of the search for an interval with a boundary.
    const FACTOR: f64 = 1.05;
    let (mut stable, mut beyond) = (low, low);
    // Steps of 5 % find the first boundary, unless a stable or unstable range is narrower than a step.
    while !unstable(beyond) {
        if beyond >= high {
            return None;
        }
        stable = beyond;
        beyond = (beyond * FACTOR).min(high);
    }
    if beyond <= low {
        return None;
    }
    // Sixty halvings of an interval of 5 % end at neighbouring doubles.
    for _ in 0..60 {
        let middle = 0.5 * (stable + beyond);
        if unstable(middle) {
            beyond = middle;
        } else {
            stable = middle;
        }
    }
    Some((beyond, outermost(beyond)?))
}

/// Returns the maps of the program in more digits, each coefficient exactly.
pub(crate) fn quadruple(maps: &[StepMap; 4]) -> [StepMap<Quad>; 4] {
    maps.map(|map| map.map(|coefficient| Quad::of(*coefficient)))
}
