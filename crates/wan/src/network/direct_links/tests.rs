use core::time::Duration;

use cohaptic_units::{Bytes, Probability, Rate};

use super::*;
use crate::laws::delay::Distribution;
use crate::laws::sojourn::Sojourn;
use crate::link::Link;
use crate::netem::Netem;
use crate::packet::PacketInfo;
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::delay::{Correlation, Delay, Jitter};
use crate::stages::loss::{GilbertElliottInTime, Loss};
use crate::stages::modulation::{Modulated, Modulator, ModulatorState};
use crate::stages::order::Order;
use crate::stages::queue::{Bottleneck, CoDel, Discipline, Framing, QueueLimit, Red, TokenBucket, nanos};

/// Packets of 64 bytes, with any gaps.
const OF_TESTS: Load = Load::of(Bytes::new(64));

fn model(words: &str) -> LinkModel {
    Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap().into()
}

/// Returns a model of these words of netem, with a queue of this limit before a transmitter of 100 kbit/s, at which 64 bytes take 5.12 ms.
fn queued(words: &str, limit: Option<QueueLimit>) -> LinkModel {
    let bottleneck = Bottleneck { limit, ..Bottleneck::at_rate(Rate::bits_per_sec(100_000).unwrap()) };
    let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
    LinkConfig { bottleneck: Some(bottleneck), layout: Layout::Physical, ..config }.into()
}

const DIRECT: [&str; 9] = [
    "delay 5ms",
    "delay 24ms 9ms loss 10%",
    "delay 24ms 9ms 50% distribution pareto",
    "loss gemodel 5% 20%",
    "delay 3ms 2ms distribution normal",
    "loss 50%",
    "delay 20ms 5ms distribution normal",
    "delay 24ms 4ms 50% loss gemodel 5% 20% 30% 2%",
    "delay 24ms 4ms 50%",
];

/// The same links in order, with and without a queue: a packet arrives with the latest packet before it at the earliest.
#[test]
fn links_in_order_decide_what_whole_links_decide() {
    let in_order = |model: LinkModel| LinkModel::from(LinkConfig { order: Order::InOrder, ..model.as_fixed().unwrap().clone() });
    let direct = DIRECT.map(|words| in_order(model(words)));
    let full =
        ["delay 24ms 9ms loss 10%", "delay 24ms 4ms 50% loss gemodel 5% 20%"].map(|words| in_order(queued(words, Some(QueueLimit::Packets(3)))));
    // Correlated in time, over packets at distances of 8 and 4 ms and, where some are left out, of more.
    let time = Duration::from_millis(50);
    let (whole, partly) = (Correlation::InTime(time), Correlation::PartlyInTime { time, share: 0.6 });
    let memories = [
        (Distribution::LogNormal, whole),
        (Distribution::Gamma, whole),
        (Distribution::Uniform, whole),
        (Distribution::LogNormal, partly),
        (Distribution::Gamma, partly),
    ];
    let in_time = memories.map(|(law, correlation)| {
        let jitter = Jitter { correlation, ..Jitter::new(Duration::from_millis(9), law) };
        let delay = Delay::with_jitter(Duration::from_millis(24), jitter).unwrap();
        let LinkModel::Fixed(config) = model("loss 10%") else { panic!("words are a configuration") };
        LinkModel::from(LinkConfig { delay, ..config })
    });
    compare(&direct[..8]);
    compare(&full);
    compare(&in_time);
    compare(&in_time.clone().map(in_order));
    for model in &in_time {
        compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
    }
    for model in direct.into_iter().chain(full) {
        compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
    }
}

/// Links that are offered packets together: a packet has its bit exactly if the packet waits, whether its delay was computed with the others or alone.
#[test]
fn packets_that_wait_have_their_bits() {
    let LinkModel::Fixed(config) = model("delay 24ms 9ms distribution normal loss 10%") else { panic!("words are a configuration") };
    let in_order = LinkModel::from(LinkConfig { order: Order::InOrder, ..config });
    let mut links = DirectLinks::new(Instant::MAX, OF_TESTS);
    assert!((0..DirectLinks::AT_ONCE).all(|place| links.add(7, &LinkName::between("a", &place.to_string()), &in_order)));
    let (mut arrivals, mut latest, mut waiting) = (Arrivals::NONE, [Instant::ZERO; DirectLinks::AT_ONCE], 0);
    for number in 0..500 {
        links.offer(Instant::from_nanos(number * 4_000_000), LinkId::new(0), DirectLinks::AT_ONCE, 0, &mut arrivals);
        for place in arrivals.places() {
            // Two delays that lead to one nanosecond are too rare to be drawn.
            assert_eq!(arrivals.waits(place), arrivals.at[place] == latest[place], "packet {number} of link {place}");
            latest[place] = arrivals.at[place];
        }
        waiting += arrivals.places().filter(|place| arrivals.waits(*place)).count();
    }
    assert!(waiting > 1000, "{waiting} of 4000 packets");
}

#[test]
fn they_decide_what_whole_links_decide() {
    let direct = DIRECT.map(model);
    compare(&direct[..8]);
    compare(&direct[1..]);
    for model in direct {
        compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
    }
}

/// Packets come every 8 ms, so that the transmitter is idle, or every 4 ms, so that its queue fills.
#[test]
fn queues_decide_what_whole_links_decide() {
    let limits = [None, Some(QueueLimit::Packets(3)), Some(QueueLimit::Bytes(Bytes::new(200))), Some(QueueLimit::Time(Duration::from_millis(9)))];
    let words = ["delay 24ms", "delay 24ms 9ms loss 10%", "delay 24ms 4ms 50% loss gemodel 5% 20%", "delay 24ms 9ms loss state 5% 20%"];
    for limit in limits {
        let queued = words.map(|words| queued(words, limit));
        compare(&queued);
        for model in queued {
            compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
        }
    }
}

/// The transmitter of 100 kbit/s under a load whose packets are at least 5.12 ms apart, with every discipline and a token bucket that holds one packet. No
/// packet waits, whatever the limit.
#[test]
fn lines_without_wait_decide_what_whole_links_decide() {
    let load = Load { gap: Duration::from_micros(5_120), ..OF_TESTS };
    let red = Red::new(Bytes::new(1), Bytes::new(2), Probability::ONE, 1.0, Bytes::new(64), false).unwrap();
    let codel = CoDel { target: Duration::ZERO, interval: Duration::ZERO, mtu: Bytes::ZERO, ecn: false };
    let words = ["delay 24ms", "delay 24ms 9ms loss 10%", "delay 24ms 4ms 50% loss gemodel 5% 20%", "delay 24ms 9ms loss state 5% 20%", "loss 50%"];
    let gamma = Jitter { correlation: Correlation::PerPacket(0.5), ..Jitter::new(Duration::from_millis(6), Distribution::Gamma) };
    let configs = words.map(|words| Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap());
    let chain = LinkConfig { delay: Delay::with_jitter(Duration::from_millis(24), gamma).unwrap(), ..configs[2].clone() };
    for discipline in [Discipline::TailDrop, Discipline::HeadDrop, Discipline::CoDel(codel), Discipline::Red(red)] {
        let lines: Vec<LinkModel> = configs
            .iter()
            .chain([&chain])
            .map(|config| {
                let rate = Rate::bits_per_sec(100_000).unwrap();
                let bottleneck = Bottleneck { discipline, limit: Some(QueueLimit::Bytes(Bytes::ZERO)), ..Bottleneck::at_rate(rate) };
                let bucket =
                    TokenBucket { rate, burst: Bytes::new(64), peak: None, framing: Framing::default(), limit: Some(QueueLimit::Packets(0)) };
                LinkConfig { bottleneck: Some(bottleneck), token_bucket: Some(bucket), layout: Layout::Physical, ..config.clone() }.into()
            })
            .collect();
        assert!(lines.iter().all(|line| !DirectLinks::takes(line, Load { gap: Duration::from_nanos(5_119_999), ..load })));
        compare_under(load, &lines);
        for line in lines {
            compare_under(load, &[const { None }; 8].map(|_: Option<()>| line.clone()));
        }
    }
}

/// Delays of normal, lognormal and gamma laws without correlation are drawn for several links together: with loss and without, in order, and behind a line on
/// which no packet waits, or packets do. The first law is cut at zero; the last law is nearly always at its floor, and has series of logarithms.
#[test]
fn delays_that_are_drawn_together_are_those_of_whole_links() {
    let us = Duration::from_micros;
    for (law, mean, sd, floor) in [
        (Distribution::Normal, us(3_000), us(2_000), us(0)),
        (Distribution::Normal, us(24_000), us(9_000), us(0)),
        (Distribution::LogNormal, us(44_300), us(98_890), us(1_500)),
        (Distribution::Gamma, us(24_000), us(6_000), us(0)),
        (Distribution::Gamma, us(11_350), us(6_300), us(9_950)),
    ] {
        let delay = Delay::with_jitter(mean, Jitter { floor, ..Jitter::new(sd, law) }).unwrap();
        for (loss, order, rate) in [
            ("", Order::AllowReordering, None),
            ("loss 20%", Order::InOrder, None),
            ("loss gemodel 5% 20%", Order::InOrder, None),
            ("loss 20%", Order::AllowReordering, Some(5_000_000)),
            ("loss 20%", Order::AllowReordering, Some(100_000)),
        ] {
            let config = LinkConfig { delay: delay.clone(), order, layout: Layout::Physical, ..model(loss).as_fixed().unwrap().clone() };
            let limit = Some(QueueLimit::Packets(3));
            let bottleneck = rate.map(|rate| Bottleneck { limit, ..Bottleneck::at_rate(Rate::bits_per_sec(rate).unwrap()) });
            let load = Load { gap: Duration::from_millis(4), ..OF_TESTS };
            let link = LinkModel::from(LinkConfig { bottleneck, ..config });
            compare_under(load, &[const { None }; 8].map(|_: Option<()>| link.clone()));
        }
    }
}

/// After jitter, packets may be closer together than they were offered.
#[test]
fn a_bucket_behind_jitter_needs_an_engine() {
    let load = Load { gap: Duration::from_millis(6), ..OF_TESTS };
    for (words, is_taken) in [("delay 24ms", true), ("delay 24ms 9ms", false)] {
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        assert_eq!(config.layout, Layout::Netem);
        let rate = Rate::bits_per_sec(100_000).unwrap();
        let bucket = TokenBucket { rate, burst: Bytes::new(64), peak: None, framing: Framing::default(), limit: None };
        let model = LinkModel::from(LinkConfig { token_bucket: Some(bucket), ..config });
        assert_eq!(DirectLinks::takes(&model, load), is_taken, "{words}");
        assert_eq!(model.constant_delay_of(load), is_taken.then_some(Duration::from_millis(24)), "{words}");
    }
}

/// Correlated gamma delays with losses in bursts, with independent losses and without loss. The shapes include some for which four terms of the series are
/// enough nearly everywhere, one for which they are not, and delays above a floor. Eleven links are offered as groups of eight and three, and as groups of
/// five, five and one.
#[test]
fn chains_decide_what_whole_links_decide() {
    let gamma = |sd: u64, floor: u64| Jitter {
        floor: Duration::from_millis(floor),
        correlation: Correlation::PerPacket(0.5),
        ..Jitter::new(Duration::from_millis(sd), Distribution::Gamma)
    };
    for (words, jitter) in [
        ("loss gemodel 20% 40%", gamma(6, 0)),
        ("loss gemodel 20% 40% 0% 0%", gamma(6, 20)),
        ("loss gemodel 20% 40% 100% 100%", gamma(90, 0)),
        ("loss gemodel 20% 40% 50% 10%", gamma(6, 0)),
        ("loss gemodel 20% 40%", gamma(20, 0)),
        ("loss 30%", gamma(6, 0)),
        ("", gamma(90, 10)),
    ] {
        let delay = Delay::with_jitter(Duration::from_millis(24), jitter).unwrap();
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        let model = LinkModel::from(LinkConfig { delay, ..config });
        compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
        compare(&[const { None }; 11].map(|_: Option<()>| model.clone()));
        compare(&[DIRECT.map(self::model).as_slice(), &[model.clone(), model]].concat());
    }
}

/// Links that change with a modulator: the rate, also while a packet is in transmission, the law of the delay, the losses, and the order. Packets come every
/// 6 ms, and each takes at most 5.12 ms. The links of one modulator change together.
#[test]
fn links_with_a_modulator_decide_what_whole_links_decide() {
    let load = Load { gap: Duration::from_millis(6), ..OF_TESTS };
    let config = |words: &str, rate: Option<u64>, order: Order| {
        let bottleneck =
            rate.map(|rate| Bottleneck { limit: Some(QueueLimit::Packets(0)), ..Bottleneck::at_rate(Rate::bits_per_sec(rate).unwrap()) });
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        LinkConfig { bottleneck, layout: Layout::Physical, order, ..config }
    };
    let modulated = |name: &str, sojourn: Sojourn, configs: Vec<LinkConfig>| {
        let states = configs.len();
        let state =
            |place: usize| ModulatorState { sojourn: Some(sojourn), next: (0..states).map(|next| f64::from(u8::from(next != place))).collect() };
        LinkModel::from(Modulated::new(Modulator::new(name, (0..states).map(state).collect()).unwrap(), configs).unwrap())
    };
    let (jumps, keeps) = (Order::AllowReordering, Order::InOrder);
    let walk = |order| [100_000, 250_000, 800_000].map(|rate| config("delay 24ms", Some(rate), order)).to_vec();
    let laws = vec![
        config("delay 24ms 9ms loss 10%", None, keeps),
        config("delay 5ms", None, keeps),
        config("delay 24ms 4ms 50% loss gemodel 5% 20% 30% 2%", None, keeps),
        config("delay 20ms 5ms distribution normal loss state 5% 20%", None, jumps),
    ];
    // Chains of losses in time that begin anew after a state without one, and that go on from one state with a chain to the next.
    let bursts = |good: u64, bad: u64, rate: u64, order: Order| {
        let (millis, half) = (Duration::from_millis, Probability::new(0.5).unwrap());
        let chain = GilbertElliottInTime::new(millis(good), millis(bad), Probability::ZERO, if good > 30 { Probability::ONE } else { half });
        LinkConfig { loss: Loss::GilbertElliottInTime(chain.unwrap()), ..config("delay 24ms 9ms distribution normal", Some(rate), order) }
    };
    let bursts = vec![
        bursts(40, 20, 100_000, keeps),
        bursts(20, 60, 250_000, keeps),
        config("delay 9ms loss 10%", Some(800_000), keeps),
        config("delay 20ms 5ms distribution normal", Some(100_000), jumps),
    ];
    let stops = vec![config("delay 24ms 9ms", Some(100_000), jumps), config("delay 5ms loss 50%", None, jumps)];
    let links = [
        // A state lasts for 17 ms, so that every third change falls into a transmission.
        modulated("walk", Sojourn::Fixed(Duration::from_millis(17)), walk(jumps)),
        modulated("walk", Sojourn::Fixed(Duration::from_millis(17)), walk(keeps)),
        modulated("fast", Sojourn::Exponential(Duration::from_millis(7)), walk(keeps)),
        modulated("laws", Sojourn::Exponential(Duration::from_millis(40)), laws),
        modulated("bursts", Sojourn::Exponential(Duration::from_millis(60)), bursts),
    ];
    let kinds = links.iter().map(|link| Kinds::new(7, link, load).is_some()).collect::<Vec<_>>();
    assert_eq!(kinds, [true, true, true, false, true], "a chain of delays begins anew with each turn, so that only such links are of no kind");
    compare_under(load, &links);
    for link in links {
        compare_under(load, &[const { None }; 8].map(|_: Option<()>| link.clone()));
    }
    // One state has a rate and the other none; a packet takes the whole gap but for half a microsecond; a state lasts for less than a gap.
    let stops = modulated("stops", Sojourn::Fixed(Duration::from_millis(17)), stops);
    let slow = modulated("slow", Sojourn::Fixed(Duration::from_millis(17)), vec![config("", Some(85_340), jumps), config("", Some(100_000), jumps)]);
    let flaps = modulated("flaps", Sojourn::Fixed(Duration::from_millis(5)), walk(jumps));
    for refused in [stops, slow, flaps] {
        assert!(!DirectLinks::takes(&refused, load), "{}", refused.words());
    }
}

/// Two links that change together, of which the second is offered a packet before the latest packet of the first.
#[test]
#[cfg(debug_assertions)]
fn instants_that_go_back_over_links_of_one_modulator_are_an_error_of_the_program() {
    let state = |next| ModulatorState { sojourn: Some(Sojourn::Fixed(Duration::from_millis(17))), next };
    let modulator = Modulator::new("two", vec![state(vec![0.0, 1.0]), state(vec![1.0, 0.0])]).unwrap();
    let config = |words: &str| LinkConfig { layout: Layout::Physical, ..model(words).as_fixed().unwrap().clone() };
    let configs = ["delay 5ms", "delay 9ms"].map(config).to_vec();
    let modulated = LinkModel::from(Modulated::new(modulator, configs).unwrap());
    let offered = |model: LinkModel, second: u64| {
        std::panic::catch_unwind(move || {
            let mut links = DirectLinks::new(Instant::MAX, OF_TESTS);
            (0..2).for_each(|to| assert!(links.add(1, &LinkName::between("a", &to.to_string()), &model)));
            links.offer_one(Instant::from_nanos(20_000_000), LinkId::new(0));
            links.offer(Instant::from_nanos(second), LinkId::new(1), 1, 0, &mut Arrivals::NONE.clone());
        })
        .is_ok()
    };
    assert!(offered(modulated.clone(), 20_000_000));
    assert!(!offered(modulated, 19_999_999));
    // Links without a modulator have their own time.
    assert!(offered(model("delay 5ms"), 0));
}

/// Compares links that are offered packets in groups of eight, then of five, with one [`Link`] for each model: the same packets at the same instants, and the
/// same counters at the end.
fn compare(direct: &[LinkModel]) {
    compare_under(OF_TESTS, direct);
}

/// [`compare`] for links of this load, whose gap is at most 6 ms.
fn compare_under(load: Load, direct: &[LinkModel]) {
    [DirectLinks::AT_ONCE, 5].into_iter().for_each(|together| compare_in_groups(load, direct, together));
}

fn compare_in_groups(load: Load, direct: &[LinkModel], together: usize) {
    let until = Instant::from_nanos(500 * 8_000_000);
    let mut links = DirectLinks::new(until, load);
    let name = |place: usize| LinkName::between("a", &format!("b{place}"));
    assert!(direct.iter().enumerate().all(|(place, model)| links.add(7, &name(place), model)));
    let mut whole: Vec<Link<u64>> = direct.iter().enumerate().map(|(place, model)| Link::new(7, &name(place), model.clone())).collect();
    let mut arrivals: Vec<Vec<(Instant, u64)>> = vec![Vec::new(); direct.len()];
    for number in 0..500_u64 {
        // Packets come every 8 ms at first and every 4 ms later, or as close together as the load allows.
        let close = nanos(load.gap).max(4_000_000);
        let now = Instant::from_nanos(number.min(250) * 8_000_000 + number.saturating_sub(250) * close);
        // Every third packet is not offered to the second link.
        let excluded = if number % 3 == 0 { 0b10 } else { 0 };
        for (place, link) in whole.iter_mut().enumerate().filter(|(place, _)| u32::from(excluded) >> place & 1 == 0) {
            link.handle_packet(now, PacketInfo::from(Bytes::new(64)), 0).unwrap_or_else(|error| panic!("{place}: {error}"));
        }
        let mut offered = Arrivals::NONE;
        for first in (0..direct.len()).step_by(together) {
            let count = together.min(direct.len() - first);
            let (link, excluded) = (LinkId::new(first), if first == 0 { excluded } else { 0 });
            links.offer(now, link, count, excluded, &mut offered);
            for place in offered.places() {
                let so_far = &mut arrivals[first + place];
                assert_eq!(offered.overtakes(place), so_far.iter().any(|(at, _)| *at > offered.at[place]));
                let latest = so_far.iter().map(|(at, _)| *at).max();
                assert!(!offered.waits(place) || latest == Some(offered.at[place]));
                so_far.push((offered.at[place], offered.sequences[place]));
            }
        }
    }
    for (place, link) in whole.iter_mut().enumerate() {
        link.handle_timeout(until).unwrap();
        let mut delivered = Vec::new();
        while let Some(event) = link.poll_event() {
            if let crate::fates::fate::Fate::Delivered(at) = event.fate {
                delivered.push((at, event.sequence));
            }
        }
        let arrivals = &mut arrivals[place];
        arrivals.sort_unstable();
        arrivals.retain(|(at, _)| *at <= until);
        assert_eq!(delivered, *arrivals, "{}", direct[place].words());
        assert_eq!(links.stats(LinkId::new(place)), link.stats(), "{}", direct[place].words());
    }
}

#[test]
fn what_is_forgotten_is_on_the_way_for_ever() {
    // The packet arrives at the very last instant of the run.
    let mut links = DirectLinks::new(Instant::from_nanos(5_000_000), OF_TESTS);
    assert!(links.add(1, &LinkName::between("a", "b"), &model("delay 5ms")));
    let mut arrivals = Arrivals::NONE;
    links.offer(Instant::ZERO, LinkId(0), 1, 0, &mut arrivals);
    assert_eq!((arrivals.arrive, arrivals.overtake, arrivals.sequences[0]), (1, 0, 0));
    assert_eq!((links.stats(LinkId(0)).delivered(), links.stats(LinkId(0)).in_flight()), (1, 0));
    links.forget(LinkId(0), Instant::ZERO, arrivals.at[0]);
    assert_eq!((links.stats(LinkId(0)).delivered(), links.stats(LinkId(0)).in_flight(), links.stats(LinkId(0)).mean_delay()), (0, 1, None));
}

#[test]
fn what_needs_an_engine_is_left_out() {
    let mut links = DirectLinks::new(Instant::MAX, OF_TESTS);
    for words in ["rate 1mbit delay 5ms 1ms", "duplicate 1%", "delay 10ms limit 5", "corrupt 1%"] {
        assert!(!links.add(1, &LinkName::between("a", "b"), &model(words)), "{words}");
    }
    assert!(links.links.is_empty());
}

/// The arrays of the links have more entries than there are links.
#[test]
fn a_missing_link_is_an_error_of_the_program() {
    let calls: [fn(&mut DirectLinks, LinkId); 5] = [
        |links, link| _ = links.offer_one(Instant::ZERO, link),
        |links, link| _ = links.offered(link),
        |links, link| _ = links.stats(link),
        |links, link| links.offer(Instant::ZERO, link, 1, 0, &mut Arrivals::NONE.clone()),
        // All links from the first to this one.
        |links, link| links.offer(Instant::ZERO, LinkId::new(0), link.index() + 1, 0, &mut Arrivals::NONE.clone()),
    ];
    for (number, call) in calls.into_iter().enumerate() {
        for link in [2, 3, 7] {
            let called = std::panic::catch_unwind(|| {
                let mut links = DirectLinks::new(Instant::MAX, OF_TESTS);
                (0..3).for_each(|to| assert!(links.add(1, &LinkName::between("a", &to.to_string()), &model("delay 5ms 1ms"))));
                call(&mut links, LinkId::new(link));
            });
            assert_eq!(called.is_ok(), link < 3, "call {number} of link {link}");
        }
    }
}

#[test]
fn a_link_without_memory_takes_a_cache_line() {
    assert_eq!(size_of::<LinkState>(), 64);
}

#[test]
#[cfg(debug_assertions)]
fn packets_that_come_earlier_than_the_load_says_are_an_error_of_the_program() {
    let load = Load { gap: Duration::from_millis(5), ..OF_TESTS };
    let offered = |second: u64, alone: bool| {
        std::panic::catch_unwind(move || {
            let mut links = DirectLinks::new(Instant::MAX, load);
            (0..2).for_each(|to| assert!(links.add(1, &LinkName::between("a", &to.to_string()), &model("delay 5ms"))));
            links.offer(Instant::from_nanos(0), LinkId::new(0), 2, 0b01, &mut Arrivals::NONE.clone());
            match alone {
                true => assert!(links.offer_one(Instant::from_nanos(second), LinkId::new(1)).is_some()),
                false => links.offer(Instant::from_nanos(second), LinkId::new(1), 1, 0, &mut Arrivals::NONE.clone()),
            }
            // The first offer left this link out, so that its first packet comes now.
            links.offer_one(Instant::from_nanos(1), LinkId::new(0));
        })
        .is_ok()
    };
    for alone in [true, false] {
        assert!(offered(5_000_000, alone));
        assert!(!offered(4_999_999, alone));
    }
}
