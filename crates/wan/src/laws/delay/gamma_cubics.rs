//! Delays of a gamma law in whole nanoseconds, as a function of a standard normal number, by four terms of its series.
//!
//! A delay is rounded. Four terms therefore suffice wherever the delay is further from the half between two whole numbers than the error of four terms. For
//! the few delays next to a half, the caller computes the whole series.

use alloc::boxed::Box;
use alloc::vec;

use super::GammaLaw;
use super::gamma_map::{DENSITY, RANGE, TERMS};

/// Largest error of four terms \[ns\], compared with the whole series. One delay in five hundred is so close to a half.
const MARGIN: f64 = 1.0 / 1024.0;
/// Largest relative error of a cell's sum, compared with the law: series of neighbouring cells differ, and all sums are rounded.
const ROUNDING: f64 = 1e-12;
/// Size up to which every number must have four terms; otherwise the law has no cubics. Larger numbers are drawn once in 400 times.
const NEEDED: f64 = 3.0;
/// Number of cells. A power of two, because a cell's number is taken from the lower bits of a sum.
const CELLS: usize = 2048;
/// 1.5·2^52. The sum with a number of either sign leaves no bits for a fraction.
const ROOM: f64 = 6_755_399_441_055_744.0;

/// Delays \[ns\] of a law by four terms.
#[derive(Clone, Debug)]
pub(crate) struct GammaCubics {
    /// Four terms per cell, in ascending order of powers, or NaN where four terms are not accurate enough.
    cells: Box<[[f64; 4]; CELLS]>,
    /// Number of cells per unit of z.
    density: f64,
}

impl GammaCubics {
    /// Mark of a delay beyond four terms.
    pub(crate) const UNKNOWN: u64 = u64::MAX;

    /// Returns the cubics of a law, or `None` if most delays of the law do not follow from four terms, because the delays are too long or vary too much.
    /// Takes the widest cells with enough accuracy.
    pub(super) fn new(law: &GammaLaw) -> Option<Self> {
        [1, 2, 4, 8, 16].into_iter().find_map(|parts| Self::of_parts(law, parts))
    }

    /// Returns the cubics with `parts` cells in place of each cell of the map.
    fn of_parts(law: &GammaLaw, parts: u32) -> Option<Self> {
        let whole = f64::from(parts);
        let mut cells = vec![[f64::NAN; 4]; CELLS];
        for (cell, (terms, left)) in law.map.series().enumerate() {
            for part in 0..parts {
                // Centre of the part in the coordinates of the cell, from −1 to 1.
                let at = (2.0 * f64::from(part) + 1.0) / whole - 1.0;
                let cubic = cubic(law, terms, (at, 2.0 / whole));
                // A missing cubic in the usual range would make the slow way the usual way.
                if cubic.is_none() && (left + f64::from(part) / (whole * DENSITY)).abs() <= NEEDED {
                    return None;
                }
                cells[cell * parts as usize + part as usize] = cubic.unwrap_or([f64::NAN; 4]);
            }
        }
        Some(Self { cells: cells.into_boxed_slice().try_into().ok()?, density: whole * DENSITY })
    }

    /// Returns the delays of several numbers, or [`GammaCubics::UNKNOWN`] for the few delays that need the whole series, and for NaN.
    #[inline(always)]
    pub(crate) fn nanos<const N: usize>(&self, z: &[f64; N]) -> [u64; N] {
        let (mut places, mut offsets) = ([0; N], [0.0; N]);
        for ((place, offset), z) in places.iter_mut().zip(&mut offsets).zip(z) {
            let position = z * self.density + (RANGE * self.density - 0.5);
            // The lower bits of `nearest` are the number of the cell, and the remainder is the offset from the cell's centre.
            let nearest = position + ROOM;
            let has_cell = z.abs() < RANGE - 1.0 / DENSITY;
            *offset = if has_cell { position - (nearest - ROOM) } else { f64::NAN };
            *place = nearest.to_bits();
        }
        let mut nanos = [0; N];
        for (nanos, (place, t)) in nanos.iter_mut().zip(places.iter().zip(&offsets)) {
            #[expect(clippy::cast_possible_truncation, reason = "the lower bits are the number of the cell")]
            let [a, b, c, d] = self.cells[*place as usize % CELLS];
            let delay = (a + b * t) + (c + d * t) * (t * t);
            // A delay within the margin of a half could be rounded the other way by the whole series. NaN is unknown, because its comparison fails.
            let nearest = delay + ROOM;
            let is_known = (delay - (nearest - ROOM)).abs() < 0.5 - MARGIN;
            *nanos = if is_known { nearest.to_bits().wrapping_sub(ROOM.to_bits()) } else { Self::UNKNOWN };
        }
        nanos
    }
}

/// Returns four terms around a point of a cell, in units of a width, or `None` if their error can exceed [`MARGIN`] within half a unit.
fn cubic(law: &GammaLaw, mut terms: [f64; TERMS], (at, width): (f64, f64)) -> Option<[f64; 4]> {
    // Shifts the polynomial to the point `at` by repeated Horner steps.
    for first in 0..TERMS {
        for term in (first..TERMS - 1).rev() {
            terms[term] += at * terms[term + 1];
        }
    }
    let mut unit = law.scale;
    for term in &mut terms {
        *term *= unit;
        unit *= width;
    }
    terms[0] += law.origin;
    // |t| is at most ½, so term k contributes at most |term|/2^k.
    let most = |terms: &[f64], mut share: f64| {
        terms.iter().fold(0.0, |sum, term| {
            share *= 0.5;
            sum + term.abs() * share
        })
    };
    let (varies, left_out) = (most(&terms[1..], 1.0), most(&terms[4..], 0.125));
    let (least, largest) = (terms[0] - varies, terms[0] + varies);
    // A delay below the floor would have to be raised, and above 10^15 ns the sum leaves too few bits for the margin.
    let is_good = left_out + ROUNDING * largest <= MARGIN && least >= law.floor && largest < 1e15;
    is_good.then(|| [terms[0], terms[1], terms[2], terms[3]])
}

#[cfg(test)]
mod tests {
    use super::super::{Distribution, Law};
    use super::*;
    use crate::random::{Purpose, Stream, unit};

    fn gamma(mean: f64, sd: f64, floor: f64) -> GammaLaw {
        Law::new(&Distribution::Gamma, mean, sd, Some(floor)).unwrap().as_gamma().unwrap()
    }

    /// Compares delays of many numbers, at the edges of cells, and where no cell is. The first laws have the fewest cells, and the others have errors close
    /// to the margin.
    #[test]
    fn delays_are_those_of_the_whole_series() {
        let edges = (-1024..=1024).map(|edge| f64::from(edge) / 128.0).flat_map(|edge| [edge.next_down(), edge, edge.next_up()]);
        let drawn = (0..100_000).map(|number| 16.0 * unit(Stream::new(7, b"cubics").packet(number).first(Purpose::Jitter)) - 8.0);
        let numbers: Vec<f64> = edges.chain(drawn).chain([-1e300, -9.0, 9.0, 1e9, 1e300, f64::INFINITY, f64::NEG_INFINITY]).collect();
        for (mean, sd, floor) in [(24e6, 2e6, 0.0), (24e6, 2e6, 20e6), (1e6, 1e4, 0.0), (20e6, 20e6, 0.0), (500e6, 100e6, 0.0), (90e6, 80e6, 10e6)] {
            let law = gamma(mean, sd, floor);
            let cubics = law.cubics().unwrap();
            let (mut known, mut usual) = (0, 0);
            for numbers in numbers.chunks_exact(4) {
                let numbers: [f64; 4] = std::array::from_fn(|place| numbers[place]);
                for (z, nanos) in numbers.into_iter().zip(cubics.nanos(&numbers)) {
                    let is_usual = z.abs() < NEEDED;
                    usual += u32::from(is_usual);
                    if nanos != GammaCubics::UNKNOWN {
                        known += u32::from(is_usual);
                        assert_eq!(nanos, libm::rint(law.at_normal(z)) as u64, "{z} around {mean} ± {sd}");
                    }
                }
            }
            assert!(f64::from(known) > 0.99 * f64::from(usual), "{known} of {usual} around {mean} ± {sd}");
            assert_eq!(cubics.nanos(&[f64::NAN, 8.1, -8.1, f64::INFINITY]), [GammaCubics::UNKNOWN; 4]);
        }
    }

    #[test]
    fn delays_of_seconds_and_those_that_vary_most_take_the_whole_series() {
        for (mean, sd) in [(5e9, 1e9), (24e6, 240e6)] {
            assert!(gamma(mean, sd, 0.0).cubics().is_none(), "{mean} ± {sd}");
        }
    }
}
