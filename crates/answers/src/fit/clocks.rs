//! Corrects the clocks of the two ends before the fit: offset, steps and drift.

use cohaptic_measure::fit::{Measurements, Skew, Step};
use serde::Serialize;

use super::milliseconds::milliseconds;
use super::probed::describe_assumed;
use super::source::Measured;
use super::{Corrections, FitFailure};

/// Largest plausible mean delay \[s\]. A longer mean delay is more likely an offset between two clocks.
const QUESTIONED_S: f64 = 60.0;

/// Corrections applied to the clocks.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct Clocks {
    /// Time added to every delay \[s\]; `None` if nothing was added.
    #[serde(skip_serializing_if = "Option::is_none")]
    added_s: Option<f64>,
    /// `true` if `added_s` is assumed: half the difference of the least delays of both ways.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    is_assumed: bool,
    /// Instants of a lasting change of the least delay.
    steps: Vec<Step>,
    /// The fitted packets.
    fitted: Fitted,
    #[serde(skip)]
    all: usize,
}

/// Consecutive packets between two steps.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Fitted {
    /// Index of the first packet, from 0.
    first: usize,
    packets: usize,
}

/// Corrects the measurements so that both ends could share one clock. Returns the corrected measurements, the applied corrections, and the estimated drift if
/// requested. With one clock, steps and long delays are left as properties of the link.
///
/// # Errors
///
/// [`FitFailure::Measurements`] if a correction is impossible, [`FitFailure::LongDelays`] if the mean delay suggests an uncorrected offset.
pub(super) fn settled(asked: &Corrections, measured: &Measured) -> Result<(Measurements, Clocks, Option<Skew>), FitFailure> {
    let refused = |error: &dyn std::fmt::Display| FitFailure::Measurements(error.to_string());
    let Measured { measurements, has_one_clock, probed, .. } = measured;
    let has_one_clock = *has_one_clock;
    // Half of a round trip has half of the tick that its program printed.
    let share = probed.as_ref().and_then(|probed| probed.share).unwrap_or(1.0);
    let ticked = asked.tick.map(|tick| tick.of(measurements.clone(), share)).transpose().map_err(|error| refused(&error))?;
    let measurements = ticked.as_ref().unwrap_or(measurements);
    // A value that the user knows replaces the value that a reader assumed.
    let assumed_s = probed.as_ref().and_then(|probed| probed.added_s);
    let is_assumed = assumed_s.is_some() && asked.offset_s.is_none() && asked.least.is_none();
    let mut added_s = asked.offset_s.or_else(|| assumed_s.filter(|_| is_assumed));
    // The user's offset replaces the assumed offset, which the reader has already added to the delays.
    let shifted = asked.offset_s.map(|by| measurements.shifted(by - assumed_s.unwrap_or(0.0))).transpose().map_err(|error| refused(&error))?;
    let measurements = shifted.as_ref().unwrap_or(measurements);
    // With one clock a change of the least delay is a change of the path, and belongs to the link.
    let steps = if has_one_clock { Vec::new() } else { measurements.steps() };
    // Between two steps the offset is constant, so only the longest such part is fitted.
    let longest = measurements.longest_part(&steps);
    let fitted = Fitted { first: longest.start, packets: longest.len() };
    let part = measurements.part(longest);
    let (mut settled, skew) = if asked.skew {
        let (corrected, skew) = part.without_skew().map_err(|error| refused(&error))?;
        (corrected, Some(skew))
    } else {
        (part, None)
    };
    // The offset is chosen after the drift is removed, because the drift changes the least delay.
    if let (Some(least), Some(found)) = (asked.least, settled.least_s()) {
        let by = least.as_secs_f64() - found;
        settled = settled.shifted(by).map_err(|error| refused(&error))?;
        // The answer gives the time added to the delays of the file, including the time added by the reader.
        added_s = Some(by + assumed_s.unwrap_or(0.0));
    }
    // A known offset, or a single clock for both ends, makes long delays credible.
    if let Some(mean_s) = settled.mean_s().filter(|mean| *mean > QUESTIONED_S && added_s.is_none() && !has_one_clock) {
        return Err(FitFailure::LongDelays { mean_s });
    }
    let clocks = Clocks { added_s, is_assumed, steps, fitted, all: measurements.packets().len() };
    Ok((settled, clocks, skew))
}

/// Returns the lines of text about the corrections.
pub(super) fn describe(clocks: &Clocks, skew: Option<&Skew>) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(added_s) = clocks.added_s {
        let known = || format!("{} was added to every delay", milliseconds(added_s));
        lines.push(if clocks.is_assumed { describe_assumed(added_s) } else { known() });
    }
    for step in &clocks.steps {
        let by = step.by_s * 1e3;
        lines.push(format!("the least delay changes by {by:+.5} ms at {:.3} s and stays so: a clock was set, or the path changed", step.at_s));
    }
    if !clocks.steps.is_empty() {
        let Fitted { first, packets } = clocks.fitted;
        let parts = clocks.steps.len() + 1;
        lines.push(format!("all figures are of the longest of these {parts} parts, packets {} to {} of {}", first + 1, first + packets, clocks.all));
    }
    lines.extend(skew.map(describe_skew));
    lines
}

fn describe_skew(skew: &Skew) -> String {
    let [drift, error, low, high] =
        [skew.seconds_per_second, skew.standard_error, skew.interval_99[0], skew.interval_99[1]].map(|drift| format!("{:.3}", drift * 1e6));
    let location = skew.location.name();
    let removed = if skew.significant { "removed" } else { "not significant at 1 %, left in" };
    format!("clocks drift by {drift} +- {error} us/s, in 99 % from {low} to {high} ({location} of each of {} blocks): {removed}", skew.blocks)
}
