//! Random configurations of links, random operations on links and networks, and a network that can be built from a value.
//!
//! Instants lie mostly on a grid of a microsecond, and at the favourite rate a byte takes just that: so departures, arrivals, offers and the edges
//! of outages often fall on the same instant.
//!
//! Strategies are boxed. An unboxed strategy is a type with the types of all its parts inside, and each property that draws from the strategy would compile
//! all of these parts again.

use std::time::Duration;

pub(crate) use cohaptic_tests_common::cases;
use cohaptic_units::{Bytes, Instant, Probability, Rate};
use cohaptic_wan::{
    AccessLine, Bottleneck, Delay, Distribution, Framing, GilbertElliott, Jitter, Link, LinkConfig, LinkName, Loss, Network, NetworkConfig, NodeId,
    Order, Outage, Outages, PacketEvent, Path, QueueLimit,
};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

/// Rate of one byte per microsecond [bit/s].
pub(crate) const BYTE_A_MICROSECOND: u64 = 8_000_000;

pub(crate) const SEED: u64 = 2015;

/// Payload of a packet: its number among all offered packets, so that a payload in a wrong packet is noticed. All tests have this type, because each type of
/// payload compiles all code of links and networks again.
pub(crate) type Payload = u64;

pub(crate) fn rate(bits_per_sec: u64) -> Rate {
    Rate::bits_per_sec(bits_per_sec).unwrap()
}

pub(crate) fn probability(value: f64) -> Probability {
    Probability::new(value).unwrap()
}

pub(crate) fn jittery(mean: Duration, sd: Duration, distribution: Distribution) -> Delay {
    Delay::with_jitter(mean, Jitter::new(sd, distribution)).unwrap()
}

/// Operation on a link. `gap` is the time since the operation before.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    Offer { gap: Duration, size: Bytes },
    Pass { gap: Duration },
    Poll,
    Configure { gap: Duration, config: Box<LinkConfig> },
}

/// A packet for a network.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sending {
    pub(crate) gap: Duration,
    pub(crate) from: NodeId,
    pub(crate) to: NodeId,
    pub(crate) size: Bytes,
    /// `true` if the driver drains the network afterwards.
    pub(crate) poll: bool,
}

/// Description of a network: a configuration for every pair of nodes, and for the access lines of some nodes.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) nodes: usize,
    /// Configuration of each link, at `from * nodes + to`. The entries of a node with itself are not used.
    pub(crate) links: Vec<LinkConfig>,
    pub(crate) uplinks: Vec<Option<LinkConfig>>,
    pub(crate) downlinks: Vec<Option<LinkConfig>>,
}

impl Plan {
    pub(crate) fn link(&self, from: NodeId, to: NodeId) -> &LinkConfig {
        &self.links[from.index() * self.nodes + to.index()]
    }

    pub(crate) fn build(&self, general: bool) -> Network<Payload> {
        self.with_access_lines(Network::new(self.config(general), |from, to| self.link(from, to).clone()))
    }

    /// Builds the network of [`build`](Self::build), but with links that are made at their first use.
    pub(crate) fn build_on_demand(&self, general: bool) -> Network<Payload> {
        let plan = self.clone();
        self.with_access_lines(Network::on_demand(self.config(general), move |from, to| plan.link(from, to).clone()))
    }

    fn config(&self, general: bool) -> NetworkConfig {
        NetworkConfig { seed: SEED, nodes: (0..self.nodes).map(name).collect(), general }
    }

    fn with_access_lines(&self, mut network: Network<Payload>) -> Network<Payload> {
        for (node, uplink, downlink) in self.node_ids().zip(&self.uplinks).zip(&self.downlinks).map(|((node, up), down)| (node, up, down)) {
            if let Some(config) = uplink {
                network = network.with_access_line(AccessLine::Uplink(node), config.clone()).unwrap();
            }
            if let Some(config) = downlink {
                network = network.with_access_line(AccessLine::Downlink(node), config.clone()).unwrap();
            }
        }
        network
    }

    pub(crate) fn node_ids(&self) -> impl Iterator<Item = NodeId> {
        (0..self.nodes).map(NodeId::new)
    }
}

pub(crate) fn name(node: usize) -> String {
    format!("node-{node}")
}

pub(crate) fn link(config: LinkConfig) -> Link<Payload> {
    Link::new(SEED, &LinkName::between("left", "right"), config)
}

pub(crate) fn drain(link: &mut Link<Payload>) -> Vec<PacketEvent<Payload>> {
    std::iter::from_fn(|| link.poll_event()).collect()
}

pub(crate) fn drain_network(network: &mut Network<Payload>) -> Vec<PacketEvent<Payload, Path>> {
    std::iter::from_fn(|| network.poll_event()).collect()
}

pub(crate) fn nanos(gap: u64) -> Duration {
    Duration::from_nanos(gap)
}

pub(crate) fn at(nanos: u64) -> Instant {
    Instant::from_nanos(nanos)
}

pub(crate) fn gap() -> BoxedStrategy<Duration> {
    prop_oneof![4 => Just(0), 8 => (1..6u64).prop_map(|n| n * 1_000), 2 => 0..10_000u64, 1 => 0..500_000_000u64].prop_map(nanos).boxed()
}

/// Mostly a few bytes.
pub(crate) fn size() -> BoxedStrategy<Bytes> {
    prop_oneof![2 => Just(0), 16 => 1..6u64, 2 => 1..1_500u64].prop_map(Bytes::new).boxed()
}

/// Nothing up to more than the line can send in the age of the universe.
pub(crate) fn any_size() -> BoxedStrategy<Bytes> {
    prop_oneof![20 => size(), 1 => any::<u32>().prop_map(|size| Bytes::new(size.into())), 1 => any::<u64>().prop_map(Bytes::new)].boxed()
}

pub(crate) fn some_probability() -> BoxedStrategy<Probability> {
    prop_oneof![1 => Just(0.0), 1 => Just(1.0), 6 => 0.0..1.0f64].prop_map(probability).boxed()
}

pub(crate) fn loss() -> BoxedStrategy<Loss> {
    let chain = [some_probability(), some_probability(), some_probability(), some_probability()];
    prop_oneof![
        2 => Just(Loss::None),
        1 => some_probability().prop_map(Loss::Independent),
        1 => chain.prop_map(|[p, r, h, k]| Loss::GilbertElliott(GilbertElliott { p, r, h, k })),
    ]
    .boxed()
}

pub(crate) fn bottleneck() -> BoxedStrategy<Bottleneck> {
    let rates = prop_oneof![4 => select(vec![BYTE_A_MICROSECOND, BYTE_A_MICROSECOND / 2]), 1 => 100_000..100_000_000u64];
    let limits = prop_oneof![
        1 => Just(None),
        2 => (0..5u64).prop_map(|packets| Some(QueueLimit::Packets(packets))),
        2 => (0..12u64).prop_map(|bytes| Some(QueueLimit::Bytes(Bytes::new(bytes)))),
    ];
    (rates, select(vec![0, 0, 1, 28]), limits)
        .prop_map(|(bits, overhead, limit)| Bottleneck { framing: Framing { overhead, cells: None }, limit, ..Bottleneck::at_rate(rate(bits)) })
        .boxed()
}

pub(crate) fn delay() -> BoxedStrategy<Delay> {
    prop_oneof![
        1 => Just(Delay::default()),
        2 => (0..20u64).prop_map(|micros| Delay::constant(Duration::from_micros(micros))),
        1 => (0..30_000_000u64).prop_map(|mean| Delay::constant(nanos(mean))),
        1 => (0..30_000u64, 0..20_000u64).prop_map(|(mean, sd)| jittery(nanos(mean), nanos(sd), Distribution::Normal)),
        // √3 < 1.8, so the law stays above zero.
        1 => (0..30_000u64).prop_map(|mean| jittery(nanos(mean), nanos(mean * 10 / 18), Distribution::Uniform)),
    ]
    .boxed()
}

pub(crate) fn outages() -> BoxedStrategy<Outages> {
    vec((0..40u64, 1..20u64), 0..3)
        .prop_map(|spans| {
            let mut edge = 0;
            let mut next = |micros| {
                edge += micros * 1_000;
                at(edge)
            };
            Outages::new(spans.into_iter().map(|(up, down)| Outage { from: next(up), to: next(down) }).collect()).unwrap()
        })
        .boxed()
}

pub(crate) fn config() -> BoxedStrategy<LinkConfig> {
    config_with(proptest::option::of(bottleneck()))
}

pub(crate) fn config_with(bottleneck: impl Strategy<Value = Option<Bottleneck>> + 'static) -> BoxedStrategy<LinkConfig> {
    let order = select(vec![Order::AllowReordering, Order::InOrder]);
    let some_outages = prop_oneof![2 => Just(Outages::default()), 1 => outages()];
    (some_outages, loss(), bottleneck, delay(), order)
        .prop_map(|(outages, loss, bottleneck, delay, order)| LinkConfig { outages, loss, bottleneck, delay, order, ..LinkConfig::default() })
        .boxed()
}

/// Returns a strategy for links that only delay, by a constant. The network computes such links by an addition.
pub(crate) fn plain_config() -> BoxedStrategy<LinkConfig> {
    (0..20u64).prop_map(|micros| LinkConfig { delay: Delay::constant(Duration::from_micros(micros)), ..LinkConfig::default() }).boxed()
}

pub(crate) fn any_config() -> BoxedStrategy<LinkConfig> {
    prop_oneof![3 => config(), 1 => plain_config()].boxed()
}

pub(crate) fn offers() -> BoxedStrategy<Vec<(Duration, Bytes)>> {
    vec((gap(), size()), 1..80).boxed()
}

pub(crate) fn operations() -> BoxedStrategy<Vec<Operation>> {
    let operation = prop_oneof![
        8 => (gap(), any_size()).prop_map(|(gap, size)| Operation::Offer { gap, size }),
        2 => gap().prop_map(|gap| Operation::Pass { gap }),
        2 => Just(Operation::Poll),
        1 => (gap(), any_config()).prop_map(|(gap, config)| Operation::Configure { gap, config: Box::new(config) }),
    ];
    vec(operation, 1..80).boxed()
}

pub(crate) fn plan(nodes: usize, access: f64) -> BoxedStrategy<Plan> {
    let line = move || proptest::option::weighted(access, any_config());
    (vec(any_config(), nodes * nodes), vec(line(), nodes), vec(line(), nodes))
        .prop_map(move |(links, uplinks, downlinks)| Plan { nodes, links, uplinks, downlinks })
        .boxed()
}

pub(crate) fn sendings(nodes: u16) -> BoxedStrategy<Vec<Sending>> {
    let sending = (gap(), 0..nodes, 1..nodes, size(), any::<bool>()).prop_map(move |(gap, from, ahead, size, poll)| Sending {
        gap,
        from: NodeId(from),
        to: NodeId((from + ahead) % nodes),
        size,
        poll,
    });
    vec(sending, 1..120).boxed()
}
