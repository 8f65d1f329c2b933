//! The text about a fitted link.

use std::time::Duration;

use cohaptic_measure::fit::{Independence, LossFit, LossModel};
use cohaptic_units::print::{Counted, Span};

use super::ends::Ends;
use super::milliseconds::milliseconds;
use super::probed::Probed;
use super::{Answered, Estimate, Kind, clocks, hold_out, recorded};

/// Returns the text about a link: the link, the read packets and the goodness of each law, or what a file records.
#[must_use]
pub fn words(answered: &Answered) -> String {
    match &answered.kind {
        Kind::Estimated(estimate) => estimated(&answered.scene, estimate),
        Kind::Recorded(recording) => recorded::words(&answered.scene, recording),
    }
}

fn estimated(scene: &str, estimate: &Estimate) -> String {
    let goodness = &estimate.fitted.goodness;
    let mut text = format!("{scene}\n");
    let mut line = |line: String| text.push_str(&format!("{line}\n"));
    let instants = estimate.measurements.instants();
    // If most gaps are zero, the packets come in bursts, and the spacing is the spacing of the bursts.
    let are_bursts = 2 * instants <= goodness.packets;
    let (bursts, burst) = if are_bursts { (format!(" in {}", Counted(instants, "burst")), " burst") } else { (String::new(), "") };
    let spaced = if goodness.evenly_spaced { "evenly" } else { "unevenly" };
    line(format!(
        "{}{bursts}, {} arrived, one{burst} every {} ({spaced}); they say as much as {:.0} independent ones",
        Counted(goodness.packets, "packet"),
        goodness.received,
        milliseconds(goodness.spacing_s),
        goodness.effective
    ));
    estimate.matched.as_ref().map_or_else(Vec::new, Ends::describe).into_iter().for_each(&mut line);
    estimate.probed.as_ref().map_or_else(Vec::new, Probed::describe).into_iter().for_each(&mut line);
    clocks::describe(&estimate.clocks, estimate.skew.as_ref()).into_iter().for_each(&mut line);
    let error = goodness.mean_se_s.map_or_else(String::new, |error| format!(" +- {}", milliseconds(error)));
    line(format!(
        "mean {}{error}, standard deviation {} +- {}, least {}, in steps of {}",
        milliseconds(goodness.mean_s),
        milliseconds(goodness.sd_s),
        milliseconds(goodness.sd_se_s),
        milliseconds(goodness.least_s),
        step(goodness.resolution_s)
    ));
    line(format!("\n  {:<12}{:>14}{:>14}{:>14}{:>16}{:>12}{:>12}", "law", "mean", "sd", "floor", "AIC - best", "Kolmogorov", "p-value"));
    // Criteria of information only compare laws, so their distance from the best law is shown.
    let best = goodness.laws.iter().map(|law| law.aic).fold(f64::INFINITY, f64::min);
    for law in &goodness.laws {
        let floor = law.floor_s.map_or_else(|| "-".to_owned(), milliseconds);
        let [mean, sd] = [law.mean_s, law.sd_s].map(milliseconds);
        let (name, aic) = (law.distribution.name(), law.aic - best);
        let mark = if law.fits { "" } else { "  *" };
        line(format!("  {name:<12}{mean:>14}{sd:>14}{floor:>14}{aic:>16.1}{:>12.5}{:>12.5}{mark}", law.kolmogorov, law.p_value));
    }
    if goodness.laws.iter().any(|law| !law.fits) {
        line(format!("  * does not fit: its distance from the delays (Kolmogorov) is above {:.5}", goodness.kolmogorov_limit));
    }
    // Fitting laws come first, so the first law tells whether any law fits.
    if goodness.laws.first().is_none_or(|law| !law.fits) {
        line("no law fits: the link draws from the measured delays, a file that --out writes next to the link".to_owned());
    }
    match goodness.correlation {
        None => line(format!("\n{}", without_memory(goodness.independence))),
        Some(correlation) => {
            let [time, lag] = [correlation.time_se_s.map(milliseconds), correlation.lag_one_se.map(|error| format!("{error:.5}"))]
                .map(|error| error.map_or_else(String::new, |error| format!(" +- {error}")));
            let share = if correlation.share < 1.0 {
                let error = correlation.share_se.map_or_else(String::new, |error| format!(" +- {error:.5}"));
                format!(" of the share {:.5}{error} of the variance; the rest differs from packet to packet", correlation.share)
            } else {
                String::new()
            };
            line(format!(
                "\ncorrelation time {}{time}{share}, normal scores of neighbours {:.5}{lag}",
                milliseconds(correlation.time_s),
                correlation.lag_one
            ));
            if let Some(rest) = goodness.independence.filter(|rest| !rest.holds()) {
                line(format!("the correlation time is NOT all of the memory of the delays, and the link leaves the rest out: {}", found(&rest)));
            }
        }
    }
    line(format!("\n  {:<60}{:>12}{:>14}", "loss", "mean", "BIC - best"));
    // The chosen model of loss comes first.
    let best = goodness.losses.first().map_or(0.0, |loss| loss.bic);
    for loss in &goodness.losses {
        line(format!("  {:<60}{:>10.5} %{:>14.1}", model(loss), loss.mean_loss * 100.0, loss.bic - best));
    }
    if let Some(judged) = &estimate.held_out {
        text.push_str(&hold_out::words(judged));
    }
    text
}

/// Returns the figures of a test of independence.
fn found(test: &Independence) -> String {
    let Independence { neighbours, neighbours_se, lags, p_value, .. } = test;
    format!("rank correlation of neighbours {neighbours:.5} +- {neighbours_se:.5}, p-value of {} {p_value:.5}", Counted(*lags, "lag"))
}

/// Returns the sentences about a link with independent delays: whether the measured delays are independent too.
fn without_memory(test: Option<Independence>) -> String {
    let Some(test) = test else { return "delays are independent in the link; no two neighbours arrived to tell whether they were".to_owned() };
    let found = found(&test);
    if test.holds() {
        return format!("delays are as good as independent: {found}");
    }
    [
        format!("delays are NOT independent: {found}"),
        "no single correlation time describes them, so the link leaves their memory out: its delays are independent.".to_owned(),
        "--hold-out shows what that changes; a trace of the measurement keeps the memory".to_owned(),
    ]
    .join("\n")
}

fn model(loss: &LossFit) -> String {
    match loss.model {
        LossModel::None => "none".to_owned(),
        LossModel::Independent { .. } => "independent".to_owned(),
        LossModel::GilbertElliott { p, r, h, k } => format!("Gilbert-Elliott p {p:.5} r {r:.5} h {h:.3} k {k:.5}"),
        LossModel::GilbertElliottInTime { mean_good_s, mean_bad_s } => format!("in time, good {mean_good_s:.4} s bad {mean_bad_s:.4} s"),
    }
}

/// Returns the resolution of a clock as a span. The resolution is a round number of seconds, which `f64` may miss by a nanosecond.
fn step(seconds: f64) -> Span {
    Span(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
}
