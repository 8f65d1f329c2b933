//! Calibration of the statements of `cohaptic fit`.

use cohaptic_wan::Distribution;
use cohaptic_wan::law::Law;
use rand_distr::{Distribution as _, Exp1, StandardNormal};

use super::{OF_BATCHES, OF_LIKELIHOOD, Tally};
use crate::fit::{LossModel, Measurement, Measurements, fit};
use crate::tests::TestRng;

const MEASUREMENTS: u64 = 250;
const PACKETS: usize = 1_200;

/// A link with delays from an Ornstein–Uhlenbeck process, and losses from a Gilbert–Elliott chain or independent.
struct Truth {
    law: Law,
    /// Correlation time \[s\]; 0 for independent delays.
    time_s: f64,
    p: f64,
    r: f64,
    drift: f64,
    evenly: bool,
}

impl Truth {
    fn random(rng: &mut TestRng) -> Self {
        use Distribution::{Gamma, Laplace, LogNormal, Normal, Uniform, Weibull};
        let law = rng.pick(&[Normal, Uniform, Laplace, LogNormal, Gamma, Weibull]).clone();
        let p = 0.01 + 0.1 * rng.unit();
        Self {
            law: Law::new(&law, 0.04, 0.001 + 0.003 * rng.unit(), Some(0.03)).unwrap(),
            time_s: if rng.unit() < 0.25 { 0.0 } else { 0.002 + 0.02 * rng.unit() },
            p,
            // Half of the links have independent losses.
            r: if rng.unit() < 0.5 { 1.0 - p } else { 0.1 + 0.6 * rng.unit() },
            drift: if rng.unit() < 0.5 { 0.0 } else { 5e-3 },
            evenly: rng.unit() < 0.5,
        }
    }

    fn measured(&self, rng: &mut TestRng) -> Measurements {
        let (mut sent_s, mut z): (f64, f64) = (0.0, StandardNormal.sample(rng));
        let mut bad = rng.unit() < self.p / (self.p + self.r);
        let packets = (0..PACKETS).map(|_| {
            let delay = self.law.at_normal(z) + self.drift * sent_s;
            let packet = Measurement { sent_s, delay_s: (!bad).then_some(delay) };
            let random: f64 = Exp1.sample(rng);
            let gap = if self.evenly { 0.004 } else { 0.004 * random };
            let fresh: f64 = StandardNormal.sample(rng);
            let phi = if self.time_s > 0.0 { (-gap / self.time_s).exp() } else { 0.0 };
            z = phi * z + (1.0 - phi * phi).sqrt() * fresh;
            sent_s += gap;
            bad ^= rng.unit() < if bad { self.r } else { self.p };
            packet
        });
        Measurements::new(packets.collect()).unwrap()
    }
}

#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_truth_lies_within_what_a_fit_states_as_often_as_it_says() {
    let mut tally = Tally::default();
    let mut untold = 0;
    for seed in 0..MEASUREMENTS {
        let mut rng = TestRng::new(seed * 13 + 5);
        let truth = Truth::random(&mut rng);
        let Ok((measurements, skew)) = truth.measured(&mut rng).without_skew() else {
            untold += 1;
            continue;
        };
        // An interval with confidence 0.99 may be counted among intervals with 0.95.
        tally.count("drift", !(skew.interval_99[0]..=skew.interval_99[1]).contains(&truth.drift));
        let fitted = fit(&measurements).unwrap();
        let goodness = &fitted.goodness;
        // A drift that is not significant moves the mean, as the estimate documents.
        if truth.drift == 0.0 || skew.significant {
            let name = if truth.drift == 0.0 { "mean" } else { "mean after drift" };
            match goodness.mean_se_s {
                Some(error) => tally.count(name, (goodness.mean_s - truth.law.mean()).abs() > OF_BATCHES * error),
                None => untold += 1,
            }
        }
        // Delays taken for independent have no stated correlation to check.
        let phi = if truth.time_s > 0.0 { (-goodness.spacing_s / truth.time_s).exp() } else { 0.0 };
        let outside = |found: f64, truth: f64, error: Option<f64>| error.is_none_or(|error| (found - truth).abs() > OF_LIKELIHOOD * error);
        let even = if truth.evenly { "even" } else { "uneven" };
        let found = goodness.correlation;
        tally.count(format!("lag one, {even}"), found.is_some_and(|found| outside(found.lag_one, phi, found.lag_one_se)));
        tally.count(format!("time, {even}"), found.is_some_and(|found| outside(found.time_s, truth.time_s, found.time_se_s)));
        let share = truth.p / (truth.p + truth.r);
        let one_by_one = truth.p + truth.r > 0.999;
        let [low, high] = goodness.loss_interval_95.unwrap();
        tally.count(if one_by_one { "share lost one by one" } else { "share lost in bursts" }, share < low || share > high);
        for loss in &goodness.losses {
            match (loss.model, loss.standard_errors) {
                (LossModel::GilbertElliott { p, r, .. }, Some([error_p, error_r])) => {
                    tally.count("p", (p - truth.p).abs() > OF_LIKELIHOOD * error_p);
                    tally.count("r", (r - truth.r).abs() > OF_LIKELIHOOD * error_r);
                }
                (LossModel::Independent { probability }, Some([error, _])) if one_by_one => {
                    tally.count("probability", (probability - share).abs() > OF_LIKELIHOOD * error);
                }
                _ => {}
            }
        }
    }
    assert!(untold <= MEASUREMENTS / 20, "{untold}");
    let figures = [
        "drift",
        "lag one, even",
        "lag one, uneven",
        "mean",
        "mean after drift",
        "p",
        "probability",
        "r",
        "share lost in bursts",
        "share lost one by one",
        "time, even",
        "time, uneven",
    ];
    tally.is_calibrated(&figures, 90);
}
