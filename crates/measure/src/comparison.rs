//! Compares achieved figures of a link with asked figures.
//!
//! Each stage is judged by the packets that reached the stage, without copies: the loss model by packets that passed all outages, damage by packets that
//! were not lost. So the other stages do not move a figure away from its law. Delays are compared only if the delay's law alone decides them: no queue, no
//! slots, no reordering, and no waiting for the order.
//!
//! Standard errors are those of 30 batch means, which take correlation into account, or of fewer batches if packets have a long memory. A standard error is
//! never below that of independent packets. A quantile is judged by the share of packets at or below the asked quantile.

use cohaptic_wan::{Distribution, DropCause, Fate, PacketRecord};
use serde::Serialize;

use crate::asked::{Asked, QUANTILES};
use crate::batches;
use crate::series::{self, count};

/// Comparison of a single figure.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Figure {
    /// Name of the figure: `mean_s`, `sd_s`, `quantile_0.95_s`, `autocorrelation_1`, `loss`, `duplicated`, `damaged`.
    pub name: String,
    /// Value asked for.
    pub asked: f64,
    /// Value achieved; `None` if no packet tells the figure.
    pub achieved: Option<f64>,
    /// Standard error of the achieved value; zero if nothing varies. `None` if packets are too few or have a too long memory, or if the law has no such
    /// error: deviation and autocorrelation of Pareto laws, with an infinite fourth moment.
    pub standard_error: Option<f64>,
    /// `true` if the asked value is more than four standard errors away.
    pub outside: bool,
}

/// Limit of the difference in standard errors. Chance exceeds the limit once in 2500 comparisons with 29 degrees of freedom (Student), and once in 600 with
/// 10 batches.
const TOO_MANY: f64 = 4.0;
/// Rounding of delays to whole nanoseconds \[s\].
const ROUNDING_S: f64 = 1e-9;

/// History of a packet, without its copies.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Final fate; `None` while the packet is on the way.
    end: Option<Fate>,
    delay_s: f64,
    copied: bool,
    marked: bool,
    damaged: bool,
}

/// Collects the records of a link, in any order, and compares figures with asked figures. Needs 48 bytes per packet.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Packets, indexed by sequence number.
    packets: Vec<Seen>,
}

impl Comparison {
    /// Adds a record. Packets are numbered from 0 without gaps.
    pub fn record(&mut self, record: &PacketRecord) {
        let Ok(number) = usize::try_from(record.sequence) else { return };
        if number >= self.packets.len() {
            self.packets.resize(number + 1, Seen::default());
        }
        let seen = &mut self.packets[number];
        if record.fate == Fate::Duplicated {
            seen.copied = true;
        } else if record.copy == 0 && record.fate.is_end() {
            seen.end = Some(record.fate);
            seen.delay_s = record.at.saturating_duration_since(record.offered).as_secs_f64();
            seen.marked = record.marked;
            seen.damaged = record.damaged;
        }
    }

    /// Compares all asked figures with an achieved counterpart, delays first.
    #[must_use]
    pub fn figures(&self, asked: &Asked) -> Vec<Figure> {
        let mut figures = Vec::new();
        self.delays(asked, &mut figures);
        let stages = &asked.stages;
        let is = |seen: &Seen, causes: &[DropCause]| matches!(seen.end, Some(Fate::Dropped(cause)) if causes.contains(&cause));
        let before_loss = [DropCause::Filter, DropCause::Mtu, DropCause::Outage];
        let lost = |seen: &Seen| is(seen, &[DropCause::Loss]);
        let mut share = |name: &str, asked: Option<f64>, reached: &dyn Fn(&Seen) -> bool, happened: &dyn Fn(&Seen) -> bool| {
            let Some(asked) = asked else { return };
            let series: Vec<f64> = self.packets.iter().filter(|seen| reached(seen)).map(|seen| f64::from(u8::from(happened(seen)))).collect();
            figures.push(of_share(name, asked, asked, &series, None));
        };
        let offered = |seen: &Seen| seen.end.is_some() && !is(seen, &before_loss);
        share("loss", asked.loss, &offered, &|seen| lost(seen) || (stages.marks && seen.marked));
        share("duplicated", asked.duplicated, &|seen| offered(seen) && (stages.copies_first || !lost(seen)), &|seen| seen.copied);
        share("damaged", asked.damaged, &|seen| offered(seen) && !lost(seen), &|seen| seen.damaged || is(seen, &[DropCause::Checksum]));
        figures
    }

    fn delays(&self, asked: &Asked, figures: &mut Vec<Figure>) {
        let Some(delay) = &asked.stages.delay else { return };
        // A damaged packet has the delay of an undamaged packet, even if its checksum leads to a drop at the end.
        let travelled = |seen: &Seen| matches!(seen.end, Some(Fate::Delivered(_) | Fate::Dropped(DropCause::Checksum))).then_some(seen.delay_s);
        let by_packet: Vec<Option<f64>> = self.packets.iter().map(travelled).collect();
        let delays: Vec<f64> = by_packet.iter().filter_map(|delay| *delay).collect();
        let (mean, variance) = (series::mean(&delays), series::variance(&delays));
        let independent = variance.map(|variance| (variance / count(delays.len())).sqrt());
        let mean_error = worst(batches::batch_standard_error(&delays), independent);
        if let Some(wanted) = asked.mean_s {
            figures.push(figure("mean_s", wanted, mean, mean_error, ROUNDING_S));
        }
        let sd = variance.map(f64::sqrt);
        // Pareto laws have an infinite fourth moment, so the variance of the squares is infinite.
        let squares_vary = !delay.law().is_some_and(|law| matches!(law.distribution(), Distribution::Pareto | Distribution::ParetoNormal));
        if let (Some(wanted), Some(mean)) = (asked.sd_s, mean) {
            let squares: Vec<f64> = delays.iter().map(|delay| (delay - mean).powi(2)).collect();
            let error = sd.and_then(|sd| if sd > 0.0 { Some(batches::batch_standard_error(&squares)? / (2.0 * sd)) } else { Some(0.0) });
            figures.push(figure("sd_s", wanted, sd, error.filter(|_| squares_vary), ROUNDING_S));
        }
        let Some(law) = delay.law() else { return };
        let mut sorted = delays.clone();
        sorted.sort_by(f64::total_cmp);
        for (name, p) in QUANTILES {
            let Some(&wanted) = asked.quantiles_s.get(name) else { continue };
            // Half a nanosecond above the quantile, because delays are rounded to nanoseconds.
            let share = law.cdf(wanted * 1e9 + 0.5);
            let below: Vec<f64> = delays.iter().map(|delay| f64::from(u8::from(*delay <= wanted + 0.5 * ROUNDING_S))).collect();
            let judged = of_share("", share, wanted, &below, quantile(&sorted, p));
            // The error of a quantile is the error of the share divided by the density. The density is taken from the distance over which the share changes
            // by one error, on the side with the longer distance.
            let error = judged.standard_error.and_then(|error| {
                let [low, middle, high] = [p - error, p, p + error].map(|p| law.quantile(p.clamp(0.0, 1.0)));
                (p > error && p + error < 1.0).then_some((high - middle).max(middle - low) / 1e9)
            });
            figures.push(Figure { name: format!("quantile_{name}_s"), standard_error: error, ..judged });
        }
        let unbroken = self.packets.iter().all(|seen| !seen.copied);
        if let (Some(&wanted), true) = (asked.autocorrelation.first(), unbroken) {
            // Means over pairs only: if packets are lost, the variance over all delays differs from the variance over pairs.
            let achieved = mean.and_then(|mean| {
                let pairs = by_packet.windows(2).filter_map(|pair| Some((pair[0]? - mean, pair[1]? - mean)));
                let (products, squares) = pairs.fold((0.0, 0.0), |(products, squares), (x, y)| (products + x * y, squares + (x * x + y * y) / 2.0));
                (squares > 0.0).then_some(products / squares)
            });
            let error = achieved.zip(mean).zip(variance).and_then(|((r, mean), variance)| {
                // Influence of each pair on the autocorrelation: the derivative of the ratio of sums.
                let influence = |pair: &[Option<f64>]| {
                    let (x, y) = (pair[0]? - mean, pair[1]? - mean);
                    Some((x * y - r * (x * x + y * y) / 2.0) / variance)
                };
                let influences: Vec<f64> = by_packet.windows(2).filter_map(influence).collect();
                let independent = series::variance(&influences).map(|variance| (variance / count(influences.len())).sqrt());
                worst(batches::batch_standard_error(&influences), independent)
            });
            figures.push(figure("autocorrelation_1", wanted, achieved, error.filter(|_| squares_vary), 0.0));
        }
    }
}

/// Judges a share against the probability `share`. The result shows `asked` and `shown`, or the achieved share for `shown` of `None`.
fn of_share(name: &str, share: f64, asked: f64, happened: &[f64], shown: Option<f64>) -> Figure {
    let achieved = series::mean(happened);
    // The variance of the asked probability, because an achieved share of zero would have no variance. The error by batches is scaled to this variance too: a
    // series with too few events has an error that is too small, and would be told apart from what was asked too often.
    let independent = (share * (1.0 - share) / count(happened.len().max(1))).sqrt();
    let found = achieved.map_or(0.0, |achieved| (achieved * (1.0 - achieved) / count(happened.len())).sqrt());
    let batches = batches::batch_standard_error(happened).map(|error| if found > 0.0 { error * (independent / found) } else { error });
    let error = worst(batches, Some(independent));
    let judged = figure(name, share, achieved, error, 1e-12);
    Figure { asked, achieved: shown.or(achieved), ..judged }
}

/// Makes a figure. Differences up to `tolerance` count as rounding.
fn figure(name: &str, asked: f64, achieved: Option<f64>, standard_error: Option<f64>, tolerance: f64) -> Figure {
    let outside = achieved.zip(standard_error).is_some_and(|(achieved, error)| (achieved - asked).abs() > TOO_MANY * error + tolerance);
    Figure { name: name.to_owned(), asked, achieved, standard_error, outside }
}

/// Returns the larger of two errors; `None` without an error by batches.
fn worst(batches: Option<f64>, independent: Option<f64>) -> Option<f64> {
    batches.map(|batches| independent.map_or(batches, |independent| batches.max(independent)))
}

/// Returns the order statistic nearest to a probability; `None` for an empty list.
fn quantile(sorted: &[f64], p: f64) -> Option<f64> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and no longer than the list")]
    let place = (p * count(sorted.len().saturating_sub(1))).round() as usize;
    sorted.get(place).copied()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_units::{Bytes, Ecn};
    use cohaptic_wan::netem::Netem;
    use cohaptic_wan::{Link, LinkConfig, LinkName, PacketInfo};

    use super::*;
    use crate::steady::SteadyStream;

    fn config(words: &str) -> LinkConfig {
        Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap()
    }

    /// Returns the comparison of a link configured by `done` with the figures asked by `asked`.
    fn figures(asked: &str, done: &str) -> Vec<Figure> {
        let info = PacketInfo { size: Bytes::new(64), ecn: Ecn::Capable0 };
        let stream = SteadyStream { packets: 60_000, every: Duration::from_millis(1), info };
        let mut beside = Comparison::default();
        let mut link = Link::new(5, &LinkName::between("a", "b"), config(done));
        stream
            .over(
                &mut link,
                |record| {
                    beside.record(record);
                    Ok::<(), ()>(())
                },
                |_, _| true,
            )
            .unwrap();
        beside.figures(&Asked::of_config(&config(asked), stream.every, info.size))
    }

    const WORDS: [&str; 5] = [
        "delay 40ms 4ms 60% distribution normal loss 2% 40%",
        "delay 40ms 4ms loss gemodel 1% 20% 90% 1% duplicate 3%",
        "delay 40ms 4ms distribution pareto corrupt 2% loss state 2% 60% 25% 50% 1%",
        "delay 4ms 4ms distribution normal loss 5% ecn",
        "delay 20ms",
    ];

    #[test]
    fn a_link_that_does_as_it_is_told_is_never_outside() {
        for words in WORDS {
            let figures = figures(words, words);
            assert!(figures.len() >= 3, "{figures:#?}");
            assert!(figures.iter().all(|figure| !figure.outside && figure.achieved.is_some()), "{words}: {figures:#?}");
        }
    }

    #[test]
    fn a_link_that_does_something_else_is_found_out() {
        let outside = |asked: &str, done: &str| -> Vec<String> {
            figures(asked, done).into_iter().filter(|figure| figure.outside).map(|figure| figure.name).collect()
        };
        assert_eq!(outside("delay 20ms", "delay 21ms"), ["mean_s"]);
        assert_eq!(outside("delay 40ms 4ms 50% distribution normal", "delay 40ms 4ms distribution normal"), ["autocorrelation_1"]);
        assert_eq!(outside("delay 40ms loss 2%", "delay 40ms loss 3%"), ["loss"]);
        assert_eq!(outside("delay 40ms duplicate 2% corrupt 2%", "delay 40ms duplicate 3% corrupt 1%"), ["duplicated", "damaged"]);
        let law = outside("delay 40ms 4ms distribution normal", "delay 40ms 6.928203ms");
        assert!(law.contains(&"quantile_0.99_s".to_owned()) && !law.contains(&"mean_s".to_owned()) && !law.contains(&"sd_s".to_owned()), "{law:?}");
    }

    /// Pareto's law with tail index 3 has no fourth moment. The error of the deviation would need the variance of squares, which is infinite.
    #[test]
    fn an_error_that_does_not_exist_is_not_stated() {
        let words = "delay 40ms 4ms distribution pareto";
        let without: Vec<String> =
            figures(words, words).into_iter().filter(|figure| figure.standard_error.is_none()).map(|figure| figure.name).collect();
        assert_eq!(without, ["sd_s", "autocorrelation_1"]);
    }

    #[test]
    fn delays_behind_a_queue_are_not_compared() {
        let figures = figures("delay 40ms 4ms rate 8mbit loss 1%", "delay 40ms 4ms rate 8mbit loss 1%");
        assert_eq!(figures.iter().map(|figure| figure.name.as_str()).collect::<Vec<_>>(), ["loss"]);
    }
}
