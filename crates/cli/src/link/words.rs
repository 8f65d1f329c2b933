//! What a link was asked for and what it achieved, as a table.

use std::fmt::Write as _;

use cohaptic_measure::achieved::Achieved;
use cohaptic_measure::beside::Figure;

use super::Measured;
use super::spec::Spec;

pub(super) fn describe(spec: &Spec, measured: &Measured) -> String {
    let mut text = format!("{}\n", spec.said);
    // Writing to a string does not fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{}", line.trim_end());
    };
    if measured.interrupted {
        line(format!("  INTERRUPTED after {} of {} packets", measured.sent, measured.wanted));
    }
    line(format!("  {:<24}{:>14}{:>14}{:>14}", "", "asked", "achieved", "std. error"));
    for figure in &measured.figures {
        line(row(figure));
    }
    let compared = |name: &str| measured.figures.iter().any(|figure| figure.name == name);
    for (name, asked, achieved) in others(spec, &measured.achieved) {
        if !compared(name) && (asked.is_some() || achieved.is_some()) {
            line(format!("  {:<24}{:>14}{:>14}", label(name), shown(name, asked), shown(name, achieved)));
        }
    }
    if measured.figures.iter().any(|figure| figure.outside) {
        line("  * asked for is more than 4 standard errors away".to_owned());
    }
    let fates = &measured.achieved.fates;
    let mut parts = vec![format!("{} packets sent", fates.offered), format!("{} delivered", fates.delivered)];
    let counts = [("copies", fates.duplicated), ("marked", fates.marked), ("delivered damaged", fates.damaged)];
    parts.extend(counts.into_iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{count} {name}")));
    parts.extend(fates.dropped.iter().filter(|(_, count)| **count > 0).map(|(cause, count)| format!("{count} dropped ({cause})")));
    line(format!("  {}", parts.join(", ")));
    line(format!("  {:.0} packets a second", measured.packets_per_s));
    for file in &measured.files {
        line(format!("  wrote {file}"));
    }
    text
}

fn row(figure: &Figure) -> String {
    let name = figure.name.as_str();
    let mark = if figure.outside { "  *" } else { "" };
    let [asked, achieved, error] = [Some(figure.asked), figure.achieved, figure.standard_error].map(|value| shown(name, value));
    format!("  {:<24}{asked:>14}{achieved:>14}{error:>14}{mark}", label(name))
}

/// What is shown where it was not compared.
fn others<'a>(spec: &Spec, achieved: &Achieved) -> [(&'a str, Option<f64>, Option<f64>); 6] {
    let delay = achieved.delay.as_ref();
    [
        ("mean_s", spec.asked.mean_s, delay.map(|delay| delay.mean_s)),
        ("sd_s", spec.asked.sd_s, delay.and_then(|delay| delay.sd_s)),
        ("autocorrelation_1", spec.asked.autocorrelation.first().copied(), delay.and_then(|delay| delay.autocorrelation.first().copied())),
        ("loss", spec.asked.loss, achieved.loss.value),
        ("reordered", None, achieved.order.reordered),
        ("rate_bit_s", spec.asked.rate_bit_s, achieved.throughput_bit_s),
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
        "rate_bit_s" => "rate",
        other => other,
    }
    .to_owned()
}

/// A figure in the unit that its name says.
fn shown(name: &str, value: Option<f64>) -> String {
    let Some(value) = value else { return "-".to_owned() };
    match name {
        "autocorrelation_1" => format!("{value:.5}"),
        "rate_bit_s" => format!("{:.3} kbit/s", value / 1e3),
        name if name.ends_with("_s") => format!("{:.5} ms", value * 1e3),
        _ => format!("{:.5} %", value * 100.0),
    }
}
