//! Words for a repeated sequence of joint symbols.

use std::time::Duration;

use cohaptic_units::print::Span;

use super::channel::{Channel, Fate};

/// Returns in words the fate of samples under the joint symbols `cycle`, repeated for ever. `delay` is the shortest delay, or `None` if delays are not part of
/// the pattern. `name` gives the name of a channel, and is used only if there are several channels.
pub(super) fn sequence(cycle: &[usize], channels: &[Channel], delay: Option<Duration>, name: impl Fn(&Channel) -> String) -> String {
    if cycle.is_empty() {
        return String::new();
    }
    let digit = |joint: usize, channel: usize| {
        let below: usize = channels[channel + 1..].iter().map(|channel| channel.symbols.len()).product();
        // The first channel is the most significant digit of a joint symbol.
        joint / below % channels[channel].symbols.len()
    };
    let fates: Vec<Vec<Fate>> = (0..cycle.len())
        .map(|frame| {
            // A sample that is put off arrives under the next symbol, so its fate needs both symbols. The last symbol is followed by the first.
            let next = cycle[(frame + 1) % cycle.len()];
            (0..channels.len()).map(|channel| channels[channel].fate(digit(cycle[frame], channel), digit(next, channel))).collect()
        })
        .collect();
    let said: Vec<String> = fates.iter().map(|fates| one_frame(fates, channels, delay, &name)).collect();
    runs(&rotated(&fates, said))
}

/// Returns in words the fate of the samples due in one frame, with one fate per channel.
fn one_frame(fates: &[Fate], channels: &[Channel], delay: Option<Duration>, name: &impl Fn(&Channel) -> String) -> String {
    let fate = |fate: &Fate| match (fate, delay) {
        (Fate::Lost, _) => "lost".to_owned(),
        (Fate::Received(_), None) => "received".to_owned(),
        (Fate::Received(extra), Some(least)) => format!("received after {}", Span(least.saturating_add(*extra))),
    };
    let Some((first, others)) = fates.split_first() else { return String::new() };
    if others.is_empty() {
        return fate(first);
    }
    if others.iter().all(|other| other == first) {
        return format!("all {}", fate(first));
    }
    // If some links lose and others receive, the words name the links that lose.
    let lost: Vec<String> = fates.iter().zip(channels).filter(|(fate, _)| **fate == Fate::Lost).map(|(_, channel)| name(channel)).collect();
    if delay.is_none() {
        return format!("lost {}", lost.join(" and "));
    }
    let each: Vec<String> = fates.iter().zip(channels).map(|(one, channel)| format!("{} {}", name(channel), fate(one))).collect();
    each.join(" and ")
}

/// Rotates the frames so that the words begin after the last loss of a run, with arrivals before losses.
fn rotated(fates: &[Vec<Fate>], mut said: Vec<String>) -> Vec<String> {
    let losses = |frame: usize| fates[frame % fates.len()].iter().filter(|fate| **fate == Fate::Lost).count();
    // The beginning of the words of an endless repetition has no meaning. This choice fixes the place for patterns with losses and arrivals.
    let start = (0..fates.len()).find(|frame| losses(*frame) == 0 && losses(frame + fates.len() - 1) > 0);
    said.rotate_left(start.unwrap_or(0));
    said
}

/// Joins the words of all frames. Three or more equal frames in a row are written once with their number.
fn runs(said: &[String]) -> String {
    let mut words: Vec<String> = said
        .chunk_by(|one, next| one == next)
        .flat_map(|run| if run.len() >= 3 { vec![format!("{} times {}", run.len(), run[0])] } else { run.to_vec() })
        .collect();
    words.push("and again".to_owned());
    words.join(", ")
}
