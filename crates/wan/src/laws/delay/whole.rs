//! Delays in whole nanoseconds, for laws whose delays take long to compute to the last digit.
//!
//! A delay of a link is rounded to a nanosecond. A delay with a small error therefore suffices wherever the delay is further than the error from the half between
//! two whole numbers. For the few other delays, the caller computes the delay itself and rounds it, so that the answer is the same in every case.

use super::Law;
use super::standard::Standard;

/// Bounds of the errors of lognormal and of gamma delays, as a share of the sum of delay and mean: at least twice the errors of the exponential and of the series.
/// A bound is relative, because the exact inverse of a gamma law takes as long as many packets: of delays around 10 ms, one in ten thousand is within the bound
/// of a half.
const ERRORS: [f64; 2] = [4e-14, 4e-12];
/// 1.5·2^52. The sum with a smaller number leaves no bits for a fraction.
const ROOM: f64 = 6_755_399_441_055_744.0;

impl Law {
    /// Mark of a delay that is not certain without computing the delay itself.
    pub(crate) const UNKNOWN: u64 = u64::MAX;

    /// Returns [`Law::at_normal`] of several numbers, rounded to whole numbers, with [`Law::UNKNOWN`] where the whole number is not certain without computing the
    /// delay itself. The law is in nanoseconds. One step at a time for all numbers, so that a processor computes several of them together.
    #[inline(always)]
    pub(crate) fn whole_at_normals<const N: usize>(&self, z: &[f64; N]) -> [u64; N] {
        let Some((delays, error)) = self.nearly_at_normals(z) else { return [Self::UNKNOWN; N] };
        let mut nanos = [0; N];
        for (nanos, delay) in nanos.iter_mut().zip(&delays) {
            let nearest = delay + ROOM;
            // A NaN fails the comparison, and so does each delay that is too long for `ROOM`, because its error exceeds a half.
            let is_certain = (delay - (nearest - ROOM)).abs() < 0.5 - error * (delay + self.asked.mean);
            *nanos = if is_certain { nearest.to_bits().wrapping_sub(ROOM.to_bits()) } else { Self::UNKNOWN };
        }
        nanos
    }

    /// Returns [`Law::at_normal`] of several numbers, or NaN without an accurate series, and a bound: errors are below half of the bound, as shares of the sum of
    /// delay and mean. Returns `None` for a law that is not computed from a normal number.
    #[inline(always)]
    fn nearly_at_normals<const N: usize>(&self, z: &[f64; N]) -> Option<([f64; N], f64)> {
        let mut delays = [0.0; N];
        let error = match &self.fit.standard {
            Standard::LogNormal { sigma } => {
                for (x, z) in delays.iter_mut().zip(z) {
                    *x = exp_nearly(sigma * z);
                }
                ERRORS[0]
            }
            Standard::Gamma(map) => {
                map.nearly(z, &mut delays);
                ERRORS[1]
            }
            Standard::Constant
            | Standard::Normal
            | Standard::Uniform
            | Standard::Pareto
            | Standard::ParetoNormal
            | Standard::Laplace
            | Standard::Weibull { .. }
            | Standard::Empirical(_)
            | Standard::Table(_) => return None,
        };
        for x in &mut delays {
            *x = self.fit.origin + self.fit.scale * *x;
        }
        Some((delays, error))
    }

    /// Returns [`Law::at_normal`], rounded to a whole number, or `None` where that is not certain without computing the delay itself. The law is in
    /// nanoseconds.
    #[inline(always)]
    pub(crate) fn whole_at_normal(&self, z: f64) -> Option<u64> {
        let [nanos] = self.whole_at_normals(&[z]);
        (nanos != Self::UNKNOWN).then_some(nanos)
    }
}

/// 2^(n/16) for n from 0 to 15.
const ROOTS: [f64; 16] = [
    1.0,
    1.044_273_782_427_413_8,
    1.090_507_732_665_257_7,
    1.138_788_634_756_691_6,
    1.189_207_115_002_721,
    1.241_857_812_073_484,
    1.296_839_554_651_009_6,
    1.354_255_546_936_892_7,
    core::f64::consts::SQRT_2,
    1.476_826_145_939_499_3,
    1.542_210_825_407_940_7,
    1.610_490_331_949_254_3,
    1.681_792_830_507_429,
    1.756_252_160_373_299_5,
    1.834_008_086_409_342_4,
    1.915_206_561_397_147_4,
];

/// Returns eˣ with a relative error below 10⁻¹⁴, or NaN beyond ±700.
#[inline(always)]
fn exp_nearly(x: f64) -> f64 {
    // ln 2/16 in two parts. The upper part has so few bits that its product with k is exact.
    const STEP_HIGH: f64 = 0.043_321_697_041_392_326;
    const STEP_LOW: f64 = 1.743_604_255_483_596_6e-9;
    const STEPS_A_UNIT: f64 = 23.083_120_654_223_414;
    // x = k·ln 2/16 + r, where |r| is at most 0.022.
    let sum = x * STEPS_A_UNIT + ROOM;
    let k = sum - ROOM;
    let r = (x - k * STEP_HIGH) - k * STEP_LOW;
    let r2 = r * r;
    // The first omitted term of the series is below 10⁻¹⁵. Pairs are added first, with less latency than Horner's rule.
    let series = ((1.0 + r) + (1.0 / 2.0 + r * (1.0 / 6.0)) * r2) + ((1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0)) * (r2 * r2);
    // The lower bits of `sum` hold k, whose upper part is added to the exponent of a number between ½ and 4.
    let k = sum.to_bits().wrapping_sub(ROOM.to_bits()).cast_signed();
    #[expect(clippy::cast_sign_loss, reason = "from 0 to 15")]
    let root = ROOTS[(k & 15) as usize];
    let power = f64::from_bits((root * series).to_bits().wrapping_add((k >> 4).cast_unsigned() << 52));
    // A NaN fails the comparison.
    if x.abs() < 700.0 { power } else { f64::NAN }
}

#[cfg(test)]
mod tests {
    use super::super::Distribution;
    use super::*;
    use crate::random::{Purpose, Stream, unit};

    #[test]
    fn the_exponential_is_near_the_exact_one() {
        let drawn = (0..200_000).map(|number| 1400.0 * unit(Stream::new(3, b"exp").packet(number).first(Purpose::Jitter)) - 700.0);
        let small = (0..2_000).map(|number| f64::from(number - 1_000) / 1_000.0);
        for x in drawn.chain(small).chain([0.0, 699.9, -699.9]) {
            let error = exp_nearly(x) / libm::exp(x) - 1.0;
            assert!(error.abs() < 1e-14, "{x}: {error:e}");
        }
        for x in [f64::NAN, 700.0, -700.0, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(exp_nearly(x).is_nan(), "{x}");
        }
    }

    /// Delays of lognormal and gamma laws of all widths, the narrowest and the widest among them, over the whole range of normal numbers.
    #[test]
    fn whole_delays_are_rounded_delays() {
        let numbers: Vec<f64> =
            (0..200_000).map(|number| 17.0 * unit(Stream::new(7, b"whole").packet(number).first(Purpose::Jitter)) - 8.5).collect();
        for (distribution, mean, sd, floor, usual) in [
            (Distribution::LogNormal, 44.3e6, 98.89e6, 1.5e6, 0.98),
            (Distribution::LogNormal, 24e6, 2e6, 20e6, 0.99),
            (Distribution::LogNormal, 24e6, 2e9, 0.0, 0.9),
            (Distribution::Gamma, 11.35e6, 6.3e6, 9.95e6, 0.99),
            (Distribution::Gamma, 24e6, 2e6, 0.0, 0.99),
            // No series is accurate where x(z) rises from nothing: between 2.7 and 4, where 0.3 % of the numbers are.
            (Distribution::Gamma, 24e6, 2.4e9, 0.0, 0.93),
            (Distribution::Gamma, 20e6, 20e6, 0.0, 0.99),
        ] {
            let law = Law::new(&distribution, mean, sd, Some(floor)).unwrap();
            let (mut known, mut all) = (0, 0);
            for z in numbers.iter().copied().chain([-40.0, 40.0, f64::NAN]) {
                let (delay, found) = (law.at_normal(z), law.whole_at_normal(z));
                if let Some(found) = found {
                    assert_eq!(found, libm::rint(delay) as u64, "{z} around {mean} ± {sd}");
                }
                // A delay within half of the bound of a half is too rare to be drawn, so that the error itself is compared. Numbers beyond ±37.5 are never drawn.
                let ([nearly], bound) = law.nearly_at_normals(&[z]).unwrap();
                assert!(
                    nearly.is_nan() || z.abs() > 37.5 || (nearly - delay).abs() <= 0.5 * bound * (delay + mean),
                    "{nearly}, {delay} around {mean} ± {sd}"
                );
                let is_usual = z.abs() < 3.0;
                (known, all) = (known + u32::from(is_usual && found.is_some()), all + u32::from(is_usual));
            }
            assert!(f64::from(known) > usual * f64::from(all), "{known} of {all} around {mean} ± {sd}");
            // Numbers together have the delays of numbers alone.
            for z in numbers.chunks_exact(8) {
                let z: &[f64; 8] = z.try_into().unwrap();
                assert_eq!(law.whole_at_normals(z), z.map(|z| law.whole_at_normal(z).unwrap_or(Law::UNKNOWN)));
            }
            assert_eq!(law.whole_at_normals(&[f64::NAN, 40.0, -40.0])[0], Law::UNKNOWN);
        }
        assert_eq!(Law::new(&Distribution::Pareto, 24e6, 2e6, None).unwrap().whole_at_normal(0.0), None);
    }
}
