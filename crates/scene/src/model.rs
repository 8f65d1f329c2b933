//! A checked scene: what a file says once every default is filled in and every value is known to make sense.

use core::fmt;
use core::time::Duration;
use std::path::PathBuf;
use std::sync::Arc;

use cohaptic_peer::coordination::{LawSettings, Pull};
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::{Clock, Contact, Coordination, DeviceConfig, Enclosure, Gains, Hand, Integrator, SendWhen, Signal};
use cohaptic_units::{Instant, Probability};
use cohaptic_wan::{DropCause, LinkModel};

use cohaptic_linkfile::{LinkChange, LinkSelector, LinkTable};

use crate::measures::MeasureName;
use crate::{RotationSpec, Topology};

/// A scene, ready to be run. Every number in it has been checked; every peer it names exists.
#[derive(Clone, PartialEq)]
pub struct Scene {
    /// The file it was read from, for messages; empty for a text.
    pub file: PathBuf,
    /// A line for people.
    pub title: String,
    /// How long it lasts; above zero.
    pub duration: Duration,
    /// The seed of every random stream.
    pub seed: u64,
    /// The number of translational axes.
    pub axes: Axes,
    /// The shared virtual object.
    pub object: ObjectSpec,
    /// How the object turns; `None`: it does not.
    pub rotation: Option<Box<RotationSpec>>,
    /// How the copies are held together.
    pub coordination: CoordinationSpec,
    /// How motion between ticks is computed.
    pub integrator: Integrator,
    /// The peers, at least two, in the order of the file. Their names differ.
    pub peers: Vec<PeerSpec>,
    /// The peers to which each peer sends; `None`: all others.
    pub topology: Option<Arc<Topology>>,
    /// Whether a relay stands between the uplinks of peers and the links: a sample passes an uplink once, and the relay hands it on to each receiver.
    pub relay: bool,
    /// The directed links between the peers; of no meaning between peers that are no neighbours in the topology.
    pub links: LinkTable,
    /// Changes while the scene runs, in order of time; equal instants in the order of the file.
    pub timeline: Vec<Change>,
    /// What a run is summed up by, if anything is measured.
    pub measure: Option<MeasureSpec>,
    /// What must come out, if the scene is a test.
    pub expect: Option<Expect>,
    /// For how many peers masses and gains are scaled; `None`: for those that are listed. See [`Scene::scaled_for`](fn@Scene::scaled_for).
    pub scaled_for: Option<usize>,
}

impl fmt::Debug for Scene {
    /// Turns, topologies and measures are shown only where there are any: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            file,
            title,
            duration,
            seed,
            axes,
            object,
            rotation,
            coordination,
            integrator,
            peers,
            topology,
            relay,
            links,
            timeline,
            measure,
            expect,
            scaled_for,
        } = self;
        let mut shown = f.debug_struct("Scene");
        shown.field("file", file).field("title", title).field("duration", duration).field("seed", seed).field("axes", axes);
        shown.field("object", object).field("coordination", coordination).field("integrator", integrator).field("peers", peers);
        shown.field("links", links).field("timeline", timeline).field("expect", expect);
        if let Some(rotation) = rotation {
            shown.field("rotation", rotation);
        }
        if let Some(topology) = topology {
            shown.field("topology", topology);
        }
        if *relay {
            shown.field("relay", relay);
        }
        if let Some(measure) = measure {
            shown.field("measure", measure);
        }
        if let Some(number) = scaled_for {
            shown.field("scaled_for", number);
        }
        shown.finish()
    }
}

impl Scene {
    /// The scene with the masses of copies, and all gains, of that number of peers; those that it lists, its links and all else stay. The motions of equal peers are the same for any number of
    /// them but for these and the weights with which they hear each other, so that an analysis needs no more peers than two.
    #[must_use]
    pub fn scaled_for(&self, peers: usize) -> Self {
        Self { scaled_for: Some(peers), ..self.clone() }
    }

    /// For how many peers masses and gains are scaled: those that the scene lists, but for [`Scene::scaled_for`].
    #[must_use]
    pub fn number(&self) -> usize {
        self.scaled_for.unwrap_or(self.peers.len())
    }

    /// The settings of measures: those of `[measure]`, or the usual ones.
    #[must_use]
    pub fn measure_settings(&self) -> MeasureSettings {
        self.measure.as_ref().map(|measure| measure.settings.clone()).unwrap_or_default()
    }
}

/// What a run is summed up by.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasureSpec {
    /// The measures, at least one, in their order and each once.
    pub names: Vec<MeasureName>,
    /// What they are about.
    pub settings: MeasureSettings,
}

/// What measures are about.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasureSettings {
    /// Of [`Measure::Travel`](crate::Measure::Travel).
    pub travel: MeasureTravel,
    /// The discrepancy at which [`Measure::Settling`](crate::Measure::Settling) is not settled yet is above this \[m\]; above zero.
    pub band: f64,
    /// The peer whose hand meets the impedance, by its place in [`Scene::peers`]: one that pushes with the same sine all the time.
    pub probe: Option<usize>,
}

/// A distance that a copy travels.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MeasureTravel {
    /// The peer whose copy is meant, by its place in [`Scene::peers`].
    pub peer: usize,
    /// 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// The distance from where the copy began, either way \[m\]; above zero.
    pub distance: f64,
}

/// How many translational axes a scene has.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Axes {
    /// x.
    #[default]
    One,
    /// x and y.
    Two,
    /// x, y and z.
    Three,
}

impl Axes {
    /// 1, 2 or 3.
    #[must_use]
    pub const fn count(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}

/// The shared virtual object. Components beyond the scene's axes are zero.
#[derive(Clone, PartialEq, Debug)]
pub struct ObjectSpec {
    /// Mass of the whole object \[kg\], above zero.
    pub mass: f64,
    /// Viscous damping of each copy [N·s/m].
    pub damping: f64,
    /// Whether each of N copies has mass/N, or the whole mass.
    pub split_mass: bool,
    /// Where every copy and every device begins \[m\].
    pub position: [f64; 3],
    /// With which velocity every copy and every device begins [m/s].
    pub velocity: [f64; 3],
    /// The walls that limit its travel, if there are any.
    pub enclosure: Option<Enclosure>,
}

/// How gains are scaled with the number of peers N.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Scaling {
    /// As they are written.
    #[default]
    None,
    /// Coordination gains times 4(N−1)/N², coupling gains times 2/N. Both leave N = 2 unchanged.
    InverseN,
}

/// The coordination controller, the same at every peer.
#[derive(Clone, Copy, PartialEq)]
pub struct CoordinationSpec {
    /// The strategy.
    pub strategy: Coordination,
    /// How its gains are scaled with the number of peers.
    pub scaling: Scaling,
    /// Whether KT and BT count once, or once for each other peer.
    pub pull: Pull,
    /// KT and BT as written, before scaling.
    pub gains: Gains,
    /// The parameters that strategies have of their own, of every strategy.
    pub settings: LawSettings,
    /// The period of sending, Tn; a whole multiple of every peer's tick, on its own clock.
    pub update: Duration,
    /// Which of these samples are sent; `None`: all.
    pub send_when: Option<SendWhen>,
}

impl fmt::Debug for CoordinationSpec {
    /// The pull, parameters of strategies and the dead bands are shown only where they are not at their defaults: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { strategy, scaling, pull, gains, settings, update, send_when } = self;
        let mut shown = f.debug_struct("CoordinationSpec");
        shown.field("strategy", strategy).field("scaling", scaling).field("gains", gains).field("update", update);
        if *pull != Pull::Mean {
            shown.field("pull", pull);
        }
        if *settings != LawSettings::default() {
            shown.field("settings", settings);
        }
        if let Some(send_when) = send_when {
            shown.field("send_when", send_when);
        }
        shown.finish()
    }
}

/// One peer.
#[derive(Clone, PartialEq)]
pub struct PeerSpec {
    /// Its name, unique in the scene.
    pub name: String,
    /// Where it lives.
    pub kind: PeerKind,
    /// When it ticks: tick period Tc, offset and drift.
    pub clock: Clock,
    /// It sends at ticks k with (k − phase) a multiple of update/tick; below update/tick.
    pub phase: u64,
    /// Whether forces are applied one tick after they were computed.
    pub compute_delay: bool,
    /// How it touches the object.
    pub contact: Contact,
    /// Its device, mH and bH. For a peer of kind `udp` that was given none, which only [`Scene::read_live`] lets pass, one that stands still: such a
    /// peer touches nothing, and a live session never moves its device.
    pub device: DeviceConfig,
    /// Its virtual coupling, KC and BC as written, before scaling.
    pub coupling: Gains,
    /// How the coupling is scaled with the number of peers.
    pub coupling_scaling: Scaling,
    /// What its hand does; `None`: nothing.
    pub hand: Option<Hand>,
    /// Where its copy and its device begin \[m\].
    pub position: [f64; 3],
    /// With which velocity its copy and its device begin [m/s].
    pub velocity: [f64; 3],
    /// Where its device begins \[m\]; `None`: with the copy.
    pub device_position: Option<[f64; 3]>,
    /// With which velocity its device begins [m/s]; `None`: with that of the copy.
    pub device_velocity: Option<[f64; 3]>,
    /// The line that all it sends passes before the links, if it has one.
    pub uplink: Option<Arc<LinkModel>>,
    /// The line that all it receives passes after the links, if it has one.
    pub downlink: Option<Arc<LinkModel>>,
}

impl fmt::Debug for PeerSpec {
    /// Where the device begins is shown only where it is said: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, kind, clock, phase, compute_delay, contact, device, coupling, coupling_scaling, hand, .. } = self;
        let Self { position, velocity, device_position, device_velocity, uplink, downlink, .. } = self;
        let mut shown = f.debug_struct("PeerSpec");
        shown.field("name", name).field("kind", kind).field("clock", clock).field("phase", phase).field("compute_delay", compute_delay);
        shown.field("contact", contact).field("device", device).field("coupling", coupling).field("coupling_scaling", coupling_scaling);
        shown.field("hand", hand).field("position", position).field("velocity", velocity);
        for (name, start) in [("device_position", device_position), ("device_velocity", device_velocity)] {
            if let Some(start) = start {
                shown.field(name, start);
            }
        }
        shown.field("uplink", uplink).field("downlink", downlink).finish()
    }
}

/// Where a peer lives. In virtual time every peer is simulated, whatever its kind; a live session (`cohaptic live`) goes by it.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum PeerKind {
    /// In this program: device, hand and copy are simulated.
    #[default]
    Simulated,
    /// In another process, which sends and receives samples.
    Udp(Silence),
    /// The copy in this program, the device in somebody's hand: a Novint Falcon.
    Falcon(Silence, FalconSpec),
    /// Copy and device in this program; a mouse, a pen, a finger or a stick pulls the device through an arm.
    Pointer(Silence, PointerSpec),
}

impl PeerKind {
    /// The name in a scene file.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Udp(_) => "udp",
            Self::Falcon(..) => "falcon",
            Self::Pointer(..) => "pointer",
        }
    }

    /// When its silence is noticed; `None` for a peer that is never silent.
    #[must_use]
    pub const fn silence(&self) -> Option<Silence> {
        match self {
            Self::Simulated => None,
            Self::Udp(silence) | Self::Falcon(silence, _) | Self::Pointer(silence, _) => Some(*silence),
        }
    }

    /// Whether somebody's hand is read at each tick in a live session.
    #[must_use]
    pub const fn is_in_hand(&self) -> bool {
        matches!(self, Self::Falcon(..) | Self::Pointer(..))
    }
}

/// What becomes of the pull of a peer from which nothing is heard any more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Silence {
    /// After so long a silence its pull begins to fade; above zero.
    pub after: Duration,
    /// So long it takes to fade from all to nothing, and to come back; above zero.
    pub fade: Duration,
}

/// The arm through which a pointer pulls the device of a peer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PointerSpec {
    /// The stiffness of the arm [N/m]; at least zero.
    pub stiffness: f64,
    /// Its damping [N·s/m]; at least zero.
    pub damping: f64,
    /// It pulls with no greater force \[N\]; above zero.
    pub force_limit: f64,
    /// Whether it holds the device from the beginning; otherwise it takes hold little by little, as after a silence.
    pub held: bool,
}

/// Which Falcon a peer has, and how its counts become metres and newtons.
#[derive(Clone, PartialEq, Debug)]
pub struct FalconSpec {
    /// Which one.
    pub device: FalconDevice,
    /// Motor counts for a newton metre at an arm's joint; above zero.
    pub counts_per_newton_metre: f64,
    /// No greater force is sent to the motors \[N\]; above zero.
    pub force_limit: f64,
    /// The place in the coordinates of the device that is the origin of the scene \[m\]. The first axes of both are the same.
    pub origin: [f64; 3],
}

/// Which Falcon is meant.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum FalconDevice {
    /// The first that is found and that no other peer has.
    #[default]
    First,
    /// One that is simulated down to its bytes.
    Simulated,
    /// The one with this serial number.
    Serial(String),
}

/// Something that changes at an instant, before anything else happens at that instant.
#[derive(Clone, PartialEq, Debug)]
pub struct Change {
    /// When.
    pub at: Instant,
    /// What.
    pub what: ChangeKind,
}

/// What changes.
#[derive(Clone, PartialEq, Debug)]
pub enum ChangeKind {
    /// A link takes a new configuration; packets in flight keep their delays.
    Link(LinkChange),
    /// All links take the configurations of this table; packets in flight keep their delays.
    AllLinks(LinkTable),
    /// A peer's contact changes.
    Contact {
        /// Its place in [`Scene::peers`].
        peer: usize,
        /// From now on.
        contact: Contact,
    },
    /// A peer's hand force or wanted motion changes. An arm stays the same arm; a hand without an arm does not grow one.
    Hand {
        /// Its place in [`Scene::peers`].
        peer: usize,
        /// From now on.
        hand: Option<Hand>,
    },
    /// The torque of a peer's hand changes. Only where the object turns, and after each change of a hand.
    HandTorque {
        /// Its place in [`Scene::peers`].
        peer: usize,
        /// In world axes from now on \[N·m\]; `None`: none.
        torque: Option<Signal>,
    },
    /// The coordination gains change, at every peer. As written, before scaling.
    Coordination(Gains),
    /// KR [N·m/rad] and BR [N·m·s/rad] change, at every peer. As written, before scaling; `None`: as it was. Only where the object turns.
    RotationalGains(Gains<Option<Triple>>),
    /// Parameters that strategies have of their own change, at every peer: those of all strategies, from now on.
    Parameters(Box<LawSettings>),
    /// Which samples are sent changes, at every peer.
    SendWhen(SendWhen),
}

/// What must come out of a run for `cohaptic check` to pass. Absent entries are not looked at.
#[derive(Clone, PartialEq, Default)]
pub struct Expect {
    /// Whether a small disturbance of the relative motion dies out (`true`) or grows (`false`).
    pub stable: Option<bool>,
    /// The largest distance along an axis between two copies, over the whole run \[m\].
    pub discrepancy: Option<Bounds>,
    /// Where a copy is at an instant.
    pub positions: Vec<ExpectPosition>,
    /// When a copy has first moved a distance from where it began.
    pub travel: Vec<ExpectTravel>,
    /// Which fraction of the packets offered to links was dropped.
    pub loss: Vec<ExpectLoss>,
    /// The mean delay of the packets that links delivered.
    pub delay: Vec<ExpectDelay>,
    /// The values of measures.
    pub measures: Vec<ExpectMeasure>,
    /// The largest angle between two copies, over the whole run \[rad\].
    pub rotation_discrepancy: Option<Bounds>,
    /// How a copy is turned at an instant.
    pub orientations: Vec<ExpectOrientation>,
}

impl fmt::Debug for Expect {
    /// Measures are shown only where there are any: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stable, discrepancy, positions, travel, loss, delay, measures, rotation_discrepancy, orientations } = self;
        let mut shown = f.debug_struct("Expect");
        shown.field("stable", stable).field("discrepancy", discrepancy).field("positions", positions).field("travel", travel);
        shown.field("loss", loss).field("delay", delay);
        if !measures.is_empty() {
            shown.field("measures", measures);
        }
        if let Some(bounds) = rotation_discrepancy {
            shown.field("rotation_discrepancy", bounds);
        }
        if !orientations.is_empty() {
            shown.field("orientations", orientations);
        }
        shown.finish()
    }
}

/// A closed interval; at least one end is given.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bounds {
    /// At least this.
    pub min: Option<f64>,
    /// At most this.
    pub max: Option<f64>,
}

impl Bounds {
    /// Whether the value lies within; a NaN does not.
    #[must_use]
    pub fn contain(&self, value: f64) -> bool {
        self.min.is_none_or(|min| value >= min) && self.max.is_none_or(|max| value <= max) && !value.is_nan()
    }
}

/// An expected orientation.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectOrientation {
    /// The place of the peer in [`Scene::peers`].
    pub peer: usize,
    /// When.
    pub at: Instant,
    /// The unit quaternion (w, x, y, z) that is expected.
    pub of: [f64; 4],
    /// The largest angle between the two \[rad\].
    pub max: f64,
}

/// An expected position.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectPosition {
    /// The peer whose copy is meant, by its place in [`Scene::peers`].
    pub peer: usize,
    /// 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// At the peer's last tick at or before this instant; at the end of the scene, where its last tick leads to.
    pub at: Instant,
    /// Where \[m\].
    pub bounds: Bounds,
}

/// An expected time of travel.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectTravel {
    /// The peer whose copy is meant, by its place in [`Scene::peers`].
    pub peer: usize,
    /// 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// The distance from where the copy began, either way \[m\]; above zero.
    pub distance: f64,
    /// The time from the scene's beginning at which it is first reached \[s\].
    pub bounds: Bounds,
}

/// An expected fraction of dropped packets.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectLoss {
    /// Over which links.
    pub link: LinkSelector,
    /// Dropped for which reason; `None`: any.
    pub cause: Option<DropCause>,
    /// The fraction of the packets offered, from 0 to 1.
    pub min: Option<Probability>,
    /// See `min`.
    pub max: Option<Probability>,
}

/// An expected value of a measure.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectMeasure {
    /// The measure.
    pub name: MeasureName,
    /// Its value, in its unit. A measure without a value is not within.
    pub bounds: Bounds,
}

/// An expected mean delay.
#[derive(Clone, PartialEq, Debug)]
pub struct ExpectDelay {
    /// Over which links.
    pub link: LinkSelector,
    /// At least this.
    pub min: Option<Duration>,
    /// At most this.
    pub max: Option<Duration>,
}
