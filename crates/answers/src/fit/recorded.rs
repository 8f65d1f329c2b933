//! A link that a file records or describes: nothing is estimated.

use std::path::Path;

use cohaptic_measure::fit::RateWalk;
use cohaptic_measure::fit::readers::{Rate, Recording};

use super::scene_link::read_again;
use super::{Answered, Beside, Corrections, FitFailure, Kind};

/// Answers with the recorded link.
///
/// # Errors
///
/// [`FitFailure::Measurements`] if the clocks are to be corrected, which such a file does not have, [`FitFailure::Scene`] if a scene refuses the link.
pub(super) fn answer(recording: &Recording, corrections: &Corrections, file: &Path) -> Result<Answered, FitFailure> {
    if *corrections != Corrections::default() {
        return Err(FitFailure::Measurements(
            "the file has no delays of packets: expected none of offset, least, skew, tick and hold-out".to_owned(),
        ));
    }
    let beside = recording.beside().map(|(extension, content)| Beside::new(file, extension, content.to_owned()));
    let scene = recording.to_scene_toml(&beside.as_ref().map_or_else(String::new, Beside::name));
    read_again(&scene, None, file, beside.as_ref())?;
    let has_law = recording.walk.as_ref().is_none_or(|walk| walk.refused.is_empty());
    Ok(Answered { scene, beside, has_law, kind: Kind::Recorded(Box::new(recording.clone())) })
}

/// Returns the text about a recorded link.
pub(super) fn words(scene: &str, recording: &Recording) -> String {
    let estimated = if recording.walk.is_some() { "the walk of the rate is estimated" } else { "nothing is estimated" };
    let mut text = format!("{scene}\nread from a file of {}: {estimated}\n", recording.program.name());
    let mbit = |bps: f64| format!("{:.3} Mbit/s", bps / 1e6);
    if let Some(Rate { intervals, seconds, mean_bps, between_bps: [low, high], loss, .. }) = recording.rate {
        text.push_str(&format!(
            "{intervals} intervals, {seconds:.1} s: mean rate {}, from {} (10 %) to {} (90 %)\n",
            mbit(mean_bps),
            mbit(low),
            mbit(high)
        ));
        if let Some(loss) = loss {
            text.push_str(&format!("{:.5} % of the packets lost\n", loss * 100.0));
        }
    }
    match &recording.walk {
        Some(walk) => text.push_str(&walk_words(walk)),
        None if recording.rate.is_some() => text.push_str("the link has the mean rate, without the changes of the rate: a walk has these\n"),
        None => {}
    }
    for note in &recording.notes {
        text.push_str(&format!("{note}\n"));
    }
    text
}

/// Returns the text about a walk of the rate: the states, what is fitted, and how far the walk is from the measurement where nothing was fitted.
fn walk_words(walk: &RateWalk) -> String {
    let mbit: Vec<String> = walk.rates_bps.iter().map(|bps| format!("{:.3}", bps / 1e6)).collect();
    let mut text = format!("{} whole seconds; means of their fifths: {} Mbit/s\n", walk.seconds, mbit.join(", "));
    if let Some(sojourn_s) = walk.sojourn_s {
        text.push_str(&format!("mean sojourn {sojourn_s:.3} s inside, {:.3} s at both ends\n", 2.0 * sojourn_s));
        text.push_str(&format!("\n  {:<28}{:>12}{:>12}{:>12}\n", "correlation of the rate", "after 1 s", "after 5 s", "after 10 s"));
        for (name, correlations) in [("measured", &walk.measured), ("walk, fitted at 5 s", &walk.walk)] {
            let cells: String = correlations.iter().map(|correlation| format!("{correlation:>12.3}")).collect();
            text.push_str(&format!("  {name:<28}{cells}\n"));
        }
    }
    for reason in &walk.refused {
        text.push_str(&format!("refused: {reason}; the link is as it is recorded\n"));
    }
    text
}
