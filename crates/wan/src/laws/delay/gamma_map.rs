//! Fast map from a standard normal number to a gamma number, x(z) = P⁻¹(a, Φ(z)).
//!
//! x(z) is smooth, and its Taylor series at any point follows from one exact inverse: x′ = x·v and v′ = v·(−z + (x − a)·v), where v = φ(z)/(x^a·e^(−x)/Γ(a))
//! (the idea is Steinbrecher & Shaw's, *Quantile mechanics*, 2008). A cell of width 1/8 has eleven derivatives. A cell has no series if its next two terms
//! would be visible (small shapes, where x(z) falls off like a power of Φ). In such a cell, and for |z| ≥ 8, the exact inverse is computed. The series of
//! ln x(z), with (ln x)′ = v, is accurate there too, and gives x(z) to twelve digits, which most [whole delays](super::whole) need.

use alloc::boxed::Box;

use super::LARGEST_NORMAL;
use super::special::{gamma, gamma_inverse, normal};
use super::tail::Tail;
use super::whole::exp_nearly;

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

/// Number below which [`GammaMap::nearly`] gives 0: e⁻¹⁰⁰.
const NOTHING: f64 = 3.7e-44;
/// Largest sum of the omitted terms of ln x.
const NEAR: f64 = 1e-13;

/// Map x(z) of one shape.
#[derive(Clone, Debug)]
pub(super) struct GammaMap {
    shape: f64,
    cells: Box<[Cell; CELLS as usize]>,
    /// Series of ln x(z), with NaN where a series is not accurate. `None` if every cell has a series of x(z).
    logarithms: Option<Box<[Cell; CELLS as usize]>>,
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
        let [mut cells, mut logarithms] = [(); 2].map(|()| Box::new([Cell::NONE; CELLS as usize]));
        for ((cell, logarithm), number) in cells.iter_mut().zip(logarithms.iter_mut()).zip(0..) {
            let series = taylor(shape, centre(number));
            *cell = series.x.map_or(Cell::NONE, |terms| Cell::new(&terms));
            *logarithm = series.logarithm.map_or(Cell::NONE, |terms| Cell::new(&terms));
            // In a cell whose right edge has an x near 0, the logarithm of x may be beyond the range of numbers.
            let edge = centre(number) + 0.5 / DENSITY;
            if series.logarithm.is_none() && gamma_inverse::inverse(shape, Tail::of_normal(edge), edge) < NOTHING {
                *logarithm = Cell::new(&core::array::from_fn(|n| if n == 0 { -1000.0 } else { 0.0 }));
            }
        }
        let has_all = cells.iter().all(|cell| !cell.sum(0.0).is_nan());
        Self { shape, cells, logarithms: (!has_all).then_some(logarithms) }
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

    /// Computes x(z) of several numbers with a relative error below 10⁻¹², or as 0 if x(z) is below e⁻¹⁰⁰. NaN without an accurate series.
    #[inline(always)]
    pub(super) fn nearly<const N: usize>(&self, z: &[f64; N], x: &mut [f64; N]) {
        // The logarithm has a series in every cell in which x has a series, so that only one sum is needed.
        let Some(logarithms) = &self.logarithms else {
            return x.iter_mut().zip(z).for_each(|(x, z)| *x = sum(&self.cells, *z));
        };
        x.iter_mut().zip(z).for_each(|(x, z)| *x = sum(logarithms, *z));
        for x in x {
            *x = if *x < -100.0 { 0.0 } else { exp_nearly(*x) };
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

/// Terms of the series of x(z) and of ln x(z) at one point, each `None` if the series is not accurate enough.
struct Series {
    x: Option<[f64; TERMS]>,
    logarithm: Option<[f64; TERMS]>,
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

/// Returns the series at `z`.
fn taylor(a: f64, z: f64) -> Series {
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
    let omitted = |series: &[f64; ALL]| series[TERMS..].iter().map(|term| term.abs()).sum::<f64>();
    let kept = |series: &[f64; ALL]| core::array::from_fn(|n| series[n]);
    let (terms, mut logarithm) = (kept(&x), [0.0; ALL]);
    logarithm[0] = libm::log(first);
    let mut order = 0.0;
    for n in 0..ALL - 1 {
        order += 1.0;
        logarithm[n + 1] = half / order * v[n];
    }
    Series {
        // At t = −1 the increasing series is least, so the bound is relative to the smallest x of the cell. NaN fails the comparison, so a series with NaN is
        // refused.
        x: (omitted(&x) <= TOLERANCE * Cell::new(&terms).sum(-1.0)).then_some(terms),
        // An absolute error of the logarithm is a relative error of x.
        logarithm: (omitted(&logarithm) <= NEAR).then(|| kept(&logarithm)),
    }
}
