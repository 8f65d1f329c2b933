//! The engine in virtual time.

use std::collections::BTreeMap;

use cohaptic_linkfile::router::Side;
use cohaptic_linkfile::{link_from_keys, router::RouterFile};
use cohaptic_router::{Counters, Departure, Engine, Framing, Packet};
use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{DropCause, Fate, Link, LinkName};
use proptest::prelude::*;

use crate::support::{file, udp, udp_bytes};

fn at(micros: u64) -> Instant {
    Instant::from_nanos(micros * 1_000)
}

fn departures(engine: &mut Engine) -> Vec<Departure> {
    std::iter::from_fn(|| engine.poll_departure()).collect()
}

/// Lets time pass from event to event until no packet is inside a link, and returns all departures.
fn finish(engine: &mut Engine) -> Vec<Departure> {
    let mut all = departures(engine);
    while let Some(due) = engine.poll_timeout() {
        engine.handle_timeout(due);
        all.append(&mut departures(engine));
    }
    all
}

fn number(departure: &Departure) -> u16 {
    u16::from_be_bytes([departure.packet.bytes()[20], departure.packet.bytes()[21]])
}

fn is_conserved(counters: &Counters, departed: [u64; 2], held: u64) {
    for side in Side::BOTH {
        let received = counters.received[side.index()];
        let lanes = counters.lanes.iter().filter(|lane| lane.from == side);
        let into_links: u64 = lanes.clone().map(|lane| lane.stats.offered() + lane.overload).sum();
        assert_eq!(received.all.packets, received.not_ip + received.malformed + received.passed + received.dropped + into_links);
        let delivered: u64 = lanes.clone().map(|lane| lane.stats.delivered()).sum();
        assert_eq!(departed[side.opposite().index()], received.not_ip + received.passed + delivered);
    }
    let inside: u64 = counters.lanes.iter().map(|lane| lane.stats.in_flight()).sum();
    assert_eq!((counters.held.packets, inside), (held, held));
    let decided: u64 = counters.by_rule.iter().chain(&counters.by_default).map(|count| count.packets).sum();
    let asked: u64 = counters.received.iter().map(|received| received.all.packets - received.not_ip - received.malformed).sum();
    assert_eq!(decided, asked);
}

#[test]
fn packets_leave_in_the_order_of_their_instants_whichever_link_they_took() {
    let file = file(
        "router = { default = \"slow\" }\nlinks = { slow = { delay = \"10ms\" }, fast = { delay = \"1ms\" } }\nrules = [{ source-port = 2, link = \"fast\" }, { source-port = 3, link = \"pass\" }, { source-port = 4, link = \"drop\" }]",
    );
    let mut engine = Engine::new(&file);
    for (instant, port, from) in [(0, 1, Side::Left), (0, 2, Side::Left), (500, 3, Side::Right), (9_500, 2, Side::Right), (9_600, 4, Side::Left)] {
        engine.handle_packet(at(instant), from, udp([port, 9], 10));
    }
    let left: Vec<_> = finish(&mut engine).iter().map(|departure| (departure.at, departure.to, number(departure))).collect();
    let expected = [(at(500), Side::Left, 3), (at(1_000), Side::Right, 2), (at(10_000), Side::Right, 1), (at(10_500), Side::Left, 2)];
    assert_eq!(left, expected);
    let counters = engine.counters();
    is_conserved(&counters, [2, 2], 0);
    assert_eq!(counters.by_rule.iter().map(|count| (count.packets, count.bytes)).collect::<Vec<_>>(), [(2, 76), (1, 38), (1, 38)]);
    assert_eq!(counters.by_default.map(|count| count.packets), [1, 0]);
    assert_eq!(counters.lane("fast", Side::Right).map(|lane| (lane.stats.delivered(), lane.delivered_bytes)), Some((1, 38)));
    assert_eq!(counters.lane("slow", Side::Left).unwrap().recent_delay.count, 1);
    assert_eq!(engine.counters().lane("slow", Side::Left).unwrap().recent_delay.count, 0, "asked for a moment ago");
    assert_eq!((counters.dropped(), engine.now()), (1, at(10_500)));
}

/// A late driver does not change the events, only the time at which they are noticed.
#[test]
fn an_engine_that_is_asked_late_gives_the_same_departures() {
    let text = "router = { seed = 3, default = \"x\" }\nlinks = { x = { delay = \"5ms\", jitter = \"2ms\", loss = \"10%\", rate = \"2Mbit\" } }";
    let offer =
        |engine: &mut Engine| (0..200_u16).for_each(|number| engine.handle_packet(at(u64::from(number) * 300), Side::Left, udp([number, 9], 30)));
    let (mut in_time, mut late) = (Engine::new(&file(text)), Engine::new(&file(text)));
    offer(&mut in_time);
    offer(&mut late);
    let expected = finish(&mut in_time);
    late.handle_timeout(at(10_000_000));
    let found = departures(&mut late);
    assert!(found.len() > 150);
    let seen = |departures: &[Departure]| departures.iter().map(|departure| (departure.at, number(departure))).collect::<Vec<_>>();
    assert_eq!(seen(&found), seen(&expected));
}

/// The loop of a router comes by during a silence, and the engine computes the cross packets of the silence then. Departures and counts are the same with any
/// calls.
#[test]
fn a_silence_beside_cross_traffic_changes_no_departure() {
    let text =
        "router = { seed = 3, default = \"x\" }\nlinks = { x = { delay = \"5ms\", rate = \"1Mbit\", cross-traffic.poisson.rate = \"900kbit\" } }";
    let run = |look_ms: Option<u64>| {
        let mut engine = Engine::new(&file(text));
        let mut left = Vec::new();
        for begin in [0, 20_000, 45_000_u64] {
            for side in Side::BOTH {
                engine.handle_packet(at(begin * 1_000), side, udp([1, 9], 30));
            }
            left.append(&mut finish(&mut engine));
            for look in look_ms.into_iter().flat_map(|look| (begin..begin + 15_000).step_by(usize::try_from(look).unwrap())) {
                engine.handle_timeout(at(look * 1_000));
            }
        }
        (left, engine.counters().lanes.iter().map(|lane| lane.stats.cross_traffic()).collect::<Vec<_>>())
    };
    let (left, crossed) = run(None);
    assert!(left.len() == 6 && crossed.iter().all(|counts| counts.offered > 2_000), "{crossed:?}");
    for look_ms in [1, 7, 50] {
        assert_eq!(run(Some(look_ms)), (left.clone(), crossed.clone()), "a look each {look_ms} ms");
    }
}

/// A link of the router treats its packets like a single link with the same name and seed, independent of packets in other links.
#[test]
fn fates_are_those_of_the_link_alone() {
    let keys = ["loss=20%", "duplicate=5%", "delay=3ms", "jitter=1ms"];
    let text = "router = { seed = 11, default = \"other\" }\nlinks = { other = { loss = \"50%\" }, wan = { loss = \"20%\", duplicate = \"5%\", delay = \"3ms\", jitter = \"1ms\" } }\nrules = [{ destination-port = 7, link = \"wan\" }]";
    let mut engine = Engine::new(&file(text));
    let mut link = Link::new(11, &LinkName::between("wan.right", "wan.left"), link_from_keys(&keys.map(str::to_owned)).unwrap());
    for number in 0..500_u16 {
        let instant = at(u64::from(number) * 100);
        engine.handle_packet(instant, Side::Right, udp([number, 8], 4));
        engine.handle_packet(instant, Side::Right, udp([number, 7], 4));
        engine.handle_packet(instant, Side::Left, udp([number, 7], 4));
        link.handle_packet(instant, Bytes::new(32), number).unwrap();
    }
    link.handle_timeout(at(1_000_000)).unwrap();
    let events = std::iter::from_fn(|| link.poll_event());
    let mut expected: Vec<_> =
        events.filter_map(|event| if let Fate::Delivered(at) = event.fate { Some((at, event.payload)) } else { None }).collect();
    let is_of_link = |departure: &&Departure| departure.to == Side::Left && departure.packet.bytes()[23] == 7;
    let mut found: Vec<_> = finish(&mut engine).iter().filter(is_of_link).map(|departure| (departure.at, number(departure))).collect();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
    let stats = engine.counters().lane("wan", Side::Right).unwrap().stats;
    assert_eq!((stats.dropped(DropCause::Loss), stats.duplicated()), (link.stats().dropped(DropCause::Loss), link.stats().duplicated()));
    assert_ne!(
        engine.counters().lane("wan", Side::Left).unwrap().stats.dropped(DropCause::Loss),
        stats.dropped(DropCause::Loss),
        "each direction has its own chance"
    );
}

#[test]
fn what_is_inside_all_links_is_bounded_by_packets_and_by_bytes() {
    for memory in ["{ packets = 10 }", "{ packets = 1000, bytes = \"380B\" }"] {
        let mut engine = Engine::new(&file(&format!("router = {{ default = \"x\", memory = {memory} }}\nlinks = {{ x = {{ delay = \"1s\" }} }}")));
        for number in 0..25 {
            engine.handle_packet(at(number), if number < 15 { Side::Left } else { Side::Right }, udp([1, 2], 10));
        }
        let counters = engine.counters();
        assert_eq!(counters.held.packets, 10);
        assert_eq!((counters.lane("x", Side::Left).unwrap().overload, counters.lane("x", Side::Right).unwrap().overload), (5, 10));
        assert_eq!(finish(&mut engine).len(), 10);
        engine.handle_packet(at(3_000_000), Side::Left, udp([1, 2], 10));
        assert_eq!(engine.counters().held.packets, 1, "there is room again");
        is_conserved(&engine.counters(), [0, 10], 1);
    }
}

#[test]
fn a_link_is_changed_while_packets_are_on_the_way() {
    let mut engine = Engine::new(&file("router = { default = \"x\" }\nlinks = { x = { delay = \"10ms\" } }"));
    let delay = |text: &str| link_from_keys(&[format!("delay={text}")]).unwrap();
    engine.handle_packet(at(0), Side::Left, udp([1, 2], 0));
    engine.set_link(at(1_000), "x", Some(Side::Left), &delay("2ms")).unwrap();
    engine.handle_packet(at(1_000), Side::Left, udp([2, 2], 0));
    engine.handle_packet(at(1_000), Side::Right, udp([3, 2], 0));
    engine.set_link(at(2_000), "x", None, &delay("1ms")).unwrap();
    engine.handle_packet(at(2_000), Side::Right, udp([4, 2], 0));
    let left: Vec<_> = finish(&mut engine).iter().map(|departure| (departure.at, number(departure))).collect();
    assert_eq!(left, [(at(3_000), 2), (at(3_000), 4), (at(10_000), 1), (at(11_000), 3)]);
    let error = engine.set_link(at(20_000), "y", None, &delay("1ms")).unwrap_err();
    assert_eq!(error.to_string(), "there is no link \"y\": expected one of x");
}

#[test]
fn what_is_no_packet_of_ip_crosses_and_what_pretends_to_be_one_does_not() {
    let mut engine = Engine::new(&file("router = { default = \"drop\" }"));
    let arp = [[0xff; 12].as_slice(), &[8, 6], &[1; 28]].concat();
    engine.handle_packet(at(5), Side::Right, Packet::new(arp.clone(), Framing::Ethernet));
    engine.handle_packet(at(5), Side::Right, Packet::new([[0xff; 12].as_slice(), &[8, 0], &[1; 28]].concat(), Framing::Ethernet));
    engine.handle_packet(at(6), Side::Right, udp([1, 2], 0));
    // An instant before the latest one counts as the latest one.
    engine.handle_packet(at(1), Side::Right, Packet::new(arp.clone(), Framing::Ethernet));
    let left = departures(&mut engine);
    assert_eq!(
        left.iter().map(|departure| (departure.at, departure.to, departure.packet.bytes())).collect::<Vec<_>>(),
        [(at(5), Side::Left, arp.as_slice()), (at(6), Side::Left, &arp)]
    );
    let received = engine.counters().received[1];
    assert_eq!((received.all.packets, received.not_ip, received.malformed, received.dropped), (4, 2, 1, 1));
    assert_eq!(engine.poll_timeout(), None);
}

/// A damaged copy leaves the other copy whole, and congestion is marked if the sender understands marks.
#[test]
fn what_a_link_does_to_one_copy_it_does_not_do_to_the_other() {
    let text = "router = { seed = 2, default = \"x\" }\nlinks = { x = { duplicate = \"100%\", corrupt = { probability = \"50%\", checksum = \"passes\", bytes = \"28-47\" } } }";
    let file = RouterFile::parse(&format!("left = {{ tun = \"a\" }}\nright = {{ tun = \"b\" }}\n{text}"), std::path::Path::new("x"), &[]);
    let mut engine = Engine::new(&file.unwrap_or_else(|error| panic!("{error}")));
    let original = udp_bytes([1, 2], &[7; 20]);
    for number in 0..100 {
        engine.handle_packet(at(number), Side::Left, Packet::new(original.clone(), Framing::Ip));
    }
    let all = finish(&mut engine);
    let mut whole = BTreeMap::new();
    all.iter().for_each(|departure| *whole.entry(departure.at).or_insert(0) += u32::from(departure.packet.bytes() == original));
    assert_eq!((all.len(), whole.len()), (200, 100));
    assert!(whole.values().any(|whole| *whole == 1), "one of two is damaged");
    let damaged = engine.counters().lane("x", Side::Left).unwrap().stats.damaged();
    assert_eq!(u64::from(200 - whole.values().sum::<u32>()), damaged);

    let text = "router = { default = \"x\" }\nlinks = { x = { loss = \"100%\", mark-instead-of-loss = true } }";
    let mut engine = Engine::new(&self::file(text));
    let mut capable = original.clone();
    capable[1] = 0b10;
    for bytes in [original, capable] {
        engine.handle_packet(at(0), Side::Left, Packet::new(bytes, Framing::Ip));
    }
    let left = finish(&mut engine);
    assert_eq!((left.len(), left[0].packet.bytes()[1]), (1, 0b11));
}

properties! {
    /// For any packets, every loss has a counter, and departures are in order and never before the packet.
    #[test]
    fn everything_is_counted(packets in prop::collection::vec((0_u64..3_000, any::<bool>(), 0_u16..7, 0_usize..600), 1..120), late in 0_u64..20_000) {
        let text = "router = { seed = 5, default = { left-to-right = \"a\", right-to-left = \"b\" }, memory = { packets = 40 } }\n\
            links = { a = { delay = \"4ms\", jitter = \"3ms\", loss = \"20%\", duplicate = \"20%\" }, b = { rate = \"1Mbit\", queue = { limit = \"5 packets\" } },\n\
            c = { netem = \"delay 3ms 1ms loss 20% duplicate 40% corrupt 20% rate 2mbit limit 4\", netem-profile = \"kernel-6.6\" },\n\
            d = { netem = \"delay 3ms 1ms loss 20% duplicate 40% corrupt 20% rate 2mbit limit 4\" } }\n\
            rules = [{ source-port = 4, link = \"c\" }, { source-port = 5, link = \"d\" }, { source-port = 1, link = \"b\" }, { source-port = 2, link = \"pass\" }, { source-port = 3, link = \"drop\" }]";
        let mut engine = Engine::new(&file(text));
        let mut now = 0;
        let mut all = Vec::new();
        for (gap, is_left, port, data) in packets {
            now += gap;
            engine.handle_packet(at(now), if is_left { Side::Left } else { Side::Right }, udp([port, 9], data));
            all.append(&mut departures(&mut engine));
            prop_assert!(engine.poll_timeout().is_none_or(|due| due >= at(now)));
        }
        engine.handle_timeout(at(now + late));
        all.append(&mut departures(&mut engine));
        let count = |all: &[Departure]| Side::BOTH.map(|side| all.iter().filter(|departure| departure.to == side).count() as u64);
        let counters = engine.counters();
        is_conserved(&counters, count(&all), counters.held.packets);
        all.extend(finish(&mut engine));
        prop_assert!(all.windows(2).all(|pair| pair[0].at <= pair[1].at));
        let counters = engine.counters();
        is_conserved(&counters, count(&all), 0);
        prop_assert_eq!(counters.held.bytes, Bytes::new(0));
    }
}
