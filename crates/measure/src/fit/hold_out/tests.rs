//! The trace of the design, of which another program computed the figures.

use super::*;

/// Sebastiano Vigna's splitmix64, so that the trace is that of the design.
struct SplitMix(u64);

impl SplitMix {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2.0_f64.powi(-53)
    }
}

/// Probabilities of leaving the good and the bad state, before each packet.
const LEAVES: [f64; 2] = [0.002, 0.02];
/// Probability of loss in each state.
const LOST: [f64; 2] = [0.001, 0.2];
/// Least delay and mean above it of the exponential delays of each state \[ms\].
const DELAYS: [[f64; 2]; 2] = [[20.0, 2.0], [45.0, 10.0]];

/// Returns the trace of the design: two states, 40 000 packets every 10 ms.
fn trace() -> Measurements {
    trace_of(1, 40_000)
}

fn trace_of(seed: u64, packets: u32) -> Measurements {
    let (mut random, mut is_bad) = (SplitMix(seed), false);
    let packet = |number: u32| {
        let [change, loss, delay] = [random.unit(), random.unit(), random.unit()];
        is_bad = if is_bad { change >= LEAVES[1] } else { change < LEAVES[0] };
        let state = usize::from(is_bad);
        let (lost, [floor, scale]) = (loss < LOST[state], DELAYS[state]);
        let delay_ms = floor - scale * (1.0 - delay).ln();
        Measurement { sent_s: f64::from(number) * 0.01, delay_s: (!lost).then_some(delay_ms * 1e-3) }
    };
    Measurements::new((0..packets).map(packet).collect()).unwrap()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, of: f64) {
    assert!((found - expected).abs() <= of, "{found} {expected}");
}

/// Delays \[ms\] to four digits, correlations to three, loss \[%\] and mean run to four, shares of runs to three: as another program computed them.
#[test]
fn figures_are_those_computed_elsewhere() {
    let whole = trace();
    let delays: Vec<f64> = whole.packets()[..3].iter().map(|packet| packet.delay_s.unwrap() * 1e3).collect();
    for (found, expected) in delays.into_iter().zip([27.081_109, 22.878_499, 20.672_369]) {
        assert_near(found, expected, 6e-7);
    }
    assert_eq!(whole.packets().iter().filter(|packet| packet.delay_s.is_none()).count(), 741);
    let (first, rest) = whole.hold_out(0.5).unwrap();
    assert_eq!((first.packets().len(), rest.packets().len()), (20_000, 20_000));
    let judged = HoldOut::of(&first, &rest, &first, 1e-9);
    let HoldOut { measured, independent, gilbert, replay, .. } = &judged;
    for (figures, mean, quantiles, wasserstein, correlations, loss, run, longer) in [
        (measured, 24.4856, [49.0554, 65.0160], None, [0.711, 0.594, 0.113], 1.9750, 1.2117, [0.184, 0.025]),
        (independent, 24.0803, [47.5361, 63.3429], Some(0.4179), [0.0; 3], 1.7300, 1.0176, [0.0173, 0.000_299]),
        (gilbert, 24.0803, [47.5361, 63.3429], Some(0.4179), [0.0; 3], 1.7300, 1.2313, [0.188, 0.035]),
        (replay, 24.0803, [47.5361, 63.3429], Some(0.4179), [0.691, 0.579, 0.119], 1.7300, 1.2313, [0.178, 0.032]),
    ] {
        assert_near(figures.mean_s * 1e3, mean, 5e-5);
        for (found, expected) in figures.quantiles_s.into_iter().zip(quantiles) {
            assert_near(found * 1e3, expected, 5e-5);
        }
        assert_eq!(figures.wasserstein_s.is_some(), wasserstein.is_some());
        assert_near(figures.wasserstein_s.unwrap_or(0.0) * 1e3, wasserstein.unwrap_or(0.0), 5e-5);
        for (found, expected) in figures.autocorrelation.into_iter().zip(correlations) {
            assert_near(found.unwrap(), expected, 6e-4);
        }
        assert_near(figures.loss * 100.0, loss, 5e-5);
        assert_near(figures.mean_run.unwrap(), run, 5e-5);
        for (found, expected) in figures.longer_runs.unwrap().into_iter().zip(longer) {
            assert_near(found, expected, 6e-4);
        }
    }
    // The first part is like the rest, so as a prediction it is not refused.
    assert_eq!(judged.refused, Vec::<String>::new());
}

/// Share of all packets by the state before (stationary), what became of each of several packets in a row, and no more: `what[n][state]` is the probability of
/// the fate of packet n in a state.
fn probability(fates: &[[f64; 2]]) -> f64 {
    let whole = LEAVES[0] + LEAVES[1];
    let mut share = [LEAVES[1] / whole, LEAVES[0] / whole];
    for fate in fates {
        let [good, bad] = [share[0] * (1.0 - LEAVES[0]) + share[1] * LEAVES[1], share[0] * LEAVES[0] + share[1] * (1.0 - LEAVES[1])];
        share = [good * fate[0], bad * fate[1]];
    }
    share[0] + share[1]
}

/// Returns the figures of the law of the trace itself, without a packet: mixtures of two exponential laws, and sums over the paths of the chain.
fn exact() -> Figures {
    let arrived = LOST.map(|lost| 1.0 - lost);
    let any = [1.0; 2];
    let all_arrived = probability(&[arrived]);
    let weights = [probability(&[[arrived[0], 0.0]]) / all_arrived, probability(&[[0.0, arrived[1]]]) / all_arrived];
    let means = DELAYS.map(|[floor, scale]| floor + scale);
    let mean = weights[0] * means[0] + weights[1] * means[1];
    // The standard deviation of an exponential law is its mean above the least delay.
    let variance: f64 = (0..2).map(|state| weights[state] * (DELAYS[state][1].powi(2) + (means[state] - mean).powi(2))).sum();
    let above = |ms: f64| (0..2).map(|state| weights[state] * (-(ms - DELAYS[state][0]).max(0.0) / DELAYS[state][1]).exp()).sum::<f64>();
    let quantile = |share: f64| {
        let (mut low, mut high) = (20.0, 500.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if above(middle) > 1.0 - share { low = middle } else { high = middle }
        }
        low * 1e-3
    };
    let correlation = |lag: usize| {
        let moment: [f64; 2] = std::array::from_fn(|state| arrived[state] * (means[state] - mean));
        let pair = |ends: [f64; 2]| probability(&[&[ends][..], &vec![any; lag - 1], &[ends]].concat());
        Some(pair(moment) / pair(arrived) / variance)
    };
    let run = |losses: usize| probability(&[&[arrived][..], &vec![LOST; losses]].concat());
    Figures {
        mean_s: mean * 1e-3,
        quantiles_s: [quantile(0.95), quantile(0.99)],
        wasserstein_s: None,
        autocorrelation: LAGS.map(correlation),
        loss: probability(&[LOST]),
        mean_run: Some(probability(&[LOST]) / run(1)),
        longer_runs: Some([run(2) / run(1), run(3) / run(1)]),
    }
}

/// Returns all figures in one row: delays in ms, the loss in %.
fn row(figures: &Figures) -> [f64; 10] {
    let [lag_1, lag_10, lag_100] = figures.autocorrelation.map(Option::unwrap);
    let [two, three] = figures.longer_runs.unwrap();
    let [p95, p99] = figures.quantiles_s;
    [figures.mean_s * 1e3, p95 * 1e3, p99 * 1e3, lag_1, lag_10, lag_100, figures.loss * 1e2, figures.mean_run.unwrap(), two, three]
}

/// The column of the exact law, to its digits.
#[test]
fn the_exact_law_has_the_figures_computed_elsewhere() {
    let expected = [24.4467, 48.9398, 65.0341, 0.705, 0.577, 0.078, 1.9091, 1.2296, 0.185, 0.036];
    let digits = [5e-5, 5e-5, 5e-5, 5e-4, 5e-4, 5e-4, 5e-5, 5e-5, 5e-4, 5e-4];
    for ((found, expected), digits) in row(&exact()).into_iter().zip(expected).zip(digits) {
        assert_near(found, expected, digits * 1.001);
    }
}

/// The figures of packets are those of their law: of 40 traces each figure is on average the exact one, to four of its standard errors.
#[test]
fn figures_of_many_packets_are_those_of_the_law() {
    const TRACES: u32 = 40;
    let found: Vec<[f64; 10]> = (2..2 + TRACES).map(|seed| row(&Figures::of(trace_of(u64::from(seed), 40_000).packets(), &[]))).collect();
    for (place, exact) in row(&exact()).into_iter().enumerate() {
        let of_traces: Vec<f64> = found.iter().map(|row| row[place]).collect();
        let error = (series::variance(&of_traces).unwrap() / f64::from(TRACES)).sqrt();
        let average = series::mean(&of_traces).unwrap();
        // The second condition keeps the first one from passing because the traces say nothing.
        assert!((average - exact).abs() < 4.0 * error && error < 0.05 * exact.max(0.5), "figure {place}: {average} +- {error}, {exact}");
    }
}

/// The normal law with mean and deviation of the first part has a W₁ of 5.650 ms.
#[test]
fn a_normal_law_is_refused() {
    let (first, rest) = trace().hold_out(0.5).unwrap();
    let delays = sorted(&first);
    let (mean, sd) = (series::mean(&delays).unwrap(), series::variance(&delays).unwrap().sqrt());
    let quantile = |number: u32| mean + sd * crate::fit::law::normal_quantile((f64::from(number) + 0.5) / 20_000.0);
    // In an order without memory: 7777 is prime to 20 000.
    let packet = |number: u32| Measurement { sent_s: f64::from(number) * 0.01, delay_s: Some(quantile(number * 7_777 % 20_000)) };
    let normal = Measurements::new((0..20_000).map(packet).collect()).unwrap();
    let judged = HoldOut::of(&first, &rest, &normal, 1e-9);
    assert_near(judged.best.wasserstein_s.unwrap() * 1e3, 5.650, 2e-3);
    for part in ["(W1), and at most 0.8358 ms may be", "10 packets apart", "its loss is 0.0000 %"] {
        assert!(judged.refused.iter().any(|reason| reason.contains(part)), "no {part:?} in {:#?}", judged.refused);
    }
}

#[test]
fn a_distance_is_the_area_between_distribution_functions() {
    assert_near(wasserstein(&[1.0, 2.0], &[1.0, 2.0]), 0.0, 0.0);
    assert_near(wasserstein(&[0.0], &[3.0]), 3.0, 0.0);
    // Half of the mass goes from 0 to 1, and a quarter from 0 to 4.
    assert_near(wasserstein(&[0.0, 0.0, 0.0, 0.0], &[0.0, 1.0, 1.0, 4.0]), 1.5, 1e-12);
}

#[test]
fn a_part_without_packets_is_refused() {
    let few = Measurements::new((0..120).map(|i| Measurement { sent_s: f64::from(i), delay_s: (i < 90).then_some(0.02) }).collect()).unwrap();
    assert_eq!(few.hold_out(0.5).unwrap_err(), HoldOutError { arrived: 30 });
    assert_eq!(Measurements::default().hold_out(0.5).unwrap_err().arrived, 0);
}

/// Packets every second with the given delays \[ms\].
fn every_second(delays: impl Iterator<Item = Option<f64>>) -> Measurements {
    let packets = (0..).zip(delays).map(|(number, delay)| Measurement { sent_s: f64::from(number), delay_s: delay.map(|delay| delay * 1e-3) });
    Measurements::new(packets.collect()).unwrap()
}

#[test]
fn the_share_is_that_of_the_end() {
    let (first, rest) = every_second((0..200).map(|_| Some(20.0))).hold_out(0.25).unwrap();
    assert_eq!((first.packets().len(), rest.packets().len()), (150, 50));
    // Fifty packets in each part are enough, and forty-nine are not.
    let arrived = |of_rest: usize| every_second((0..100).map(|number| (number < 50 + of_rest).then_some(20.0))).hold_out(0.5).map(|_| ());
    assert_eq!((arrived(50), arrived(49)), (Ok(()), Err(HoldOutError { arrived: 49 })));
}

/// Delays of 20 to 24 ms in an order without memory. `lost` says which packets are lost.
fn plain(of: u32, step: u32, lost: impl Fn(u32) -> bool) -> Measurements {
    every_second((0..of).map(|number| (!lost(number)).then(|| 20.0 + f64::from(number * step % 101) * 0.04)))
}

#[track_caller]
fn assert_refused(judged: &HoldOut, part: &str) {
    assert!(judged.refused.len() == 1 && judged.refused[0].contains(part), "{part}: {:#?}", judged.refused);
}

/// A link is refused by a distance beyond the tick and beyond twice that of the first part from the rest.
#[test]
fn a_distance_is_measured_by_the_tick_and_by_the_first_part() {
    let (first, rest) = (plain(2_020, 37, |_| false), plain(2_020, 44, |_| false));
    // The first part has all delays of the rest, so that it is at the distance 0.
    let shifted = every_second(first.packets().iter().map(|packet| packet.delay_s.map(|delay| delay * 1e3 + 0.3)));
    assert_refused(&HoldOut::of(&first, &rest, &shifted, 0.29e-3), "(W1), and at most 0.2900 ms may be");
    assert_eq!(HoldOut::of(&first, &rest, &shifted, 0.31e-3).refused, Vec::<String>::new());
    // A first part that is 0.2 ms off lets a link be 0.4 ms off.
    let off = |by: f64| every_second(rest.packets().iter().map(|packet| packet.delay_s.map(|delay| delay * 1e3 + by)));
    assert_eq!(HoldOut::of(&off(0.2), &rest, &off(0.39), 1e-9).refused, Vec::<String>::new());
    assert_refused(&HoldOut::of(&off(0.2), &rest, &off(0.41), 1e-9), "(W1), and at most 0.4000 ms may be");
}

/// Correlations that are too high are refused like those that are too low.
#[test]
fn a_correlation_is_refused_in_both_directions() {
    let without_memory = plain(2_020, 37, |_| false);
    // The same delays in rising order.
    let mut delays: Vec<f64> = without_memory.arrivals().map(|arrival| arrival.1 * 1e3).collect();
    delays.sort_by(f64::total_cmp);
    let rising = every_second(delays.into_iter().map(Some));
    for (rest, best) in [(&without_memory, &rising), (&rising, &without_memory)] {
        let judged = HoldOut::of(rest, rest, best, 1e-9);
        assert!(judged.refused.len() == 3 && judged.refused.iter().all(|reason| reason.contains("apart is")), "{:#?}", judged.refused);
    }
}

/// 2.05 standard errors of both parts are the limit of the share lost, and of the mean run.
#[test]
fn losses_are_compared_with_their_errors() {
    // Single losses, at random places, of 10 % of 10,000 packets: the error of a part is about 0.3 %, of both 0.42 %.
    let single = |seed: u64, share: f64| {
        let mut random = SplitMix(seed);
        let lost: Vec<bool> = (0..10_000).map(|_| random.unit() < share).collect();
        plain(10_000, 37, move |number| lost[number as usize])
    };
    let (first, rest) = (single(1, 0.1), single(2, 0.1));
    let error = {
        let ((one, _), (other, _)) = (errors(first.packets()), errors(rest.packets()));
        one.hypot(other)
    };
    assert!((0.003..0.006).contains(&error), "{error}");
    let judged = |share: f64| HoldOut::of(&first, &rest, &single(3, share), 1.0);
    let lost = |judged: &HoldOut| judged.refused.iter().any(|reason| reason.starts_with("its loss is"));
    assert!(!lost(&judged(0.1)) && !lost(&judged(0.105)), "{:#?}", judged(0.105).refused);
    assert!(lost(&judged(0.12)) && lost(&judged(0.08)));
    // Runs of two and of four losses alike have the same share, and another mean run.
    let runs = |length: u32, shift: u32| plain(10_000, 37, move |number| (number / length * 7_919 + shift).is_multiple_of(10));
    let judged = HoldOut::of(&runs(2, 1), &runs(2, 5), &runs(4, 1), 1.0);
    assert!(judged.refused.iter().any(|reason| reason.starts_with("its runs of losses have")), "{:#?}", judged.refused);
    // The error of the mean of n runs is their deviation over √n.
    let ((_, run_error), run) = (errors(first.packets()), runs_of(&first));
    let expected = (series::variance(&run).unwrap() / run.len() as f64).sqrt();
    assert_near(run_error.unwrap(), expected, 1e-12);
    // Losses that come together have a larger error than single ones, which batches of packets find.
    let together = plain(10_000, 37, |number| (number / 100).is_multiple_of(10));
    assert!(errors(together.packets()).0 > 3.0 * errors(first.packets()).0);
}

fn runs_of(measurements: &Measurements) -> Vec<f64> {
    runs(measurements.packets())
}
