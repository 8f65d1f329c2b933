//! The published state of a run: names, constant during the run, and numbers at one instant.

use core::time::Duration;

use serde::Serialize;

/// Numbers of a run at one instant. Entries for links, peers, clocks and measures are in the order of the [`Description`](crate::Description).
///
/// A list shorter than in the description counts as filled up with defaults, and a longer list as cut.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Snapshot {
    /// Time since the run began.
    pub elapsed: Duration,
    /// Reason why the run is not valid, such as too many late ticks; `None` as long as the run is valid.
    pub invalid: Option<String>,
    /// Lateness of each clock since the run began, indexed by clock.
    pub lateness: Vec<Quantiles>,
    /// Counters of each link since the run began, indexed by link.
    pub links: Vec<LinkCounters>,
    /// State of each participant, indexed by peer.
    pub peers: Vec<PeerView>,
    /// Refused datagrams since the run began, by cause.
    pub refused: Vec<(&'static str, u64)>,
    /// Present value of each measure, indexed by measure; `None` for a measure without a value yet.
    pub measures: Vec<Option<f64>>,
}

/// Summary of a distribution of spans. With a count of 0 the other fields have no meaning.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Quantiles {
    /// Number of spans.
    pub count: u64,
    /// Sum of all spans.
    pub sum: Duration,
    /// Median: half of the spans are shorter.
    pub p50: Duration,
    /// Quantile 0.99.
    pub p99: Duration,
    /// Quantile 0.999.
    pub p999: Duration,
    /// Longest span.
    pub max: Duration,
}

/// Counters of a link since the run began. `offered + duplicated = delivered + Σ dropped + in_flight`.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct LinkCounters {
    /// Packets handed to the link.
    pub offered: u64,
    /// Extra copies made by the link.
    pub duplicated: u64,
    /// Packets that came out of the link, copies included.
    pub delivered: u64,
    /// Bytes of the delivered packets.
    pub delivered_bytes: u64,
    /// Dropped packets by name of the cause. Causes with zero packets may be left out.
    pub dropped: Vec<(&'static str, u64)>,
    /// Packets marked by the link with "congestion experienced".
    pub marked: u64,
    /// Packets with bits flipped by the link.
    pub damaged: u64,
    /// Packets inside the link now.
    pub in_flight: u64,
    /// Mean delay of all delivered packets; `None` before the first delivery.
    pub mean_delay: Option<Duration>,
    /// Delays of packets delivered recently, for instance in the last second; the publisher chooses the window. The count is 0 if no packet was delivered.
    pub recent_delay: Quantiles,
}

impl LinkCounters {
    /// Returns the number of packets dropped for any reason. Saturates.
    #[must_use]
    pub fn dropped_in_all(&self) -> u64 {
        self.dropped.iter().fold(0, |sum, (_, count)| sum.saturating_add(*count))
    }
}

/// State of a participant at one instant.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct PeerView {
    /// Whether the participant takes part.
    pub status: Presence,
    /// Time since the participant was last heard; `None` if the participant runs in this program or was never heard.
    pub age: Option<Duration>,
    /// Position of the participant's copy of the object \[m\], indexed by axis; empty without a copy.
    pub position: Vec<f64>,
    /// Force felt by the participant's user \[N\], indexed by axis; empty if unknown.
    pub force: Vec<f64>,
    /// Orientations; `None` if the object does not rotate.
    pub turn: Option<TurnView>,
    /// Program of the participant; `None` if no other program runs the participant.
    pub joined: Option<JoinedView>,
}

/// Program that runs a participant, and its way to this program.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct JoinedView {
    /// Name of the device, as the program told, or the kind of the participant.
    pub device: String,
    /// Address of the computer.
    pub address: String,
    /// Samples that never came.
    pub lost: u64,
    /// Samples that the program has sent.
    pub sent: u64,
}

/// Orientation of a participant's copy, and pose of the participant's device, for a picture in depth. Orientations are unit quaternions (w, x, y, z) from
/// body to world axes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TurnView {
    /// Orientation of the copy of the object.
    pub orientation: [f64; 4],
    /// Position of the device \[m\]; `None` if unknown here.
    pub device: Option<[f64; 3]>,
    /// Orientation of the device; `None` for a device without rotation.
    pub device_orientation: Option<[f64; 4]>,
}

/// Presence of a participant.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub enum Presence {
    /// The participant runs in this program.
    Here,
    /// The participant runs elsewhere and was heard recently.
    Present,
    /// The participant runs elsewhere and was not heard for too long. The figures shown are old.
    Stale,
    /// The participant was never heard.
    #[default]
    Absent,
}

impl Presence {
    /// All values, in the order of the declaration.
    pub(crate) const ALL: [Self; 4] = [Self::Here, Self::Present, Self::Stale, Self::Absent];

    /// Returns the name shown to users.
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

/// Names of a run. The numbers of a [`Snapshot`](crate::Snapshot) are in the same order.
#[derive(Clone, PartialEq, Debug)]
pub struct Description {
    /// Command of the run.
    pub kind: Kind,
    /// Title of the run: the name of a scene, or an address.
    pub title: String,
    /// Links. The index of a link is its number in requests.
    pub links: Vec<LinkName>,
    /// Participants; empty for a run without participants.
    pub peers: Vec<PeerName>,
    /// Clocks with measured lateness, such as `"tick of left"` or `"release"`.
    pub clocks: Vec<String>,
    /// Measures computed during the run; may be empty.
    pub measures: Vec<MeasureLabel>,
    /// Shape of the object; `None` if the object does not rotate.
    pub body: Option<Body>,
}

/// Shape of a rotating object, in body axes.
#[derive(Clone, PartialEq, Debug)]
pub struct Body {
    /// Lengths of the edges of the box drawn for the object \[m\], indexed by axis.
    pub edges: [f64; 3],
    /// Position of each participant's grasp, from the centre of mass \[m\], indexed by peer.
    pub grasps: Vec<[f64; 3]>,
}

/// Command of a run.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A scene in wall time.
    Live,
    /// Datagrams between programs that do not know of the emulation.
    Relay,
    /// Whole packets between networks.
    Router,
}

impl Kind {
    /// Returns the name of the command on the command line.
    #[must_use]
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Relay => "relay",
            Self::Router => "router",
        }
    }
}

/// Name and ends of a link.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct LinkName {
    /// Name of the link, unique in the run, such as `"left->right"`.
    pub name: String,
    /// Name of the sender.
    pub from: String,
    /// Name of the receiver.
    pub to: String,
}

/// Name, unit and meaning of a measure.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MeasureLabel {
    /// Name of the measure, unique in the run, with the unit as its last part.
    pub name: String,
    /// Unit of the value.
    pub unit: &'static str,
    /// Meaning of the measure, as a sentence without its final full stop.
    pub about: &'static str,
}

/// Name and kind of a participant.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct PeerName {
    /// Name of the participant, unique in the run.
    pub name: String,
    /// Kind of the participant in a word or two, such as `"simulated Falcon"`.
    pub kind: String,
}
