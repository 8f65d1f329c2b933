use core::time::Duration;

use cohaptic_tests_common::{are_all, properties};
use cohaptic_units::{Bytes, Ecn, Probability, Rate};
use proptest::prelude::*;

use super::*;
use crate::link::Link;
use crate::netem::Netem;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::delay::{Delay, Jitter};
use crate::stages::loss::Loss;
use crate::stages::outage::{Outage, Outages};
use crate::stages::queue::limit::strategies::limits;
use crate::stages::queue::{Bottleneck, CoDel, CrossTraffic, Discipline, DualPi2, FqCoDel, Framing, OnOff, Pie, Poisson, QueueLimit, Red};

const SIZE: Bytes = Bytes::new(64);

fn millis(n: u64) -> Instant {
    Instant::from_nanos(n * 1_000_000)
}

fn bottleneck(discipline: Discipline, limit: Option<QueueLimit>, bits: u64) -> Bottleneck {
    Bottleneck { limit, discipline, ..Bottleneck::at_rate(Rate::bits_per_sec(bits).unwrap()) }
}

fn codel(interval: u64, mtu: u64, ecn: bool) -> Discipline {
    Discipline::CoDel(CoDel { target: Duration::from_millis(5), interval: Duration::from_millis(interval), mtu: Bytes::new(mtu), ecn })
}

fn red(ecn: bool) -> Discipline {
    Discipline::Red(Red::new(SIZE, Bytes::new(320), Probability::new(0.5).unwrap(), 0.02, SIZE, ecn).unwrap())
}

/// Compares the arrivals and the counters of a whole link with those of a stepped link. Packets are offered at `instants`, and each pair in `then` changes
/// the model of both links right before the packet at that index.
fn compare(model: &LinkModel, then: &[(usize, &LinkModel)], (instants, until): (&[Instant], Instant)) {
    let (name, info) = (LinkName::between("a", "b"), PacketInfo { size: SIZE, ecn: Ecn::Capable0 });
    let mut whole = Link::new(7, &name, model.clone());
    let mut stepped = SteppedLinks::new(until, info);
    stepped.add(7, &name, model);
    let mut arrivals = Vec::new();
    for (place, now) in instants.iter().enumerate() {
        for (_, model) in then.iter().filter(|(at, _)| *at == place) {
            whole.set_model(*now, (*model).clone()).unwrap();
            stepped.set_model(*now, LinkId(0), (7, &name), (*model).clone(), &mut |at, _, number, item| arrivals.push((at, number, item)));
        }
        let payload = 1000 - place as u64;
        whole.handle_packet(*now, info, payload).unwrap();
        let next = instants.get(place + 1).copied().unwrap_or(Instant::MAX);
        stepped.offer((*now, next), LinkId(0), payload, |at, is_late, number, item| {
            assert_eq!(is_late, arrivals.iter().any(|(other, ..)| *other >= at));
            arrivals.push((at, number, item));
        });
    }
    whole.handle_timeout(until).unwrap();
    let mut delivered = Vec::new();
    while let Some(event) = whole.poll_event() {
        if matches!(event.fate, Fate::Delivered(_)) {
            delivered.push((event.at, event.sequence, event.payload));
        }
    }
    arrivals.retain(|(at, ..)| *at <= until);
    arrivals.sort_unstable();
    assert_eq!(delivered, arrivals, "{}", model.words());
    assert_eq!(stepped.stats(LinkId(0)), whole.stats(), "{}", model.words());
}

/// Two bursts of 160 packets of 64 bytes. At 100 kbit/s a packet takes 5.12 ms. The first 40 packets of a burst are 3 ms apart and form a queue, the other
/// 120 are 8 ms apart, of which most find an idle transmitter. At 64 kbit/s packets leave just when the next one comes.
fn bursts() -> Vec<Instant> {
    (0..320).map(|n: u64| millis(n / 160 * 1_500 + (n % 160).min(40) * 3 + (n % 160).saturating_sub(40) * 8)).collect()
}

fn with(discipline: Discipline, bits: u64, layout: Layout) -> LinkModel {
    let limit = if matches!(discipline, Discipline::Red(_)) { QueueLimit::Bytes(Bytes::new(640)) } else { QueueLimit::Packets(6) };
    let delay = Delay::with_jitter(Duration::from_millis(24), Jitter::new(Duration::from_millis(6), Default::default())).unwrap();
    let loss = Loss::Independent(Probability::new(0.1).unwrap());
    LinkConfig { bottleneck: Some(bottleneck(discipline, Some(limit), bits)), delay, loss, layout, ..LinkConfig::default() }.into()
}

/// Returns the link with cross-traffic of a fifth of its rate at 100 kbit/s.
fn crossed(mut model: LinkModel, place: usize) -> LinkModel {
    let (rate, second) = (|bits| Rate::bits_per_sec(bits).unwrap(), Duration::from_secs(1));
    let on_off = OnOff { sources: 2, peak: rate(100_000), size: Bytes::new(200), on: second / 20, off: second * 9 / 20, shape: 1.5 };
    let traffic = [CrossTraffic::poisson(Poisson { rate: rate(20_000), size: Bytes::new(100) }), CrossTraffic::on_off(on_off)];
    if let LinkModel::Fixed(config) = &mut model {
        config.cross_traffic = Some(traffic[place].clone().unwrap());
    }
    model
}

fn fq_codel(ecn: bool) -> Discipline {
    let Discipline::CoDel(codel) = codel(30, 64, ecn) else { unreachable!("a CoDel was made") };
    Discipline::FqCoDel(FqCoDel { codel, ..FqCoDel::default() })
}

fn pie(ecn: bool) -> Discipline {
    Discipline::Pie(Pie { target: Duration::from_millis(1), burst: Duration::ZERO, mtu: SIZE, ecn })
}

fn dualpi2() -> Discipline {
    Discipline::DualPi2(DualPi2 { target: Duration::from_millis(1), ..DualPi2::default() })
}

const DISCIPLINES: usize = 11;

fn discipline(place: usize) -> Discipline {
    [
        Discipline::TailDrop,
        Discipline::HeadDrop,
        codel(30, 64, false),
        codel(30, 64, true),
        red(false),
        red(true),
        fq_codel(false),
        fq_codel(true),
        pie(false),
        pie(true),
        dualpi2(),
    ][place]
}

#[test]
fn they_decide_what_whole_links_decide() {
    // At 64 kbit/s a packet takes 8 ms, and leaves at the instant at which the next one comes.
    for (discipline, bits, layout) in (0..DISCIPLINES).map(discipline).flat_map(|discipline| {
        [(discipline, 100_000, Layout::Physical), (discipline, 64_000, Layout::Physical), (discipline, 100_000, Layout::Netem)]
    }) {
        let marks = [codel(30, 64, true), red(true), fq_codel(true), pie(true), dualpi2()].contains(&discipline);
        let queued = QueuedKind::new(&with(discipline, bits, layout), SIZE);
        assert_eq!(queued.is_some(), layout == Layout::Physical && !marks, "{discipline:?}");
        compare(&with(discipline, bits, layout), &[], (&bursts(), millis(2_900)));
    }
}

/// With cross-traffic, and with changes of the cross-traffic while packets are inside.
#[test]
fn they_decide_what_whole_links_decide_beside_cross_traffic() {
    for (place, discipline) in (0..2).flat_map(|place| (0..DISCIPLINES).map(move |number| (place, discipline(number)))) {
        let plain = with(discipline, 100_000, Layout::Physical);
        let model = crossed(plain.clone(), place);
        assert!(SteppedLinks::takes(&model) && QueuedKind::new(&model, SIZE).is_none());
        compare(&model, &[], (&bursts(), millis(2_900)));
        for changes in
            [[(17, &plain), (44, &model)], [(17, &crossed(plain.clone(), 1 - place)), (30, &with(Discipline::HeadDrop, 50_000, Layout::Physical))]]
        {
            compare(&model, &changes, (&bursts(), millis(2_900)));
            compare(&plain, &[(16, &model), changes[1]], (&bursts(), millis(2_900)));
        }
    }
    let netem = crossed(with(Discipline::TailDrop, 100_000, Layout::Netem), 0);
    assert!(!SteppedLinks::takes(&netem));
}

/// A driver stops 2 ms after a packet, before the next one. Counters then hold the events up to the stop only: no drop and no mark that the link has decided
/// for a later instant.
#[test]
fn what_is_ahead_of_a_driver_that_stops_is_taken_back() {
    let (name, info, until) = (LinkName::between("a", "b"), PacketInfo { size: SIZE, ecn: Ecn::Capable0 }, millis(2_900));
    let offered = bursts();
    let models = (0..DISCIPLINES).map(discipline).flat_map(|discipline| {
        let [physical, netem] = [Layout::Physical, Layout::Netem].map(|layout| with(discipline, 100_000, layout));
        [crossed(physical.clone(), 0), crossed(physical.clone(), 1), physical, netem]
    });
    for model in models {
        for last in 20..50 {
            let mut whole = Link::new(7, &name, model.clone());
            let mut stepped = SteppedLinks::new(until, info);
            stepped.add(7, &name, &model);
            let mut arrivals = Vec::new();
            for (now, next) in offered[..=last].iter().zip(&offered[1..]) {
                whole.handle_packet(*now, info, 0_u64).unwrap();
                stepped.offer((*now, *next), LinkId(0), 0_u64, |at, _, number: u64, _| arrivals.push((at, usize::try_from(number).unwrap())));
            }
            let stop = offered[last].saturating_add(Duration::from_millis(2));
            whole.handle_timeout(stop).unwrap();
            while whole.poll_event().is_some() {}
            stepped.stop(stop);
            for (at, number) in arrivals.into_iter().filter(|(at, _)| *at > stop) {
                stepped.forget(LinkId(0), offered[number], at);
            }
            assert_eq!(stepped.stats(LinkId(0)), whole.stats(), "{}, stopped after {last}", model.words());
        }
    }
}

/// A link changes at a packet that finds other packets in transmission and in the queue. The new link has another rate, discipline or limit, or no queue, or a
/// stage that needs an engine. A second change leads back. By day each pair of links changes at two of the eight packets, and all pairs together at each.
#[test]
fn what_is_inside_stays_when_links_change() {
    let netem = |words: &str| Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
    let words = |words: &str| LinkModel::from(LinkConfig { layout: Layout::Physical, ..netem(words) });
    let few = Bottleneck {
        framing: Framing { overhead: -30, ..Framing::default() },
        ..bottleneck(Discipline::HeadDrop, Some(QueueLimit::Time(Duration::from_millis(9))), 90_000)
    };
    let outages = Outages::new(vec![Outage { from: millis(60), to: millis(100) }]).unwrap();
    let models: Vec<LinkModel> = (0..DISCIPLINES)
        .map(|place| with(discipline(place), 100_000, Layout::Physical))
        .chain((0..DISCIPLINES).step_by(2).map(|place| with(discipline(place), 400_000, Layout::Physical)))
        .chain([
            words("delay 5ms"),
            words("delay 24ms 9ms loss gemodel 5% 20%"),
            words("delay 24ms 4ms 50%"),
            words("delay 24ms 4ms 50% duplicate 5%"),
            netem("delay 24ms rate 100kbit").into(),
            with(Discipline::TailDrop, 20_000, Layout::Physical),
        ])
        .chain([LinkConfig { bottleneck: Some(few), outages, ..LinkConfig::default() }.into()])
        .chain([with(Discipline::TailDrop, 100_000, Layout::Netem)])
        .collect();
    for (number, (from, to)) in models.iter().flat_map(|from| models.iter().map(move |to| (from, to))).enumerate() {
        let (first, step) = if are_all() { (0, 1) } else { (number % 4, 4) };
        // At these packets the transmitter is busy, has just sent its last packet, or has been idle for long.
        for at in [1, 17, 30, 44, 52, 60, 68, 100].into_iter().skip(first).step_by(step) {
            compare(from, &[(at, to)], (&bursts(), millis(2_900)));
        }
        // A second change follows while one packet is in transmission, to a discipline that needs an engine.
        compare(from, &[(16, to), (17, &models[3])], (&bursts(), millis(2_900)));
    }
}

/// Queues between losses in bursts and correlated delays, both of which have state.
#[test]
fn queues_between_memories_decide_what_whole_links_decide() {
    for words in ["delay 24ms 4ms 50% loss gemodel 5% 20%", "delay 24ms", "loss 30%"] {
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        for discipline in [Discipline::HeadDrop, codel(30, 0, false), red(false), fq_codel(false), pie(false)] {
            let model = LinkConfig { bottleneck: Some(bottleneck(discipline, None, 100_000)), layout: Layout::Physical, ..config.clone() }.into();
            assert!(QueuedKind::new(&model, SIZE).is_some());
            compare(&model, &[], (&bursts(), millis(2_900)));
        }
    }
}

properties! {
    /// Gaps range from zero to longer than the queue, limits are of each kind, and intervals of CoDel end long before the run does or never.
    #[test]
    fn queues_decide_what_whole_links_decide(
        limit in limits(90_000_000),
        bits in prop_oneof![Just(64_000_u64), 40_000_u64..200_000],
        discipline in prop_oneof![
            Just(Discipline::HeadDrop), Just(red(false)), Just(fq_codel(false)), Just(pie(false)), (1_u64..300, 0_u64..300).prop_map(|(interval, mtu)| codel(interval, mtu, false))
        ],
        gaps in prop::collection::vec(prop_oneof![Just(0_u64), 0..6_000_000_u64, 4_000_000..9_000_000_u64, Just(8_000_000), Just(90_000_000)], 1..200),
        until in 0_u64..1_500_000_000,
    ) {
        let instants: Vec<Instant> = gaps.iter().scan(0, |at, gap| { *at += gap; Some(Instant::from_nanos(*at)) }).collect();
        let loss = Loss::Independent(Probability::new(0.05).unwrap());
        let delay = Delay::with_jitter(Duration::from_millis(24), Jitter::new(Duration::from_millis(6), Default::default())).unwrap();
        let model = LinkConfig { bottleneck: Some(bottleneck(discipline, limit, bits)), loss, delay, ..LinkConfig::default() }.into();
        prop_assert!(QueuedKind::new(&model, SIZE).is_some());
        // A run ends at the offer of its last packet, or later.
        let until = Instant::from_nanos(until).max(*instants.last().expect("there is one"));
        compare(&model, &[], (&instants, until));
    }
}
