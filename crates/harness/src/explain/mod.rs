//! Explanation of a scene: which parts the program models, which parts the program leaves out, and why.

mod operators;
#[cfg(test)]
mod tests;

use cohaptic_peer::coordination::{Law, LawValue, Pull, UsedGains};
use cohaptic_peer::{Contact, Exchange, Hand, Integrator, SendWhen};
use cohaptic_scene::{Axes, FromScene, PeerSpec, RotationPart, RotationParts, Scaling, Scene, TopologyKind};
use cohaptic_units::print::{Counted, Number, Span};
use cohaptic_wan::LinkModel;

use crate::arrays::Shape;
use crate::measures::Measures;
use crate::plan::{DeviceChoice, Model, Plan, Ticking};
use crate::world::Watch;

/// Content of the answer to `cohaptic explain`.
#[derive(Clone, PartialEq, Debug)]
pub struct Explanation {
    /// Modelled parts with their models.
    pub models: Vec<ModelRow>,
    /// Parts left out, each with a reason.
    pub left_out: Vec<String>,
    /// Sizes of the state.
    pub dimensions: Dimensions,
    /// Expected cost of a run.
    pub cost: Cost,
}

/// One part of the scene and its model.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ModelRow {
    /// Name of the part.
    pub part: String,
    /// Model of the part.
    pub model: String,
    /// Reason for the model.
    pub reason: String,
}

/// Sizes of the state of the running scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Dimensions {
    /// Number of positions and velocities of devices and copies.
    pub plant: u64,
    /// Number of numbers in the samples held from other peers.
    pub held: u64,
    /// Approximate number of packets in flight at once: packets per second times the mean delay.
    pub in_flight: u64,
}

/// Estimated cost of a run, from the speeds in `docs/measured-speed.md`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cost {
    /// Control ticks of all peers in a simulated second.
    pub peer_ticks_per_s: f64,
    /// Packets sent in a simulated second.
    pub packets_per_s: f64,
    /// Simulated seconds per second of processor time without records, within a factor of two on a present-day core. Access lines are not counted.
    pub realtime_factor: f64,
    /// Approximate bytes written by `--out` in a simulated second.
    pub record_bytes_per_s: f64,
}

/// Times \[ns\] of a control tick of one peer with one axis, of a packet over a link of constant delay, and of a packet over a link with more impairments: see
/// `docs/measured-speed.md`.
struct Nanos {
    a_tick: f64,
    a_packet: f64,
    an_impaired_packet: f64,
}

const WITH_EVENTS: Nanos = Nanos { a_tick: 12.0, a_packet: 20.0, an_impaired_packet: 45.0 };
const IN_ARRAYS: Nanos = Nanos { a_tick: 8.0, a_packet: 1.0, an_impaired_packet: 25.0 };

/// Approximate bytes of a row of `trajectory.csv` without its axes, in scenes of ordinary size.
const BYTES_A_TICK: f64 = 20.0;
/// Approximate bytes of each axis in a row of `trajectory.csv`.
const BYTES_AN_AXIS: f64 = 145.0;
/// Approximate bytes of a row of `packets.csv`.
const BYTES_A_PACKET: f64 = 40.0;

/// Explains which parts of a scene the program models, and why.
#[must_use]
pub fn explain(scene: &Scene) -> Explanation {
    // Only measures watch the explained run: records and plots are options of a command, not of the scene.
    let watch = Watch::of(&Measures::of(scene));
    let plan = Plan::new(scene, Model::Least, watch.ticks);
    let mut rows = Rows::default();
    rows.clock_and_motion(scene, &plan);
    rows.peers(scene, &plan);
    rows.coordination(scene);
    rows.turns(scene);
    // A broadcast decides the row about packets on the way, so the shape comes before the rows about the network.
    let shape = Shape::of(scene, &plan, &FromScene);
    rows.network(scene, shape.as_ref().is_ok_and(|(shape, _)| watch.is_of_ticks() && shape.is_broadcast()));
    if let Some(measure) = &scene.measure {
        let count = Counted(measure.names.len(), "number");
        let why = if watch.is_of_ticks() {
            "[measure]: of ticks and instants alone, so the run needs no events for them"
        } else {
            "[measure]: some of steps, samples sent or held, so the run has events whatever else it needs"
        };
        rows.model("measures", format!("{count}, computed tick by tick"), why);
    }
    let arrays = match shape {
        Err(why) => {
            rows.leave_out(format!("arrays: {why}; the run has events"));
            None
        }
        Ok((shape, _)) => Some(shape).filter(|_| watch.is_of_ticks()),
    };
    // In a broadcast every link has a constant delay; over other links of arrays every packet costs as an impaired one.
    let nanos = match &arrays {
        None => WITH_EVENTS,
        Some(shape) if shape.is_broadcast() => Nanos { an_impaired_packet: IN_ARRAYS.a_packet, ..IN_ARRAYS },
        Some(_) => Nanos { a_packet: IN_ARRAYS.an_impaired_packet, ..IN_ARRAYS },
    };
    if let Some(shape) = arrays {
        rows.model(
            "engine, unless packets are recorded",
            "arrays: binary64 in eight lanes, for eight peers of one run or for one peer of eight runs",
            "all peers tick together, and the fate of each packet is known before the next packet comes; a run whose packets are recorded has events",
        );
        // Only a bottleneck or a token bucket has a queue, so the row may be absent.
        if let Some((queues, why)) = shape.queues(&used_links(scene)) {
            rows.model("queues in arrays", queues, why);
        }
        let (threads, why) = shape.threads();
        rows.model("threads in arrays, without an observer", if threads == 1 { "one".to_owned() } else { format!("up to {threads}") }, why);
    }
    Explanation { dimensions: dimensions(scene, &plan), cost: cost(scene, &nanos), models: rows.models, left_out: rows.left_out }
}

#[derive(Default)]
struct Rows {
    models: Vec<ModelRow>,
    left_out: Vec<String>,
}

impl Rows {
    fn model(&mut self, part: &str, model: impl Into<String>, reason: impl Into<String>) {
        self.models.push(ModelRow { part: part.into(), model: model.into(), reason: reason.into() });
    }

    fn leave_out(&mut self, what: impl Into<String>) {
        self.left_out.push(what.into());
    }

    fn clock_and_motion(&mut self, scene: &Scene, plan: &Plan) {
        let axes = scene.axes.count();
        // A world of events has one axis or three axes.
        let reason = match scene.axes {
            Axes::One => "scene.axes = 1; the other axes do not exist",
            Axes::Two => "scene.axes = 2; a third axis is simulated too and rests, because two alone would save about a quarter of the time",
            Axes::Three => "scene.axes = 3",
        };
        self.model("axes", format!("{axes}"), reason);
        match plan.ticking {
            Ticking::Lockstep => {
                let tick = Span(scene.peers[0].clock.tick);
                self.model("ticks", format!("lockstep, every {tick}"), "all clocks are equal, without offset or drift");
                self.leave_out("an event for each tick: all peers tick together");
            }
            Ticking::EventDriven => self.model("ticks", "of each peer by its own clock", "peers have other ticks, offsets or drifts"),
        }
        let integrator = match scene.integrator {
            Integrator::Exact => "the matrix exponential of each body with its held inputs".to_owned(),
            Integrator::SemiImplicitEuler { steps } => format!("semi-implicit Euler, {} a tick", Counted(steps, "step")),
            Integrator::RungeKutta4 { steps } => format!("Runge-Kutta of order 4, {} a tick", Counted(steps, "step")),
        };
        self.model("motion", integrator, "forces are held over a tick, so a step is one linear map, computed once");
        if scene.object.enclosure.is_none() {
            self.leave_out("walls: the object has no enclosure");
        } else {
            self.model("enclosure", "sampled walls, spring and damper", "object.enclosure");
        }
        if scene.timeline.is_empty() {
            self.leave_out("changes: the timeline is empty");
        } else {
            self.model("timeline", Counted(scene.timeline.len(), "change").to_string(), "each applied at its instant, before anything else");
        }
    }

    fn peers(&mut self, scene: &Scene, plan: &Plan) {
        let copy = if scene.object.split_mass { "the mass of the object is split" } else { "every copy has the whole mass" };
        self.model("object", format!("{} of {} kg", Counted(scene.peers.len(), "copy"), Number(scene.copy_mass())), copy);
        // Peers with equal devices share a row, so a scene of thousands of equal peers stays readable.
        self.rotation(scene);
        for (group, peers) in groups(scene, plan) {
            let part = format!("peer {}", names(&peers));
            match group {
                DeviceChoice::Simulated => self.model(&part, describe(peers[0]), "it touches the object"),
                DeviceChoice::Resting => self.leave_out(format!("the device of {}: it touches nothing and no hand moves it", names(&peers))),
                DeviceChoice::Unobserved => {
                    self.leave_out(format!("the device of {}: it touches nothing; it is simulated only where it is recorded", names(&peers)));
                }
            }
        }
        self.operators(scene);
        if scene.peers.iter().all(|peer| !peer.compute_delay) {
            self.leave_out("computed forces from the last tick: no peer has a compute-delay");
        }
    }

    fn rotation(&mut self, scene: &Scene) {
        let (Some(rotation), Some(copy)) = (&scene.rotation, scene.copy_spin()) else { return };
        // A scene without rotation has no rows about turns.
        let triple = |numbers: [f64; 3]| numbers.map(|number| Number(number).to_string()).join(", ");
        self.model(
            "rotation",
            format!("copies with moments of inertia {} kg·m², damped by {} N·m·s/rad", triple(copy.inertia), triple(copy.damping)),
            "object.inertia; each takes part in the inertia as in the mass",
        );
        if let Some(gains) = scene.rotation_gains_in_time().next() {
            let gains = format!("KR = {} N·m/rad, BR = {} N·m·s/rad about body axes", triple(gains.stiffness), triple(gains.damping));
            self.model("coordination of turns", gains, "the mean of the matrices held, which is no rotation, gives the mean torque");
        }
        let own = scene.own_rotational_damping(0);
        if own.iter().any(|damping| *damping > 0.0) {
            self.model("damping of turns", format!("another {} N·m·s/rad of each copy", triple(own)), "the strategy damps each copy");
        }
        let method = match scene.integrator {
            Integrator::Exact => "exponential of the damped turn, fourth order in the gyroscopic term",
            Integrator::SemiImplicitEuler { .. } => "explicit Euler on quaternion and angular velocity",
            Integrator::RungeKutta4 { .. } => "Runge-Kutta of order 4 on quaternion and angular velocity",
        };
        self.model("turns", format!("{method}, {} per tick", Counted(rotation.steps, "step")), "torques are held in body axes over a tick");
        let turning = rotation.peers.iter().filter(|peer| peer.device.is_some()).count();
        if turning == 0 {
            self.leave_out("turns of devices: no device has an inertia");
        } else {
            self.model("devices that turn", format!("{turning}"), "device.inertia");
        }
    }

    fn coordination(&mut self, scene: &Scene) {
        let spec = &scene.coordination;
        let gains = scene.coordination_gains(spec.gains, 0);
        let scaling = match spec.scaling {
            Scaling::None => "as written",
            Scaling::InverseN => "scaled by 4(N-1)/N^2",
        };
        let pull = match spec.pull {
            Pull::Mean => "",
            Pull::Sum if scene.topology.is_some() => ", times the weight of the peers heard",
            Pull::Sum => ", times N-1",
        };
        let mut model = format!("{}, KT = {} N/m, BT = {} N·s/m", spec.strategy.name(), Number(gains.stiffness), Number(gains.damping));
        for (place, parameter) in spec.strategy.parameters().iter().enumerate() {
            model.push_str(&format!(", {} = ", parameter.key));
            match (spec.settings.of(spec.strategy).get(place), parameter.form) {
                (LawValue::Automatic, _) => model.push_str("auto"),
                (LawValue::Duration(span), _) => model.push_str(&Span(span).to_string()),
                (LawValue::Number(number), form) => model.push_str(&format!("{} {}", Number(number), form.unit())),
                (LawValue::Word(word), form) => model.push_str(form.word(word)),
                (LawValue::Place(peer), _) => model.push_str(&scene.peers[peer].name),
            }
        }
        // Peers can tick at different rates, so one lag in time is a different number of ticks for each.
        let lags = (0..scene.peers.len()).map(|peer| scene.law(peer).map_or(0, |law| Law::<f64>::lag(&law)));
        match (lags.clone().min().unwrap_or(0), lags.max().unwrap_or(0)) {
            (0, 0) => {}
            (least, most) if least == most => model.push_str(&format!("; own states are taken {} old", Counted(most, "tick"))),
            (least, most) => model.push_str(&format!("; own states are taken {least} to {most} ticks old, as the peers' ticks are")),
        }
        let damping = scene.own_damping(0);
        if damping > 0.0 {
            model.push_str(&format!("; each copy is damped by another {} N·s/m", Number(damping)));
        }
        // A strategy without use of a gain still accepts the gain, so a reader must hear that the gain has no effect.
        match spec.strategy.gains() {
            UsedGains::Stiffness if gains.damping > 0.0 => model.push_str("; BT is not used"),
            UsedGains::Neither => model.push_str("; KT and BT are not used"),
            UsedGains::Stiffness | UsedGains::Both => {}
        }
        self.model("coordination", model, format!("gains {scaling}{pull}; the mean of the samples held is kept until one changes"));
        let len = scene.sample_kind().datagram_len(scene.axes.count());
        let receivers = match (scene.server(), &scene.topology) {
            (Some(_), _) => "from each client to the server and back",
            (None, Some(_)) => "to each neighbour",
            (None, None) => "to each other peer",
        };
        self.model(
            "samples",
            format!("{len} bytes {receivers} every {}{}", Span(spec.update), dead_bands(spec.send_when.as_ref())),
            "with the size and the numbers of the datagrams of a live session",
        );
        if scene.sends_increments() {
            self.model(
                "positions of clients at the server",
                "sums of the displacements that have arrived, each counted once and in any order; the velocity is that of the newest sample",
                "sends = \"increments\": a lost sample loses motion; the analysis of stability follows displacements over lines of constant delay alone",
            );
        }
        if scene.returns_nothing() {
            self.leave_out("forces on the devices of clients: returns = \"none\", so clients see the object and feel nothing");
        }
    }

    /// Adds the analysis of stability of a rotating object.
    fn turns(&mut self, scene: &Scene) {
        match scene.rotation_parts() {
            None => {}
            Some(Ok(RotationParts { reason, parts })) => {
                let names: Vec<String> = parts.iter().map(RotationPart::name).collect();
                self.model("stability of an object that turns", format!("scenes of one axis that do not mix: {}", names.join("; ")), reason);
            }
            Some(Err(why)) => self.model("stability of an object that turns", "all six components of each copy together, linearised at rest", why),
        }
    }

    fn topology(&mut self, scene: &Scene) {
        if scene.relay {
            let model = "a star: what a peer sends passes its uplink once, and a relay hands it on to all others";
            self.model("topology", model, "[topology]: the hub is no peer and takes no time; links and downlinks lead on from it");
        }
        let Some(topology) = &scene.topology else { return };
        let model = match topology.kind() {
            TopologyKind::Ring { neighbours } => format!("a ring: each hears {neighbours}, half of them on either side"),
            TopologyKind::Star { hub } => format!("a star: {} hears all others, and each of these hears it alone", scene.peers[hub].name),
            TopologyKind::Graph => format!("a graph of {} neighbours, with their weights", Counted(topology.links() / 2, "pair")),
        };
        self.model("topology", model, "[topology]: links and samples held are those of neighbours, and no others");
    }

    fn network(&mut self, scene: &Scene, is_broadcast: bool) {
        self.topology(scene);
        if !scene.profiles.is_empty() {
            let why = "profile and access of the scene; cohaptic link NAME --show prints each key with its source";
            self.model("links of the library", scene.profiles.join(", "), why);
        }
        let used = used_links(scene);
        for (config, count) in &used {
            let part = format!("{count} {}", if *count == 1 { "link" } else { "links" });
            if config.is_constant_delay() {
                self.model(&part, format!("constant delay {}", Span(config.mean_delay())), "one addition per packet: nothing else is configured");
            } else {
                self.model(&part, config.words(), "a chain of the stages that are configured");
            }
        }
        let links_change = scene.timeline.iter().any(|change| !change.what.link_configs().is_empty());
        // A ring needs arrivals in the order of sending: a broadcast, or equal delays at all times and no access lines.
        let one_delay = scene.topology.is_none() && used.len() == 1 && used.iter().all(|(config, _)| config.is_constant_delay());
        if is_broadcast || one_delay && !links_change && scene.peers.iter().all(|peer| peer.uplink.is_none() && peer.downlink.is_none()) {
            self.model("packets on the way", "a ring", "all delays are equal, so packets arrive in the order in which they were sent");
            self.leave_out("sorting of arrivals");
        } else {
            self.model("packets on the way", "a calendar queue", "arrivals are not in the order of sending");
        }
        for (peer, direction, line) in access_lines(scene) {
            self.model(&format!("{direction} of {peer}"), line.words(), "shared by all that passes it");
        }
        // A later change can bring chance into links without chance at the start.
        let timeline_is_random = scene.timeline.iter().flat_map(|change| change.what.link_configs()).any(|link| link.has_chance());
        let lines_are_random = access_lines(scene).iter().any(|(_, _, line)| line.has_chance());
        let people_are_random = operators::has_noise(scene);
        if used.iter().all(|(config, _)| !config.has_chance()) && !lines_are_random && !timeline_is_random && !people_are_random {
            self.leave_out("random numbers: no link leaves anything to chance");
        }
    }
}

/// Groups the peers with the same device model and description, in the order of their first peers.
fn groups<'a>(scene: &'a Scene, plan: &Plan) -> Vec<(DeviceChoice, Vec<&'a PeerSpec>)> {
    let mut groups: Vec<(DeviceChoice, Vec<&PeerSpec>)> = Vec::new();
    for (peer, choice) in scene.peers.iter().zip(&plan.devices) {
        // Equal descriptions are enough: a reader cannot tell such devices apart.
        match groups.iter_mut().find(|(other, peers)| other == choice && describe(peers[0]) == describe(peer)) {
            Some((_, peers)) => peers.push(peer),
            None => groups.push((*choice, vec![peer])),
        }
    }
    groups
}

fn names(peers: &[&PeerSpec]) -> String {
    match peers {
        // Beyond four names, the first and the last name stand for all.
        [first, .., last] if peers.len() > 4 => format!("{} to {} ({} peers)", first.name, last.name, peers.len()),
        _ => peers.iter().map(|peer| peer.name.as_str()).collect::<Vec<_>>().join(", "),
    }
}

fn describe(peer: &PeerSpec) -> String {
    let contact = match peer.contact {
        Contact::Grasp => "grasps the object",
        Contact::None => "touches nothing",
        Contact::Push(_) => "pushes the object from one side",
    };
    let hand = match &peer.hand {
        None => "no hand force",
        Some(Hand::Force(force)) if force.is_constant() => "a constant hand force",
        Some(Hand::Force(_)) => "a hand force sampled at each tick",
        Some(Hand::Arm { .. }) => "an arm, its spring and damper part of the plant",
        Some(Hand::Operator { .. }) => "the arm of an operator, its spring and damper part of the plant",
    };
    format!("device of {} kg that {contact}, {hand}{}", Number(peer.device.mass), exchanges(peer.exchange))
}

/// Returns the text about a device that exchanges late, or not at each tick, as a continuation of a sentence; empty for other devices.
fn exchanges(exchange: Exchange) -> String {
    let every = match exchange.every {
        1 => "each tick".to_owned(),
        every => format!("every {every} ticks"),
    };
    match exchange {
        Exchange::EACH_TICK => String::new(),
        Exchange { late: false, .. } => format!("; the device exchanges {every}, and keeps each force until the next exchange"),
        Exchange { every: 1, late: true } => "; the readings of the device are a tick old".to_owned(),
        Exchange { late: true, .. } => {
            format!("; the device exchanges {every}, keeps each force until the next exchange, and its readings are an exchange old")
        }
    }
}

/// Returns the configurations of the links between different peers, each with the number of links.
fn used_links(scene: &Scene) -> Vec<(&LinkModel, u64)> {
    scene.used_links().into_iter().map(|(config, count)| (config.as_ref(), count)).collect()
}

fn access_lines(scene: &Scene) -> Vec<(&str, &'static str, &LinkModel)> {
    scene
        .peers
        .iter()
        .flat_map(|peer| [(peer.name.as_str(), "uplink", peer.uplink.as_deref()), (peer.name.as_str(), "downlink", peer.downlink.as_deref())])
        .filter_map(|(peer, direction, line)| line.map(|line| (peer, direction, line)))
        .collect()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an estimate of a count, not negative")]
fn dimensions(scene: &Scene, plan: &Plan) -> Dimensions {
    let (peers, axes) = (scene.peers.len() as u64, scene.axes.count() as u64);
    let devices = plan.devices.iter().filter(|choice| **choice == DeviceChoice::Simulated).count() as u64;
    let links = used_links(scene).into_iter();
    // Little's law: packets in flight are packets per second times mean delay.
    let delays: f64 = links.map(|(config, count)| config.mean_delay().as_secs_f64() * count_f64(count)).sum();
    Dimensions {
        plant: 2 * axes * (peers + devices),
        held: 2 * axes * scene.link_count(),
        in_flight: (delays / scene.coordination.update.as_secs_f64()).ceil() as u64,
    }
}

fn cost(scene: &Scene, nanos: &Nanos) -> Cost {
    let axes = count_f64(scene.axes.count() as u64);
    let peer_ticks_per_s: f64 = scene.peers.iter().map(|peer| peer.clock.tick.as_secs_f64().recip()).sum();
    let update = scene.coordination.update.as_secs_f64();
    // Every link carries one packet per update, so packets per second are links over the update.
    let packets = |constant: bool| -> f64 {
        used_links(scene).iter().filter(|(config, _)| config.is_constant_delay() == constant).map(|(_, count)| count_f64(*count) / update).sum()
    };
    let busy = peer_ticks_per_s * nanos.a_tick * axes + packets(true) * nanos.a_packet + packets(false) * nanos.an_impaired_packet;
    let packets_per_s = packets(true) + packets(false);
    // A row has the columns of every axis, but instant and name of the peer only once.
    let record_bytes_per_s = peer_ticks_per_s * (BYTES_A_TICK + BYTES_AN_AXIS * axes) + packets_per_s * BYTES_A_PACKET;
    Cost { peer_ticks_per_s, packets_per_s, realtime_factor: 1e9 / busy, record_bytes_per_s }
}

#[expect(clippy::cast_precision_loss, reason = "counts of links and axes are far below 2^53")]
fn count_f64(count: u64) -> f64 {
    count as f64
}

/// Returns the text of the send condition, as a continuation of a sentence; empty without a condition.
fn dead_bands(when: Option<&SendWhen>) -> String {
    let Some(SendWhen { velocity, position, heartbeat }) = when else { return String::new() };
    let conditions = [
        velocity.map(|part| format!("the velocity has changed by {} %", Number(part * 100.0))),
        position.map(|distance| format!("the copy is {} m from where receivers hold it", Number(distance))),
        heartbeat.map(|span| format!("{} have passed", Span(span))),
    ];
    format!(", if {}", conditions.into_iter().flatten().collect::<Vec<_>>().join(" or "))
}
