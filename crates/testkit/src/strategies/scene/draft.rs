//! Drafts of scenes, and their TOML text.

use core::fmt;

use cohaptic_peer::coordination::{LawSettings, LawValue};
use cohaptic_peer::{ArmConfig, Contact, Coordination, DeviceConfig, Direction, Enclosure, Gains, SendWhen};
use cohaptic_scene::{Scene, SceneError};

/// Components for up to three axes. Components beyond the axes of the scene are not written.
pub type Place = [f64; 3];

/// Draft of a scene. `Debug` prints its TOML text.
#[derive(Clone, PartialEq)]
pub struct Draft {
    /// Duration of the scene \[ms\].
    pub duration: u64,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Number of axes, from 1 to 3.
    pub axes: usize,
    /// Mass of the whole object \[kg\].
    pub mass: f64,
    /// Damping of each copy [N·s/m].
    pub damping: f64,
    /// `true` if the mass is divided among the copies.
    pub split_mass: bool,
    /// Initial position of all bodies \[m\].
    pub position: Place,
    /// Initial velocity of all bodies \[m/s\].
    pub velocity: Place,
    /// Walls around the object.
    pub enclosure: Option<Enclosure>,
    /// Strategy of coordination.
    pub strategy: Coordination,
    /// Stiffness KT and damping BT of the coordination.
    pub gains: Gains,
    /// Parameters of the strategies.
    pub settings: LawSettings,
    /// Condition for sending a sample; `None`: every sample is sent.
    pub send_when: Option<SendWhen>,
    /// Period of sending \[µs\].
    pub update: u64,
    /// Integrator and number of steps per tick; `None` is the exact integrator.
    pub integrator: Option<(&'static str, u32)>,
    /// The peers.
    pub peers: Vec<DraftPeer>,
    /// Keys of all links, as TOML: `delay = "8ms", loss = 0.1`.
    pub link: String,
    /// Keys of single links.
    pub links: Vec<DraftLink>,
    /// Entries of the timeline, as TOML without braces.
    pub timeline: Vec<String>,
}

/// Peer of a draft.
#[derive(Clone, PartialEq, Debug)]
pub struct DraftPeer {
    /// Name of the peer.
    pub name: String,
    /// Length of a tick \[µs\].
    pub tick: u64,
    /// `true` if forces act a tick late.
    pub compute_delay: bool,
    /// Index of the first tick at which the peer sends.
    pub phase: u64,
    /// Contact of the device with the object.
    pub contact: Contact,
    /// Mass mH and damping bH of the device.
    pub device: DeviceConfig,
    /// Stiffness KC and damping BC of the contact.
    pub coupling: Gains,
    /// Activity of the hand.
    pub hand: DraftHand,
    /// Offset by which the clock is late \[ns\].
    pub offset: u64,
    /// Drift of the clock \[parts per billion\].
    pub drift: i32,
    /// Initial position of the device \[m\]. `None`: the position of the object.
    pub position: Option<Place>,
    /// Initial velocity of the device \[m/s\]. `None`: the velocity of the object.
    pub velocity: Option<Place>,
    /// Keys of the uplink, as TOML.
    pub uplink: Option<String>,
    /// Keys of the downlink, as TOML.
    pub downlink: Option<String>,
}

/// Hand of a draft.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum DraftHand {
    /// No force.
    None,
    /// A constant force \[N\].
    Force(Place),
    /// Force amplitude·sin(2π·frequency·t + phase) \[N\].
    Sine {
        /// Amplitude \[N\].
        amplitude: Place,
        /// Frequency \[Hz\].
        frequency: f64,
        /// Phase \[rad\].
        phase: f64,
    },
    /// Arm that pulls towards a position.
    Arm {
        /// Impedance of the arm.
        arm: ArmConfig,
        /// Position to which the arm pulls \[m\].
        wanted: Place,
    },
}

/// Directed link of a draft.
#[derive(Clone, PartialEq, Debug)]
pub struct DraftLink {
    /// Name of the sender.
    pub from: String,
    /// Name of the receiver.
    pub to: String,
    /// Keys of the link, as TOML.
    pub keys: String,
}

impl fmt::Debug for Draft {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\n{}", self.to_toml())
    }
}

impl Draft {
    /// Creates a calm scene: average-position coordination over an ideal network, with a sample per tick of 1 ms, and an object of 0.45 kg that nobody touches.
    #[must_use]
    pub fn calm(peers: usize) -> Self {
        Self {
            duration: 300,
            seed: 0,
            axes: 1,
            mass: 0.45,
            damping: 0.0,
            split_mass: true,
            position: [0.0; 3],
            velocity: [0.0; 3],
            enclosure: None,
            strategy: Coordination::AveragePosition,
            gains: Gains { stiffness: 1000.0, damping: 5.0 },
            settings: LawSettings::default(),
            send_when: None,
            update: 1000,
            integrator: None,
            peers: (1..=peers).map(|number| DraftPeer::calm(&format!("peer{number}"))).collect(),
            link: String::new(),
            links: Vec::new(),
            timeline: Vec::new(),
        }
    }

    /// Reads the draft like a scene file.
    ///
    /// # Panics
    ///
    /// If the draft is refused; [`Draft::read`] returns the error instead.
    #[must_use]
    #[track_caller]
    #[expect(clippy::panic, reason = "documented: a draft stands in a test")]
    pub fn scene(&self) -> Scene {
        self.read().unwrap_or_else(|error| panic!("{error}\n{}", self.to_toml()))
    }

    /// Reads the draft like a scene file.
    ///
    /// # Errors
    ///
    /// The error of the reader for a scene that makes no sense.
    pub fn read(&self) -> Result<Scene, SceneError> {
        Scene::parse(&self.to_toml(), "draft.toml".as_ref(), &[])
    }

    /// Returns the text of the scene file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        // `{:?}` prints a number with as many digits as the same number needs to be read back.
        let Self { duration, seed, axes, mass, damping, split_mass, gains, update, .. } = self;
        let mut line = |content: String| {
            text.push_str(&content);
            text.push('\n');
        };
        line(format!("scene = {{ duration = \"{duration}ms\", seed = {seed}, axes = {axes} }}"));
        let (position, velocity) = (self.vector(&self.position), self.vector(&self.velocity));
        let walls = self.enclosure.map_or_else(String::new, |walls| {
            let (min, max) = (self.vector(&walls.min), self.vector(&walls.max));
            format!(", enclosure = {{ min = {min}, max = {max}, stiffness = {:?}, damping = {:?} }}", walls.stiffness, walls.damping)
        });
        line(format!(
            "object = {{ mass = {mass:?}, damping = {damping:?}, split-mass = {split_mass}, position = {position}, velocity = {velocity}{walls} }}"
        ));
        let Gains { stiffness: k, damping: b } = gains;
        let name = self.strategy.name();
        let value = |place: usize| match self.settings.of(self.strategy).get(place) {
            LawValue::Automatic => "\"auto\"".to_owned(),
            LawValue::Word(word) => format!("{:?}", self.strategy.parameters()[place].form.word(word)),
            LawValue::Place(peer) => format!("{:?}", self.peers[peer].name),
            LawValue::Duration(duration) => format!("\"{}ns\"", duration.as_nanos()),
            LawValue::Number(number) => format!("{number:?}"),
        };
        let own: Vec<String> =
            self.strategy.parameters().iter().enumerate().map(|(place, parameter)| format!("{} = {}", parameter.key, value(place))).collect();
        let own = if own.is_empty() { String::new() } else { format!(", {name} = {{ {} }}", own.join(", ")) };
        let sends = self.send_when.as_ref().map_or_else(String::new, |when| {
            let velocity = when.velocity.map(|part| format!("velocity = {part:?}"));
            let position = when.position.map(|distance| format!("position = {distance:?}"));
            let heartbeat = when.heartbeat.map(|span| format!("heartbeat = \"{}ns\"", span.as_nanos()));
            format!(", send-when = {{ {} }}", [velocity, position, heartbeat].into_iter().flatten().collect::<Vec<_>>().join(", "))
        });
        line(format!("coordination = {{ strategy = \"{name}\", stiffness = {k:?}, damping = {b:?}, update = \"{update}us\"{own}{sends} }}"));
        if let Some((integrator, substeps)) = self.integrator {
            line(format!("simulation = {{ integrator = \"{integrator}\", substeps = {substeps} }}"));
        }
        line(format!("link = {{ {} }}", self.link));
        for DraftLink { from, to, keys } in &self.links {
            line(format!("[[links]]\nfrom = \"{from}\"\nto = \"{to}\"\n{}", on_lines(keys)));
        }
        for entry in &self.timeline {
            line(format!("[[timeline]]\n{entry}"));
        }
        for peer in &self.peers {
            line(format!("[[peers]]\n{}", self.peer(peer)));
        }
        text
    }

    fn peer(&self, peer: &DraftPeer) -> String {
        let DraftPeer { name, tick, phase, device, coupling, offset, .. } = peer;
        let contact = contact_to_toml(peer.contact);
        let hand = match peer.hand {
            DraftHand::None => "\"none\"".to_owned(),
            DraftHand::Force(force) => format!("{{ force = {} }}", self.vector(&force)),
            DraftHand::Sine { amplitude, frequency, phase } => {
                format!("{{ sine = {{ amplitude = {}, frequency = {frequency:?}, phase = {phase:?} }} }}", self.vector(&amplitude))
            }
            DraftHand::Arm { arm: ArmConfig { mass, damping, stiffness }, wanted } => format!(
                "{{ arm = {{ mass = {mass:?}, damping = {damping:?}, stiffness = {stiffness:?} }}, follows = {{ position = {} }} }}",
                self.vector(&wanted)
            ),
        };
        let drift = f64::from(peer.drift) * 1e-9;
        let mut text = format!(
            "name = \"{name}\"\ntick = \"{tick}us\"\ncompute-delay = {}\nphase = {phase}\ncontact = {contact}\nhand = {hand}\n\
             device = {{ mass = {:?}, damping = {:?} }}\ncoupling = {{ stiffness = {:?}, damping = {:?} }}\n\
             clock = {{ offset = \"{offset}ns\", drift = {drift:?} }}\n",
            u8::from(peer.compute_delay),
            device.mass,
            device.damping,
            coupling.stiffness,
            coupling.damping
        );
        for (key, value) in [("position", &peer.position), ("velocity", &peer.velocity)] {
            if let Some(value) = value {
                text.push_str(&format!("{key} = {}\n", self.vector(value)));
            }
        }
        for (key, value) in [("uplink", &peer.uplink), ("downlink", &peer.downlink)] {
            if let Some(value) = value {
                text.push_str(&format!("{key} = {{ {value} }}\n"));
            }
        }
        text
    }

    fn vector(&self, place: &Place) -> String {
        format!("{:?}", &place[..self.axes])
    }
}

/// Writes each key of `a = 1, b = { c = 2, d = 3 }` on a line of its own.
fn on_lines(keys: &str) -> String {
    let mut depth = 0;
    let split = keys.chars().map(|c| {
        match c {
            '{' | '[' => depth += 1,
            '}' | ']' => depth -= 1,
            _ => {}
        }
        if c == ',' && depth == 0 { '\n' } else { c }
    });
    split.collect()
}

impl DraftPeer {
    /// Creates a peer that does nothing.
    #[must_use]
    pub fn calm(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            tick: 1000,
            compute_delay: false,
            phase: 0,
            contact: Contact::None,
            device: DeviceConfig { mass: 0.1, damping: 5.0 },
            coupling: Gains { stiffness: 3500.0, damping: 5.0 },
            hand: DraftHand::None,
            offset: 0,
            drift: 0,
            position: None,
            velocity: None,
            uplink: None,
            downlink: None,
        }
    }
}

/// Writes a contact as in a scene file.
#[must_use]
pub fn contact_to_toml(contact: Contact) -> String {
    match contact {
        Contact::Grasp => "\"grasp\"".to_owned(),
        Contact::None => "\"none\"".to_owned(),
        Contact::Push(Direction { axis, positive }) => format!("{{ push = \"{}{}\" }}", if positive { '+' } else { '-' }, ["x", "y", "z"][axis]),
    }
}
