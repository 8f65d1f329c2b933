//! Calibration of the statements of `cohaptic link`.

use std::time::Duration;

use cohaptic_units::{Bytes, Ecn, Probability};
use cohaptic_wan::{Chance, Correlation, Delay, Distribution, GilbertElliott, Jitter, Link, LinkConfig, LinkName, Loss, PacketInfo};

use super::{OF_BATCHES, OF_LIKELIHOOD, Tally};
use crate::achieved::{Accumulator, Achieved};
use crate::asked::Asked;
use crate::comparison::{Comparison, Figure};
use crate::steady::SteadyStream;
use crate::tests::TestRng;

const LINKS: u64 = 300;
const STREAM: SteadyStream =
    SteadyStream { packets: 3_000, every: Duration::from_millis(1), info: PacketInfo { size: Bytes::new(64), ecn: Ecn::NotCapable } };

fn probability(value: f64) -> Probability {
    Probability::new(value).unwrap()
}

/// A link with jitter of a random law and memory, and losses of a random model.
fn random_link(rng: &mut TestRng) -> LinkConfig {
    use Distribution::{Gamma, Laplace, LogNormal, Normal, Pareto, ParetoNormal, Uniform, Weibull};
    let distribution = rng.pick(&[Normal, Uniform, Laplace, LogNormal, Gamma, Weibull, Pareto, ParetoNormal]).clone();
    let correlation = match rng.pick(&[0, 1, 2, 3]) {
        0 => Correlation::None,
        1 => Correlation::PerPacket(0.95 * rng.unit()),
        2 => Correlation::InTime(Duration::from_secs_f64(0.03 * rng.unit() + 1e-4)),
        _ => Correlation::PartlyInTime { time: Duration::from_secs_f64(0.03 * rng.unit() + 1e-4), share: 0.1 + 0.8 * rng.unit() },
    };
    let jitter = Jitter { correlation, ..Jitter::new(Duration::from_secs_f64(0.001 + 0.007 * rng.unit()), distribution) };
    let share = 0.01 + 0.2 * rng.unit();
    let loss = match rng.pick(&[0, 1, 2, 3]) {
        0 => Loss::None,
        1 => Loss::Independent(probability(share)),
        2 => Loss::Correlated(Chance::correlated(probability(share), 0.8 * rng.unit()).unwrap()),
        _ => Loss::GilbertElliott(GilbertElliott {
            p: probability(0.005 + 0.05 * rng.unit()),
            r: probability(0.05 + 0.6 * rng.unit()),
            h: Probability::ZERO,
            k: Probability::ONE,
        }),
    };
    LinkConfig {
        delay: Delay::with_jitter(Duration::from_millis(40), jitter).unwrap(),
        loss,
        duplication: Chance::correlated(probability(0.02 + 0.1 * rng.unit()), 0.5 * rng.unit()).unwrap(),
        ..LinkConfig::default()
    }
}

/// The configured link, its comparison with the measured link, and the measured link.
fn measured(seed: u64, config: LinkConfig) -> (Asked, Vec<Figure>, Achieved) {
    let asked = Asked::of_config(&config, STREAM.every, STREAM.info.size);
    let mut link = Link::new(seed, &LinkName::between("a", "b"), config);
    let (mut beside, mut accumulator) = (Comparison::default(), Accumulator::new());
    STREAM
        .over(
            &mut link,
            |record| {
                beside.record(record);
                accumulator.record(record)
            },
            |_, _| true,
        )
        .unwrap();
    let figures = beside.figures(&asked);
    (asked, figures, accumulator.finish())
}

/// Checks a comparison of a link with its own configuration, which is the truth.
#[test]
#[ignore = ".ci/nightly runs it: it takes long"]
fn the_truth_lies_within_what_a_link_states_as_often_as_it_says() {
    let mut tally = Tally::default();
    let (mut untold, mut figures_of_all) = (0, 0);
    for seed in 0..LINKS {
        let mut rng = TestRng::new(seed * 7 + 1);
        let mut config = random_link(&mut rng);
        // The other half of the links makes copies. The first arrived copy of a packet follows another law of delay.
        let copies = seed % 4 == 0;
        if !copies {
            config.duplication = Chance::default();
        }
        let jitter = config.delay.jitter().unwrap().clone();
        let (asked, figures, achieved) = measured(seed, config.clone());
        for figure in figures {
            figures_of_all += 1;
            let far_tail = matches!(jitter.distribution, Distribution::Pareto | Distribution::ParetoNormal);
            match figure.standard_error {
                Some(error) => tally.count(figure.name, (figure.achieved.unwrap() - figure.asked).abs() > OF_BATCHES * error),
                None if far_tail && ["sd_s", "autocorrelation_1"].contains(&figure.name.as_str()) => {}
                None => untold += 1,
            }
        }
        if !copies {
            of_losses(&mut tally, &asked, &achieved);
            of_delays(&mut tally, &config, &achieved);
        }
    }
    assert!(untold <= figures_of_all / 50, "{untold} of {figures_of_all}");
    let beside = ["autocorrelation_1", "duplicated", "loss", "mean_s"];
    let quantiles = ["0.01", "0.05", "0.25", "0.5", "0.75", "0.95", "0.99"].map(|p| format!("quantile_{p}_s"));
    let others = [
        "achieved autocorrelation, independent",
        "achieved gap",
        "achieved loss",
        "achieved loss interval",
        "achieved quantile, correlated",
        "achieved quantile, independent",
        "achieved run",
        "sd_s",
    ];
    let mut names: Vec<&str> = beside.into_iter().chain(quantiles.iter().map(String::as_str)).chain(others).collect();
    names.sort_unstable();
    tally.is_calibrated(&names, 55);
}

fn of_losses(tally: &mut Tally, asked: &Asked, achieved: &Achieved) {
    let loss = &achieved.loss;
    let Some(wanted) = asked.loss.filter(|wanted| *wanted > 0.0) else { return };
    if let Some(error) = loss.standard_error {
        tally.count("achieved loss", (loss.value.unwrap() - wanted).abs() > OF_BATCHES * error);
    }
    if let Some([low, high]) = loss.interval_95 {
        tally.count("achieved loss interval", wanted < low || wanted > high);
    }
    let Some(run) = asked.loss_run_mean else { return };
    if let Some(error) = loss.run_mean_se {
        tally.count("achieved run", (loss.run_mean.unwrap() - run).abs() > OF_LIKELIHOOD * error);
    }
    // In the long run, runs and gaps alternate, and the share of packets in runs is the share of losses.
    if let Some(error) = loss.gap_mean_se {
        tally.count("achieved gap", (loss.gap_mean.unwrap() - run * (1.0 - wanted) / wanted).abs() > OF_LIKELIHOOD * error);
    }
}

fn of_delays(tally: &mut Tally, config: &LinkConfig, achieved: &Achieved) {
    let (delay, law) = (achieved.delay.as_ref().unwrap(), config.delay.law().unwrap());
    let independent = config.delay.jitter().unwrap().correlation == Correlation::None;
    // A single quantile of each link, in turn, because quantiles of the same link are correlated.
    let place = usize::try_from(achieved.loss.received).unwrap() % delay.quantile_intervals_95_s.len();
    if let Some((name, [low, high])) = delay.quantile_intervals_95_s.iter().nth(place) {
        let truth = law.quantile(name.parse().unwrap()) / 1e9;
        let kind = if independent { "independent" } else { "correlated" };
        // Delays are whole nanoseconds.
        tally.count(format!("achieved quantile, {kind}"), truth < low - 1e-9 || truth > high + 1e-9);
    }
    if independent {
        for r in &delay.autocorrelation {
            tally.count("achieved autocorrelation, independent", r.abs() > delay.autocorrelation_bound_95);
        }
    }
}

/// A packet per millisecond, with delays uniform over a span of 8 ms. A packet delayed by u (in ms above the least delay) is overtaken by the packet sent k
/// ms later if the later packet is delayed by less than u − k. The share not overtaken is ∫∏ₖ(1 − (u − k)₊/8) du/8, computed by Simpson's rule between the
/// kinks, which is exact for polynomials of degree 3 and here right to 10⁻⁹.
#[test]
fn the_share_that_is_reordered_lies_within_its_interval_as_often_as_it_says() {
    let kept = |u: f64| (1..8).map(|k| 1.0 - (u - f64::from(k)).max(0.0) / 8.0).product::<f64>();
    let simpson = |from: f64| {
        let h = 1.0 / 64.0;
        (0..32).map(|i| from + f64::from(2 * i) * h).map(|u| h / 3.0 * (kept(u) + 4.0 * kept(u + h) + kept(u + 2.0 * h))).sum::<f64>()
    };
    let truth = 1.0 - (0..8).map(|from| simpson(f64::from(from))).sum::<f64>() / 8.0;
    let sd = Duration::from_secs_f64(0.008 / 12.0_f64.sqrt());
    let config =
        LinkConfig { delay: Delay::with_jitter(Duration::from_millis(40), Jitter::new(sd, Distribution::Uniform)).unwrap(), ..LinkConfig::default() };
    let mut tally = Tally::default();
    for seed in 0..LINKS {
        let [low, high] = measured(seed, config.clone()).2.order.reordered_interval_95.unwrap();
        tally.count("reordered", truth < low || truth > high);
        assert!(high - low < 0.05, "{low} {high}");
    }
    tally.is_calibrated(&["reordered"], LINKS);
}
