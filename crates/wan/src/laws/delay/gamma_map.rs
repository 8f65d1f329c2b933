//! Fast map from a standard normal number to a gamma number, x(z) = P⁻¹(a, Φ(z)).
//!
//! x(z) is smooth, and its Taylor series at any point follows from one exact inverse: x′ = x·v and v′ = v·(−z + (x − a)·v), where v = φ(z)/(x^a·e^(−x)/Γ(a))
//! (the idea is Steinbrecher & Shaw's, *Quantile mechanics*, 2008). A cell of width 1/8 has eleven derivatives. A cell has no series if its next two terms
//! would be visible (small shapes, where x(z) falls off like a power of Φ). In such a cell, and for |z| ≥ 8, the exact inverse is computed. The omitted terms are
//! large there only beside x itself, which is far below the mean, and most [whole delays](super::whole) need no more than a small share of the mean.

use alloc::boxed::Box;

use super::LARGEST_NORMAL;
use super::special::{gamma, gamma_inverse, normal};
use super::tail::Tail;

/// Half of the range of z: cells cover (−RANGE, RANGE).
pub(super) const RANGE: f64 = 8.0;
/// Number of cells per unit of z.
pub(super) const DENSITY: f64 = 8.0;
/// Number of cells, 2·RANGE·DENSITY.
const CELLS: u32 = 128;
/// Number of Taylor coefficients of a cell.
pub(super) const TERMS: usize = 12;
/// Number of terms computed only to bound the error of the kept terms.
const WITNESSES: usize = 2;
/// Largest sum of the omitted terms, relative to x.
const TOLERANCE: f64 = 1e-14;

/// 1.5·2^52. The sum with a smaller number leaves no bits for a fraction.
const ROOM: f64 = 6_755_399_441_055_744.0;
/// Number below which [`GammaMap::nearly`] gives 0: e⁻¹⁰⁰.
const NOTHING: f64 = 3.7e-44;
/// Largest sum of the omitted terms of [`GammaMap::nearly`], as a share of the mean of x.
const NEAR: f64 = 1e-12;

/// Map x(z) of one shape.
#[derive(Clone, Debug)]
pub(super) struct GammaMap {
    shape: f64,
    cells: Box<[Cell; CELLS as usize]>,
    /// Series for [`GammaMap::nearly`], with NaN where a series is not even near. `None` if every cell of `cells` has a series.
    near: Option<Box<[Cell; CELLS as usize]>>,
}

/// Taylor coefficients in units of half a cell, or NaN without an accurate series. Array k, for k from 0 to 3, holds the terms k, k + 4 and k + 8, so vector
/// instructions add three sums at once.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Cell([[f64; 4]; 4]);

impl GammaMap {
    /// Returns the map of one shape, after computing the series of every cell.
    pub(super) fn new(shape: f64) -> Self {
        let centre = |cell: u32| (f64::from(cell) + 0.5) / DENSITY - RANGE;
        let [mut cells, mut near] = [(); 2].map(|()| Box::new([Cell::NONE; CELLS as usize]));
        for ((cell, near), number) in cells.iter_mut().zip(near.iter_mut()).zip(0..) {
            let (terms, omitted) = taylor(shape, centre(number));
            let series = Cell::new(&terms);
            // At t = −1 the increasing series is least, so the bound is relative to the smallest x of the cell. NaN fails both comparisons, so a series with NaN
            // is refused.
            if omitted <= TOLERANCE * series.sum(-1.0) {
                (*cell, *near) = (series, series);
                continue;
            }
            let edge = centre(number) + 0.5 / DENSITY;
            // The mean of x is the shape. In a cell whose right edge has an x near 0, derivatives of x may be beyond the range of numbers.
            if omitted <= NEAR * shape {
                *near = series;
            } else if gamma_inverse::inverse(shape, Tail::of_normal(edge), edge) < NOTHING {
                *near = Cell::new(&[0.0; TERMS]);
            }
        }
        let has_all = cells.iter().all(|cell| !cell.sum(0.0).is_nan());
        Self { shape, cells, near: (!has_all).then_some(near) }
    }

    pub(super) const fn shape(&self) -> f64 {
        self.shape
    }

    /// Returns x(z). NaN and numbers outside of the range of cells take the exact inverse.
    #[inline(always)]
    pub(super) fn at_normal(&self, z: f64) -> f64 {
        let x = sum(&self.cells, z);
        if x.is_nan() { self.exactly(z) } else { x }
    }

    /// Computes x(z) of several numbers with an error below 10⁻¹²·(x(z) + mean of x). NaN without such a series, and in the outermost cells.
    #[inline(always)]
    pub(super) fn nearly<const N: usize>(&self, z: &[f64; N], x: &mut [f64; N]) {
        let cells = self.near.as_ref().unwrap_or(&self.cells);
        let (mut places, mut offsets) = ([0; N], [0.0; N]);
        // Loops instead of `for_each`: the compiler does not inline the fold of a zip, which would then be compiled for narrower registers than the caller's loop.
        for ((place, offset), z) in places.iter_mut().zip(&mut offsets).zip(z) {
            let position = (z + RANGE) * DENSITY - 0.5;
            // The lower bits of `nearest` are the number of the cell, and the remainder is the offset from the cell's centre.
            let nearest = position + ROOM;
            *place = nearest.to_bits();
            *offset = if z.abs() < RANGE - 1.0 / DENSITY { position - (nearest - ROOM) } else { f64::NAN };
        }
        for (x, (place, offset)) in x.iter_mut().zip(places.iter().zip(&offsets)) {
            #[expect(clippy::cast_possible_truncation, reason = "the lower bits are the number of the cell")]
            let cell = &cells[*place as usize % CELLS as usize];
            *x = cell.sum(2.0 * offset);
        }
    }

    /// Returns the terms of each cell, NaN without an accurate series, and the cell's left edge.
    pub(super) fn series(&self) -> impl Iterator<Item = ([f64; TERMS], f64)> {
        self.cells.iter().zip(0..).map(|(cell, number)| (cell.terms(), f64::from(number) / DENSITY - RANGE))
    }

    /// Returns x(z) by the exact inverse.
    #[cold]
    fn exactly(&self, z: f64) -> f64 {
        let z = z.clamp(-LARGEST_NORMAL, LARGEST_NORMAL);
        gamma_inverse::inverse(self.shape, Tail::of_normal(z), z)
    }
}

/// Returns the sum of the series of the cell of z, or NaN without a series and outside of the range of cells.
#[inline(always)]
fn sum(cells: &[Cell; CELLS as usize], z: f64) -> f64 {
    let position = (z + RANGE) * DENSITY;
    #[expect(clippy::cast_possible_truncation, reason = "saturates, to cells that are refused below")]
    let cell = position as i32;
    match cells.get(cell.cast_unsigned() as usize) {
        // Half a cell is the unit of t, so t goes from −1 to 1 over the cell.
        Some(terms) if position >= 0.0 => terms.sum(2.0 * (position - f64::from(cell)) - 1.0),
        Some(_) | None => f64::NAN,
    }
}

impl Cell {
    /// Cell without a series.
    const NONE: Self = Self([[f64::NAN; 4]; 4]);

    /// Returns a cell with the given terms, in ascending order of powers.
    fn new(terms: &[f64; TERMS]) -> Self {
        Self(core::array::from_fn(|k| [terms[k], terms[k + 4], terms[k + 8], 0.0]))
    }

    /// Returns the terms in ascending order of powers.
    fn terms(&self) -> [f64; TERMS] {
        core::array::from_fn(|term| self.0[term % 4][term / 4])
    }

    /// Returns Σ terms·tᵏ for t from −1 to 1, added in pairs and pairs of pairs, with half the latency of Horner's rule.
    #[inline(always)]
    fn sum(&self, t: f64) -> f64 {
        let Self([first, second, third, fourth]) = self;
        let t2 = t * t;
        let t4 = t2 * t2;
        // A loop instead of `from_fn`: the compiler does not inline `from_fn` of an array here.
        let mut fours = [0.0; 4];
        for (i, four) in fours.iter_mut().enumerate() {
            *four = (first[i] + second[i] * t) + (third[i] + fourth[i] * t) * t2;
        }
        fours[0] + (fours[1] + fours[2] * t4) * t4
    }
}

/// Returns the series of x(z) at `z`, and the sum of the omitted terms.
fn taylor(a: f64, z: f64) -> ([f64; TERMS], f64) {
    const ALL: usize = TERMS + WITNESSES;
    let half = 0.5 / DENSITY;
    let first = gamma_inverse::inverse(a, Tail::of_normal(z), z);
    let slope = gamma::incomplete(a, first).slope;
    let (mut x, mut v, mut s) = ([0.0; ALL], [0.0; ALL], [0.0; ALL]);
    // v = φ(z)/(x^a·e^(−x)/Γ(a)), as at the head of this file.
    (x[0], v[0]) = (first, normal::density(z) / slope);
    // s = −z + (x − a)·v.
    let mut excess = x;
    excess[0] = first - a;
    let product = |left: &[f64; ALL], right: &[f64; ALL], n: usize| (0..=n).map(|i| left[i] * right[n - i]).sum::<f64>();
    // Coefficient n + 1 of x and of v follows from the coefficients up to n of the right sides of their differential equations.
    let mut order = 0.0;
    for n in 0..ALL - 1 {
        order += 1.0;
        s[n] = product(&excess, &v, n);
        match n {
            0 => s[0] -= z,
            1 => s[1] -= half,
            _ => {}
        }
        // t is in units of half a cell, so each derivative brings a factor `half`.
        x[n + 1] = half / order * product(&x, &v, n);
        excess[n + 1] = x[n + 1];
        v[n + 1] = half / order * product(&v, &s, n);
    }
    (core::array::from_fn(|n| x[n]), x[TERMS..].iter().map(|term| term.abs()).sum())
}
