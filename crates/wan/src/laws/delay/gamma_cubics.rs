//! Delays of a gamma law in whole nanoseconds, as a function of a standard normal number, by four terms of its series.
//!
//! A delay is rounded. So four terms tell it wherever they lie further from the half between two whole numbers than they may be wrong; for the few numbers
//! next to a half the whole series does.

use alloc::boxed::Box;
use alloc::vec;

use super::GammaLaw;
use super::gamma_map::{DENSITY, RANGE, TERMS};

/// How far four terms may be from the whole series \[ns\]: one delay in five hundred lies so close to a half.
const MARGIN: f64 = 1.0 / 1024.0;
/// How far the sums of a cell may be from the law, relative to it: the series of neighbouring cells differ, and all are rounded.
const ROUNDING: f64 = 1e-12;
/// Numbers of this size and smaller have four terms, or nothing has: others are drawn once in 400 times.
const NEEDED: f64 = 3.0;
const CELLS: usize = 2048;
/// From here on there is no room for a fraction, for numbers of either sign.
const ROOM: f64 = 6_755_399_441_055_744.0;

/// The delays \[ns\] of a law.
#[derive(Clone, Debug)]
pub(crate) struct GammaCubics {
    cells: Box<[[f64; 4]; CELLS]>,
    /// Cells per unit of z.
    density: f64,
}

impl GammaCubics {
    /// No delay, which may be one that takes longer.
    pub(crate) const UNKNOWN: u64 = u64::MAX;

    /// `None` if most delays of the law do not follow from four terms: they are too long, or vary too much.
    pub(super) fn new(law: &GammaLaw) -> Option<Self> {
        [1, 2, 4, 8, 16].into_iter().find_map(|parts| Self::of_parts(law, parts))
    }

    /// With that number of cells in place of one.
    fn of_parts(law: &GammaLaw, parts: u32) -> Option<Self> {
        let whole = f64::from(parts);
        let mut cells = vec![[f64::NAN; 4]; CELLS];
        for (cell, (terms, left)) in law.map.series().enumerate() {
            for part in 0..parts {
                let at = (2.0 * f64::from(part) + 1.0) / whole - 1.0;
                let cubic = cubic(law, terms, (at, 2.0 / whole));
                if cubic.is_none() && (left + f64::from(part) / (whole * DENSITY)).abs() <= NEEDED {
                    return None;
                }
                cells[cell * parts as usize + part as usize] = cubic.unwrap_or([f64::NAN; 4]);
            }
        }
        Some(Self { cells: cells.into_boxed_slice().try_into().ok()?, density: whole * DENSITY })
    }

    /// The delays of several numbers, [`GammaCubics::UNKNOWN`] for those few that take longer, and for a NaN.
    #[inline(always)]
    pub(crate) fn nanos<const N: usize>(&self, z: &[f64; N]) -> [u64; N] {
        let (mut places, mut offsets) = ([0; N], [0.0; N]);
        for ((place, offset), z) in places.iter_mut().zip(&mut offsets).zip(z) {
            let position = z * self.density + (RANGE * self.density - 0.5);
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
            let nearest = delay + ROOM;
            let is_known = (delay - (nearest - ROOM)).abs() < 0.5 - MARGIN;
            *nanos = if is_known { nearest.to_bits().wrapping_sub(ROOM.to_bits()) } else { Self::UNKNOWN };
        }
        nanos
    }
}

/// Four terms around a point of a cell, in units of a width, if they are good enough within half a unit.
fn cubic(law: &GammaLaw, mut terms: [f64; TERMS], (at, width): (f64, f64)) -> Option<[f64; 4]> {
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
    let most = |terms: &[f64], mut share: f64| {
        terms.iter().fold(0.0, |sum, term| {
            share *= 0.5;
            sum + term.abs() * share
        })
    };
    let (varies, left_out) = (most(&terms[1..], 1.0), most(&terms[4..], 0.125));
    let (least, largest) = (terms[0] - varies, terms[0] + varies);
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

    /// Of many numbers, at the edges of cells, and where no cell is. The first laws have the least cells, the others errors that come close to the margin.
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
