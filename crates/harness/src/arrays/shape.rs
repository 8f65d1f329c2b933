//! Which scenes can be run in arrays, and which of them side by side.

use std::sync::Arc;
use std::time::Duration;

use cohaptic_peer::coordination::{BuiltIn, Law};
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Coordination, EXACT_FROM, Integrator};
use cohaptic_scene::{Scene, Strategies, Topology};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{DirectLinks, LinkModel, SteppedLinks};

use super::{nanos, threads};
use crate::plan::{Plan, Ticking};

/// What two scenes must have in common to be run side by side.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Shape {
    pub(super) law: Coordination,
    /// How many numbers it remembers along each axis.
    pub(super) memory: usize,
    /// How many ticks it looks back.
    pub(super) lag: usize,
    pub(super) peers: usize,
    pub(super) axes: usize,
    /// How turns between ticks are computed, and by how many steps a tick, if the object turns.
    pub(super) turns: Option<(Integrator, u32)>,
    pub(super) tick: Duration,
    pub(super) end: Instant,
    /// Ticks from one sample to the next.
    pub(super) send_every: u64,
    /// The tick at which each peer sends first.
    pub(super) phases: Vec<u64>,
    /// The size of a sample.
    pub(super) size: Bytes,
    /// Whether the fate of a packet on some link may depend on later ones.
    pub(super) has_queues: bool,
    /// The delay of all links, if they do nothing but delay, all alike, and lead from all to all.
    pub(super) delay: Option<Duration>,
    /// The neighbours of each peer, if they are not all others.
    pub(super) topology: Option<Arc<Topology>>,
}

/// A year: far from where instants end, so that sums of a few need no care.
const LONGEST: Duration = Duration::from_secs(365 * 86_400);

impl Shape {
    /// The tick before one, and when it is.
    pub(super) fn before(&self, tick: u64) -> (u64, Instant) {
        let before = tick.saturating_sub(1);
        (before, Instant::from_nanos(before * nanos(self.tick)))
    }

    /// Whether a sample reaches all others together, so that links take no memory.
    pub(crate) const fn is_broadcast(&self) -> bool {
        self.delay.is_some()
    }

    /// How many threads pay for a run at most, and why no more.
    pub(crate) fn threads(&self) -> (usize, &'static str) {
        threads::that_pay(self)
    }

    /// Whether a run that diverges is to be run once more with events: queues have looked ahead of the end.
    pub(crate) const fn looks_ahead(&self) -> bool {
        self.has_queues
    }

    /// The shape of a scene that can be run in arrays: everybody ticks together, nothing changes on the way, and no link counts or damages packets inside.
    /// `None` for any other, for strategies that are no law of the registry, on an object that turns for laws with a past, which may have one of its
    /// attitudes, and for exact means, and for gains that differ from peer to peer.
    pub(crate) fn of(scene: &Scene, plan: &Plan, strategies: &impl Strategies) -> Option<(Self, BuiltIn)> {
        // All tick together, so that all have one law.
        let law = strategies.law(scene, 0)?;
        let clock = scene.peers.first()?.clock;
        let kind = if scene.rotation.is_some() { SampleKind::Attitude } else { SampleKind::State };
        let size = Bytes::new(kind.datagram_len(scene.axes.count()) as u64);
        let links = scene.used_links();
        let fits = plan.ticking == Ticking::Lockstep
            && !plan.general_links
            && (scene.rotation.is_none() || Law::<f64>::lag(&law) == 0 && Law::<f64>::memory(&law) == 0 && scene.peers.len() <= EXACT_FROM)
            && scene.timeline.is_empty()
            && scene.coordination.send_when.is_none()
            && scene.duration <= LONGEST
            && clock.tick <= LONGEST
            // What each packet carries counts them in 16 bits.
            && (scene.peers.len() <= usize::from(u16::MAX) || one_delay(scene).is_some())
            && scene.peers.iter().all(|peer| peer.uplink.is_none() && peer.downlink.is_none())
            // All have one law.
            && !scene.has_gains_by_peer()
            && links.iter().all(|(link, _)| DirectLinks::takes(link, size) || SteppedLinks::takes(link));
        fits.then(|| {
            let shape = Self {
                law: scene.coordination.strategy,
                memory: Law::<f64>::memory(&law),
                lag: Law::<f64>::lag(&law),
                peers: scene.peers.len(),
                axes: plan.axes.count(),
                turns: scene.rotation.as_ref().map(|rotation| (scene.integrator, rotation.steps)),
                tick: clock.tick,
                end: Instant::ZERO.saturating_add(scene.duration),
                send_every: u64::try_from(scene.coordination.update.as_nanos() / clock.tick.as_nanos()).unwrap_or(u64::MAX),
                phases: scene.peers.iter().map(|peer| peer.phase).collect(),
                size,
                has_queues: !links.iter().all(|(link, _)| DirectLinks::takes(link, size)),
                delay: one_delay(scene),
                topology: scene.topology.clone(),
            };
            (shape, law)
        })
    }
}

/// The delay of all links, if they have one and nothing else, and lead from all to all.
fn one_delay(scene: &Scene) -> Option<Duration> {
    if scene.topology.is_some() {
        return None;
    }
    let mut delays = scene.links.used().map(|(link, _)| link.is_constant_delay().then(|| LinkModel::mean_delay(link)));
    let first = delays.next()??;
    (first <= LONGEST && delays.all(|delay| delay == Some(first))).then_some(first)
}
