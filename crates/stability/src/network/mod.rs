//! The arrival times of samples over the links of a scene, with nothing left to chance.
//!
//! The timing of a purely delaying link is its delay. In every other link each random part is replaced by a stated part. If the link still does more than
//! delay, samples of the scene are sent through the emulator until the fates repeat. Links without shared access lines are probed once for each
//! configuration and each way of sampling, so very many equal peers cost as much as two.

mod increments;
mod nominal;
mod notes;
mod probe;
mod sampling;
#[cfg(test)]
mod tests;
mod timing;

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_units::{Bytes, Ecn};
use cohaptic_wan::{AccessLine, LinkConfig, Network, NetworkConfig, NodeId, PacketInfo};

pub use timing::LinkTiming;

use self::increments::refuse_lost_increments;
use self::nominal::Nominal;
use self::probe::{MOST_SAMPLES, NoPattern, Probe, RatedLine};
use self::sampling::Sampling;
use crate::AnalysisError;
use crate::pieces::{refuse_operators, refuse_topology};

/// The largest number of peers with shared lines probed together.
const MOST_SHARING: usize = 256;

/// The timings of the links of a scene with nothing left to chance.
#[derive(Clone, Debug)]
pub struct NominalNetwork {
    /// The different timings, each used by at least one link.
    timings: Vec<LinkTiming>,
    places: Places,
    /// A sentence for each replaced part of the network.
    pub notes: Vec<String>,
}

/// The place of each link's timing in [`NominalNetwork::timings`].
#[derive(Clone, Debug)]
enum Places {
    /// Indexed by the configuration of the link, the class of its sender and the class of its receiver.
    Classes { links: cohaptic_scene::LinkTable, senders: Vec<usize>, receivers: Vec<usize>, places: BTreeMap<(usize, usize, usize), usize> },
    /// Indexed by sender and receiver, row by row; the diagonal has no meaning.
    Each { peers: usize, places: Vec<usize> },
}

/// The nominal links and access lines of a scene; `size` is the size of a sample's datagram.
struct Lines {
    size: Bytes,
    links: Vec<Nominal>,
    uplinks: Vec<Option<Nominal>>,
    downlinks: Vec<Option<Nominal>>,
}

impl NominalNetwork {
    /// Returns the timings of all links of a scene in the configuration of its beginning.
    ///
    /// # Errors
    ///
    /// [`AnalysisError`] if the fates of samples never repeat, because a queue is offered more than its rate or because periods do not meet; if too many
    /// peers share lines; if the scene has a topology; if peers send only on changes (dead bands); if clients send displacements over a line that does more
    /// than delay; or if an operator with the law crossover holds a device of an object that turns.
    pub fn of(scene: &Scene) -> Result<Self, AnalysisError> {
        refuse_topology(scene, "this analysis")?;
        if scene.rotation.is_some() {
            refuse_operators(scene, "the analysis of an object that turns")?;
        }
        if scene.coordination.send_when.is_some() {
            return Err(AnalysisError::DeadBands);
        }
        refuse_lost_increments(scene)?;
        let size = Bytes::new(scene.sample_kind().datagram_len(scene.axes.count()) as u64);
        let access = |model: Option<&cohaptic_wan::LinkModel>| model.map(|model| Nominal::of(model, size));
        let lines = Lines {
            size,
            links: scene.links.configs().iter().map(|model| Nominal::of(model, size)).collect(),
            uplinks: scene.peers.iter().map(|peer| access(peer.uplink.as_deref())).collect(),
            downlinks: scene.peers.iter().map(|peer| access(peer.downlink.as_deref())).collect(),
        };
        // Without queues on access lines the links do not affect each other, and one link of each kind is enough.
        let constant = |line: &Option<Nominal>| line.as_ref().map_or(Some(Duration::ZERO), Nominal::constant);
        let delays = |lines: &[Option<Nominal>]| lines.iter().map(constant).collect::<Option<Vec<Duration>>>();
        let mut known = Known::default();
        let places = match (delays(&lines.uplinks), delays(&lines.downlinks)) {
            (Some(uplinks), Some(downlinks)) => by_class(scene, &lines, &uplinks, &downlinks, &mut known)?,
            _ => shared(scene, &lines, &mut known)?,
        };
        known.check_period(scene)?;
        let Lines { links, uplinks, downlinks, .. } = &lines;
        Ok(Self { timings: known.timings, places, notes: notes::notes(scene, links, uplinks, downlinks) })
    }

    /// Returns the network with links of the constant delay `delay`.
    pub fn uniform(delay: Duration) -> Self {
        let places = Places::Each { peers: 0, places: Vec::new() };
        Self { timings: vec![LinkTiming::Constant(delay)], places, notes: Vec::new() }
    }

    /// Returns the timing of the link from peer `from` to peer `to`. The timing from a peer to itself has no meaning.
    pub fn timing(&self, from: usize, to: usize) -> &LinkTiming {
        if self.is_uniform() {
            return &self.timings[0];
        }
        let place = match &self.places {
            Places::Classes { links, senders, receivers, places } => {
                places.get(&(links.config_between(from, to), senders[from], receivers[to])).copied().unwrap_or(0)
            }
            Places::Each { peers, places } => places[from * peers + to],
        };
        &self.timings[place]
    }

    /// Returns whether all links have the same timing.
    pub const fn is_uniform(&self) -> bool {
        self.timings.len() == 1
    }
}

/// Returns the names of the random parts of all links and access lines of a scene, each name once, in the order of the links.
pub(crate) fn chance_of(scene: &Scene) -> Vec<&'static str> {
    let size = Bytes::new(scene.sample_kind().datagram_len(scene.axes.count()) as u64);
    let used = scene.used_links();
    let lines = scene.peers.iter().flat_map(|peer| peer.uplink.as_deref().into_iter().chain(peer.downlink.as_deref()));
    let mut names = Vec::new();
    for name in used.iter().map(|(link, _)| link.as_ref()).chain(lines).flat_map(|model| Nominal::of(model, size).chance) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The different timings found so far, each with an example link.
#[derive(Default)]
struct Known {
    timings: Vec<LinkTiming>,
    links: Vec<(usize, usize)>,
    places: BTreeMap<LinkTiming, usize>,
}

impl Known {
    fn place(&mut self, timing: LinkTiming, link: (usize, usize)) -> usize {
        *self.places.entry(timing).or_insert_with_key(|timing| {
            self.timings.push(timing.clone());
            self.links.push(link);
            self.timings.len() - 1
        })
    }

    /// Fails if all patterns together repeat only after more than [`MOST_SAMPLES`] samples.
    fn check_period(&self, scene: &Scene) -> Result<(), AnalysisError> {
        let mut all = 1;
        for (timing, link) in self.timings.iter().zip(&self.links) {
            all = all / gcd(all, timing.period()) * timing.period();
            if all > MOST_SAMPLES {
                return Err(no_pattern(scene, *link));
            }
        }
        Ok(())
    }
}

const fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Finds the timings of a scene with purely delaying access lines. Links then do not affect each other.
fn by_class(scene: &Scene, lines: &Lines, uplinks: &[Duration], downlinks: &[Duration], known: &mut Known) -> Result<Places, AnalysisError> {
    let links = &scene.links;
    // The instants of sampling matter only if some link does more than delay. Without such a link all peers of equal uplink delay are one class.
    let matters = lines.links.iter().any(|link| link.constant().is_none());
    let (mut ways, mut spans) = (BTreeMap::new(), BTreeMap::new());
    let sampling = |peer: usize| matters.then(|| Sampling::of(scene, peer, uplinks[peer]));
    let senders: Vec<usize> = (0..uplinks.len()).map(|peer| class(&mut ways, (uplinks[peer], sampling(peer)))).collect();
    let receivers: Vec<usize> = downlinks.iter().map(|delay| class(&mut spans, *delay)).collect();
    // Finds one link for each occurring combination of configuration and classes.
    let mut members = (vec![Vec::new(); ways.len()], vec![Vec::new(); spans.len()]);
    for peer in 0..senders.len() {
        members.0[senders[peer]].push(peer);
        members.1[receivers[peer]].push(peer);
    }
    let mut used: BTreeMap<(usize, usize, usize), (usize, usize)> = BTreeMap::new();
    for ((from, to), config) in links.exceptions() {
        used.entry((config, senders[from], receivers[to])).or_insert((from, to));
    }
    for (sender, from) in members.0.iter().enumerate() {
        for (receiver, to) in members.1.iter().enumerate() {
            let mut pairs = from.iter().flat_map(|from| to.iter().map(move |to| (*from, *to))).filter(|(from, to)| from != to);
            if let Some(pair) = pairs.find(|(from, to)| links.config_between(*from, *to) == links.usual()) {
                used.insert((links.usual(), sender, receiver), pair);
            }
        }
    }
    let mut alone: BTreeMap<(usize, Option<Sampling>), LinkTiming> = BTreeMap::new();
    let mut places = BTreeMap::new();
    for ((config, sender, receiver), (from, to)) in used {
        let link = &lines.links[config];
        let way = Sampling::of(scene, from, uplinks[from]);
        // A timeless link treats two senders alike if they differ only by a shift in time.
        let way = if link.is_timeless() { way.timeless() } else { way };
        let key = (config, link.constant().is_none().then_some(way));
        let timing = match (alone.get(&key), link.constant()) {
            (Some(timing), _) => timing.clone(),
            (None, Some(delay)) => LinkTiming::Constant(delay),
            (None, None) => probed(scene, lines, link, way, (from, to))?,
        };
        let place = known.place(timing.later(uplinks[from].saturating_add(downlinks[to])), (from, to));
        alone.insert(key, timing);
        places.insert((config, sender, receiver), place);
    }
    Ok(Places::Classes { links: links.clone(), senders, receivers, places })
}

fn class<K: Ord>(classes: &mut BTreeMap<K, usize>, key: K) -> usize {
    let next = classes.len();
    *classes.entry(key).or_insert(next)
}

/// Returns the timing of one link, by a probe of a network of its two ends.
fn probed(scene: &Scene, lines: &Lines, link: &Nominal, way: Sampling, (from, to): (usize, usize)) -> Result<LinkTiming, AnalysisError> {
    let config = NetworkConfig { seed: scene.seed, nodes: [from, to].map(|peer| scene.peers[peer].name.clone()).to_vec(), general: false };
    let network = Network::new(config, |_, _| link.config.clone());
    let name = format!("the link from {} to {}", scene.peers[from].name, scene.peers[to].name);
    let rated = rated(Some(link), lines.size, name, vec![(0, 1)]);
    let probe = Probe::new(network, 2, vec![way], info(lines.size));
    let found = probe.patterns(cycle([link], scene, 1), rated.as_slice()).map_err(|error| explained(scene, error, |_, _| (from, to)))?;
    Ok(found[1].clone())
}

/// Finds the timings of a scene with queues on access lines, by a probe of all links together.
fn shared(scene: &Scene, lines: &Lines, known: &mut Known) -> Result<Places, AnalysisError> {
    let peers = scene.peers.len();
    if peers > MOST_SHARING {
        return Err(AnalysisError::TooManyShare { peers, most: MOST_SHARING });
    }
    let config = NetworkConfig { seed: scene.seed, nodes: scene.peers.iter().map(|peer| peer.name.clone()).collect(), general: false };
    let link = |from: NodeId, to: NodeId| -> LinkConfig { lines.links[scene.links.config_between(from.index(), to.index())].config.clone() };
    let mut network = Network::new(config, link);
    let mut rates = Vec::new();
    for (place, peer) in scene.peers.iter().enumerate() {
        let node = NodeId::new(place);
        let others = || (0..peers).filter(move |other| *other != place);
        for (line, nominal) in [(AccessLine::Uplink(node), &lines.uplinks[place]), (AccessLine::Downlink(node), &lines.downlinks[place])] {
            let Some(nominal) = nominal else { continue };
            let (name, paths) = match line {
                // A peer sends a sample to a relay as one packet, and without a relay as one packet per receiver.
                AccessLine::Uplink(_) => {
                    let receivers = if scene.relay { 1 } else { peers };
                    (format!("the uplink of {}", peer.name), others().take(receivers).map(|other| (place, other)).collect())
                }
                AccessLine::Downlink(_) => (format!("the downlink of {}", peer.name), others().map(|other| (other, place)).collect()),
            };
            rates.extend(rated(Some(nominal), lines.size, name, paths));
            network = network.with_access_line(line, nominal.config.clone()).unwrap_or_else(|_| unreachable!("every peer is a node"));
        }
        for to in others() {
            let name = format!("the link from {} to {}", peer.name, scene.peers[to].name);
            rates.extend(rated(lines.links.get(scene.links.config_between(place, to)), lines.size, name, vec![(place, to)]));
        }
    }
    if scene.relay {
        network = network.with_relay();
    }
    let ways = (0..peers).map(|peer| Sampling::of(scene, peer, Duration::ZERO)).collect();
    let probe = Probe::new(network, peers, ways, info(lines.size));
    let all = lines.links.iter().chain(lines.uplinks.iter().flatten()).chain(lines.downlinks.iter().flatten());
    let found = probe.patterns(cycle(all, scene, peers), &rates).map_err(|error| explained(scene, error, |from, to| (from, to)))?;
    let timings = found.into_iter().enumerate();
    // The diagonal has no meaning and must not count as a further timing.
    let places = timings.map(|(place, timing)| if place / peers == place % peers { 0 } else { known.place(timing, (place / peers, place % peers)) });
    Ok(Places::Each { peers, places: places.collect() })
}

/// Returns the packet of a sample. Samples are capable of ECN, as in a simulation.
const fn info(size: Bytes) -> PacketInfo {
    PacketInfo { size, ecn: Ecn::Capable0 }
}

fn rated(line: Option<&Nominal>, size: Bytes, name: String, paths: Vec<(usize, usize)>) -> Option<RatedLine> {
    line?.rate(size).map(|(rate, bits)| RatedLine { name, rate, bits, paths })
}

/// Returns the largest number of samples until every time-dependent or packet-counting part begins anew.
fn cycle<'a>(lines: impl IntoIterator<Item = &'a Nominal>, scene: &Scene, senders: usize) -> u64 {
    let update = scene.coordination.update.as_nanos();
    // A clock may be a tenth fast and then sends more samples in the same time.
    let in_time =
        |line: &Nominal| line.cycle().map_or(0, |cycle| u64::try_from(cycle.as_nanos() * 10 / 9 / update).unwrap_or(u64::MAX).saturating_add(1));
    lines.into_iter().map(|line| in_time(line).max(line.packet_cycle())).max().unwrap_or(0).max(senders as u64)
}

fn explained(scene: &Scene, error: NoPattern, link: impl Fn(usize, usize) -> (usize, usize)) -> AnalysisError {
    match error {
        NoPattern::Overloaded { line, load, rate } => AnalysisError::Overloaded { line, load, rate },
        NoPattern::Path { from, to } => no_pattern(scene, link(from, to)),
    }
}

fn no_pattern(scene: &Scene, (from, to): (usize, usize)) -> AnalysisError {
    let name = |peer: usize| scene.peers[peer].name.clone();
    AnalysisError::NoPattern { from: name(from), to: name(to), most: MOST_SAMPLES }
}
