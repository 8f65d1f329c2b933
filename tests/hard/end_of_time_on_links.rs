//! Every stage of a link with spans, rates and sizes at their edges, offered packets until the last instant there is: nothing wraps, panics or never ends, every
//! packet is counted, and what would happen past the end happens at it.

use std::time::Duration;

use cohaptic_tests_common::{properties, same_cases};
use cohaptic_units::{Bytes, Ecn, Instant, Probability, Rate};
use cohaptic_wan::{
    Bottleneck, Chance, CoDel, Correlation, Delay, DeliveryTrace, Discipline, Displacement, Distribution, DualPi2, Fate, FqCoDel, Framing,
    IdleOutages, Jitter, KernelNetem, Layout, Link, LinkConfig, LinkModel, LinkName, Network, NetworkConfig, NodeId, Order, Outage, Outages,
    PacketInfo, Peak, Pie, QueueLimit, RandomOutages, Red, Reorder, Service, Slots, Sojourn, TokenBucket, netem,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

fn nanos(nanos: u64) -> Duration {
    Duration::from_nanos(nanos)
}

/// Spans: none, short, and at the edges of 63 and 64 bits and of a `Duration`.
fn span() -> BoxedStrategy<Duration> {
    select(vec![
        nanos(0),
        nanos(1),
        nanos(1_000_000),
        nanos(1 << 62),
        nanos(i64::MAX as u64),
        nanos(1 << 63),
        nanos(u64::MAX - 1),
        nanos(u64::MAX),
        Duration::MAX,
    ])
    .boxed()
}

/// Spans above zero; for what goes on and on, of a length that time holds a few hundred of at most.
fn long_span() -> BoxedStrategy<Duration> {
    select(vec![nanos(1 << 56), nanos(1 << 62), nanos(i64::MAX as u64), nanos(u64::MAX), Duration::MAX]).boxed()
}

fn rate() -> BoxedStrategy<Rate> {
    select(vec![1, 1000, 1 << 40, u64::MAX]).prop_map(|bits| Rate::bits_per_sec(bits).unwrap()).boxed()
}

fn size() -> BoxedStrategy<Bytes> {
    select(vec![0, 1, 64, 1 << 40, u64::MAX]).prop_map(Bytes::new).boxed()
}

fn limit() -> BoxedStrategy<Option<QueueLimit>> {
    let limits = prop_oneof![
        span().prop_map(QueueLimit::Time),
        size().prop_map(QueueLimit::Bytes),
        select(vec![0, 1, u64::MAX]).prop_map(QueueLimit::Packets)
    ];
    option::of(limits).boxed()
}

fn framing() -> BoxedStrategy<Framing> {
    select(vec![0, i32::MIN, i32::MAX]).prop_map(|overhead| Framing { overhead, cells: None }).boxed()
}

fn bottleneck() -> BoxedStrategy<Bottleneck> {
    let red = Red::new(Bytes::new(1), Bytes::new(u64::MAX), Probability::new(0.5).unwrap(), 0.002, Bytes::new(1500), false).unwrap();
    let codel = (span(), span()).prop_map(|(target, interval)| Discipline::CoDel(CoDel { target, interval, mtu: Bytes::ZERO, ecn: false }));
    let fq_codel = (span(), span()).prop_map(|(target, interval)| {
        Discipline::FqCoDel(FqCoDel { codel: CoDel { target, interval, mtu: Bytes::ZERO, ecn: false }, ..FqCoDel::default() })
    });
    let pie = (span(), span()).prop_map(|(target, burst)| Discipline::Pie(Pie { target, burst, mtu: Bytes::ZERO, ecn: false }));
    let dualpi2 = (span(), span(), span())
        .prop_map(|(target, tupdate, step_thresh)| Discipline::DualPi2(DualPi2 { target, tupdate, step_thresh, ..DualPi2::default() }));
    let discipline = prop_oneof![Just(Discipline::TailDrop), Just(Discipline::HeadDrop), Just(Discipline::Red(red)), codel, fq_codel, pie, dualpi2];
    let recorded =
        select(vec!["1", "9000000000000", "0\n1\n1\n"]).prop_map(|text| Service::Recorded(DeliveryTrace::parse(text, Bytes::new(1500)).unwrap()));
    let service = prop_oneof![3 => rate().prop_map(Service::Rate), 1 => recorded];
    (service, framing(), limit(), discipline)
        .prop_map(|(service, framing, limit, discipline)| {
            let framing = if matches!(service, Service::Recorded(_)) { Framing::default() } else { framing };
            Bottleneck { service, framing, limit, discipline }
        })
        .boxed()
}

fn outages() -> BoxedStrategy<Outages> {
    let scheduled = select(vec![(0, u64::MAX), (u64::MAX - 1, u64::MAX), (u64::MAX - 1000, u64::MAX - 10)])
        .prop_map(|(from, to)| Outages::new(vec![Outage { from: Instant::from_nanos(from), to: Instant::from_nanos(to) }]).unwrap());
    let sojourn = prop_oneof![
        long_span().prop_map(Sojourn::Fixed),
        long_span().prop_map(Sojourn::Exponential),
        long_span().prop_map(|span| Sojourn::Erlang(span, 3))
    ];
    let random = (sojourn.clone(), sojourn).prop_map(|(up, down)| Outages::default().with_random(RandomOutages { up, down }).unwrap());
    let idle = (long_span(), long_span()).prop_map(|(after, down)| Outages::default().with_idle(IdleOutages { after, down }).unwrap());
    prop_oneof![scheduled, random, idle].boxed()
}

fn delay() -> BoxedStrategy<Delay> {
    let longest = nanos(i64::MAX as u64);
    let jittered = (select(vec![nanos(0), longest / 2, longest]), select(vec![nanos(1), longest / 4, longest / 2]), option::of(long_span()));
    let jittered = jittered.prop_map(|(mean, sd, tau)| {
        let correlation = tau.map_or(Correlation::None, Correlation::InTime);
        Delay::with_jitter(mean, Jitter { correlation, ..Jitter::new(sd, Distribution::Normal) }).unwrap()
    });
    prop_oneof![2 => span().prop_map(Delay::constant), 1 => jittered].boxed()
}

/// Any link that is made of these.
fn config() -> BoxedStrategy<LinkConfig> {
    let bucket = (rate(), size(), option::of((rate(), size())), framing(), limit()).prop_map(|(rate, burst, peak, framing, limit)| TokenBucket {
        rate,
        burst,
        peak: peak.map(|(rate, burst)| Peak { rate, burst }),
        framing,
        limit,
    });
    let slots = (span(), span()).prop_map(|(one, other)| Slots::new(one.min(other), one.max(other)).unwrap());
    let how = prop_oneof![
        span().prop_map(|by| Displacement::Later { by }),
        span().prop_map(|at_most| Displacement::Behind { packets: 2.try_into().unwrap(), at_most }),
        Just(Displacement::Jump { gap: 2.try_into().unwrap() }),
    ];
    let reorder = how.prop_map(|how| Reorder { packets: Chance::independent(Probability::new(0.5).unwrap()), how });
    let layout =
        select(vec![(Layout::Physical, Order::AllowReordering), (Layout::Physical, Order::InOrder), (Layout::Netem, Order::AllowReordering)]);
    let queues = (option::weighted(0.3, bucket), option::weighted(0.5, bottleneck()), option::weighted(0.2, slots), option::weighted(0.3, reorder));
    (option::weighted(0.3, outages()), queues, delay(), layout, option::weighted(0.2, select(vec![0, 1, u64::MAX])))
        .prop_map(|(outages, (token_bucket, bottleneck, slots, reorder), delay, (layout, order), limit)| LinkConfig {
            outages: outages.unwrap_or_default(),
            duplication: Chance::independent(Probability::new(0.3).unwrap()),
            token_bucket,
            bottleneck,
            slots,
            reorder,
            delay,
            order,
            layout,
            limit,
            ..LinkConfig::default()
        })
        .boxed()
}

fn is_recorded(config: &LinkConfig) -> bool {
    config.bottleneck.as_ref().is_some_and(|bottleneck| matches!(bottleneck.service, Service::Recorded(_)))
}

/// A size that such links send in some time: a recorded line looks at every opportunity, of which the largest packet takes 10¹⁶.
fn bounded(size: Bytes, configs: &[&LinkConfig]) -> Bytes {
    if configs.iter().any(|config| is_recorded(config)) { size.min(Bytes::new(4000)) } else { size }
}

/// When packets are offered: a few at the beginning, then near the end, the last at the last instant.
fn instants() -> BoxedStrategy<Vec<Instant>> {
    let some = select(vec![0, 1, 1 << 40, 1 << 62, u64::MAX - 1_000_000_000, u64::MAX - 1000, u64::MAX - 2, u64::MAX - 1, u64::MAX]);
    vec(some.prop_map(Instant::from_nanos), 1..25)
        .prop_map(|mut instants| {
            instants.sort_unstable();
            instants
        })
        .boxed()
}

/// Takes all events out of a link; each happens at or after it was offered.
fn drained(link: &mut Link<u64>) -> usize {
    let events = std::iter::from_fn(|| link.poll_event());
    events.map(|event| assert!(event.at >= event.offered && event.fate.is_end() | (event.fate == Fate::Duplicated))).count()
}

fn is_conserved(link: &Link<u64>) -> bool {
    let stats = link.stats();
    stats.offered() + stats.duplicated() == stats.delivered() + stats.dropped_in_all() + stats.in_flight()
}

properties! {
    #![proptest_config(same_cases(3000, 0x6c69_6e6b))]

    /// Whatever the stages, in a link that changes to other ones near the end. When time is at its end, nothing is left inside but what a recorded line has no
    /// opportunity for any more.
    #[test]
    fn every_stage_holds_at_the_edges(one in config(), other in config(), instants in instants(), sizes in vec(size(), 25), change in 0..25_usize) {
        let mut link: Link<u64> = Link::new(3, &LinkName::between("a", "b"), one.clone());
        for (number, (now, size)) in instants.iter().zip(sizes).enumerate() {
            if number == change {
                link.set_model(*now, other.clone()).unwrap();
            }
            let size = bounded(size, &[&one, &other]);
            link.handle_packet(*now, PacketInfo { size, ecn: Ecn::from_bits((number % 4) as u8) }, 0).unwrap();
            prop_assert!(is_conserved(&link));
            if number % 3 == 0 {
                drained(&mut link);
            }
        }
        // As a driver does: until nothing is announced. A link that announced the same instant for ever would never end; each step but few lets something happen.
        let mut steps = 0;
        while let Some(at) = link.poll_timeout() {
            prop_assert!(at >= *instants.last().unwrap());
            link.handle_timeout(at).unwrap();
            drained(&mut link);
            prop_assert!(is_conserved(&link));
            steps += 1;
            prop_assert!(steps < 1_000_000, "{:?} announces {at} again and again", link);
            if at == Instant::MAX && steps > 1000 {
                break;
            }
        }
        link.handle_timeout(Instant::MAX).unwrap();
        drained(&mut link);
        prop_assert!(link.stats().in_flight() == 0 || is_recorded(&one) || is_recorded(&other), "{link:?}");
    }

    /// A network of them gives the same by its direct and by its general path.
    #[test]
    fn a_network_at_the_edges_is_the_same_by_either_path(configs in vec(config(), 2), instants in instants(), sizes in vec(size(), 25)) {
        let fates = |general: bool| {
            let names = ["a", "b"].map(str::to_owned).to_vec();
            let mut network = Network::new(NetworkConfig { seed: 3, nodes: names, general }, |from, _| configs[from.index()].clone());
            let mut fates = Vec::new();
            for (now, size) in instants.iter().zip(&sizes) {
                let size = bounded(*size, &[&configs[0], &configs[1]]);
                network.handle_broadcast(*now, NodeId(0), size, 0_u64).unwrap();
                network.handle_packet(*now, NodeId(1), NodeId(0), size, 0_u64).unwrap();
                fates.extend(std::iter::from_fn(|| network.poll_event()));
            }
            network.handle_timeout(Instant::MAX).unwrap();
            fates.extend(std::iter::from_fn(|| network.poll_event()));
            (fates, [(0, 1), (1, 0)].map(|(from, to)| network.link_stats(NodeId(from), NodeId(to))))
        };
        prop_assert_eq!(fates(false), fates(true));
    }

    /// The kernel's netem, with the longest delays that `tc` counts, the lowest rates and slots.
    #[test]
    fn the_kernels_netem_holds_at_the_edges(
        words in select(vec![
            "delay 274s 2s", "delay 1us rate 8bit", "rate 8bit limit 1000", "slot 274s 274s delay 1s", "delay 100s reorder 50% gap 3 duplicate 30%",
            "rate 8bit 100 53 5 delay 4s",
        ]),
        instants in instants(), sizes in vec(size(), 25),
    ) {
        let words = netem::Netem::parse(words).unwrap();
        let model = LinkModel::from(KernelNetem::new(words, Vec::new()).unwrap());
        let mut link: Link<u64> = Link::new(3, &LinkName::between("a", "b"), model);
        for (now, size) in instants.iter().zip(sizes) {
            link.handle_packet(*now, size, 0).unwrap();
            prop_assert!(is_conserved(&link));
        }
        link.handle_timeout(Instant::MAX).unwrap();
        drained(&mut link);
        prop_assert!(is_conserved(&link));
    }
}

/// Past the end, at it: 5 ns before the end, a delay of 4 is there before, of 5 at it, and any longer one at it too, in the order of their numbers.
#[test]
fn what_would_arrive_past_the_end_arrives_at_it() {
    let now = Instant::from_nanos(u64::MAX - 5);
    let names = LinkName::between("a", "b");
    let mut link: Link<u64> = Link::new(0, &names, LinkConfig::default());
    for (payload, delay) in (0..).zip([nanos(4), Duration::MAX, nanos(5), nanos(6), nanos(u64::MAX)]) {
        link.set_model(now, LinkConfig { delay: Delay::constant(delay), ..LinkConfig::default() }).unwrap();
        link.handle_packet(now, Bytes::new(1), payload).unwrap();
    }
    assert_eq!(link.poll_timeout(), Some(Instant::from_nanos(u64::MAX - 1)));
    link.handle_timeout(Instant::MAX).unwrap();
    let events: Vec<(u64, u64)> = std::iter::from_fn(|| link.poll_event()).map(|event| (event.payload, event.at.as_nanos())).collect();
    assert_eq!(events, [(0, u64::MAX - 1), (1, u64::MAX), (2, u64::MAX), (3, u64::MAX), (4, u64::MAX)]);
    assert_eq!(link.poll_timeout(), None);
}

/// Jitter is computed with a sign: a mean and a deviation that an `i64` does not hold are refused.
#[test]
fn jitter_beyond_292_years_is_refused() {
    let with = |mean, sd| Delay::with_jitter(mean, Jitter::new(sd, Distribution::Normal)).map(|_| ()).map_err(|error| error.to_string());
    let longest = nanos(i64::MAX as u64);
    assert_eq!(with(longest, longest / 2), Ok(()));
    for (mean, sd) in [(longest + nanos(1), nanos(1)), (longest, longest / 2 + nanos(1)), (Duration::MAX, nanos(1)), (nanos(1), Duration::MAX)] {
        assert_eq!(with(mean, sd), Err("a delay and its deviation must be below 292 years".to_owned()));
    }
}

/// A packet of 2⁶⁴ − 1 bytes at one bit per second: until the end of time; at 2⁶⁴ − 1 bit/s: 8 s, to the nanosecond. A change of rate keeps what was sent.
#[test]
fn the_largest_packet_at_the_lowest_and_the_highest_rate() {
    let at_rate = |bits| LinkConfig { bottleneck: Some(Bottleneck::at_rate(Rate::bits_per_sec(bits).unwrap())), ..LinkConfig::default() };
    let largest = Bytes::new(u64::MAX);
    let mut link: Link<u64> = Link::new(0, &LinkName::between("a", "b"), at_rate(u64::MAX));
    link.handle_packet(Instant::ZERO, largest, 0).unwrap();
    assert_eq!(link.poll_timeout(), Some(Instant::from_nanos(8_000_000_000)));
    // Half of it is sent; the other half takes for ever at one bit a second, and 4 s at the old rate.
    link.set_model(Instant::from_nanos(4_000_000_000), at_rate(1)).unwrap();
    assert_eq!(link.poll_timeout(), Some(Instant::MAX));
    link.set_model(Instant::from_nanos(5_000_000_000), at_rate(u64::MAX)).unwrap();
    // In that second one bit was sent, of 2⁶⁴ − 1 a second: less than a nanosecond, and what is left is rounded up.
    assert_eq!(link.poll_timeout(), Some(Instant::from_nanos(9_000_000_000)));
}
