//! Random links with any stage and of any kind, and what may be done to them.

use std::sync::{Arc, LazyLock};
use std::time::Duration;

use cohaptic_units::{Bytes, Ecn, Instant, Probability};
use cohaptic_wan::law::{DistTable, Empirical};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::parameters::{Form, Table};
use cohaptic_wan::{
    Between, Bottleneck, Cells, Chance, Checksum, CoDel, Correlation, Corruption, Counts, CrossRecording, CrossTraffic, Delay, DeliveryTrace,
    Discipline, Displacement, Distribution, DualPi2, FateLog, Flips, FourState, FqCoDel, Framing, GilbertElliott, GilbertElliottInTime, IdleOutages,
    Impairments, Jitter, KernelNetem, Layout, Link, LinkConfig, LinkModel, LinkName, Loss, Modulated, Modulator, ModulatorState, OnOff, Order,
    Outages, PacketEvent, PacketInfo, PacketRecord, ParameterValue, PathTrace, Pattern, Peak, Poisson, QueueLimit, RandomOutages, Red, Reorder,
    Service, Slots, Sojourn, TokenBucket, Values,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

use crate::random_links::{BYTE_A_MICROSECOND, Payload, SEED, gap, nanos, outages, probability, rate, size, some_probability};

/// Operation on a link. `gap` is the time since the operation before.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    Offer { gap: Duration, info: PacketInfo },
    Pass { gap: Duration },
    Poll,
    Change { gap: Duration, model: Box<LinkModel> },
}

pub(crate) fn micros(count: u64) -> Duration {
    Duration::from_micros(count)
}

/// The link whose random numbers the tests and the naive models share.
pub(crate) fn any_link(model: impl Into<LinkModel>) -> Link<Payload> {
    Link::new(SEED, &LinkName::between("left", "right"), model)
}

/// Returns the events of packets offered with the given gaps before them, in the order in which the link gives them when it is polled at the end.
pub(crate) fn all_events(model: impl Into<LinkModel>, offered: &[(Duration, PacketInfo)]) -> Vec<PacketEvent<Payload>> {
    let mut subject = any_link(model);
    let mut now = Instant::ZERO;
    for ((gap, info), number) in offered.iter().zip(0..) {
        now += *gap;
        subject.handle_packet(now, *info, number).unwrap();
    }
    subject.handle_timeout(Instant::MAX).unwrap();
    std::iter::from_fn(|| subject.poll_event()).collect()
}

/// The records of a fate log, in its order.
pub(crate) fn all_records(model: impl Into<LinkModel>, offered: &[(Duration, PacketInfo)]) -> Vec<PacketRecord> {
    FateLog::new(all_events(model, offered).iter().map(|event| event.record)).unwrap().records().to_vec()
}

/// Packets of a few bytes, half of them with ECN.
pub(crate) fn packet() -> BoxedStrategy<PacketInfo> {
    (size(), any::<u8>()).prop_map(|(size, bits)| PacketInfo { size, ecn: Ecn::from_bits(bits) }).boxed()
}

pub(crate) fn packets() -> BoxedStrategy<Vec<(Duration, PacketInfo)>> {
    vec((gap(), packet()), 1..60).boxed()
}

pub(crate) fn chance() -> BoxedStrategy<Chance> {
    (some_probability(), prop_oneof![2 => Just(0.0), 1 => 0.0..0.95f64, 1 => -1.0..0.0f64])
        .prop_map(|(p, rho)| Chance::correlated(p, rho).unwrap_or_else(|error| Chance::correlated(p, error.least).unwrap()))
        .boxed()
}

pub(crate) fn four_state() -> BoxedStrategy<FourState> {
    let part = || prop_oneof![1 => Just(0.0), 4 => 0.0..0.5f64];
    (part(), part(), part(), some_probability(), part())
        .prop_map(|(p13, p31, p32, p23, p14)| FourState::new(probability(p13), probability(p31), probability(p32), p23, probability(p14)).unwrap())
        .boxed()
}

pub(crate) fn pattern() -> BoxedStrategy<Pattern> {
    (vec((0..6u64, 1..5u64), 0..4), option::of(1..4u64), any::<bool>())
        .prop_map(|(spans, spare, in_time)| {
            let unit = if in_time { 1_000 } else { 1 };
            let mut edge = 0;
            let mut next = |count| {
                edge += count * unit;
                edge
            };
            let spans: Vec<_> = spans.into_iter().map(|(before, length)| next(before)..next(length)).collect();
            let period = spare.map(|spare| edge + spare * unit);
            let pattern = if in_time {
                let spans: Vec<_> = spans.iter().map(|span| Instant::from_nanos(span.start)..Instant::from_nanos(span.end)).collect();
                Pattern::in_time(&spans, period.map(nanos)).unwrap()
            } else {
                Pattern::of_packets(spans, period).unwrap()
            };
            assert_eq!(pattern.counts() == Counts::Nanoseconds, in_time);
            pattern
        })
        .boxed()
}

pub(crate) fn in_time() -> BoxedStrategy<GilbertElliottInTime> {
    (1..100_000u64, 1..100_000u64, some_probability(), some_probability())
        .prop_map(|(good, bad, h, k)| GilbertElliottInTime::new(nanos(good), nanos(bad), h, k).unwrap())
        .boxed()
}

pub(crate) fn any_loss() -> BoxedStrategy<Loss> {
    let chain = [some_probability(), some_probability(), some_probability(), some_probability()];
    prop_oneof![
        4 => Just(Loss::None),
        1 => some_probability().prop_map(Loss::Independent),
        1 => chance().prop_map(Loss::Correlated),
        1 => chain.prop_map(|[p, r, h, k]| Loss::GilbertElliott(GilbertElliott { p, r, h, k })),
        1 => in_time().prop_map(Loss::GilbertElliottInTime),
        1 => four_state().prop_map(Loss::FourState),
        1 => pattern().prop_map(Loss::Pattern),
    ]
    .boxed()
}

pub(crate) fn limit() -> BoxedStrategy<Option<QueueLimit>> {
    prop_oneof![
        1 => Just(None),
        1 => (0..5u64).prop_map(|packets| Some(QueueLimit::Packets(packets))),
        1 => (0..12u64).prop_map(|bytes| Some(QueueLimit::Bytes(Bytes::new(bytes)))),
        1 => (0..12u64).prop_map(|time| Some(QueueLimit::Time(micros(time)))),
    ]
    .boxed()
}

pub(crate) fn framing() -> BoxedStrategy<Framing> {
    let cells = (1..5u32, 0..3u32).prop_map(|(payload, overhead)| Cells { payload: payload.try_into().unwrap(), overhead });
    (select(vec![0, 0, 0, -14, -2, 1, 28]), option::weighted(0.3, cells)).prop_map(|(overhead, cells)| Framing { overhead, cells }).boxed()
}

fn some_rate() -> BoxedStrategy<cohaptic_units::Rate> {
    prop_oneof![4 => select(vec![BYTE_A_MICROSECOND, BYTE_A_MICROSECOND / 2]), 1 => 100_000..100_000_000u64].prop_map(rate).boxed()
}

pub(crate) fn token_bucket() -> BoxedStrategy<TokenBucket> {
    let peak = (some_rate(), 1..40u64).prop_map(|(rate, burst)| Peak { rate, burst: Bytes::new(burst) });
    (some_rate(), 1..40u64, option::of(peak), framing(), limit())
        .prop_map(|(rate, burst, peak, framing, limit)| TokenBucket { rate, burst: Bytes::new(burst), peak, framing, limit })
        .boxed()
}

/// Opportunities at some milliseconds, often several at once.
pub(crate) fn delivery_trace() -> BoxedStrategy<DeliveryTrace> {
    (vec(0..3u64, 1..6), 1..8u64)
        .prop_map(|(gaps, bytes)| {
            let mut at = 1;
            let lines: Vec<String> = gaps
                .into_iter()
                .map(|gap| {
                    at += gap;
                    at.to_string()
                })
                .collect();
            DeliveryTrace::parse(&lines.join("\n"), Bytes::new(bytes)).unwrap()
        })
        .boxed()
}

pub(crate) fn service() -> BoxedStrategy<Service> {
    prop_oneof![3 => some_rate().prop_map(Service::Rate), 1 => delivery_trace().prop_map(Service::Recorded)].boxed()
}

pub(crate) fn red() -> BoxedStrategy<Red> {
    (0..6u64, 1..8u64, some_probability(), prop_oneof![Just(1.0), 0.001..1.0f64], 1..5u64, any::<bool>())
        .prop_map(|(min, more, p, weight, mean, ecn)| Red::new(Bytes::new(min), Bytes::new(min + more), p, weight, Bytes::new(mean), ecn).unwrap())
        .boxed()
}

pub(crate) fn codel() -> BoxedStrategy<CoDel> {
    (0..5u64, 1..20u64, 0..4u64, any::<bool>())
        .prop_map(|(target, interval, mtu, ecn)| CoDel { target: micros(target), interval: micros(interval), mtu: Bytes::new(mtu), ecn })
        .boxed()
}

pub(crate) fn discipline() -> BoxedStrategy<Discipline> {
    prop_oneof![
        Just(Discipline::TailDrop),
        Just(Discipline::HeadDrop),
        red().prop_map(Discipline::Red),
        codel().prop_map(Discipline::CoDel),
        fq_codel().prop_map(Discipline::FqCoDel),
        dualpi2().prop_map(Discipline::DualPi2),
    ]
    .boxed()
}

pub(crate) fn fq_codel() -> BoxedStrategy<FqCoDel> {
    let number = |numbers: std::ops::Range<u32>| numbers.prop_map(|number| number.try_into().unwrap());
    (codel(), number(1..8), number(1..6)).prop_map(|(codel, quantum, flows)| FqCoDel { codel, quantum, flows }).boxed()
}

/// Gains that make something of waits of microseconds.
pub(crate) fn dualpi2() -> BoxedStrategy<DualPi2> {
    ((0..5u64, 6..30u64, 0..4u64), (0.0..3e4f64, 0.0..1e5f64, 1..5u8), select(vec![0.0, 0.1, 0.5, 1.0]))
        .prop_map(|((target, tupdate, step_thresh), (alpha, beta, factor), share)| DualPi2 {
            target: micros(target),
            tupdate: micros(tupdate),
            alpha,
            beta,
            coupling_factor: factor.try_into().unwrap(),
            step_thresh: micros(step_thresh),
            classic_protection: probability(share),
        })
        .boxed()
}

pub(crate) fn any_bottleneck() -> BoxedStrategy<Bottleneck> {
    (service(), framing(), limit(), discipline())
        .prop_map(|(service, framing, limit, discipline)| Bottleneck { service, framing, limit, discipline })
        .boxed()
}

/// Cross-traffic of some ten thousand packets per second at most, of a load below and above one, and bursts among the first packets.
pub(crate) fn cross_traffic() -> BoxedStrategy<CrossTraffic> {
    let poisson = (select(vec![400_000, 8_000_000u64]), select(vec![5, 100u64]));
    let on_off = (1..4u32, 1..20u64, 1.1..1.9f64);
    let rows = vec((0..8u64, 1..8u64), 1..20);
    prop_oneof![
        poisson.prop_map(|(bits, size)| {
            let size = Bytes::new(size.max(bits / 80_000));
            CrossTraffic::poisson(Poisson { rate: rate(bits), size }).unwrap()
        }),
        on_off.prop_map(|(sources, size, shape)| {
            let (peak, size) = (rate(BYTE_A_MICROSECOND), Bytes::new(size));
            CrossTraffic::on_off(OnOff { sources, peak, size, on: micros(100), off: micros(2_000), shape }).unwrap()
        }),
        rows.prop_map(|rows| {
            let mut at = 0;
            let row = |(gap, bytes)| {
                at += gap;
                format!("{at}e-6,{bytes}\n")
            };
            let rows: String = rows.into_iter().map(row).collect();
            CrossTraffic::recorded(CrossRecording::parse(&format!("t,bytes\n{rows}")).unwrap())
        }),
    ]
    .boxed()
}

pub(crate) fn slots() -> BoxedStrategy<Slots> {
    (0..4_000u64, 0..4_000u64, option::of(1..4u64), option::of(1..8u64))
        .prop_map(|(min, more, packets, bytes)| {
            let count = |count: Option<u64>| count.map(|count| count.try_into().unwrap());
            let mut slots = Slots::new(nanos(min), nanos(min + more)).unwrap();
            (slots.packets, slots.bytes) = (count(packets), count(bytes));
            slots
        })
        .boxed()
}

pub(crate) fn displacement() -> BoxedStrategy<Displacement> {
    prop_oneof![
        (1..4u32).prop_map(|gap| Displacement::Jump { gap: gap.try_into().unwrap() }),
        (1..4u32, 0..20u64).prop_map(|(packets, at_most)| Displacement::Behind { packets: packets.try_into().unwrap(), at_most: micros(at_most) }),
        (0..20u64).prop_map(|by| Displacement::Later { by: micros(by) }),
    ]
    .boxed()
}

pub(crate) fn reorder() -> BoxedStrategy<Reorder> {
    (chance(), displacement()).prop_map(|(packets, how)| Reorder { packets, how }).boxed()
}

pub(crate) fn corruption() -> BoxedStrategy<Corruption> {
    let bits = prop_oneof![
        (chance(), 0..20u32).prop_map(|(packets, count)| Flips::Bits { packets, count }),
        prop_oneof![some_probability(), (0.0..0.1f64).prop_map(probability)].prop_map(Flips::Rate),
    ];
    let within = option::of((0..5u64, 0..5u64).prop_map(|(from, length)| from..from + length));
    (bits, within, select(vec![Checksum::Discards, Checksum::Passes]))
        .prop_map(|(bits, within, checksum)| Corruption { bits, within, checksum })
        .boxed()
}

/// Rows some microseconds apart; an empty delay loses everything.
pub(crate) fn path_trace() -> BoxedStrategy<PathTrace> {
    let row = (1..30u64, option::weighted(0.8, 0..20u64), 0..5u32);
    (vec(row, 1..6), any::<bool>(), any::<bool>())
        .prop_map(|(rows, lines, repeats)| {
            let mut text = String::from("t,delay,loss\n");
            let mut at = 0;
            for (gap, delay, loss) in rows {
                at += gap;
                let delay = delay.map_or(String::new(), |delay| format!("{:.6}", delay as f64 * 1e-6));
                text += &format!("{:.6},{delay},{}\n", at as f64 * 1e-6, f64::from(loss) / 4.0);
            }
            PathTrace::parse(&text, if lines { Between::Lines } else { Between::Steps }, repeats).unwrap()
        })
        .boxed()
}

pub(crate) fn sojourn() -> BoxedStrategy<Sojourn> {
    let mean = || select(vec![20, 1_000, 100_000u64]).prop_map(micros);
    prop_oneof![
        mean().prop_map(Sojourn::Fixed),
        mean().prop_map(Sojourn::Exponential),
        mean().prop_map(|mean| Sojourn::Uniform(mean / 2, mean)),
        (mean(), 1..4u32).prop_map(|(mean, stages)| Sojourn::Erlang(mean, stages)),
    ]
    .boxed()
}

pub(crate) fn any_outages() -> BoxedStrategy<Outages> {
    let random = (sojourn(), sojourn()).prop_map(|(up, down)| RandomOutages { up, down });
    let idle = (1..20u64, 1..20u64).prop_map(|(after, down)| IdleOutages { after: micros(after), down: micros(down) });
    (outages(), option::weighted(0.3, random), option::weighted(0.3, idle))
        .prop_map(|(mut outages, random, idle)| {
            if let Some(random) = random {
                outages = outages.with_random(random).unwrap();
            }
            if let Some(idle) = idle {
                outages = outages.with_idle(idle).unwrap();
            }
            outages
        })
        .boxed()
}

/// Every law, independent and with both memories, and two laws with a memory of a share. Some take milliseconds to make, so they are made once.
pub(crate) static JITTERS: LazyLock<Vec<Delay>> = LazyLock::new(|| {
    use Distribution::{Gamma, Laplace, LogNormal, Normal, Pareto, ParetoNormal, Uniform, Weibull};
    let values = Empirical::new(vec![0.0, 1.0, 2.0, 3.0, 10.0]).unwrap();
    let table = DistTable::parse("-8192 -4000 0 0 4000 8192").unwrap();
    let own = [Distribution::Empirical(Arc::new(values)), Distribution::Table(Arc::new(table))];
    let laws = [Normal, Uniform, Pareto, ParetoNormal, LogNormal, Gamma, Weibull, Laplace].into_iter().chain(own);
    let mut delays = Vec::new();
    for distribution in laws {
        for correlation in [Correlation::None, Correlation::PerPacket(0.5), Correlation::InTime(micros(10))] {
            for (mean, sd, floor) in [(8, 2, 3), (40, 12, 0)] {
                let jitter = Jitter { sd: micros(sd), floor: micros(floor), correlation, distribution: distribution.clone() };
                delays.push(Delay::with_jitter(micros(mean), jitter).unwrap());
            }
        }
    }
    // At the end, because other tests find delays by their place.
    for distribution in [Gamma, Normal] {
        let correlation = Correlation::PartlyInTime { time: micros(10), share: 0.6 };
        delays.push(Delay::with_jitter(micros(40), Jitter { correlation, ..Jitter::new(micros(12), distribution) }).unwrap());
    }
    delays
});

pub(crate) fn any_delay() -> BoxedStrategy<Delay> {
    prop_oneof![
        1 => Just(Delay::default()),
        2 => (0..20u64).prop_map(|mean| Delay::constant(micros(mean))),
        3 => select(JITTERS.as_slice()),
    ]
    .boxed()
}

/// Returns a strategy for the impairments that list their own parameters, with random values of each parameter's form.
#[expect(clippy::panic, reason = "a test may fail")]
fn listed() -> BoxedStrategy<Impairments> {
    let value = |form: &Form| match form {
        Form::Duration => (0..60u64).prop_map(|millis| ParameterValue::Duration(Duration::from_millis(millis))).boxed(),
        Form::Number(_) => (0.0..20.0).prop_map(ParameterValue::Number).boxed(),
        Form::Probability => (0.0..1.0).prop_map(|p| ParameterValue::Probability(Probability::new(p).unwrap())).boxed(),
        Form::Integer(least, most) => (*least..=(least + 9).min(*most)).prop_map(ParameterValue::Integer).boxed(),
        Form::Boolean => any::<bool>().prop_map(ParameterValue::Boolean).boxed(),
        Form::Words(words) => select(words.iter().map(|(word, _)| ParameterValue::Word(word)).collect::<Vec<_>>()).boxed(),
        other => panic!("no values of the form {other:?}"),
    };
    let values = |table: &Table| table.keys().map(|key| value(&key.form).prop_map(move |value| (key.name, value)).boxed()).collect::<Vec<_>>();
    let each: Vec<_> = Impairments::KEYS.iter().map(|key| option::weighted(0.3, values(key.form.table().unwrap()))).collect();
    each.prop_map(|given| {
        let mut impairments = Impairments::default();
        for (key, values) in Impairments::KEYS.iter().zip(given) {
            // Values that are refused leave the impairment out.
            let _ = impairments.set(key.name, values.map(Values).as_ref());
        }
        impairments
    })
    .boxed()
}

/// Returns a strategy for configurations with the given layout.
pub(crate) fn config_in(layout: Layout) -> BoxedStrategy<LinkConfig> {
    let first = (
        option::weighted(0.2, (0..8u64).prop_map(Bytes::new)),
        prop_oneof![2 => Just(Outages::default()), 1 => any_outages()],
        any_loss(),
        any::<bool>(),
        prop_oneof![2 => Just(Chance::default()), 1 => chance()],
        option::weighted(0.25, corruption()),
        option::weighted(0.2, 0..6u64),
    );
    let second = (
        option::weighted(0.25, token_bucket()),
        (option::weighted(0.5, any_bottleneck()), option::weighted(0.25, cross_traffic())),
        option::weighted(0.2, slots()),
        option::weighted(0.25, reorder()),
        option::weighted(0.25, path_trace()),
        any_delay(),
        select(vec![Order::AllowReordering, Order::InOrder]),
        listed(),
    );
    (first, second)
        .prop_map(move |(first, second)| {
            let (mtu, outages, loss, marks_instead_of_loss, duplication, corruption, limit) = first;
            let (token_bucket, (bottleneck, cross_traffic), slots, reorder, trace, delay, order, listed) = second;
            LinkConfig {
                mtu,
                outages,
                loss,
                marks_instead_of_loss,
                duplication,
                corruption,
                limit,
                token_bucket,
                bottleneck,
                cross_traffic,
                slots,
                reorder,
                trace,
                delay,
                listed,
                order,
                layout,
            }
        })
        .boxed()
}

pub(crate) fn any_stages() -> BoxedStrategy<LinkConfig> {
    prop_oneof![config_in(Layout::Physical), config_in(Layout::Netem)].boxed()
}

/// Returns a strategy for configurations without a queue, on which the arrival of a packet is known when it is offered.
pub(crate) fn direct_config() -> BoxedStrategy<LinkConfig> {
    let order = select(vec![Order::AllowReordering, Order::InOrder]);
    (any_outages(), any_loss(), any_delay(), order)
        .prop_map(|(outages, loss, delay, order)| LinkConfig { outages, loss, delay, order, ..LinkConfig::default() })
        .boxed()
}

/// Two or three states and the weights of the ways between them.
pub(crate) fn modulator() -> BoxedStrategy<Modulator> {
    (2..4usize)
        .prop_flat_map(|count| vec((sojourn(), vec(0.1..1.0f64, count)), count))
        .prop_map(|states| {
            let states = states.into_iter().enumerate().map(|(place, (sojourn, mut next))| {
                next[place] = 0.0;
                ModulatorState { sojourn: Some(sojourn), next }
            });
            Modulator::new("cell", states.collect()).unwrap()
        })
        .boxed()
}

pub(crate) fn modulated() -> BoxedStrategy<Modulated> {
    (modulator(), vec(any_stages(), 3))
        .prop_map(|(modulator, mut configs)| {
            configs.truncate(modulator.states().len());
            // A link has one layout in all its states.
            let layout = configs[0].layout;
            configs.iter_mut().for_each(|config| config.layout = layout);
            Modulated::new(modulator, configs).unwrap()
        })
        .boxed()
}

pub(crate) const KERNEL_WORDS: [&str; 8] = [
    "delay 10us 5us",
    "delay 10us 5us 25% loss 10% 25% duplicate 20% corrupt 20%",
    "delay 8us reorder 25% 50% gap 3 duplicate 30%",
    "limit 3 delay 10us rate 8mbit",
    "delay 5us 3us distribution normal loss gemodel 10% 30% 80% 5% rate 4mbit 1 3 2",
    "loss state 10% 50% 20% 40% 5% ecn delay 2us duplicate 10%",
    "slot 3us 9us packets 2 delay 4us",
    "slot 2us bytes 5 limit 4 duplicate 40% delay 1us 1us distribution pareto",
];

pub(crate) fn kernel() -> BoxedStrategy<KernelNetem> {
    select(KERNEL_WORDS.as_slice()).prop_map(|words| KernelNetem::new(Netem::parse(words).unwrap(), Vec::new()).unwrap()).boxed()
}

/// The log of some random link.
pub(crate) fn replay() -> BoxedStrategy<LinkModel> {
    (any_stages(), packets())
        .prop_map(|(config, offered)| {
            let log = FateLog::new(all_events(config, &offered).iter().map(|event| event.record)).unwrap();
            LinkModel::Replay(Arc::new(log))
        })
        .boxed()
}

pub(crate) fn any_model() -> BoxedStrategy<LinkModel> {
    prop_oneof![
        6 => any_stages().prop_map(LinkModel::from),
        1 => direct_config().prop_map(LinkModel::from),
        2 => modulated().prop_map(LinkModel::from),
        1 => kernel().prop_map(LinkModel::from),
        1 => replay(),
    ]
    .boxed()
}

pub(crate) fn steps() -> BoxedStrategy<Vec<Step>> {
    let step = prop_oneof![
        16 => (gap(), packet()).prop_map(|(gap, info)| Step::Offer { gap, info }),
        3 => gap().prop_map(|gap| Step::Pass { gap }),
        3 => Just(Step::Poll),
        1 => (gap(), any_model()).prop_map(|(gap, model)| Step::Change { gap, model: Box::new(model) }),
    ];
    vec(step, 1..60).boxed()
}
