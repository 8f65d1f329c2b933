//! A link as a file records or describes it, without an estimate.

use std::fmt::Write as _;

use cohaptic_units::print::Span;
use serde::Serialize;
use std::time::Duration;

use super::Program;

/// A link as a file records or describes it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Recording {
    /// Program that wrote the file.
    pub program: Program,
    /// Measured rate; `None` for a file that describes a link.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<Rate>,
    /// Properties of the file that the link lacks, and assumptions: sentences without a full stop.
    pub notes: Vec<String>,
    #[serde(skip)]
    pub(super) link: Link,
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

impl Recording {
    /// Returns the text of the link for a scene: the `[link]` table and, for a link that changes, its modulator. `beside` is the path of the file of
    /// [`beside`](Self::beside), relative to the folder of the scene.
    #[must_use]
    pub fn to_scene_toml(&self, beside: &str) -> String {
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
        match &self.link {
            Link::Constant(_) | Link::Turns { .. } => None,
            Link::Line { text, .. } => Some(("line", text)),
            Link::Delays { text } => Some(("delays.csv", text)),
        }
    }
}
