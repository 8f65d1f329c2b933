//! The table of a link's requested and achieved figures.

use std::fmt::Write as _;

use cohaptic_measure::comparison::Figure;
use cohaptic_units::print::Counted;

use super::{MOST_MEASURED, Measured};

/// Returns the text about a link.
#[must_use]
pub fn words(measured: &Measured) -> String {
    let mut text = format!("{}\n", measured.said);
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{}", line.trim_end());
    };
    if measured.is_interrupted() {
        line(format!("  INTERRUPTED after {} of {}", measured.sent, Counted(measured.wanted, "packet")));
    }
    line(format!("  {:<24}{:>18}{:>18}{:>14}", "", "asked", "achieved", "std. error"));
    for figure in &measured.figures {
        line(row(figure));
    }
    // A compared figure has a row already.
    let compared = |name: &str| measured.figures.iter().any(|figure| figure.name == name);
    for (name, asked, achieved, error) in others(measured) {
        if !compared(name) && (asked.is_some() || achieved.is_some()) {
            let error = error.map_or_else(String::new, |error| shown(name, Some(error)));
            line(format!("  {:<24}{:>18}{:>18}{error:>14}", label(name), shown(name, asked), shown(name, achieved)));
        }
    }
    if measured.figures.iter().any(|figure| figure.outside) {
        line("  * more than 4 standard errors from what was asked".to_owned());
    }
    if measured.achieved.delay.as_ref().is_some_and(|delay| delay.mean_se_s.is_none()) && measured.sent >= LEAST_JUDGED {
        line(
            "  no standard error: the delays change more slowly than a stream of this length can tell; longer: --every 8ms, or more --packets"
                .to_owned(),
        );
    }
    if !fills_the_rate(measured) {
        line("  the stream does not fill the rate: larger packets (--size) or less time between packets (--every) do".to_owned());
    }
    if measured.sent > MOST_MEASURED {
        line(format!("  figures describe the first {MOST_MEASURED} packets, counts all packets"));
    }
    let fates = &measured.achieved.fates;
    let mut parts = vec![format!("{} sent", Counted(fates.offered, "packet")), format!("{} delivered", fates.delivered)];
    let counts = [("copies", fates.duplicated), ("marked", fates.marked), ("delivered damaged", fates.damaged)];
    parts.extend(counts.into_iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{count} {name}")));
    parts.extend(fates.dropped.iter().filter(|(_, count)| **count > 0).map(|(cause, count)| format!("{count} dropped ({cause})")));
    line(format!("  {}", parts.join(", ")));
    if measured.cross_traffic.offered > 0 {
        line(format!("  beside {}", measured.cross_traffic));
    }
    text
}

fn row(figure: &Figure) -> String {
    let name = figure.name.as_str();
    let mark = if figure.outside { "  *" } else { "" };
    let [asked, achieved, error] = [Some(figure.asked), figure.achieved, figure.standard_error].map(|value| shown(name, value));
    format!("  {:<24}{asked:>18}{achieved:>18}{error:>14}{mark}", label(name))
}

/// Fewest packets for which a missing standard error has another reason than their number.
const LEAST_JUDGED: u64 = 1000;

/// Returns `false` if the achieved rate is that of the stream and not that of the link: the link has a rate, less than nine tenths of the rate arrived, no
/// cross-traffic had a share, and no queue dropped a packet.
fn fills_the_rate(measured: &Measured) -> bool {
    let (Some(asked), Some(achieved)) = (measured.asked.rate_bit_s, measured.achieved.throughput_bit_s) else { return true };
    let by_queues = measured.achieved.fates.dropped.iter().any(|(cause, count)| !["loss", "outage"].contains(cause) && *count > 0);
    achieved >= 0.9 * asked || measured.cross_traffic.offered > 0 || by_queues
}

/// A figure: name, requested value, achieved value, and standard error of the achieved value.
type Other = (&'static str, Option<f64>, Option<f64>, Option<f64>);

/// Returns the figures shown even if they were not compared.
fn others(measured: &Measured) -> [Other; 8] {
    let Measured { asked, achieved, .. } = measured;
    let (delay, loss) = (achieved.delay.as_ref(), &achieved.loss);
    let first = |lags: &[f64]| lags.first().copied();
    [
        ("mean_s", asked.mean_s, delay.map(|delay| delay.mean_s), delay.and_then(|delay| delay.mean_se_s)),
        ("sd_s", asked.sd_s, delay.and_then(|delay| delay.sd_s), delay.and_then(|delay| delay.sd_se_s)),
        ("autocorrelation_1", first(&asked.autocorrelation), delay.and_then(|delay| first(&delay.autocorrelation)), None),
        ("loss", asked.loss, loss.value, None),
        ("loss_run_mean", asked.loss_run_mean, loss.run_mean, loss.run_mean_se),
        ("loss_autocorrelation_1", first(&asked.loss_autocorrelation), first(&loss.autocorrelation), None),
        ("reordered", None, achieved.order.reordered, None),
        ("rate_bit_s", asked.rate_bit_s, achieved.throughput_bit_s, None),
    ]
}

fn label(name: &str) -> String {
    if let Some(p) = name.strip_prefix("quantile_").and_then(|rest| rest.strip_suffix("_s")) {
        return format!("quantile {p}");
    }
    match name {
        "mean_s" => "mean delay",
        "sd_s" => "standard deviation",
        "autocorrelation_1" => "autocorrelation, lag 1",
        "loss_run_mean" => "packets lost in a row",
        "loss_autocorrelation_1" => "autocorr. of loss, lag 1",
        "rate_bit_s" => "rate",
        other => other,
    }
    .to_owned()
}

/// Returns a value in the unit named by the end of the figure's name; a dash for `None`.
fn shown(name: &str, value: Option<f64>) -> String {
    let Some(value) = value else { return "-".to_owned() };
    match name {
        "autocorrelation_1" | "loss_autocorrelation_1" => format!("{value:.5}"),
        "loss_run_mean" => format!("{value:.5}"),
        // The name of the rate also ends in `_s`, so this arm comes before the arm for times.
        "rate_bit_s" => format!("{:.3} kbit/s", value / 1e3),
        name if name.ends_with("_s") => format!("{:.5} ms", value * 1e3),
        _ => format!("{:.5} %", value * 100.0),
    }
}
