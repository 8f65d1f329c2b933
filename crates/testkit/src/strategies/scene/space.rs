//! Space of scenes, in which shrinking searches.

use cohaptic_peer::Contact;

use super::AnyScene;
use super::draft::{Draft, DraftHand, DraftPeer};
use super::knobs::{self, Knob};
use crate::strategies::shrink::{Number, Space};
use crate::strategies::space::{NetworkPart, NetworkSpace};

/// Scenes with at least `least` peers, and links of the space `network`.
#[derive(Clone, Debug)]
pub(super) struct SceneSpace {
    pub(super) least: usize,
    pub(super) network: NetworkSpace,
}

/// Part of a scene.
#[derive(Clone, Debug)]
pub(super) enum Part {
    /// Peer, by its name, because indices change when peers are removed.
    Peer(String),
    Section(Section),
    OfPeer(usize, Section),
    Network(NetworkPart),
}

/// Section of a scene or of a peer that may differ from the calm scene.
#[derive(Clone, Copy, Debug)]
pub(super) enum Section {
    Walls,
    Start,
    Integrator,
    Damping,
    Hand,
    Contact,
    Clock,
    ComputeDelay,
    Phase,
}

const OF_SCENE: [Section; 4] = [Section::Walls, Section::Start, Section::Integrator, Section::Damping];
const OF_PEER: [Section; 6] = [Section::Hand, Section::Contact, Section::Start, Section::Clock, Section::ComputeDelay, Section::Phase];

/// Change of a scene to a plainer form.
#[derive(Clone, Debug)]
pub(super) enum Form {
    Axes,
    Hand(usize),
    Network(<NetworkSpace as Space>::Form),
}

/// Place of a number.
#[derive(Clone, Debug)]
pub(super) enum Spot {
    Draft(Knob),
    Network(<NetworkSpace as Space>::Place),
}

impl AnyScene {
    fn with_draft(&self, change: impl FnOnce(&mut Draft)) -> Self {
        let mut changed = self.clone();
        change(&mut changed.draft);
        changed
    }

    /// Returns the scene if it differs from `before` and can be read.
    fn readable(self, before: &Self) -> Option<Self> {
        (self != *before && self.read().is_ok()).then_some(self)
    }
}

fn calm_scene(draft: &mut Draft, section: Section) {
    match section {
        Section::Walls => draft.enclosure = None,
        Section::Start => (draft.position, draft.velocity) = ([0.0; 3], [0.0; 3]),
        Section::Integrator => draft.integrator = None,
        Section::Damping => draft.damping = 0.0,
        Section::Hand | Section::Contact | Section::Clock | Section::ComputeDelay | Section::Phase => {}
    }
}

fn calm_peer(peer: &mut DraftPeer, section: Section) {
    match section {
        Section::Hand => peer.hand = DraftHand::None,
        Section::Contact => peer.contact = Contact::None,
        Section::Start => (peer.position, peer.velocity) = (None, None),
        Section::Clock => (peer.offset, peer.drift) = (0, 0),
        Section::ComputeDelay => peer.compute_delay = false,
        Section::Phase => peer.phase = 0,
        Section::Walls | Section::Integrator | Section::Damping => {}
    }
}

impl SceneSpace {
    /// Returns the sections that are not calm.
    fn sections(scene: &AnyScene) -> Vec<Part> {
        let draft = &scene.draft;
        // A section that is calm already is no part, because its removal would change nothing.
        let of_scene = OF_SCENE.into_iter().filter(|section| scene.with_draft(|draft| calm_scene(draft, *section)) != *scene).map(Part::Section);
        let of_peer = draft.peers.iter().enumerate().flat_map(|(place, peer)| {
            let is_there = move |section: &Section| {
                let mut calm = peer.clone();
                calm_peer(&mut calm, *section);
                calm != *peer
            };
            OF_PEER.into_iter().filter(is_there).map(move |section| Part::OfPeer(place, section))
        });
        of_scene.chain(of_peer).collect()
    }
}

impl Space for SceneSpace {
    type Value = AnyScene;
    type Part = Part;
    type Form = Form;
    type Place = Spot;

    const LEVELS: usize = 2 + NetworkSpace::LEVELS;

    fn parts(&self, scene: &AnyScene, level: usize) -> Vec<Part> {
        match level {
            0 => scene.draft.peers.iter().map(|peer| Part::Peer(peer.name.clone())).collect(),
            1 => Self::sections(scene),
            _ => self.network.parts(&scene.network, level - 2).into_iter().map(Part::Network).collect(),
        }
    }

    fn without(&self, scene: &AnyScene, parts: &[Part]) -> Option<AnyScene> {
        let mut less = scene.clone();
        let mut links = Vec::new();
        for part in parts {
            match part {
                // A peer is found by name, because the removal of another peer has moved the indices.
                Part::Peer(name) => {
                    let place = less.draft.peers.iter().position(|peer| peer.name == *name)?;
                    if less.draft.peers.len() == self.least {
                        return None;
                    }
                    less.draft.peers.remove(place);
                    less.network = less.network.without_host(place);
                }
                Part::Section(section) => calm_scene(&mut less.draft, *section),
                Part::OfPeer(place, section) => calm_peer(less.draft.peers.get_mut(*place)?, *section),
                Part::Network(part) => links.push(*part),
            }
        }
        // All parts of the network are removed in one call, because the network expects the stages of a link side by side.
        if !links.is_empty() {
            less.network = self.network.without(&less.network, &links)?;
        }
        less.readable(scene)
    }

    fn forms(&self, scene: &AnyScene) -> Vec<Form> {
        let hands = (0..scene.draft.peers.len()).map(Form::Hand);
        let links = self.network.forms(&scene.network).into_iter().map(Form::Network);
        core::iter::once(Form::Axes).chain(hands).chain(links).collect()
    }

    fn plainer(&self, scene: &AnyScene, form: &Form) -> Option<AnyScene> {
        let plainer = match form {
            Form::Axes => scene.with_draft(|draft| draft.axes = 1),
            Form::Hand(peer) => scene.with_draft(|draft| {
                if let Some(peer) = draft.peers.get_mut(*peer) {
                    peer.hand = match peer.hand {
                        DraftHand::None => DraftHand::None,
                        DraftHand::Force(force) | DraftHand::Sine { amplitude: force, .. } => DraftHand::Force(force),
                        // An arm has no force by itself. One newton on the first axis keeps the hand active.
                        DraftHand::Arm { .. } => DraftHand::Force([1.0, 0.0, 0.0]),
                    };
                }
            }),
            Form::Network(form) => AnyScene { network: self.network.plainer(&scene.network, form)?, ..scene.clone() },
        };
        plainer.readable(scene)
    }

    fn places(&self, scene: &AnyScene) -> Vec<Spot> {
        let links = self.network.places(&scene.network).into_iter().map(Spot::Network);
        knobs::knobs(&scene.draft).into_iter().map(Spot::Draft).chain(links).collect()
    }

    fn number(&self, scene: &AnyScene, spot: &Spot) -> Option<Number> {
        match spot {
            Spot::Draft(knob) => knob.number(&scene.draft),
            Spot::Network(place) => self.network.number(&scene.network, place),
        }
    }

    fn with_number(&self, scene: &AnyScene, spot: &Spot, number: u64) -> Option<AnyScene> {
        let changed = match spot {
            Spot::Draft(knob) => AnyScene { draft: knob.set(&scene.draft, number)?, network: scene.network.clone() },
            Spot::Network(place) => AnyScene { network: self.network.with_number(&scene.network, place, number)?, ..scene.clone() },
        };
        changed.readable(scene)
    }
}
