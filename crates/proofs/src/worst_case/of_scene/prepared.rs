//! The parts of a linear scene as switched systems.

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Contacts, Lifted, LinkTiming, NominalNetwork, Structure, alone, clocks, links};
use cohaptic_stability::{Matrix, Part, PartKind};

use super::super::automaton::Automaton;
use super::super::pattern::Pattern;
use super::channel::{Channel, Link, Way};
use super::error::SceneWorstCaseError;
use super::frames::Block;
use super::patterns::{Links, Patterns};

/// Largest number of kinds of frame.
const MOST_SYMBOLS: u128 = 64;
/// Largest product of the number of edges and the third power of the number of states. The certificate alone takes about a minute for this product.
const MOST_WORK: usize = 1 << 26;

/// A part of a scene as a switched system.
#[derive(Debug)]
pub(super) struct Search {
    pub kind: PartKind,
    pub automaton: Automaton,
    /// Upper bound of the errors of the matrices, as the largest sum over a row.
    pub rounding: f64,
}

/// The parts of a linear scene.
#[derive(Debug)]
pub(super) struct Prepared {
    /// Channels. Their joint symbols drive every part.
    pub channels: Vec<Channel>,
    pub searches: Vec<Search>,
    /// Devices without contact. Their motion does not depend on the network.
    pub devices: Vec<Part>,
}

/// Returns the classes of peers equal under the patterns.
pub(super) fn structure(scene: &Scene, network: &NominalNetwork, contacts: &Contacts, patterns: &Patterns) -> Result<Structure, SceneWorstCaseError> {
    match patterns.links {
        Links::Each if patterns.choose() => {
            // Each link has at least two symbols (received, lost). Too many links are refused here, before memory per link is allocated.
            let links = scene.peers.len().saturating_mul(scene.peers.len().saturating_sub(1));
            few_enough(links, std::iter::repeat_n(2, links))?;
            // Links that differ in their losses make peers different, so each peer is a class then.
            Ok(Structure::of_each(scene, network, contacts)?)
        }
        Links::Together | Links::Each => Ok(Structure::of(&[scene], network, contacts)?),
    }
}

impl Prepared {
    pub(super) fn of(scene: &Scene, network: &NominalNetwork, structure: &Structure, patterns: &Patterns) -> Result<Self, SceneWorstCaseError> {
        let channels = channels(scene, network, structure, patterns)?;
        let pattern = Pattern::product(&channels.iter().map(|channel| channel.pattern.clone()).collect::<Vec<_>>())?;
        let search = |kind: PartKind, block: &Block<'_>| -> Result<Search, SceneWorstCaseError> {
            let (matrices, rounding) = block.matrices(&channels);
            let automaton = Automaton::new(pattern.clone(), matrices)?;
            let (edges, nodes, dimension) = (pattern.edges().len(), pattern.nodes(), automaton.size());
            // Each edge costs products and factorisations of matrices, the third power of their size.
            if edges.saturating_mul(dimension.saturating_pow(3)) > MOST_WORK {
                return Err(SceneWorstCaseError::TooLarge { edges, nodes, dimension });
            }
            Ok(Search { kind, automaton, rounding })
        };
        let nodes = structure.nodes(scene);
        let quotient = structure.quotient(scene, &nodes);
        if quotient.sampling.channels() > 1 {
            return Err(SceneWorstCaseError::Ages { strategy: scene.coordination.strategy.name() });
        }
        let everything = |channel: &Channel| channel.links.iter().copied().enumerate().collect();
        let whole = if structure.classes.len() < scene.peers.len() { PartKind::Together } else { PartKind::Whole };
        let mut searches = vec![search(whole, &Block { lifted: quotient, links: channels.iter().map(everything).collect() })?];
        let mut devices = Vec::new();
        for (class, members) in structure.classes.iter().enumerate() {
            if let Some(timetable) = &structure.apart[class] {
                let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
                let lifted = Lifted { nodes: &nodes[class..=class], weights: &weight, timetable, tied: true, ..quotient };
                let own = |(_, link): &(usize, Link)| (link.from, link.to) == (class, class);
                let links = |channel: &Channel| {
                    let links = channel.links.iter().copied().enumerate().filter(own);
                    links.map(|(place, link)| (place, Link { from: 0, to: 0, ..link })).collect()
                };
                let block = Block { lifted, links: channels.iter().map(links).collect() };
                searches.push(search(PartKind::Apart { peer: members[0] }, &block)?);
            }
            devices.extend(alone(structure, scene, class, 1).map(|(device, _)| device));
        }
        Ok(Self { channels, searches, devices })
    }
}

/// Returns the channels of a scene: one channel of all links, or one channel per link.
fn channels(scene: &Scene, network: &NominalNetwork, structure: &Structure, patterns: &Patterns) -> Result<Vec<Channel>, SceneWorstCaseError> {
    let name = |class: usize, member: usize| scene.peers[structure.classes[class][member]].name.clone();
    let mut ways = Vec::new();
    for (from, to, timing) in links(&structure.classes, network) {
        match timing {
            LinkTiming::Constant(delay) => ways.push(Way { from, to, delay }),
            LinkTiming::Pattern(_) => return Err(SceneWorstCaseError::Pattern { from: name(from, usize::from(from == to)), to: name(to, 0) }),
        }
    }
    let step = scene.coordination.update;
    if structure.timetable.frame != step || structure.timetable.sent.iter().any(|sent| *sent != 1) {
        return Err(SceneWorstCaseError::Frame { frame: structure.timetable.frame, step });
    }
    let clocks = clocks(&structure.classes, scene);
    let channel = |ways: &[Way]| Channel::new(ways, &clocks, patterns.width(), patterns.losses_in_a_row).map_err(SceneWorstCaseError::from);
    let channels: Vec<Channel> = match patterns.links {
        Links::Each if patterns.choose() => ways.chunks(1).map(channel).collect::<Result<_, _>>()?,
        Links::Together | Links::Each => vec![channel(&ways)?],
    };
    few_enough(ways.len(), channels.iter().map(|channel| channel.symbols.len()))?;
    Ok(channels)
}

/// Refuses too many kinds of frame.
fn few_enough(links: usize, mut symbols: impl Iterator<Item = usize>) -> Result<(), SceneWorstCaseError> {
    let all = symbols.try_fold(1_u128, |all, own| all.checked_mul(own as u128));
    match all {
        Some(symbols) if symbols <= MOST_SYMBOLS => Ok(()),
        symbols => Err(SceneWorstCaseError::TooMany { links, symbols, most: MOST_SYMBOLS }),
    }
}
