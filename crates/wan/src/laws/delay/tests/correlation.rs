use super::*;

const PHIS: [f64; 7] = [-1.0, -0.9, -0.5, 0.25, 0.5, 0.9, 0.99];

/// ρ at [`PHIS`], from double integrals ∬ g(x)·g(φ·x + √(1 − φ²)·u)·φ(x)·φ(u) dx du with numpy: Gauss–Legendre panels of width ¼ with 12 nodes in x from
/// −13 to 20 and of width 0.1 with 10 nodes in u from −20 to 20; g from scipy 1.17 (`gammainccinv`) or in closed form. For the normal law cut at c the
/// inner integral is closed: c + s·φ(d) + (m − c)·Φ(d) with d = (m − c)/s.
#[rustfmt::skip]
const REFERENCE: [(&str, f64, f64, f64, [f64; 7]); 7] = [
    ("gamma", 4.0, 2.0, 1e-9, [-0.894_292_318_682_078_8, -0.809_563_447_895_077_8, -0.460_235_002_335_276_4, 0.240_011_144_424_280_8, 0.486_660_056_163_000_7, 0.895_185_136_318_057_3, 0.989_470_053_816_736_4]),
    ("gamma", 1.0, 1.0, 1e-9, [-0.644_934_066_848_226_5, -0.595_293_160_447_268_3, -0.364_362_557_139_846_6, 0.215_133_256_276_669_15, 0.453_075_020_206_117_8, 0.882_850_798_580_631_2, 0.988_107_135_016_166_6]),
    ("pareto", 24.0, 2.0, 1e-9, [-0.262_146_376_081_097_03, -0.248_351_457_241_836_02, -0.171_101_926_560_375_43, 0.135_504_835_569_960_93, 0.324_109_401_150_190_05, 0.815_913_497_641_272_5, 0.980_002_245_156_506]),
    ("weibull", 1.0, 0.522_723_200_877_062_4, 1e-9, [-0.947_093_211_243_156_6, -0.854_578_192_521_858_4, -0.479_755_181_667_867_6, 0.244_785_984_770_376_4, 0.492_976_656_286_893_4, 0.897_427_953_449_996_4, 0.989_715_930_724_589_6]),
    ("laplace", 99.0, 1.0, 1e-6, [-1.0, -0.893_354_919_869_318_8, -0.485_961_724_862_887_36, 0.241_310_360_920_338_72, 0.485_961_724_862_887_36, 0.893_354_919_869_318_7, 0.989_220_798_902_519]),
    ("paretonormal", 99.0, 1.0, 1e-9, [-0.499_753_641_199_748_6, -0.458_198_536_722_115_2, -0.277_015_307_208_583_64, 0.172_375_133_428_011_45, 0.380_750_559_772_972_2, 0.842_991_448_079_104_1, 0.983_221_771_507_914_9]),
    ("normal", 1.5, 1.0, 1e-6, [f64::NAN, -0.878_690_925_189_910_1, -0.488_578_469_395_300_25, 0.245_774_172_418_446_68, 0.493_478_796_266_317_5, 0.896_677_905_456_138_8, 0.989_550_294_756_069_7]),
];

#[test]
fn correlations_agree_with_double_integrals() {
    for (name, mean, sd, tolerance, expected) in REFERENCE {
        let law = law(name, mean, sd, 0.0);
        for (phi, rho) in PHIS.into_iter().zip(expected) {
            let found = law.correlation(phi);
            assert!(rho.is_nan() || (found - rho).abs() < tolerance, "{name} at {phi}: {found} is not {rho}: {:e}", found - rho);
        }
    }
}

/// A coin has the correlation 2/π·asin φ (Sheppard 1899), and a law uniform between two values has 6/π·asin(φ/2). The laws are made as tables and values, so
/// that no closed form is used.
#[test]
fn correlations_of_values_agree_with_closed_forms() {
    let coin = Law::new(&table("-8192 8192"), 24.0, 2.0, None).unwrap();
    let uniform = Law::new(&empirical(&[1.0, 2.0, 3.0]), 24.0, 2.0, None).unwrap();
    for phi in [-1.0, -0.99, -0.5, 0.1, 0.9, 0.999, 0.9999, 1.0] {
        let expected = core::f64::consts::FRAC_2_PI * libm::asin(phi);
        assert!((coin.correlation(phi) - expected).abs() < 1e-5, "coin at {phi}: {}", coin.correlation(phi) - expected);
        let expected = 6.0 / core::f64::consts::PI * libm::asin(0.5 * phi);
        assert!((uniform.correlation(phi) - expected).abs() < 1e-9, "uniform at {phi}: {}", uniform.correlation(phi) - expected);
    }
}

/// Compares the series with the closed form for a law that has both: the empirical law of 4097 lognormal quantiles is nearly lognormal.
#[test]
fn a_large_sample_has_the_correlation_of_its_law() {
    let smooth = law("lognormal", 24.0, 2.0, 0.0);
    let quantiles: Vec<f64> = (0..40_001).map(|i| smooth.quantile((f64::from(i) + 0.5) / 40_001.0)).collect();
    let sampled = Law::new(&empirical(&quantiles), 24.0, 2.0, None).unwrap();
    for phi in [-0.9, -0.3, 0.5, 0.9] {
        assert!((sampled.correlation(phi) - smooth.correlation(phi)).abs() < 1e-3, "{phi}: {}", sampled.correlation(phi));
    }
}

#[test]
fn the_inverse_undoes_the_correlation() {
    for (name, law) in every_law() {
        for phi in [-0.99, 0.1, 0.9] {
            let rho = law.correlation(phi);
            let again = law.correlation(law.gaussian_correlation(rho).unwrap());
            assert!((again - rho).abs() < 1e-12, "{name} at {phi}: {again}");
        }
        assert!((law.correlation(1.0) - 1.0).abs() < 1e-12, "{name}: {}", law.correlation(1.0));
        assert!(law.gaussian_correlation(1.0).unwrap() > 1.0 - 1e-9 && law.correlation(0.0) == 0.0, "{name}");
    }
}

#[test]
fn a_correlation_that_the_law_cannot_have_is_refused_with_the_bound() {
    let exponential = law("gamma", 1.0, 1.0, 0.0);
    let Err(LawError::TooNegative { asked, least }) = exponential.gaussian_correlation(-0.7) else { panic!("below the least") };
    // 1 − π²/6 (Moran 1967).
    assert!(asked == -0.7 && (least - (1.0 - core::f64::consts::PI * core::f64::consts::PI / 6.0)).abs() < 1e-12);
    assert!(exponential.gaussian_correlation(-0.64).is_ok());
    for found in [1.1, -1.1, f64::NAN] {
        assert!(matches!(exponential.gaussian_correlation(found), Err(LawError::NotACorrelation { .. })));
    }
}
