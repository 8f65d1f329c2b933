//! Elliptic integrals and functions.

/// Returns Carlson's symmetric integral of the first kind of three numbers, of which at most one is zero, by duplication (Carlson 1979).
pub(crate) fn carlson_rf([mut x, mut y, mut z]: [f64; 3]) -> f64 {
    loop {
        let mean = (x + y + z) / 3.0;
        let [a, b, c] = [x, y, z].map(|number| 1.0 - number / mean);
        // The truncation error of the series is below 3·10⁻³ of the sixth power.
        if a.abs().max(b.abs()).max(c.abs()) < 1e-3 {
            let (second, third) = (a * b - c * c, a * b * c);
            return (1.0 - second / 10.0 + third / 14.0 + second * second / 24.0 - 3.0 * second * third / 44.0) / libm::sqrt(mean);
        }
        let [rx, ry, rz] = [x, y, z].map(libm::sqrt);
        let lambda = rx * ry + ry * rz + rz * rx;
        [x, y, z] = [x, y, z].map(|number| 0.25 * (number + lambda));
    }
}

/// Number of steps of the arithmetic–geometric mean. Each step squares the distance of the means, and from 1 − m = 10⁻³⁰⁰ eleven steps are enough.
const STEPS: usize = 12;

/// Jacobi's elliptic functions of one parameter m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jacobi {
    /// 1 − m.
    complement: f64,
    /// Ratios c/a of the arithmetic–geometric mean, from its first step on.
    ratios: [f64; STEPS],
    /// Arithmetic–geometric mean of 1 and √(1 − m).
    mean: f64,
}

impl Jacobi {
    /// Returns the functions of the parameter with 1 − m = `complement`, above 0 and at most 1.
    pub(crate) fn of_complement(complement: f64) -> Self {
        let (mut a, mut b) = (1.0, libm::sqrt(complement));
        let ratios = std::array::from_fn(|_| {
            let c = 0.5 * (a - b);
            (a, b) = (0.5 * (a + b), libm::sqrt(a * b));
            c / a
        });
        Self { complement, ratios, mean: a }
    }

    /// Returns K, a quarter of the period.
    pub(crate) fn quarter(&self) -> f64 {
        std::f64::consts::FRAC_PI_2 / self.mean
    }

    /// Returns sn, cn and dn of u (Abramowitz & Stegun 1964, 16.4).
    pub(crate) fn at(&self, u: f64) -> [f64; 3] {
        let period = 4.0 * self.quarter();
        // The reduction to one period keeps the digits of the amplitude.
        let u = u - period * (u / period).round();
        let amplitude = self
            .ratios
            .iter()
            .rev()
            .fold(libm::ldexp(self.mean * u, 12), |angle, ratio| 0.5 * (angle + libm::asin((ratio * libm::sin(angle)).clamp(-1.0, 1.0))));
        let (sn, cn) = libm::sincos(amplitude);
        [sn, cn, libm::sqrt(self.complement + (1.0 - self.complement) * cn * cn)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of 1 − m, u, the functions of u, and K, by mpmath 1.3.0 with 50 digits.
    const VALUES: [(f64, f64, [f64; 3], f64); 5] = [
        (1.0, 2.0, [0.909_297_426_825_681_7, -0.416_146_836_547_142_4, 1.0], std::f64::consts::FRAC_PI_2),
        (0.75, 0.3, [0.294_465_551_549_556_2, 0.955_662_094_545_250_7, 0.989_101_870_252_833_9], 1.685_750_354_812_596),
        (0.25, 5.0, [-0.605_595_637_887_026, -0.795_772_532_431_351_3, 0.851_434_344_226_937_2], 2.156_515_647_499_643_2),
        (1e-6, 7.5, [0.999_999_612_654_136_8, 0.000_880_165_652_850_525, 0.001_332_175_214_364_167], 8.294_051_463_615_44),
        (1e-6, -20.0, [0.997_827_435_621_848_3, -0.065_881_778_363_415_9, 0.065_889_334_341_132_44], 8.294_051_463_615_44),
    ];

    #[test]
    fn values_are_those_of_another_program() {
        for (complement, u, expected, quarter) in VALUES {
            let functions = Jacobi::of_complement(complement);
            assert!((functions.quarter() / quarter - 1.0).abs() < 1e-15, "{complement}");
            assert!((carlson_rf([0.0, complement, 1.0]) / quarter - 1.0).abs() < 2e-15, "{complement}");
            for (found, expected) in functions.at(u).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{complement}, {u}: {found} is not {expected}");
            }
        }
    }
}
