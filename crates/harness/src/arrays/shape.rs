//! Selection of the scenes for arrays, and of scenes for runs side by side.

use std::sync::Arc;
use std::time::Duration;

use cohaptic_peer::coordination::{BuiltIn, Law};
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Coordination, EXACT_FROM, Exchange};
use cohaptic_scene::{Change, ChangeKind, Scene, Strategies, Topology};
use cohaptic_units::print::Span;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{DirectLinks, LinkConfig, LinkModel, Load, SteppedLinks};

use super::nanos;
use crate::plan::{Plan, Ticking};
use crate::questions::instants_between_questions;

/// Common properties of scenes side by side. Made only for a scene fit for arrays.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Shape {
    pub(super) law: Coordination,
    /// Numbers of the law's memory along each axis.
    pub(super) memory: usize,
    /// Lag of the law in ticks.
    pub(super) lag: usize,
    pub(super) peers: usize,
    pub(super) axes: usize,
    pub(super) tick: Duration,
    pub(super) end: Instant,
    /// Ticks between two samples of a peer.
    pub(super) send_every: u64,
    /// Tick of the first sending, indexed by peer.
    pub(super) phases: Vec<u64>,
    /// Size of the samples and least time between two samples on a link.
    pub(super) load: Load,
    /// Time at which the fates of packets become known.
    pub(super) way: Way,
    /// Delay of all links, if every peer sends to all other peers and links do nothing but delay, all by this span; else `None`.
    pub(super) delay: Option<Duration>,
    /// Neighbours of each peer; `None` if every peer sends to all other peers.
    pub(super) topology: Option<Arc<Topology>>,
    /// Ticks between two calls of [`Observer::keep_going`](crate::Observer::keep_going). A power of two.
    pub(super) between_questions: u64,
}

/// Time at which the fates of packets become known, if links do more than delay all packets by the same span.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Way {
    /// The fate of each packet is known as the packet is sent.
    Direct,
    /// The fate of each packet is known before its sender sends the next packet. The fate can depend on later packets, or on a change of the timeline.
    Stepped,
}

/// Longest duration of a run in arrays: a year. Sums of a few such spans do not overflow an instant.
const LONGEST: Duration = Duration::from_secs(365 * 86_400);

impl Shape {
    /// Returns the tick before `tick` and its instant. At tick 0 this is tick 0 itself.
    pub(super) fn before(&self, tick: u64) -> (u64, Instant) {
        let before = tick.saturating_sub(1);
        (before, self.instant(before))
    }

    /// Returns whether the observer is asked before `tick` whether the run goes on.
    pub(super) const fn is_asked_before(&self, tick: u64) -> bool {
        // A power of two minus one masks the remainder.
        tick > 0 && tick & (self.between_questions - 1) == 0
    }

    /// Returns the first tick after `tick` before which the observer is asked.
    pub(super) const fn asked_after(&self, tick: u64) -> u64 {
        (tick | (self.between_questions - 1)) + 1
    }

    /// Returns the instant of a tick.
    pub(super) fn instant(&self, tick: u64) -> Instant {
        Instant::from_nanos(tick * nanos(self.tick))
    }

    /// Returns whether a sample reaches all other peers at the same tick, so links take no memory.
    pub(crate) const fn is_broadcast(&self) -> bool {
        self.delay.is_some()
    }

    /// Returns how the queues of these links are simulated and why; `None` if no link has a queue.
    pub(crate) fn queues(&self, links: &[(&LinkModel, u64)]) -> Option<(&'static str, String)> {
        let have_queues = |config: &LinkConfig| config.bottleneck.is_some() || config.token_bucket.is_some();
        let mut configs = links.iter().filter_map(|(link, _)| link.as_fixed()).filter(|config| have_queues(config)).peekable();
        configs.peek()?;
        let apart = || format!("samples of a link come at least {} apart", Span(self.load.gap));
        Some(match self.way {
            Way::Direct if configs.all(|config| !config.makes_wait(self.load)) => {
                ("none: no sample waits", format!("{}, and each has left by then", apart()))
            }
            Way::Direct => {
                ("when the sample before left the line", "samples have one size, and the newest is dropped where there is no room".to_owned())
            }
            Way::Stepped => {
                let beside = links.iter().any(|(link, _)| link.has_cross_traffic());
                let cross = if beside { "; cross packets are computed one by one when a sample meets them" } else { "" };
                ("from one sample of a link to its next", format!("{}: until then nothing new can be known{cross}", apart()))
            }
        })
    }

    /// Returns whether `alike` scenes of this shape run faster in eight lanes than one after the other.
    ///
    /// Unused lanes cost as much as used lanes, so a minimum of scenes is needed. If all samples travel together, lanes share all work up to the number of
    /// peers from which means are exact; exact means are computed for a single run. If each packet has a separate arrival, packets are most of the work and
    /// are computed for each run by itself. With many peers, the samples in flight of eight runs then no longer fit into the nearest cache.
    pub(crate) fn pays_side_by_side(&self, alike: usize) -> bool {
        if self.delay.is_some() { alike >= 5 && self.peers <= EXACT_FROM } else { alike >= 7 && self.peers <= 12 && self.way == Way::Direct }
    }

    /// Returns whether links have queues that must be advanced as time passes.
    pub(super) fn has_queues(&self) -> bool {
        self.way == Way::Stepped
    }

    /// Returns the first tick at or after an instant.
    pub(super) fn tick_at(&self, at: Instant) -> u64 {
        at.as_nanos().div_ceil(nanos(self.tick))
    }

    /// Returns the shape and the law of a scene, or the reason for which the scene cannot run in arrays.
    pub(crate) fn of<S: Strategies>(scene: &Scene, plan: &Plan, strategies: &S) -> Result<(Self, BuiltIn), &'static str> {
        // All peers tick together, so the law of the first peer is the law of all.
        let law = strategies.law(scene, 0).ok_or("the strategy is not a law of the registry")?;
        let clock = scene.peers[0].clock;
        let load = load(scene);
        let links = scene.used_links();
        let links_change = models_to_come(scene).next().is_some();
        // A change of a link can alter the fate of packets under way, so changing links need the instants of later packets.
        let are_direct = !links_change && links.iter().all(|(link, _)| DirectLinks::takes(link, load));
        let delay = one_delay(scene, load).filter(|_| !links_change);
        // Links of later changes count from the start, because the form of the arrays stays the same for the whole run.
        let late = links.iter().find_map(|(link, _)| why_known_late(link)).or_else(|| models_to_come(scene).find_map(why_known_late));
        // The law after a change is known only for the scene's own strategies.
        let changes_law = |change: &Change| matches!(change.what, ChangeKind::Coordination(_) | ChangeKind::Parameters(_));
        let fits = [
            (!plan.general_links, "everything is modelled"),
            (scene.peers.iter().all(|peer| peer.clock.tick == clock.tick), "the ticks of peers differ in length"),
            (scene.rotation.is_none(), "the object turns"),
            (!(0..scene.peers.len()).any(|peer| scene.operator(peer).is_some()), "an operator sees and moves at each tick"),
            (scene.peers.iter().all(|peer| peer.exchange == Exchange::EACH_TICK), "a device exchanges late, or not at each tick"),
            (plan.ticking == Ticking::Lockstep, "peers tick at instants of their own, by offsets or drifts"),
            (links.iter().all(|(link, _)| !link.may_damage()), "a link damages packets"),
            (models_to_come(scene).all(|link| !link.may_damage()), "the timeline makes a link damage packets"),
            (scene.peers.iter().all(|peer| peer.uplink.is_none() && peer.downlink.is_none()), "packets of several links share an access line"),
            (late.is_none(), late.unwrap_or_default()),
            (!sends_by_difference(scene), "there are dead bands"),
            (!scene.has_gains_by_peer(), "the gains follow the weight that a peer hears, so they differ from peer to peer"),
            (S::OF_SCENE || !scene.timeline.iter().any(changes_law), "the timeline changes the law of the strategy"),
            // A packet stores the index of its receiver in 16 bits.
            (scene.peers.len() <= usize::from(u16::MAX) || delay.is_some(), "there are more than 65,535 peers, over links that take memory"),
            (!scene.ends_with_task(), "the run ends at the outcome of the task"),
            (scene.duration <= LONGEST && clock.tick <= LONGEST, "it lasts longer than a year"),
        ];
        // The first reason counts: explanations show a single one.
        if let Some((_, why)) = fits.into_iter().find(|(fits, _)| !fits) {
            return Err(why);
        }
        let peers = scene.peers.len();
        // One sample to all peers takes as long as one packet.
        let packets = match (&scene.topology, delay) {
            (Some(topology), _) => topology.links(),
            (None, Some(_)) => peers,
            (None, None) => peers.saturating_mul(peers),
        };
        let shape = Self {
            law: scene.coordination.strategy,
            memory: Law::<f64>::memory(&law),
            lag: Law::<f64>::lag(&law),
            peers,
            axes: plan.axes.count(),
            tick: clock.tick,
            end: Instant::ZERO.saturating_add(scene.duration),
            send_every: scene.samples_every(0),
            phases: scene.peers.iter().map(|peer| peer.phase).collect(),
            load,
            way: if are_direct { Way::Direct } else { Way::Stepped },
            delay,
            topology: scene.topology.clone(),
            between_questions: u64::from(instants_between_questions(packets.max(peers))),
        };
        Ok((shape, law))
    }
}

/// Returns whether a send condition (dead bands) keeps back samples at some time of the run.
fn sends_by_difference(scene: &Scene) -> bool {
    scene.coordination.send_when.is_some() || scene.timeline.iter().any(|change| matches!(change.what, ChangeKind::SendWhen(_)))
}

/// Returns the link models set by the timeline.
fn models_to_come(scene: &Scene) -> impl Iterator<Item = &LinkModel> {
    scene.timeline.iter().flat_map(|change| change.what.link_configs()).map(|link| &**link)
}

/// Returns why the fate of a packet over a link may be unknown when the sender sends the next packet; `None` if the fate is known by then.
///
/// Meaningless for a link with damage: [`Shape::of`] gives another reason for such a link first.
fn why_known_late(link: &LinkModel) -> Option<&'static str> {
    (!SteppedLinks::takes(link)).then_some(match link {
        LinkModel::Replay(_) => "a link replays a log",
        LinkModel::Kernel(_) => "a link is netem as a kernel computes it",
        // Besides damage, stepped links refuse a limit, and cross-traffic behind another queue.
        LinkModel::Fixed(_) | LinkModel::Modulated(_) if link.has_limit() => "a link has a limit, and counts packets until they arrive",
        LinkModel::Fixed(_) | LinkModel::Modulated(_) => {
            "a link has cross-traffic behind a token bucket, so that a sample meets it later than it is sent"
        }
    })
}

/// Returns the load of each link of a scene: the size of a sample, and the least time between two samples.
fn load(scene: &Scene) -> Load {
    let ticks = |peer: usize| u32::try_from(scene.samples_every(peer)).unwrap_or(u32::MAX);
    // The shortest time between two samples of any peer bounds the load of all links.
    let gaps = scene.peers.iter().enumerate().map(|(peer, spec)| spec.clock.tick.saturating_mul(ticks(peer)));
    Load { size: Bytes::new(SampleKind::State.datagram_len(scene.axes.count()) as u64), gap: gaps.min().unwrap_or(Duration::ZERO) }
}

/// Returns the delay of all links for the samples of a scene. Returns `None` if links do more than delay, differ, or do not lead from every peer to all other
/// peers.
fn one_delay(scene: &Scene, load: Load) -> Option<Duration> {
    if scene.topology.is_some() {
        return None;
    }
    let mut delays = scene.links.used().map(|(link, _)| link.constant_delay_of(load));
    let first = delays.next()??;
    (first <= LONGEST && delays.all(|delay| delay == Some(first))).then_some(first)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use cohaptic_scene::FromScene;

    use super::*;
    use crate::plan::Model;

    const SHIPPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");

    /// Returns why two peers with the given additional keys cannot run in arrays; `None` if they can.
    fn refusal(keys: &str) -> Option<&'static str> {
        let text = r#"
scene = { duration = "1s", count = 2 }
object.mass = 1
peer = { contact = "none", device.mass = 1 }
link.delay = "9ms"
coordination = { strategy = "average-position", stiffness = 1, update = "8ms" }
"#;
        let settings: Vec<String> = keys.lines().map(str::to_owned).collect();
        let scene = Scene::parse(text, Path::new("x.toml"), &settings).unwrap_or_else(|error| panic!("{keys}: {error}"));
        Shape::of(&scene, &Plan::new(&scene, Model::Least, false), &FromScene).err()
    }

    #[test]
    fn what_needs_events_has_a_reason() {
        let change = |what: &str| format!("timeline=[{{ at = \"1ms\", {what} }}]");
        for fits in [
            String::new(),
            change("link = \"all\", set = { rate = \"1Mbit\" }"),
            "link={ rate = \"1Mbit\", cross-traffic.poisson.rate = \"100kbit\" }".to_owned(),
            change("peer = \"peer1\", set = { hand = { force = 1 } }"),
            change("coordination = { stiffness = 2 }"),
        ] {
            assert_eq!(refusal(&fits), None, "{fits}");
        }
        for (keys, expected) in [
            ("peers=[{ name = \"peer1\", tick = \"2ms\" }]".to_owned(), "differ in length"),
            ("peer.uplink={ rate = \"1Mbit\" }".to_owned(), "share an access line"),
            ("peer.downlink={ corrupt = 0.1 }".to_owned(), "share an access line"),
            ("link.limit=\"9 packets\"".to_owned(), "a link has a limit"),
            (
                "link={ rate = \"1Mbit\", cross-traffic.poisson.rate = \"1kbit\", token-bucket = { rate = \"1Mbit\", burst = \"1kB\" } }".to_owned(),
                "cross-traffic behind a token bucket",
            ),
            (change("link = \"all\", set = { limit = \"9 packets\" }"), "a link has a limit"),
            (format!("link={{ replay = '{SHIPPED}/network/data/fates.csv' }}"), "a link replays a log"),
            ("link={ netem = \"delay 20ms\", netem-profile = \"kernel-6.6\" }".to_owned(), "netem as a kernel computes it"),
            ("peer.clock.drift=\"10ppm\"".to_owned(), "tick at instants of their own"),
            ("peers=[{ name = \"peer1\", clock.offset = \"1ms\" }]".to_owned(), "tick at instants of their own"),
            ("link.corrupt=0.1".to_owned(), "a link damages"),
            (change("link = \"all\", set = { corrupt = 0.1 }"), "the timeline makes a link damage"),
            ("coordination.send-when={ position = 0.001 }".to_owned(), "dead bands"),
            (change("coordination = { send-when = { position = 0.001 } }"), "dead bands"),
            ("scene.axes=3\nobject.inertia=[1, 1, 1]".to_owned(), "the object turns"),
            (
                "peer={ device.mass = 1, coupling.stiffness = 1, hand.operator = {} }\ntask={ kind = \"reach\", targets = [0], radius = 1 }"
                    .to_owned(),
                "an operator sees and moves",
            ),
            ("peer={ contact = \"none\", device = { mass = 1, exchange-every = 2 } }".to_owned(), "exchanges late, or not at each tick"),
            ("peer={ contact = \"none\", device = { mass = 1, exchange-age = 1 } }".to_owned(), "exchanges late, or not at each tick"),
            ("coordination.strategy=\"wave\"\ncoordination.wave.impedance=1".to_owned(), "not a law"),
            (
                "peer.contact=\"grasp\"\npeer.coupling.stiffness=1\ntask={ kind = \"hold\", target = 0, radius = 1, end = \"stop\" }".to_owned(),
                "at the outcome of the task",
            ),
            ("scene.duration=\"9000h\"".to_owned(), "longer than a year"),
        ] {
            assert!(refusal(&keys).is_some_and(|why| why.contains(expected)), "{keys}: {:?}", refusal(&keys));
        }
    }
}
