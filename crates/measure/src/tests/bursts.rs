//! Packets sent in bursts, all packets of a burst at the same instant.

use rand_distr::{Distribution, StandardNormal};

use crate::fit::{DelayLaw, FittedLaw, LossModel, Measurement, Measurements, fit};
use crate::tests::TestRng;

/// Makes bursts of `of` packets every 10 ms, with normal delays of 30 ± 2 ms. Each packet is lost with probability 0.1, independently of others.
fn bursts(of: u32) -> Measurements {
    let mut rng = TestRng::new(u64::from(of));
    let packet = |number: u32| {
        let (z, draw): (f64, f64) = (StandardNormal.sample(&mut rng), rng.unit());
        Measurement { sent_s: 0.01 * f64::from(number / of), delay_s: (draw >= 0.1).then_some(0.03 + 0.002 * z) }
    };
    Measurements::new((0..20_000).map(packet).collect()).unwrap()
}

/// With 18 000 delays the mean has the standard error 2 ms/√18 000 = 15 µs, the deviation 11 µs, and the loss √(0.09/20 000) = 0.0021. The tolerance is
/// five standard errors.
#[test]
fn a_link_is_found_from_bursts() {
    for of in [2, 3, 5, 40] {
        let measurements = bursts(of);
        assert_eq!(measurements.instants(), 20_000_usize.div_ceil(of as usize));
        let fitted = fit(&measurements).unwrap();
        assert!((fitted.goodness.spacing_s - 0.01).abs() < 1e-9, "{of} {:?}", fitted.goodness.spacing_s);
        assert!(!fitted.goodness.evenly_spaced);
        assert_eq!(fitted.link.jitter.distribution, FittedLaw::Law(DelayLaw::Normal), "{of}");
        assert!((fitted.link.delay_s - 0.03).abs() < 5.0 * 15e-6 && (fitted.link.jitter.sd_s - 0.002).abs() < 5.0 * 11e-6, "{of} {:?}", fitted.link);
        let LossModel::Independent { probability } = fitted.link.loss else { panic!("{of} {:?}", fitted.link) };
        assert!((probability - 0.1).abs() < 5.0 * 0.0021, "{of} {probability}");
    }
}
