//! The gamma law as a function of a standard normal number, x(z) = P⁻¹(a, Φ(z)), quickly.
//!
//! x(z) is smooth, and its Taylor series at any point follows from one exact inverse: x′ = x·v and v′ = v·(−z + (x − a)·v), where
//! v = φ(z)/(x^a·e^(−x)/Γ(a)) (the idea is Steinbrecher & Shaw's, *Quantile mechanics*, 2008). A cell of width 1/8 has eleven derivatives. A cell whose
//! next two terms could be seen (small shapes, where x(z) falls off like a power of Φ) has none, nor has |z| ≥ 8: there the exact inverse answers.

use alloc::boxed::Box;

use super::LARGEST_NORMAL;
use super::special::{gamma, gamma_inverse, normal};
use super::tail::Tail;

/// Cells lie in (−RANGE, RANGE).
pub(super) const RANGE: f64 = 8.0;
/// Cells per unit of z.
pub(super) const DENSITY: f64 = 8.0;
const CELLS: u32 = 128;
pub(super) const TERMS: usize = 12;
/// Terms computed but not kept: they say how good the kept ones are.
const WITNESSES: usize = 2;
/// What the terms left out may add, relative to x.
const TOLERANCE: f64 = 1e-14;

/// x(z) of one shape.
#[derive(Clone, Debug)]
pub(super) struct GammaMap {
    shape: f64,
    cells: Box<[Cell; CELLS as usize]>,
}

/// Taylor coefficients in units of half a cell, NaN where they would not do: terms k, k + 4 and k + 8 lie together for k from 0 to 3, so that three sums are one
/// of registers. It took a third of the instructions off a delay.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Cell([[f64; 4]; 4]);

impl GammaMap {
    pub(super) fn new(shape: f64) -> Self {
        let centre = |cell: u32| (f64::from(cell) + 0.5) / DENSITY - RANGE;
        let mut cells = Box::new([Cell::NONE; CELLS as usize]);
        for (cell, number) in cells.iter_mut().zip(0..) {
            if let Some(terms) = taylor(shape, centre(number)) {
                *cell = Cell::new(&terms);
            }
        }
        Self { shape, cells }
    }

    pub(super) const fn shape(&self) -> f64 {
        self.shape
    }

    #[inline(always)]
    pub(super) fn at_normal(&self, z: f64) -> f64 {
        let position = (z + RANGE) * DENSITY;
        #[expect(clippy::cast_possible_truncation, reason = "saturates, to cells that are refused below")]
        let cell = position as i32;
        if position >= 0.0
            && let Some(terms) = self.cells.get(cell.cast_unsigned() as usize)
        {
            let x = terms.sum(2.0 * (position - f64::from(cell)) - 1.0);
            if !x.is_nan() {
                return x;
            }
        }
        self.exactly(z)
    }

    /// The terms of each cell, NaN where they would not do, and where it begins.
    pub(super) fn series(&self) -> impl Iterator<Item = ([f64; TERMS], f64)> {
        self.cells.iter().zip(0..).map(|(cell, number)| (cell.terms(), f64::from(number) / DENSITY - RANGE))
    }

    #[cold]
    #[inline(never)]
    fn exactly(&self, z: f64) -> f64 {
        let z = z.clamp(-LARGEST_NORMAL, LARGEST_NORMAL);
        gamma_inverse::inverse(self.shape, Tail::of_normal(z), z)
    }
}

impl Cell {
    const NONE: Self = Self([[f64::NAN; 4]; 4]);

    fn new(terms: &[f64; TERMS]) -> Self {
        Self(core::array::from_fn(|k| [terms[k], terms[k + 4], terms[k + 8], 0.0]))
    }

    fn terms(&self) -> [f64; TERMS] {
        core::array::from_fn(|term| self.0[term % 4][term / 4])
    }

    /// Σ terms·tᵏ, in pairs and pairs of pairs: half the latency of Horner's rule.
    #[inline(always)]
    fn sum(&self, t: f64) -> f64 {
        let Self([first, second, third, fourth]) = self;
        let t2 = t * t;
        let t4 = t2 * t2;
        let fours: [f64; 4] = core::array::from_fn(|i| (first[i] + second[i] * t) + (third[i] + fourth[i] * t) * t2);
        fours[0] + (fours[1] + fours[2] * t4) * t4
    }
}

/// The series at `z`, if it is good enough.
fn taylor(a: f64, z: f64) -> Option<[f64; TERMS]> {
    const ALL: usize = TERMS + WITNESSES;
    let half = 0.5 / DENSITY;
    let first = gamma_inverse::inverse(a, Tail::of_normal(z), z);
    let slope = gamma::incomplete(a, first).slope;
    let (mut x, mut v, mut s) = ([0.0; ALL], [0.0; ALL], [0.0; ALL]);
    (x[0], v[0]) = (first, normal::density(z) / slope);
    // s = −z + (x − a)·v.
    let mut excess = x;
    excess[0] = first - a;
    let product = |left: &[f64; ALL], right: &[f64; ALL], n: usize| (0..=n).map(|i| left[i] * right[n - i]).sum::<f64>();
    let mut order = 0.0;
    for n in 0..ALL - 1 {
        order += 1.0;
        s[n] = product(&excess, &v, n);
        match n {
            0 => s[0] -= z,
            1 => s[1] -= half,
            _ => {}
        }
        x[n + 1] = half / order * product(&x, &v, n);
        excess[n + 1] = x[n + 1];
        v[n + 1] = half / order * product(&v, &s, n);
    }
    let mut terms = [0.0; TERMS];
    terms.copy_from_slice(&x[..TERMS]);
    let witnesses: f64 = x[TERMS..].iter().map(|term| term.abs()).sum();
    // A NaN is no witness.
    (witnesses <= TOLERANCE * Cell::new(&terms).sum(-1.0)).then_some(terms)
}
