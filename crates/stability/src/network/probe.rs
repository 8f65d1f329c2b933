//! A probe of an emulated network: samples are sent through the network until the fates repeat.

use std::collections::BTreeSet;
use std::time::Duration;

use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Network, NodeId, PacketInfo};

use super::sampling::Sampling;
use super::timing::LinkTiming;

/// The longest pattern of all links together \[samples\].
pub(crate) const MOST_SAMPLES: usize = 64;

/// The largest number of samples of a peer in a probe. [`MOST_PACKETS`] is the largest number of packets of all peers.
const MOST_SENT: u64 = 16_384;
const MOST_PACKETS: u64 = 1 << 24;

/// The number of samples of each peer before the first search for patterns. The number doubles before each further search.
const FIRST_LOOK: u64 = 256;

const PENDING: u64 = u64::MAX;
const LOST: u64 = u64::MAX - 1;

/// A network and its sending peers.
pub(crate) struct Probe {
    network: Network<()>,
    nodes: usize,
    senders: Vec<Sampling>,
    info: PacketInfo,
    /// Number of sent samples, indexed by sender.
    sent: Vec<u64>,
    /// Instant of the next sample of each sender; equal instants in the order of the senders.
    next: BTreeSet<(Instant, usize)>,
    /// Travel time of each sample \[ns\], or `LOST` or `PENDING`; indexed by sender · nodes + receiver, then by sample.
    taken: Vec<Vec<u64>>,
}

/// A line with a limited rate, and the paths through the line.
#[derive(Clone, Debug)]
pub(crate) struct RatedLine {
    pub(crate) name: String,
    /// Rate of the line [bit/s].
    pub(crate) rate: f64,
    /// Size of a sample on the line \[bit\].
    pub(crate) bits: f64,
    pub(crate) paths: Vec<(usize, usize)>,
}

/// Why no pattern was found.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum NoPattern {
    Overloaded { line: String, load: f64, rate: f64 },
    Path { from: usize, to: usize },
}

impl Probe {
    /// Returns a probe with the first nodes of the network, one for each entry of `senders`, sending to all other nodes.
    pub(crate) fn new(network: Network<()>, nodes: usize, senders: Vec<Sampling>, info: PacketInfo) -> Self {
        let next = senders.iter().enumerate().filter_map(|(place, sampling)| Some((sampling.instant(0)?, place))).collect();
        Self { network, nodes, sent: vec![0; senders.len()], senders, info, next, taken: vec![Vec::new(); nodes * nodes] }
    }

    /// Returns the timing of each path, indexed by sender · nodes + receiver. `cycle` is the largest number of samples until every time-dependent or
    /// packet-counting part of the links begins anew. A pattern must repeat for longer than `cycle` samples to be accepted.
    pub(crate) fn patterns(mut self, cycle: u64, lines: &[RatedLine]) -> Result<Vec<LinkTiming>, NoPattern> {
        let paths: Vec<(usize, usize)> =
            (0..self.senders.len()).flat_map(|from| (0..self.nodes).map(move |to| (from, to))).filter(|(from, to)| from != to).collect();
        let most = MOST_SENT.min(MOST_PACKETS / paths.len().max(1) as u64).max(FIRST_LOOK);
        let mut samples = FIRST_LOOK;
        let mut culprit = paths.first().copied().unwrap_or((0, 1));
        loop {
            // The first half of the samples fills queues. Only the second half is searched for a pattern.
            self.send(samples);
            let mut found = vec![LinkTiming::Constant(Duration::ZERO); self.nodes * self.nodes];
            let mut missing = None;
            for (from, to) in &paths {
                match repeated(&self.taken[from * self.nodes + to], samples / 2, cycle) {
                    Some(timing) => found[from * self.nodes + to] = timing,
                    None => missing = missing.or(Some((*from, *to))),
                }
            }
            // A pattern above the rate of a line lasts only until the queue of the line has filled.
            let carried = |line: &RatedLine| self.load(line, |from, to| found[from * self.nodes + to].arriving());
            if missing.is_none() && lines.iter().all(|line| carried(line) <= line.rate * (1.0 + 1e-9)) {
                return Ok(found);
            }
            culprit = missing.unwrap_or(culprit);
            if samples * 2 > most {
                break;
            }
            samples *= 2;
        }
        let overloaded = lines.iter().map(|line| (line, self.load(line, |_, _| 1.0))).find(|(line, load)| *load > line.rate * (1.0 + 1e-9));
        // An overloaded line explains the missing pattern best: its queue grows without end, and so do the delays.
        Err(match overloaded {
            Some((line, load)) => NoPattern::Overloaded { line: line.name.clone(), load, rate: line.rate },
            None => NoPattern::Path { from: culprit.0, to: culprit.1 },
        })
    }

    /// Returns the load of a line [bit/s], if the fraction `fraction(from, to)` of the samples of each path passes the line.
    fn load(&self, line: &RatedLine, fraction: impl Fn(usize, usize) -> f64) -> f64 {
        line.paths.iter().map(|(from, to)| fraction(*from, *to) * self.senders[*from].per_second() * line.bits).sum()
    }

    /// Sends samples until every peer has sent `samples` of them since the beginning.
    fn send(&mut self, samples: u64) {
        let mut waiting = Vec::new();
        while let Some((now, place)) = self.next.pop_first() {
            if self.sent[place] >= samples {
                waiting.push((now, place));
                continue;
            }
            // No error is possible: instants come in order, and every sender is a node.
            let _ = self.network.handle_broadcast(now, NodeId::new(place), self.info, ());
            self.sent[place] += 1;
            self.next.extend(self.senders[place].instant(self.sent[place]).map(|at| (at, place)));
            // All samples of one instant enter the network before the network handles the instant.
            if self.next.first().is_none_or(|(at, _)| *at > now) {
                self.receive(now);
            }
        }
        self.next.extend(waiting);
    }

    fn receive(&mut self, now: Instant) {
        // No error is possible: instants come in order.
        let _ = self.network.handle_timeout(now);
        while let Some(event) = self.network.poll_event() {
            if !event.fate.is_end() {
                continue;
            }
            let arrived = matches!(event.fate, Fate::Delivered(_));
            let taken = if arrived { u64::try_from((event.at - event.offered).as_nanos()).unwrap_or(LOST) } else { LOST };
            let path = &mut self.taken[event.path.from.index() * self.nodes + event.path.to.index()];
            let Ok(place) = usize::try_from(event.sequence) else { continue };
            if path.len() <= place {
                path.resize(place + 1, PENDING);
            }
            path[place] = taken;
        }
    }
}

/// Returns the shortest pattern repeating from sample `start` to the last sample before a pending sample; `None` without a pattern, or with too few samples.
fn repeated(taken: &[u64], start: u64, cycle: u64) -> Option<LinkTiming> {
    let known = taken.iter().position(|taken| *taken == PENDING).unwrap_or(taken.len());
    let start = usize::try_from(start).ok()?;
    let tail = taken.get(start..known)?;
    let needed = (MOST_SAMPLES as u64 * 3 / 2).max(cycle.saturating_add(MOST_SAMPLES as u64));
    if (tail.len() as u64) < needed {
        return None;
    }
    // A period fits if every sample equals the sample one period later. The smallest fitting period is the pattern.
    let period = (1..=MOST_SAMPLES).find(|period| tail.iter().zip(&tail[*period..]).all(|(one, next)| one == next))?;
    let entry = |place: usize| {
        // Index in `tail` of the first sample from `start` on at this place in the pattern.
        let sample = (place + period - start % period) % period;
        (tail[sample] != LOST).then(|| Duration::from_nanos(tail[sample]))
    };
    Some(LinkTiming::repeating((0..period).map(entry).collect()))
}
