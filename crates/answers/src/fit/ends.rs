//! Counts of the frames in the captures of both ends.

use cohaptic_measure::fit::Measurements;
use cohaptic_measure::fit::captures::{Contents, Matched};
use cohaptic_units::print::Counted;
use serde::Serialize;

/// Numbers of unfitted packets in a pair of captures, and counts of all frames.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(super) struct Ends {
    unmatched_sent: usize,
    unmatched_arrived: usize,
    ambiguous: usize,
    /// Numbers of the sender's packets before and after the time covered by both captures.
    left_out: [usize; 2],
    sender: Contents,
    receiver: Contents,
}

impl Ends {
    pub(super) fn of(matched: Matched) -> (Measurements, Self) {
        let Matched { measurements, unmatched_sent, unmatched_arrived, ambiguous, left_out, sender, receiver } = matched;
        (measurements, Self { unmatched_sent, unmatched_arrived, ambiguous, left_out, sender, receiver })
    }

    pub(super) fn describe(&self) -> Vec<String> {
        let mut lines = vec![
            format!("sender: {}", of_capture(&self.sender)),
            format!("receiver: {}", of_capture(&self.receiver)),
            format!("{} sent and {} received without a counterpart, {} ambiguous", self.unmatched_sent, self.unmatched_arrived, self.ambiguous),
        ];
        let [before, after] = self.left_out;
        if before + after > 0 {
            lines.push(format!(
                "left out, since the receiver's capture may not have run: the first {} and the last {} of the sender, which have no counterpart",
                Counted(before, "packet"),
                Counted(after, "packet")
            ));
        }
        // Fragments are not joined, so a datagram cut by the path has no match at the receiver.
        if self.receiver.kinds.keys().any(|kind| kind.starts_with("fragments")) {
            lines.push("fragments are not joined: a datagram that the path cut counts as lost".to_owned());
        }
        lines
    }
}

fn of_capture(contents: &Contents) -> String {
    let mut text = contents.to_string();
    if contents.seen_again > 0 {
        text.push_str(&format!("; {} show a packet again", contents.seen_again));
    }
    if contents.super_packets > 0 {
        text.push_str(&format!("; {} hold several packets", contents.super_packets));
    }
    if contents.cut_off {
        text.push_str("; the file ends within a block, and was read up to there");
    }
    text
}
