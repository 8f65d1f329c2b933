//! The figures achieved, compared with those asked for.
//!
//! Each stage is judged by the packets that reached it, not counting copies: the loss model by packets that no outage took, damage by those that were
//! not lost. So a figure is near the one asked for whatever the other stages do. A delay is compared only where nothing but its law makes it (no queue,
//! no slots, no reordering, no order that makes packets wait).
//!
//! Standard errors are those of 30 batch means, or of fewer where packets remember for long, which take correlation into account, but not below those of
//! independent packets. A quantile is judged by the share of packets that are not above the one asked for.

use cohaptic_wan::{Distribution, DropCause, Fate, PacketRecord};
use serde::Serialize;

use crate::asked::{Asked, QUANTILES};
use crate::batches;
use crate::series::{self, count};

/// One figure.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Figure {
    /// Its name: `mean_s`, `sd_s`, `quantile_0.95_s`, `autocorrelation_1`, `loss`, `duplicated`, `damaged`.
    pub name: String,
    /// What was asked for.
    pub asked: f64,
    /// What was achieved; `None` if no packet can tell.
    pub achieved: Option<f64>,
    /// The standard error of what was achieved; `None` where packets are too few or remember for too long, or where the law has no such error (the deviation
    /// and the autocorrelation of Pareto's laws, whose fourth moment is infinite); zero where nothing varies.
    pub standard_error: Option<f64>,
    /// Whether what was asked for lies more than four standard errors away.
    pub outside: bool,
}

/// How many standard errors are too many: 1 in 2500 with 29 degrees of freedom (Student), 1 in 600 where there are only 10 batches.
const TOO_MANY: f64 = 4.0;
/// Delays count whole nanoseconds.
const ROUNDING_S: f64 = 1e-9;

/// What became of one packet, not of its copies.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    end: Option<Fate>,
    delay_s: f64,
    copied: bool,
    marked: bool,
    damaged: bool,
}

/// Takes the records of one link in any order and compares figures with those asked for. It holds 48 bytes a packet.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    packets: Vec<Seen>,
}

impl Comparison {
    /// Takes one record. Packets are numbered from 0 without gaps.
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

    /// Every figure that was asked for and can be compared. Delays first.
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
        // A damaged packet has travelled as long as a whole one.
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
        // Of Pareto's tail the fourth moment is infinite, and so is the variance of squares.
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
            // Half a nanosecond above, since delays are rounded.
            let share = law.cdf(wanted * 1e9 + 0.5);
            let below: Vec<f64> = delays.iter().map(|delay| f64::from(u8::from(*delay <= wanted + 0.5 * ROUNDING_S))).collect();
            let judged = of_share("", share, wanted, &below, quantile(&sorted, p));
            // The error of a quantile is that of the share over the density, here from the distance over which the share changes by one error, to the side on
            // which that is farther.
            let error = judged.standard_error.and_then(|error| {
                let [low, middle, high] = [p - error, p, p + error].map(|p| law.quantile(p.clamp(0.0, 1.0)));
                (p > error && p + error < 1.0).then_some((high - middle).max(middle - low) / 1e9)
            });
            figures.push(Figure { name: format!("quantile_{name}_s"), standard_error: error, ..judged });
        }
        let unbroken = self.packets.iter().all(|seen| !seen.copied);
        if let (Some(&wanted), true) = (asked.autocorrelation.first(), unbroken) {
            // Of the pairs alone: where packets are lost, the variance over all delays is another one than theirs.
            let achieved = mean.and_then(|mean| {
                let pairs = by_packet.windows(2).filter_map(|pair| Some((pair[0]? - mean, pair[1]? - mean)));
                let (products, squares) = pairs.fold((0.0, 0.0), |(products, squares), (x, y)| (products + x * y, squares + (x * x + y * y) / 2.0));
                (squares > 0.0).then_some(products / squares)
            });
            let error = achieved.zip(mean).zip(variance).and_then(|((r, mean), variance)| {
                // The influence of each pair on the autocorrelation.
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

/// A share that is judged against the probability `share`, and shown as `asked` and `shown`.
fn of_share(name: &str, share: f64, asked: f64, happened: &[f64], shown: Option<f64>) -> Figure {
    let achieved = series::mean(happened);
    // Of what was asked for: of nothing that happened one cannot tell.
    let independent = (share * (1.0 - share) / count(happened.len().max(1))).sqrt();
    let error = worst(batches::batch_standard_error(happened), Some(independent));
    let judged = figure(name, share, achieved, error, 1e-12);
    Figure { asked, achieved: shown.or(achieved), ..judged }
}

fn figure(name: &str, asked: f64, achieved: Option<f64>, standard_error: Option<f64>, tolerance: f64) -> Figure {
    let outside = achieved.zip(standard_error).is_some_and(|(achieved, error)| (achieved - asked).abs() > TOO_MANY * error + tolerance);
    Figure { name: name.to_owned(), asked, achieved, standard_error, outside }
}

/// The larger of the two, if there is the first.
fn worst(batches: Option<f64>, independent: Option<f64>) -> Option<f64> {
    batches.map(|batches| independent.map_or(batches, |independent| batches.max(independent)))
}

/// The order statistic at that share; `None` of nothing.
fn quantile(sorted: &[f64], p: f64) -> Option<f64> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and no longer than the list")]
    let place = (p * count(sorted.len().saturating_sub(1))).round() as usize;
    sorted.get(place).copied()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use cohaptic_units::Bytes;
    use cohaptic_wan::netem::Netem;
    use cohaptic_wan::{Link, LinkConfig, LinkName, PacketInfo};

    use super::*;
    use crate::steady::SteadyStream;

    fn config(words: &str) -> LinkConfig {
        Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap()
    }

    /// What a link that was asked for one thing looks like beside another.
    fn figures(asked: &str, done: &str) -> Vec<Figure> {
        let info = PacketInfo { size: Bytes::new(64), ecn_capable: true };
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
                |_| true,
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

    /// Pareto's law of tail index 3 has no fourth moment: the variance of its squares, from which the error of a deviation comes, is infinite.
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
