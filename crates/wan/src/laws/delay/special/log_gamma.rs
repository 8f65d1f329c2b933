//! Logarithm of Γ(1 + a), accurate also for small a.

/// Returns ln Γ(1 + a) for a > −1. The relative error is about 10⁻¹⁶ also for small a, where `lgamma(1 + a)` loses digits by rounding its argument.
pub(in crate::laws::delay) fn log_gamma_1p(a: f64) -> f64 {
    // ln Γ(1 + a) = −γ·a + Σ ζ(k)·(−a)^k/k (DLMF 5.7.3).
    if a.abs() > 0.125 { libm::lgamma(1.0 + a) } else { -EULER * a + series(a, |_| 1.0) }
}

/// Returns ln Γ(1 + 2t) − 2·ln Γ(1 + t) for t > 0, which is ln(1 + CV²) of a Weibull law of shape 1/t. The terms linear in t cancel in the series.
pub(in crate::laws::delay) fn log_gamma_ratio(t: f64) -> f64 {
    // f(2^k) = 2^k − 2 joins both series, so the terms linear in t are never computed.
    if t > 0.125 { libm::lgamma(1.0 + 2.0 * t) - 2.0 * libm::lgamma(1.0 + t) } else { series(t, |two_to_k| two_to_k - 2.0) }
}

/// Returns Σ ζ(k)·(−a)^k·f(2^k)/k over k ≥ 2 (DLMF 5.7.3), where `factor` is f. For |a| ≤ 1/8 and f(2^k) ≤ 2^k the first omitted term is below 10⁻¹⁹ of the
/// first term.
fn series(a: f64, factor: impl Fn(f64) -> f64) -> f64 {
    let (mut power, mut two_to_k, mut k, mut sum) = (-a, 2.0, 1.0, 0.0);
    for zeta in ZETA {
        // `power` becomes (−a)^k.
        (power, two_to_k, k) = (-a * power, 2.0 * two_to_k, k + 1.0);
        sum += zeta * power * factor(two_to_k) / k;
    }
    sum
}

/// Euler's γ.
const EULER: f64 = 0.577_215_664_901_532_9;

/// ζ(2), ζ(3), …
const ZETA: [f64; 32] = [
    1.644_934_066_848_226_4,
    1.202_056_903_159_594_2,
    1.082_323_233_711_138_1,
    1.036_927_755_143_37,
    1.017_343_061_984_449_2,
    1.008_349_277_381_923,
    1.004_077_356_197_944_4,
    1.002_008_392_826_082_1,
    1.000_994_575_127_818,
    1.000_494_188_604_119_4,
    1.000_246_086_553_308,
    1.000_122_713_347_578_5,
    1.000_061_248_135_058_8,
    1.000_030_588_236_307,
    1.000_015_282_259_408_6,
    1.000_007_637_197_637_9,
    1.000_003_817_293_265,
    1.000_001_908_212_716_5,
    1.000_000_953_962_033_8,
    1.000_000_476_932_986_9,
    1.000_000_238_450_502_7,
    1.000_000_119_219_926,
    1.000_000_059_608_189,
    1.000_000_029_803_503_4,
    1.000_000_014_901_554_9,
    1.000_000_007_450_711_8,
    1.000_000_003_725_334,
    1.000_000_001_862_659_8,
    1.000_000_000_931_327_5,
    1.000_000_000_465_662_8,
    1.000_000_000_232_831,
    1.000_000_000_116_415_5,
];

#[cfg(test)]
mod tests {
    use super::*;

    use crate::laws::delay::tests::reference;

    #[test]
    fn both_functions_agree_with_the_reference() {
        for &(a, expected) in reference::LOG_GAMMA {
            assert!((log_gamma_1p(a) - expected).abs() <= 1e-15 * expected.abs().max(0.1 * a), "{a}: {}", log_gamma_1p(a) / expected - 1.0);
        }
        for &(t, expected) in reference::LOG_GAMMA_RATIO {
            assert!((log_gamma_ratio(t) / expected - 1.0).abs() <= 3e-14, "{t}: {}", log_gamma_ratio(t) / expected - 1.0);
        }
    }
}
