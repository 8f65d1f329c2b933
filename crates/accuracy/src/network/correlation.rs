//! Correlated jitter: requested and delivered correlation.

use std::time::Duration;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Correlation, Delay, Distribution, Fate, Jitter, Link, LinkConfig, LinkModel, LinkName};

use super::losses::kernel;
use super::{Effort, RowSink, real, row};
use crate::cost::{nanos, processor_time};
use crate::{AccuracyError, Row};

/// Requested autocorrelation at lag one.
const ASKED: f64 = 0.75;
/// Mean delay.
const MEAN: Duration = Duration::from_millis(24);
/// Standard deviation of the delay.
const SD: Duration = Duration::from_millis(2);

/// Seeds of the links whose figures are averaged.
const SEEDS: [u64; 4] = [1, 2, 3, 4];

/// Measures the rows of correlated jitter.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    for (name, distribution, words) in [
        ("normal", Distribution::Normal, Some("delay 24ms 2ms 75% distribution normal")),
        // Half the width of netem's uniform law is √3 deviations.
        ("uniform", Distribution::Uniform, Some("delay 24ms 3464us 75%")),
        ("gamma", Distribution::Gamma, None),
    ] {
        let case = format!("jitter, {name}, correlation {ASKED}");
        let what = "Gaussian copula: the law of each delay stays as asked";
        of_model(&case, "copula", &ours(distribution), what, effort, done)?;
        if let Some(words) = words {
            let what = "running mean of uniform words, of whose remainder the delay is made";
            of_model(&case, "kernel-6.6", &kernel(words), what, effort, done)?;
        }
    }
    Ok(())
}

/// Returns the link of the program with correlated jitter.
fn ours(distribution: Distribution) -> LinkModel {
    let jitter = Jitter { correlation: Correlation::PerPacket(ASKED), ..Jitter::new(SD, distribution) };
    let delay = Delay::with_jitter(MEAN, jitter).expect("a law with this correlation");
    LinkConfig { delay, ..LinkConfig::default() }.into()
}

/// Measures the rows of one model.
fn of_model(case: &str, method: &str, model: &LinkModel, what: &str, effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let packets = effort.correlated_packets / SEEDS.len();
    let (mut at_lag_one, mut variance) = (0.0, 0.0);
    let start = processor_time();
    for seed in SEEDS {
        let seen = moments(&delays(model, seed, packets));
        at_lag_one += seen[0] / real(SEEDS.len());
        variance += seen[1] / real(SEEDS.len());
        done.check()?;
    }
    let n = real(packets * SEEDS.len());
    let cost = (nanos(processor_time() - start) / n, "ns a packet");
    let row = Row { reference: "what was asked", ..row(case, method, format!("{} packets", packets * SEEDS.len()), cost) };
    // Bartlett's formulas give the standard errors of both figures for n packets of a Gaussian chain.
    let square = ASKED * ASKED;
    let (of_lag, of_sd) = (((1.0 - square) / n).sqrt(), (0.5 * (1.0 + square) / (1.0 - square) / n).sqrt());
    let note = |figure: String, noise: f64| format!("{figure}; {what}; this number of packets leaves {noise:.1e} open");
    done.push(Row {
        error: Some((at_lag_one - ASKED).abs()),
        error_unit: "autocorrelation at lag one [1]",
        note: note(format!("{at_lag_one:.4} in place of {ASKED}"), of_lag),
        ..row.clone()
    })?;
    let relative = variance.sqrt() / SD.as_secs_f64() - 1.0;
    done.push(Row {
        error: Some(relative.abs()),
        error_unit: "standard deviation [relative]",
        note: note(format!("{:+.2} %", 100.0 * relative), of_sd),
        ..row
    })
}

/// Returns the delays of packets a millisecond apart, in the order of sending \[s\].
fn delays(model: &LinkModel, seed: u64, packets: usize) -> Vec<f64> {
    let mut link = Link::new(seed, &LinkName::between("left", "right"), model.clone());
    let mut delays = vec![0.0; packets];
    let mut now = Instant::ZERO;
    let mut note = |link: &mut Link<usize>| {
        while let Some(event) = link.poll_event() {
            if let Fate::Delivered(at) = event.fate {
                // The payload is the number of the packet: packets may arrive out of order.
                delays[event.payload] = at.saturating_duration_since(event.offered).as_secs_f64();
            }
        }
    };
    for packet in 0..packets {
        now += Duration::from_millis(1);
        // Packets on the way leave before the next packet is offered, in the order of time.
        while let Some(at) = link.poll_timeout().filter(|at| *at <= now) {
            link.handle_timeout(at).expect("time goes on");
            note(&mut link);
        }
        link.handle_packet(now, Bytes::new(64), packet).expect("time goes on");
        note(&mut link);
    }
    while let Some(at) = link.poll_timeout() {
        link.handle_timeout(at).expect("time goes on");
        note(&mut link);
    }
    delays
}

/// Returns the autocorrelation at lag one, and the variance.
fn moments(delays: &[f64]) -> [f64; 2] {
    let n = real(delays.len());
    let mean = delays.iter().sum::<f64>() / n;
    let variance = delays.iter().map(|delay| (delay - mean).powi(2)).sum::<f64>() / n;
    let covariance = delays.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>() / n;
    [covariance / variance, variance]
}
