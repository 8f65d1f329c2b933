//! Spaces of links and networks, in which shrinking searches.

use std::sync::Arc;

use cohaptic_wan::NodeId;
use cohaptic_wan::netem::Netem;

use super::bounds::{LinkBounds, Presence};
use super::forms::Form;
use super::link::ImpairedLink;
use super::network::ImpairedNetwork;
use super::numbers::{KNOBS, Knob};
use super::shrink::{Number, Space};
use super::stage::{self, Stage};

/// Space of the links within bounds.
#[derive(Clone, Debug)]
pub(super) struct LinkSpace(pub(super) Arc<LinkBounds>);

impl LinkSpace {
    /// Returns the link described by the words, if it differs from `link` and is within the bounds.
    fn changed(&self, link: &ImpairedLink, netem: Netem) -> Option<ImpairedLink> {
        if netem == *link.netem() {
            return None;
        }
        // A change of one number can break the bounds of another: a delay below its jitter, for instance.
        ImpairedLink::new(netem).ok().filter(|link| self.0.admits(link))
    }
}

impl Space for LinkSpace {
    type Value = ImpairedLink;
    type Part = Stage;
    type Form = Form;
    type Place = &'static Knob;

    const LEVELS: usize = 1;

    fn parts(&self, link: &ImpairedLink, _level: usize) -> Vec<Stage> {
        link.stages().into_iter().filter(|stage| self.0.presence(*stage) != Presence::Always).collect()
    }

    fn without(&self, link: &ImpairedLink, parts: &[Stage]) -> Option<ImpairedLink> {
        let keeps_delay = self.0.presence(Stage::Delay) == Presence::Always;
        self.changed(link, stage::without(link.netem(), parts, keeps_delay))
    }

    fn forms(&self, _link: &ImpairedLink) -> Vec<Form> {
        Form::ALL.to_vec()
    }

    fn plainer(&self, link: &ImpairedLink, form: &Form) -> Option<ImpairedLink> {
        self.changed(link, form.plainer(link, &self.0))
    }

    fn places(&self, _link: &ImpairedLink) -> Vec<&'static Knob> {
        static ALL: [Knob; KNOBS.len()] = KNOBS;
        ALL.iter().collect()
    }

    fn number(&self, link: &ImpairedLink, knob: &&'static Knob) -> Option<Number> {
        knob.number(link.netem(), &self.0)
    }

    fn with_number(&self, link: &ImpairedLink, knob: &&'static Knob, number: u64) -> Option<ImpairedLink> {
        self.changed(link, knob.set(link.netem(), number))
    }
}

/// Space of the networks whose links are within bounds.
#[derive(Clone, Debug)]
pub(super) struct NetworkSpace(pub(super) LinkSpace);

/// Sender and receiver of a link.
pub(super) type Pair = (NodeId, NodeId);

/// Part of a network.
#[derive(Clone, Copy, Debug)]
pub(super) enum NetworkPart {
    /// The removable stages of a link together.
    Link(Pair),
    /// A single stage of a link.
    Stage(Pair, Stage),
    /// The NAT of a host.
    Nat(NodeId),
}

/// Form of a network that may become plainer.
#[derive(Clone, Copy, Debug)]
pub(super) enum NetworkForm {
    /// Form of a link.
    Link(Pair, Form),
    /// Behaviour of the NAT of a host.
    Nat(NodeId),
}

impl NetworkSpace {
    fn changed(network: &ImpairedNetwork, pair: Pair, change: impl FnOnce(&ImpairedLink) -> Option<ImpairedLink>) -> Option<ImpairedNetwork> {
        let link = change(network.link(pair.0, pair.1)?)?;
        Some(network.clone().with_link(pair.0, pair.1, link))
    }

    /// Returns the values of `of` for each link that is not ideal, with the link.
    fn each<T>(network: &ImpairedNetwork, of: impl Fn(&ImpairedLink) -> Vec<T>) -> Vec<(Pair, T)> {
        network.impaired().flat_map(|(from, to, link)| of(link).into_iter().map(move |thing| ((from, to), thing))).collect()
    }
}

impl Space for NetworkSpace {
    type Value = ImpairedNetwork;
    type Part = NetworkPart;
    type Form = NetworkForm;
    type Place = (Pair, &'static Knob);

    const LEVELS: usize = 2;

    fn parts(&self, network: &ImpairedNetwork, level: usize) -> Vec<NetworkPart> {
        let stages = Self::each(network, |link| self.0.parts(link, 0));
        if level > 0 {
            return stages.into_iter().map(|(pair, stage)| NetworkPart::Stage(pair, stage)).collect();
        }
        let mut pairs: Vec<Pair> = stages.into_iter().map(|(pair, _)| pair).collect();
        // The stages of a link are neighbours, so equal pairs are too.
        pairs.dedup();
        let nats = network.nats().map(|(host, _)| NetworkPart::Nat(host));
        nats.chain(pairs.into_iter().map(NetworkPart::Link)).collect()
    }

    fn without(&self, network: &ImpairedNetwork, parts: &[NetworkPart]) -> Option<ImpairedNetwork> {
        let mut gone: Vec<(Pair, Vec<Stage>)> = Vec::new();
        let mut network = network.clone();
        for part in parts {
            match *part {
                NetworkPart::Nat(host) => network.set_behaviour(host, None),
                NetworkPart::Link(pair) => gone.push((pair, self.0.parts(network.link(pair.0, pair.1)?, 0))),
                // The parts keep the order of `parts`, in which the stages of a link are neighbours.
                NetworkPart::Stage(pair, stage) => match gone.last_mut() {
                    Some((last, stages)) if *last == pair => stages.push(stage),
                    Some(_) | None => gone.push((pair, vec![stage])),
                },
            }
        }
        // A link that cannot change refuses the whole group. The search then tries halves of the group.
        gone.into_iter().try_fold(network, |network, (pair, stages)| Self::changed(&network, pair, |link| self.0.without(link, &stages)))
    }

    fn forms(&self, network: &ImpairedNetwork) -> Vec<NetworkForm> {
        let links = Self::each(network, |link| self.0.forms(link)).into_iter().map(|(pair, form)| NetworkForm::Link(pair, form));
        // A kind has at most three plainer ones, and each step is a form of its own.
        let nats = network.nats().flat_map(|(host, _)| [NetworkForm::Nat(host); 3]);
        nats.chain(links).collect()
    }

    fn plainer(&self, network: &ImpairedNetwork, form: &NetworkForm) -> Option<ImpairedNetwork> {
        match form {
            NetworkForm::Link(pair, form) => Self::changed(network, *pair, |link| self.0.plainer(link, form)),
            NetworkForm::Nat(host) => {
                let plainer = network.behaviour(*host)?.plainer()?;
                let mut network = network.clone();
                network.set_behaviour(*host, Some(plainer));
                Some(network)
            }
        }
    }

    fn places(&self, network: &ImpairedNetwork) -> Vec<(Pair, &'static Knob)> {
        Self::each(network, |link| self.0.places(link))
    }

    fn number(&self, network: &ImpairedNetwork, (pair, knob): &(Pair, &'static Knob)) -> Option<Number> {
        self.0.number(network.link(pair.0, pair.1)?, knob)
    }

    fn with_number(&self, network: &ImpairedNetwork, (pair, knob): &(Pair, &'static Knob), number: u64) -> Option<ImpairedNetwork> {
        Self::changed(network, *pair, |link| self.0.with_number(link, knob, number))
    }
}
