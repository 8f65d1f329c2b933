//! The model of a checked scene: [`Scene`] and the types of its fields. Every default is filled in and every value lies in its range. The types hold numbers
//! as written; scaling by the number of peers is applied elsewhere, by the methods of [`Scene`] that make the parts of a peer.

use core::fmt;
use core::time::Duration;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use cohaptic_peer::coordination::{LawSettings, Pull};
use cohaptic_peer::rotation::Triple;
use cohaptic_peer::{Clock, Contact, Coordination, DeviceConfig, Enclosure, Exchange, Gains, Hand, Integrator, SendWhen, Signal};
use cohaptic_units::Instant;
use cohaptic_wan::LinkModel;

use cohaptic_linkfile::{LinkChange, LinkTable};

use crate::expect::Expect;
use crate::measures::MeasureName;
use crate::{RotationSpec, TaskSpec, Topology};

/// A scene ready to run. Every number is checked, and every named peer exists.
#[derive(Clone, PartialEq)]
pub struct Scene {
    /// Path of the scene file, for messages: the argument `file` of [`Scene::parse`].
    pub file: PathBuf,
    /// Title for people; the name of the file if the scene gives no title.
    pub title: String,
    /// Duration of the scene; above zero.
    pub duration: Duration,
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of translational axes.
    pub axes: Axes,
    /// The shared virtual object.
    pub object: ObjectSpec,
    /// Rotation of the object; `None` if the object does not turn.
    pub rotation: Option<Box<RotationSpec>>,
    /// Coordination controller that keeps the copies together.
    pub coordination: CoordinationSpec,
    /// Method of computing the motion between two ticks.
    pub integrator: Integrator,
    /// Peers in the order of the file, at least two. Names are unique.
    pub peers: Vec<PeerSpec>,
    /// Neighbours to which each peer sends; `None` if every peer sends to every other peer.
    pub topology: Option<Arc<Topology>>,
    /// True if a relay stands between the uplinks of peers and the links. A sample then passes the sender's uplink once, and the relay sends a copy to each
    /// receiver.
    pub relay: bool,
    /// Directed links between the peers. An entry between two peers that are not neighbours in the topology has no effect.
    pub links: LinkTable,
    /// Links of the library that the scene names, with versions: `starlink@1/down`. A link with equal directions has no direction in its name. The
    /// configurations above and in the timeline hold the keys of these links, and the names only tell where the keys are from.
    pub profiles: Vec<String>,
    /// Changes during the run, in order of time; changes at the same instant are in the order of the file.
    pub timeline: Vec<Change>,
    /// Task of the users; `None` if the scene has no table `[task]`.
    pub task: Option<Box<TaskSpec>>,
    /// Measures of a run; `None` if the scene has no table `[measure]`.
    pub measure: Option<MeasureSpec>,
    /// Expected results of a run; `None` if the scene is not a test.
    pub expect: Option<Expect>,
    /// Number of peers by which masses and gains are scaled; `None` for the number of listed peers. See [`Scene::scaled_for`](fn@Scene::scaled_for).
    pub scaled_for: Option<usize>,
}

impl fmt::Debug for Scene {
    /// Writes rotation, topology, relay, task, measure and `scaled_for` only where the scene has such a part. Fingerprints of records are made of this text,
    /// so a scene without the part must print as before the part existed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Destructured without `..`: a new field does not compile until this function decides how to show the field.
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
            // Equal links move equally, whatever their keys are from.
            profiles: _,
            timeline,
            task,
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
        if let Some(task) = task {
            shown.field("task", task);
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
    /// Returns the scene with masses of copies and all gains scaled for `peers` peers. Listed peers, links and everything else stay as they are. Equal peers
    /// move alike for any number of peers, apart from these masses and gains and the weights with which the peers hear each other, so that an analysis needs
    /// only two of the peers.
    #[must_use]
    pub fn scaled_for(&self, peers: usize) -> Self {
        Self { scaled_for: Some(peers), ..self.clone() }
    }

    /// Returns the number of peers by which masses and gains are scaled: the number given to [`Scene::scaled_for`], otherwise the number of listed peers.
    #[must_use]
    pub(crate) fn number(&self) -> usize {
        self.scaled_for.unwrap_or(self.peers.len())
    }

    /// Returns the settings of the measures: the settings of `[measure]`, or the defaults if the scene has no such table.
    #[must_use]
    pub fn measure_settings(&self) -> MeasureSettings {
        self.measure.as_ref().map(|measure| measure.settings.clone()).unwrap_or_default()
    }
}

/// Measures of a run, from `[measure]`.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasureSpec {
    /// Measures, at least one, without duplicates, in the order of display.
    pub names: Vec<MeasureName>,
    /// Settings of some measures.
    pub settings: MeasureSettings,
}

/// Settings of some measures: a distance, a threshold and a probe.
#[derive(Clone, PartialEq, Debug)]
pub struct MeasureSettings {
    /// Distance for [`Measure::Travel`](crate::Measure::Travel): the measure reports the first crossing.
    pub travel: MeasureTravel,
    /// Discrepancy above which copies are not settled, for [`Measure::Settling`](crate::Measure::Settling) \[m\]; above zero.
    pub band: f64,
    /// Index into [`Scene::peers`] of the peer with the probe, for the impedance at the hand of this peer. The hand pushes with the same sine during the whole
    /// scene. `None`: no impedance is measured.
    pub probe: Option<usize>,
}

/// Distance that a copy travels along an axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MeasureTravel {
    /// Index into [`Scene::peers`] of the peer with the observed copy.
    pub peer: usize,
    /// Axis: 0 for x, 1 for y, 2 for z.
    pub axis: usize,
    /// Distance from the initial position of the copy, in either direction \[m\]; above zero.
    pub distance: f64,
}

/// Number of translational axes of a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Axes {
    /// Axis x.
    #[default]
    One,
    /// Axes x and y.
    Two,
    /// Axes x, y and z.
    Three,
}

impl Axes {
    /// Returns the number of axes: 1, 2 or 3.
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
    /// True if each of N copies has the mass divided by N, false if each copy has the whole mass.
    pub split_mass: bool,
    /// Initial position of every copy and of every device \[m\], unless a peer gives another position.
    pub position: [f64; 3],
    /// Initial velocity of every copy and of every device [m/s], unless a peer gives another velocity.
    pub velocity: [f64; 3],
    /// Walls around every copy; `None` for unlimited travel.
    pub enclosure: Option<Enclosure>,
}

/// Dependence of gains on the number of peers N.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Scaling {
    /// Gains as written.
    #[default]
    None,
    /// Coordination gains times 4(N−1)/N², coupling gains times 2/N. Both leave N = 2 unchanged.
    InverseN,
}

/// Coordination controller, the same at every peer.
#[derive(Clone, Copy, PartialEq)]
pub struct CoordinationSpec {
    /// Coordination strategy.
    pub strategy: Coordination,
    /// Dependence of KT and BT on the number of peers.
    pub scaling: Scaling,
    /// Whether KT and BT count once ([`Pull::Mean`]) or once per heard peer ([`Pull::Sum`]).
    pub pull: Pull,
    /// KT [N/m] and BT [N·s/m] as written, before scaling.
    pub gains: Gains,
    /// Own parameters of all strategies, also of unused strategies.
    pub settings: LawSettings,
    /// Period Tn between two samples of a peer; a whole multiple of the tick of every peer, measured on the peer's own clock.
    pub update: Duration,
    /// Dead bands for the choice of samples to send; `None` if every sample is sent.
    pub send_when: Option<SendWhen>,
}

impl fmt::Debug for CoordinationSpec {
    /// Writes the pull, the parameters of strategies and the dead bands only if changed from the defaults: fingerprints of records are made of this text.
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

/// A peer of a scene.
#[derive(Clone, PartialEq)]
pub struct PeerSpec {
    /// Name, unique in the scene.
    pub name: String,
    /// Place where the peer runs in a live session.
    pub kind: PeerKind,
    /// Clock: tick period Tc, offset and drift.
    pub clock: Clock,
    /// Phase of sending, in ticks: the peer sends at ticks k with k − phase a multiple of update/tick. Below update/tick.
    pub phase: u64,
    /// True if a force computed at a tick is applied at the next tick.
    pub compute_delay: bool,
    /// Contact between the device and the object.
    pub contact: Contact,
    /// Mass mH and damping bH of the device. A peer of kind `udp` may have no device; only [`Scene::read_live`] accepts such a peer. The field then holds a
    /// device at rest: the peer touches nothing, and a live session never moves the device.
    pub device: DeviceConfig,
    /// Ticks at which the peer reads the device and gives the device a new force. At most 100 ms from one such tick to the next; at each tick without delay
    /// for a peer with `compute_delay`, and if the object turns.
    pub exchange: Exchange,
    /// KC [N/m] and BC [N·s/m] of the virtual coupling as written, before scaling.
    pub coupling: Gains,
    /// Dependence of KC and BC on the number of peers.
    pub coupling_scaling: Scaling,
    /// Force, arm or operator of the hand; `None` if the hand does nothing.
    pub hand: Option<Hand>,
    /// Initial position of the copy, and of the device unless `device_position` is given \[m\].
    pub position: [f64; 3],
    /// Initial velocity of the copy, and of the device unless `device_velocity` is given [m/s].
    pub velocity: [f64; 3],
    /// Initial position of the device \[m\]; `None` if the device begins with the copy.
    pub device_position: Option<[f64; 3]>,
    /// Initial velocity of the device [m/s]; `None` if the device begins with the velocity of the copy.
    pub device_velocity: Option<[f64; 3]>,
    /// Access line for all samples of this peer, before the links; `None` for no such line.
    pub uplink: Option<Arc<LinkModel>>,
    /// Access line for all samples to this peer, after the links; `None` for no such line.
    pub downlink: Option<Arc<LinkModel>>,
}

impl fmt::Debug for PeerSpec {
    /// Writes the initial state of the device and its exchanges only where the scene gives them: fingerprints of records are made of this text.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, kind, clock, phase, compute_delay, contact, device, coupling, coupling_scaling, hand, .. } = self;
        let Self { exchange, position, velocity, device_position, device_velocity, uplink, downlink, .. } = self;
        let mut shown = f.debug_struct("PeerSpec");
        shown.field("name", name).field("kind", kind).field("clock", clock).field("phase", phase).field("compute_delay", compute_delay);
        shown.field("contact", contact).field("device", device).field("coupling", coupling).field("coupling_scaling", coupling_scaling);
        shown.field("hand", hand).field("position", position).field("velocity", velocity);
        if *exchange != Exchange::EACH_TICK {
            shown.field("exchange", exchange);
        }
        for (name, start) in [("device_position", device_position), ("device_velocity", device_velocity)] {
            if let Some(start) = start {
                shown.field(name, start);
            }
        }
        shown.field("uplink", uplink).field("downlink", downlink).finish()
    }
}

impl PeerSpec {
    /// Returns the exchanges of the peer with a device in a hand. Readings of an Inverse3 are an exchange old by themselves, so that the peer must not delay
    /// such readings once more.
    #[must_use]
    pub const fn exchange_in_hand(&self) -> Exchange {
        Exchange { late: self.exchange.late && !matches!(self.kind, PeerKind::Inverse3(..)), ..self.exchange }
    }
}

/// Place where a peer runs in a live session (`cohaptic live`). In virtual time every peer is simulated, whatever the kind.
#[derive(Clone, PartialEq, Debug, Default)]
pub enum PeerKind {
    /// Device, hand and copy are simulated in this program.
    #[default]
    Simulated,
    /// The peer is another process, which sends and receives samples.
    Udp(Silence),
    /// The copy is simulated in this program; the device is a Novint Falcon in a person's hand.
    Falcon(Silence, FalconSpec),
    /// The copy is simulated in this program; the device is a Haply Inverse3 in a person's hand.
    Inverse3(Silence, Inverse3Spec),
    /// Copy and device are simulated in this program; a mouse, a pen, a finger or a stick pulls the device through an arm.
    Pointer(Silence, PointerSpec),
}

impl PeerKind {
    /// Returns the name of the kind in a scene file.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Udp(_) => "udp",
            Self::Falcon(..) => "falcon",
            Self::Inverse3(..) => "inverse3",
            Self::Pointer(..) => "pointer",
        }
    }

    /// Returns the limits of silence of the peer; `None` for a simulated peer, which is never silent.
    #[must_use]
    pub const fn silence(&self) -> Option<Silence> {
        match self {
            Self::Simulated => None,
            Self::Udp(silence) | Self::Falcon(silence, _) | Self::Inverse3(silence, _) | Self::Pointer(silence, _) => Some(*silence),
        }
    }

    /// Returns true if a live session reads a person's hand at each tick.
    #[must_use]
    pub(crate) const fn is_in_hand(&self) -> bool {
        matches!(self, Self::Falcon(..) | Self::Inverse3(..) | Self::Pointer(..))
    }
}

/// Limits after which the pull of a peer fades, because nothing is heard from the peer any more.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Silence {
    /// Silence after which the pull begins to fade; above zero.
    pub after: Duration,
    /// Duration of the fade from the whole pull to zero, and of the way back; above zero.
    pub fade: Duration,
}

/// Arm through which a pointer pulls the device of a peer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PointerSpec {
    /// Stiffness of the arm [N/m]; at least zero.
    pub stiffness: f64,
    /// Damping of the arm [N·s/m]; at least zero.
    pub damping: f64,
    /// Largest force of the arm \[N\]; above zero.
    pub force_limit: f64,
    /// True if the arm holds the device from the beginning. Otherwise the pull grows gradually, as after a silence.
    pub held: bool,
}

/// Falcon of a peer, and the conversion of its counts into metres and newtons.
#[derive(Clone, PartialEq, Debug)]
pub struct FalconSpec {
    /// Selects the device.
    pub device: FalconDevice,
    /// Motor counts per newton metre at the joint of an arm; above zero.
    pub counts_per_newton_metre: f64,
    /// Largest force to the motors \[N\]; above zero.
    pub force_limit: f64,
    /// Origin of the scene in the coordinates of the device \[m\]. The first axis of the scene is the first axis of the device, and so on.
    pub origin: [f64; 3],
}

/// Selection of a Falcon.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum FalconDevice {
    /// The first found device not taken by another peer.
    #[default]
    First,
    /// A device simulated down to the bytes of its protocol.
    Simulated,
    /// The device with this serial number.
    Serial(String),
}

/// Haply Inverse3 of a peer, and the service that speaks for the device.
#[derive(Clone, PartialEq, Debug)]
pub struct Inverse3Spec {
    /// Address of the service, on this machine.
    pub service: SocketAddr,
    /// Selects the device.
    pub device: Inverse3Device,
    /// Origin of the scene in the coordinates of the device \[m\]; `None` for the middle of the workspace, which needs version 3.5 of the service.
    pub origin: Option<[f64; 3]>,
    /// Largest force \[N\]; above zero and at most 10.
    pub force_limit: f64,
    /// Age of a reading above which the force is zero; above zero and at most 1 s. `None` for 10 ms or three exchanges, the larger.
    pub reading_age: Option<Duration>,
}

/// Selection of an Inverse3.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum Inverse3Device {
    /// The first device of the service not taken by another peer.
    #[default]
    First,
    /// A device simulated down to the messages of its service.
    Simulated,
    /// The device with this id.
    Id(String),
}

/// A change during the run, in effect before anything else happens at the same instant.
#[derive(Clone, PartialEq, Debug)]
pub struct Change {
    /// Instant of the change, since the beginning of the scene.
    pub at: Instant,
    /// Changed part of the scene, with the new value.
    pub what: ChangeKind,
}

/// Changed part of the scene, with the new value.
#[derive(Clone, PartialEq, Debug)]
pub enum ChangeKind {
    /// A link takes a new configuration. Packets in flight keep their delays.
    Link(LinkChange),
    /// All links take the configurations of this table. Packets in flight keep their delays.
    AllLinks(LinkTable),
    /// The contact of a peer changes.
    Contact {
        /// Index of the peer in [`Scene::peers`].
        peer: usize,
        /// New contact.
        contact: Contact,
    },
    /// The force or the wanted motion of a peer's hand changes. An arm stays the same arm, and a hand without an arm does not get an arm.
    Hand {
        /// Index of the peer in [`Scene::peers`].
        peer: usize,
        /// New hand; `None` for a hand that does nothing.
        hand: Option<Hand>,
    },
    /// The torque of a peer's hand changes. Occurs only in scenes with a turning object, directly after each change of the hand.
    HandTorque {
        /// Index of the peer in [`Scene::peers`].
        peer: usize,
        /// New torque in world axes \[N·m\]; `None` for no torque.
        torque: Option<Signal>,
    },
    /// KT [N/m] and BT [N·s/m] change at every peer. Values as written, before scaling.
    Coordination(Gains),
    /// KR [N·m/rad] and BR [N·m·s/rad] change at every peer. Values as written, before scaling; a gain of `None` keeps the value before. Occurs only in scenes
    /// with a turning object.
    RotationalGains(Gains<Option<Triple>>),
    /// Own parameters of strategies change at every peer. Holds the new parameters of all strategies, changed or not.
    Parameters(Box<LawSettings>),
    /// The dead bands of samples change at every peer.
    SendWhen(SendWhen),
}

impl ChangeKind {
    /// Returns the configurations that links take; empty for a change of something else.
    #[must_use]
    pub fn link_configs(&self) -> &[Arc<LinkModel>] {
        match self {
            Self::Link(link) => core::slice::from_ref(&link.config),
            Self::AllLinks(links) => links.configs(),
            Self::Contact { .. }
            | Self::Hand { .. }
            | Self::HandTorque { .. }
            | Self::Coordination(_)
            | Self::RotationalGains(_)
            | Self::Parameters(_)
            | Self::SendWhen(_) => &[],
        }
    }
}
