//! Samples over lines that packets of several peers share, or that know the fate of a packet only when it arrives: a network carries them, as in a run with events.

use cohaptic_peer::State;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::{AccessLine, Fate, LinkModel, LinkStats, Network, NodeId, PacketInfo, Path};

use super::super::Sample;
use super::super::in_flight::Packet;
use super::{Links, PerPacket};
use crate::plan::Plan;
use crate::summary::AccessSummary;
use crate::world::network;

/// The networks of the runs.
#[derive(Clone, Debug)]
pub(super) struct Carrier<const P: usize> {
    networks: Vec<Network<Carried<P>>>,
    /// By sender of the scene, how many samples it has sent.
    sent: Vec<u64>,
    info: PacketInfo,
    /// What has arrived while its receiver did not tick, in the order of arrivals.
    waiting: Vec<Packet<P>>,
}

/// A sample on its way, and which one of its sender it is.
#[derive(Clone, Copy, Debug)]
struct Carried<const P: usize> {
    sequence: u64,
    state: State<P>,
}

impl<const P: usize> Carrier<P> {
    /// The networks of these scenes, with nothing on the way.
    pub(super) fn new(scenes: &[&Scene], info: PacketInfo) -> Self {
        let networks = scenes.iter().map(|scene| network(scene, &Plan::new(scene, crate::Model::Least, false))).collect();
        Self { networks, sent: vec![0; scenes[0].peers.len()], info, waiting: Vec::new() }
    }

    /// Some peers send, one after the other.
    pub(super) fn send<const L: usize>(&mut self, now: Instant, senders: &[usize], sent: &[Sample<P, L>]) {
        for sender in senders {
            for (run, network) in self.networks.iter_mut().enumerate() {
                let carried = Carried { sequence: self.sent[*sender], state: sent[*sender].state(run) };
                network.handle_broadcast(now, NodeId::new(*sender), self.info, carried).expect("instants come in order");
            }
            self.sent[*sender] += 1;
        }
    }

    /// In a run a link is another one from an instant on.
    pub(super) fn set_link(&mut self, at: Instant, run: usize, (from, to): (usize, usize), model: &LinkModel) {
        self.networks[run]
            .set_link(at, NodeId::new(from), NodeId::new(to), model.clone())
            .expect("instants come in order, between peers of the scene");
    }

    /// The next sample of a run that has arrived by the latest instant, and when.
    fn next_arrival(&mut self, run: usize) -> Option<(Path, Instant, Carried<P>)> {
        let network = &mut self.networks[run];
        while let Some(event) = network.poll_event() {
            if let Fate::Delivered(at) = event.fate {
                return Some((event.path, at, event.payload));
            }
        }
        None
    }

    /// The counters of a link.
    pub(super) fn stats(&self, run: usize, from: usize, to: usize) -> Option<LinkStats> {
        self.networks[run].link_stats(NodeId::new(from), NodeId::new(to))
    }

    /// What the access lines of a run did.
    pub(super) fn access_lines(&self, run: usize) -> Vec<AccessSummary> {
        let lines = (0..self.sent.len()).flat_map(|peer| [(peer, true), (peer, false)]);
        let summary = |(peer, uplink)| {
            let node = NodeId::new(peer);
            let line = if uplink { AccessLine::Uplink(node) } else { AccessLine::Downlink(node) };
            self.networks[run].access_stats(line).map(|stats| AccessSummary { peer, uplink, stats })
        };
        lines.filter_map(summary).collect()
    }
}

impl<const P: usize, const L: usize> PerPacket<P, L> {
    /// What has arrived by now is held, in the order of arrivals.
    #[inline(never)]
    pub(super) fn deliver_carried(&mut self, now: Instant) {
        for run in 0..L {
            if let Links::Carried(carrier) = &mut self.links {
                carrier.networks[run].handle_timeout(now).expect("instants come in order");
            }
            while let Some((path, arrival, carried)) = self.next_arrival(run) {
                let packet = self.packet(path, run, arrival, carried);
                self.take_in_one(&packet);
            }
        }
    }

    fn next_arrival(&mut self, run: usize) -> Option<(Path, Instant, Carried<P>)> {
        if let Links::Carried(carrier) = &mut self.links { carrier.next_arrival(run) } else { None }
    }

    fn packet(&self, path: Path, run: usize, arrival: Instant, carried: Carried<P>) -> Packet<P> {
        let receiver = path.to.index() - self.receivers.start;
        let column = self.rows.column(receiver, path.from.index()).expect("packets come over links");
        self.rows.packet::<P, L>((receiver, column, run), &carried.state, arrival, carried.sequence)
    }
}

impl<const P: usize> PerPacket<P, 1> {
    /// What has arrived by an instant is taken in by the receivers for which it arrived before an instant of their own; what others have not taken in, they do later.
    #[inline(never)]
    pub(super) fn deliver_carried_until(&mut self, latest: Instant, until: impl Fn(usize) -> u64) {
        let Links::Carried(carrier) = &mut self.links else { return };
        carrier.networks[0].handle_timeout(latest).expect("instants come in order");
        let mut waiting = std::mem::take(&mut carrier.waiting);
        while let Some((path, arrival, carried)) = self.next_arrival(0) {
            waiting.push(self.packet(path, 0, arrival, carried));
        }
        waiting.retain(|packet| {
            let arrives = packet.arrival.as_nanos() < until(usize::from(packet.receiver));
            if arrives {
                self.take_in_one(packet);
            }
            !arrives
        });
        if let Links::Carried(carrier) = &mut self.links {
            carrier.waiting = waiting;
        }
    }
}
