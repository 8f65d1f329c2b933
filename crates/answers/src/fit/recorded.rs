//! A link that a file records or describes: nothing is estimated.

use std::path::Path;

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
    Ok(Answered { scene, beside, has_law: true, kind: Kind::Recorded(Box::new(recording.clone())) })
}

/// Returns the text about a recorded link.
pub(super) fn words(scene: &str, recording: &Recording) -> String {
    let mut text = format!("{scene}\nread from a file of {}: nothing is estimated\n", recording.program.name());
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
    for note in &recording.notes {
        text.push_str(&format!("{note}\n"));
    }
    text
}
