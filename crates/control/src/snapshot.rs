//! What a run shows: its names, which do not change while it lasts, and numbers at one instant, which do.

use core::time::Duration;

use serde::Serialize;

/// The numbers of a run at one instant. What belongs to links, peers, clocks and measures stands in the order of the [`Description`](crate::Description).
///
/// A list that is shorter than that of the description is filled up with nothing counted yet, one that is longer is cut.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Snapshot {
    /// Since the run began.
    pub elapsed: Duration,
    /// Why the run is not valid so far, such as too many late ticks; `None` while it is.
    pub invalid: Option<String>,
    /// How late each clock of the description was, since the run began.
    pub lateness: Vec<Quantiles>,
    /// Counters of each link, since the run began.
    pub links: Vec<LinkCounters>,
    /// Each participant.
    pub peers: Vec<PeerView>,
    /// How many datagrams were refused, by cause, since the run began.
    pub refused: Vec<(&'static str, u64)>,
    /// The value of each measure of the description so far; `None` where it has none.
    pub measures: Vec<Option<f64>>,
}

/// A distribution of spans in a few numbers. With a count of 0 the others say nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Quantiles {
    /// How many spans were seen.
    pub count: u64,
    /// Their sum.
    pub sum: Duration,
    /// Half of them are shorter.
    pub p50: Duration,
    /// 99 % of them are shorter.
    pub p99: Duration,
    /// 99.9 % of them are shorter.
    pub p999: Duration,
    /// The longest.
    pub max: Duration,
}

/// What one link did so far. `offered + duplicated = delivered + Σ dropped + in flight`.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LinkCounters {
    /// Packets handed to the link.
    pub offered: u64,
    /// Extra copies that it made.
    pub duplicated: u64,
    /// Packets that came out of it, copies included.
    pub delivered: u64,
    /// Bytes of the packets that came out of it.
    pub delivered_bytes: u64,
    /// Packets dropped, by the name of the cause. Causes that never happened may be left out.
    pub dropped: Vec<(&'static str, u64)>,
    /// Packets that it marked: congestion experienced.
    pub marked: u64,
    /// Packets of which it flipped bits.
    pub damaged: u64,
    /// Packets inside it now.
    pub in_flight: u64,
    /// The mean time in the link of all that was delivered; `None` before the first delivery.
    pub mean_delay: Option<Duration>,
    /// The delays of what was delivered of late: in the last second or so, as the publisher likes. A count of 0: nothing was.
    pub recent_delay: Quantiles,
}

impl LinkCounters {
    /// Packets dropped for any reason.
    #[must_use]
    pub fn dropped_in_all(&self) -> u64 {
        self.dropped.iter().fold(0, |sum, (_, count)| sum.saturating_add(*count))
    }
}

/// One participant at one instant.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PeerView {
    /// Whether it takes part.
    pub status: Presence,
    /// How long ago it was last heard; `None` if it is here, or never was heard.
    pub age: Option<Duration>,
    /// Where its copy of the object is, for each axis \[m\]; empty if there is none.
    pub position: Vec<f64>,
    /// The force that its user feels, for each axis \[N\]; empty if it is not known.
    pub force: Vec<f64>,
    /// How it is turned; `None` if the object does not turn.
    pub turn: Option<TurnView>,
}

/// How a participant is turned, and where its device is: what a picture in depth needs. Orientations are unit quaternions (w, x, y, z) from body to world axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TurnView {
    /// The orientation of its copy.
    pub orientation: [f64; 4],
    /// Where its device is \[m\]; `None` if that is not known here.
    pub device: Option<[f64; 3]>,
    /// The orientation of its device; `None` for one that does not turn.
    pub device_orientation: Option<[f64; 4]>,
}

/// Whether a participant takes part.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum Presence {
    /// It runs in this program.
    Here,
    /// It runs elsewhere and was heard of late.
    Present,
    /// It runs elsewhere and was not heard for too long: its figures are old.
    Stale,
    /// It was never heard.
    #[default]
    Absent,
}

impl Presence {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Here, Self::Present, Self::Stale, Self::Absent];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Here => "here",
            Self::Present => "present",
            Self::Stale => "stale",
            Self::Absent => "absent",
        }
    }
}

/// The run, in names. The numbers of a [`Snapshot`](crate::Snapshot) stand in the same order.
#[derive(Clone, PartialEq, Debug)]
pub struct Description {
    /// Which command runs.
    pub kind: Kind,
    /// The title of the run: the name of a scene, or an address.
    pub title: String,
    /// The links. Their places are the numbers by which they are asked for.
    pub links: Vec<LinkName>,
    /// The participants, or none.
    pub peers: Vec<PeerName>,
    /// The clocks whose lateness is measured, such as `"tick of left"` or `"release"`.
    pub clocks: Vec<String>,
    /// The measures that are computed while it runs, or none.
    pub measures: Vec<MeasureLabel>,
    /// The object, if it turns.
    pub body: Option<Body>,
}

/// An object that turns, in its body axes.
#[derive(Clone, PartialEq, Debug)]
pub struct Body {
    /// The edges of the box as which it is drawn \[m\].
    pub edges: [f64; 3],
    /// Where each participant grasps it, from the centre of mass \[m\], in the order of [`Description::peers`].
    pub grasps: Vec<[f64; 3]>,
}

/// The command that runs.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A scene in wall time.
    Live,
    /// Datagrams of programs that know nothing of it.
    Relay,
    /// Whole packets between networks.
    Router,
}

impl Kind {
    /// Its name, as it is written on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Relay => "relay",
            Self::Router => "router",
        }
    }
}

/// A link in names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct LinkName {
    /// The link itself, such as `"left->right"`; no other link has it.
    pub name: String,
    /// Where it begins.
    pub from: String,
    /// Where it ends.
    pub to: String,
}

/// A measure in words.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MeasureLabel {
    /// No other measure has it. It ends in the unit.
    pub name: String,
    /// The unit.
    pub unit: &'static str,
    /// Its meaning, without the last full stop.
    pub about: &'static str,
}

/// A participant in names.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct PeerName {
    /// No other participant has it.
    pub name: String,
    /// What it is, in a word or two, such as `"simulated Falcon"`.
    pub kind: String,
}
