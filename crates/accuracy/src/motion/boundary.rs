//! Where the loop turns unstable, as each way of moving predicts it.
//!
//! The matrix of one frame, from one sampling to the next, is made by pushing unit vectors through the loop of [`super::world`]. Its states are the two
//! devices, the two copies, the two samples held, and those on the way. Raising one stiffness K, the boundary is the first K at which an eigenvalue
//! reaches the unit circle: found with the program's numbers by halving, and then as the root of
//!
//! ```text
//! det(M(K) − λ·I) = 0,   λ = (1 − t² + 2t·i)/(1 + t²)
//! ```
//!
//! in the two unknowns K and t = tan(θ/2), by Newton's method with 100 bits, so that the rest of an error is the integrator's and not the solver's.
//! Where it is a real one that reaches the circle, λ is 1 or −1, and K the only unknown.

use cohaptic_peer::{Motion, Number as _, StepMap};
use cohaptic_stability::{Matrix, eigenvalues};
use qd::Quad;

use super::advance::Advance;
use super::number::{Complex, Number, absolute};
use super::scenes::Along;
use super::world::{Loop, Pair, World};

/// The matrix of a frame, row by row.
fn frame<T: Number>(gains: &Loop<T>, movers: &[impl Advance<T>; 4]) -> Vec<Vec<T>> {
    let flying = gains.delay / gains.update;
    let size = 12 + 4 * flying;
    let mut matrix = vec![vec![T::of(0.0); size]; size];
    for column in 0..size {
        let mut world = World::rest(gains);
        *entry(&mut world, column, 0) = T::of(1.0);
        // Samples 0 to flying − 1 are on the way when the frame begins.
        let first = flying * gains.update;
        for tick in first..first + gains.update {
            world.tick(gains, movers, tick, [T::of(0.0); 2]);
        }
        for (row, values) in matrix.iter_mut().enumerate() {
            values[column] = *entry(&mut world, row, 1);
        }
    }
    matrix
}

/// A number of the state: four bodies, two samples held, and the samples on the way from number `first` on.
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

/// The eigenvalue farthest out.
fn outermost(gains: &Loop<f64>, movers: &[StepMap<f64>; 4]) -> Option<Complex<f64>> {
    let rows = frame(gains, movers);
    let matrix = Matrix::from_fn(rows.len(), rows.len(), |row, column| rows[row][column]);
    eigenvalues(&matrix).first().map(|value| Complex { re: value.re, im: value.im })
}

/// det(M − λ·I), by elimination with partial pivoting.
fn determinant(rows: &[Vec<Quad>], eigenvalue: Complex<Quad>) -> Complex<Quad> {
    let size = rows.len();
    let mut matrix: Vec<Vec<Complex<Quad>>> = rows.iter().map(|row| row.iter().map(|entry| Complex::real(*entry)).collect()).collect();
    for (place, row) in matrix.iter_mut().enumerate() {
        row[place] = row[place] - eigenvalue;
    }
    let mut product = Complex::real(Quad::ONE);
    for place in 0..size {
        let mut best = place;
        for row in place + 1..size {
            if matrix[row][place].norm_squared() > matrix[best][place].norm_squared() {
                best = row;
            }
        }
        if best != place {
            matrix.swap(best, place);
            product = Complex::real(-Quad::ONE) * product;
        }
        let (above, below) = matrix.split_at_mut(place + 1);
        let pivot = &above[place];
        product = product * pivot[place];
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

/// The first stiffness within the range at which the loop turns unstable \[N/m\]. `None` if it is unstable at the beginning of the range or nowhere within
/// it.
pub(crate) fn critical(pair: &Pair, (along, low, high): (Along, f64, f64), maps: &[StepMap<Quad>; 4]) -> Option<Quad> {
    let (stiffness, eigenvalue) = rough(pair, (along, low, high), &maps.map(|map| map.map(|coefficient| coefficient.rounded())))?;
    let residue = |stiffness: Quad, eigenvalue: Complex<Quad>| determinant(&frame(&pair.with(along, stiffness), maps), eigenvalue);
    let start = Quad::of(stiffness);
    let root = if eigenvalue.im.abs() < REAL {
        let side = Complex::real(Quad::of(eigenvalue.re.signum()));
        real_root(start, |k| residue(k, side).re)
    } else {
        pair_root(start, Quad::of(eigenvalue.im.abs() / (1.0 + eigenvalue.re)), residue)
    };
    // The root near which the halving ended, and no other.
    root.filter(|root| (root.rounded() / stiffness - 1.0).abs() < 1e-6)
}

/// An eigenvalue that is nearer to the real axis than this is a real one with an error.
const REAL: f64 = 1e-6;
/// The steps that Newton's method takes at most, and the relative step after which it has ended.
const STEPS: u32 = 20;
const ENOUGH: f64 = 1e-26;
/// Slopes are differences over this share, and have as many right digits: so each step adds about as many.
const SHARE: f64 = 1e-15;

/// Where a function of K is zero.
fn real_root(start: Quad, residue: impl Fn(Quad) -> Quad) -> Option<Quad> {
    let mut k = start;
    for _ in 0..STEPS {
        let (here, dk) = (residue(k), k * Quad::of(SHARE));
        let step = here * dk / (residue(k + dk) - here);
        k -= step;
        if absolute(step) < absolute(k) * Quad::of(ENOUGH) {
            return Some(k);
        }
    }
    None
}

/// Where a complex function of K and of λ on the unit circle is zero.
fn pair_root(start: Quad, tangent: Quad, residue: impl Fn(Quad, Complex<Quad>) -> Complex<Quad>) -> Option<Quad> {
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

/// The first stiffness and the eigenvalue, with the program's numbers.
fn rough(pair: &Pair, (along, low, high): (Along, f64, f64), maps: &[StepMap<f64>; 4]) -> Option<(f64, Complex<f64>)> {
    let outermost = |stiffness: f64| outermost(&pair.with(along, stiffness), maps);
    let unstable = |stiffness: f64| outermost(stiffness).is_none_or(|value| value.norm_squared() > 1.0);
    /// Values looked at before any are halved, each this much above the one before.
    const FACTOR: f64 = 1.05;
    let (mut stable, mut beyond) = (low, low);
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

/// The maps of the program in more digits, each coefficient exactly.
pub(crate) fn quadruple(maps: &[StepMap; 4]) -> [StepMap<Quad>; 4] {
    maps.map(|map| map.map(|coefficient| Quad::of(*coefficient)))
}
