//! A link as a file records or describes it, without an estimate.

use std::fmt::Write as _;

use cohaptic_units::print::Span;
use serde::Serialize;
use std::time::Duration;

use super::{Program, ReaderError};
use crate::fit::RateWalk;
use crate::series::{count, count_u64, floor};

/// A link as a file records or describes it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Recording {
    /// Program that wrote the file.
    pub program: Program,
    /// Measured rate; `None` for a file that describes a link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<Rate>,
    /// Estimated walk of the rate; `None` if none was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub walk: Option<RateWalk>,
    /// Properties of the file that the link lacks, and assumptions: sentences without a full stop.
    pub notes: Vec<String>,
    #[serde(skip)]
    pub(super) link: Link,
    /// Measured rates over time. Empty for a file that does not measure a rate.
    #[serde(skip)]
    pub(super) spans: Vec<RateSpan>,
}

/// A rate over a time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct RateSpan {
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    pub(super) bps: f64,
}

/// A rate measured in intervals.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Rate {
    /// Number of intervals.
    pub intervals: usize,
    /// Sum of the lengths of the intervals \[s\].
    pub seconds: f64,
    /// Mean rate \[bit/s\].
    pub mean_bps: f64,
    /// Rates that 10 % and 90 % of the intervals do not exceed \[bit/s\].
    pub between_bps: [f64; 2],
    /// `true` if the link may be faster: a sender of TCP waits for answers, and slows down after a loss.
    pub is_lower_bound: bool,
    /// Share of the packets that was lost; `None` if the file does not count packets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<f64>,
}

/// Keys of a link.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Link {
    /// Keys that hold for ever.
    Constant(Vec<Key>),
    /// Keys that hold in turn.
    Turns {
        turns: Vec<Turn>,
        /// `true` if the first turn follows the last one. The last turn holds for ever otherwise.
        forever: bool,
    },
    /// Instants of delivery, in a file beside the link. What leaves at each instant \[bytes\].
    Line { text: String, bytes: u64 },
    /// Delays over time, in a file beside the link.
    Delays { text: String },
}

/// A key of a link.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Key {
    /// Rate \[bit/s\].
    Rate(u64),
    Delay(Duration),
    /// Probability of loss of each packet.
    Loss(f64),
    /// Probability of loss after a packet that arrived, and after a lost one.
    LossInRuns([f64; 2]),
}

/// Keys that hold for a time.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Turn {
    pub(super) key: Key,
    pub(super) lasts: Duration,
}

/// Rounds a rate from 0 to 10¹⁵ bit/s.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to 10^15")]
pub(super) fn whole(bps: f64) -> u64 {
    bps.round() as u64
}

impl Key {
    fn toml(&self) -> String {
        match self {
            Self::Rate(bps) => format!("rate = \"{bps}bit\""),
            Self::Delay(delay) => format!("delay = \"{}\"", Span(*delay)),
            // `{:?}` writes 1.0 where `{}` writes 1, so that TOML reads a float.
            Self::Loss(loss) => format!("loss = {loss:?}"),
            // By default the bad state loses every packet and the good state none, so the state is the fate of the packet before.
            Self::LossInRuns([p, again]) => format!("loss = {{ gilbert-elliott = {{ p = {p:?}, r = {:?} }} }}", 1.0 - again),
        }
    }
}

/// Longest measurement for a walk of the rate \[s\]: 115 days. The instants of a file can be further apart than memory has seconds.
const MOST_SECONDS: f64 = 1e7;

impl Recording {
    /// Returns a link that changes its rate as a walk which is estimated from the rates of whole seconds ([`RateWalk`]). A refused walk is kept in
    /// [`walk`](Self::walk) with the reasons, and the link stays as it is recorded.
    ///
    /// # Errors
    ///
    /// [`ReaderError`] if the file measures no rate, or for too few or too long seconds.
    pub fn with_rate_walk(self) -> Result<Self, ReaderError> {
        let refused = |problem: &dyn std::fmt::Display| ReaderError::new("walk", problem);
        let seconds = match &self.link {
            Link::Line { text, bytes } => seconds_of_line(text, *bytes)?,
            Link::Constant(_) | Link::Turns { .. } | Link::Delays { .. } if self.spans.is_empty() => {
                return Err(refused(&"the file measures no rate: expected one of iperf3, mahimahi or CellReplay (heavy)"));
            }
            Link::Constant(_) | Link::Turns { .. } | Link::Delays { .. } => seconds_of_spans(&self.spans)?,
        };
        let walk = RateWalk::of(&seconds).map_err(|error| refused(&error))?;
        Ok(Self { walk: Some(walk), ..self })
    }

    /// Returns the line with another number of bytes that leave at each instant.
    ///
    /// # Errors
    ///
    /// [`ReaderError`] if the file has no instants of delivery.
    pub fn with_bytes(mut self, bytes: u64) -> Result<Self, ReaderError> {
        let Link::Line { bytes: held, .. } = &mut self.link else {
            return Err(ReaderError::new("bytes", "the file has no instants of delivery: expected a line of mahimahi or CellReplay (heavy)"));
        };
        *held = bytes;
        // The first note of a line is about the bytes that nobody has named.
        self.notes[0] = format!("the line sends {bytes} bytes at each instant");
        Ok(self)
    }

    /// Returns the text of the link for a scene: the `[link]` table and, for a link that changes, its modulator. `beside` is the path of the file of
    /// [`beside`](Self::beside), relative to the folder of the scene.
    #[must_use]
    pub fn to_scene_toml(&self, beside: &str) -> String {
        if let Some(text) = self.walk.as_ref().and_then(RateWalk::to_scene_toml) {
            return text;
        }
        let file = crate::fit::link::text_of(beside);
        let mut text = String::new();
        // Writing to a `String` cannot fail.
        let _ = match &self.link {
            Link::Constant(keys) => {
                let keys: Vec<String> = keys.iter().map(Key::toml).collect();
                writeln!(text, "[link]\n{}", keys.join("\n"))
            }
            Link::Line { bytes, .. } => writeln!(text, "[link]\ntrace = {{ file = {file}, bytes = \"{bytes}B\" }}"),
            Link::Delays { .. } => writeln!(text, "[link]\ntrace = {{ file = {file}, between = \"lines\", repeat = true }}"),
            Link::Turns { turns, forever } => {
                let name = |turn: usize| format!("turn-{turn}");
                let keys: Vec<String> = (1..).zip(turns).map(|(turn, Turn { key, .. })| format!("{} = {{ {} }}", name(turn), key.toml())).collect();
                let _ = writeln!(text, "[link]\nmodulated = {{ by = \"pattern\", {} }}\n", keys.join(", "));
                let _ = writeln!(text, "[[modulators]]\nname = \"pattern\"\nstates = [");
                for (turn, Turn { lasts, .. }) in (1..).zip(turns) {
                    let next = if turn == turns.len() { 1 } else { turn + 1 };
                    // A modulator never leaves a state without a sojourn, so the last turn of a pattern with an end holds for ever.
                    let ends = if turn == turns.len() && !forever {
                        String::new()
                    } else {
                        format!(", sojourn = {{ fixed = \"{}\" }}, next = \"{}\"", Span(*lasts), name(next))
                    };
                    let _ = writeln!(text, "    {{ name = \"{}\"{ends} }},", name(turn));
                }
                writeln!(text, "]")
            }
        };
        text
    }

    /// Returns the content of the file beside the link, which [`to_scene_toml`](Self::to_scene_toml) names, and the end of its name; `None` if the link needs
    /// no file.
    #[must_use]
    pub fn beside(&self) -> Option<(&'static str, &str)> {
        // A walk has replaced the line.
        if self.walk.as_ref().is_some_and(|walk| walk.refused.is_empty()) {
            return None;
        }
        match &self.link {
            Link::Constant(_) | Link::Turns { .. } => None,
            Link::Line { text, .. } => Some(("line", text)),
            Link::Delays { text } => Some(("delays.csv", text)),
        }
    }
}

/// Returns the rates of the whole seconds of a line \[bit/s\]. The last second is left out, because the line begins anew within it.
fn seconds_of_line(text: &str, bytes: u64) -> Result<Vec<Option<f64>>, ReaderError> {
    // The reader of the line has checked that each line is a number, in ascending order.
    let instants = || text.lines().filter_map(|line| line.trim().parse::<u64>().ok()).map(|ms| ms / 1_000);
    let seconds = instants().next_back().unwrap_or(0);
    let mut counts = vec![0_u64; whole_seconds(count_u64(seconds))?];
    for second in instants().filter_map(|second| usize::try_from(second).ok()) {
        if let Some(found) = counts.get_mut(second) {
            *found += 1;
        }
    }
    Ok(counts.into_iter().map(|instants| Some(count_u64(instants) * count_u64(bytes) * 8.0)).collect())
}

/// Returns the rates of the whole seconds from the first interval on \[bit/s\]; `None` for a second of which less than nine tenths were measured.
fn seconds_of_spans(spans: &[RateSpan]) -> Result<Vec<Option<f64>>, ReaderError> {
    // An interval longer than a second hides what the rate does within it.
    if let Some(long) = spans.iter().find(|span| span.end_s - span.start_s > LONGEST_INTERVAL_S) {
        let found = format!("an interval of {:.3} s", long.end_s - long.start_s);
        return Err(ReaderError::found("walk", found, "intervals of at most a second, as of iperf3 -i 1"));
    }
    let [begin_s, end_s] =
        [spans.iter().map(|span| span.start_s).reduce(f64::min), spans.iter().map(|span| span.end_s).reduce(f64::max)].map(|end| end.unwrap_or(0.0));
    let seconds = whole_seconds((end_s - begin_s).ceil())?;
    let (mut bits, mut measured_s) = (vec![0.0; seconds], vec![0.0; seconds]);
    for span in spans {
        let (mut from_s, to_s) = (span.start_s - begin_s, span.end_s - begin_s);
        // An interval lies in at most three seconds, because it is not longer than the limit above.
        while from_s < to_s {
            let second = floor(from_s);
            let until_s = to_s.min(count(second + 1));
            if let (Some(bits), Some(measured_s)) = (bits.get_mut(second), measured_s.get_mut(second)) {
                *bits += span.bps * (until_s - from_s);
                *measured_s += until_s - from_s;
            }
            from_s = until_s;
        }
    }
    Ok(bits.into_iter().zip(measured_s).map(|(bits, measured_s)| (measured_s >= MEASURED).then(|| bits / measured_s)).collect())
}

/// Longest interval for a walk of the rate \[s\]. The intervals of `iperf3 -i 1` are a little longer or shorter than a second.
const LONGEST_INTERVAL_S: f64 = 1.5;
/// Share of a second that must be measured.
const MEASURED: f64 = 0.9;

fn whole_seconds(seconds: f64) -> Result<usize, ReaderError> {
    if seconds > MOST_SECONDS {
        return Err(ReaderError::found("walk", format!("{seconds} s"), format!("at most {MOST_SECONDS} s")));
    }
    Ok(floor(seconds))
}
