//! The engine in virtual time.

use std::time::Duration;

use cohaptic_linkfile::{LinkTable, RelayFile};
use cohaptic_realtime::udp::Ecn;
use cohaptic_relay::{Arrival, Change, ConfigError, Engine, Form, Intake, Limits, Mesh, Port, RelayConfig};
use cohaptic_tests_common::properties;
use cohaptic_units::{self as units, Bytes, Instant};
use cohaptic_wan::{Fate, LinkModel, Network, NetworkConfig, NodeId, PacketInfo, Path};
use proptest::prelude::*;

use super::{address, at, link, mesh};

/// Returns a mesh of three programs. Program number n sends from port 9000 + n.
fn three(usual: LinkModel, own: &[((usize, usize), LinkModel)]) -> RelayConfig {
    let program = |n: u16| (["a", "b", "c"][usize::from(n)], address(7000 + n), Some(address(9000 + n)));
    mesh(&[program(0), program(1), program(2)], usual, own)
}

fn arrival<'a>(when: Instant, from: u16, to: u16, bytes: &'a [u8], ecn: Option<Ecn>) -> Arrival<'a> {
    Arrival { at: when, port: Port::Program(NodeId(to)), from: address(9000 + from), bytes, ecn }
}

/// Datagram sent or released: instant, sender, receiver, payload, congestion bits.
type Passing = (Instant, u16, u16, Vec<u8>, Option<Ecn>);

fn drain(engine: &mut Engine, left: &mut Vec<Passing>) {
    while let Some(release) = engine.poll_release() {
        let Port::Program(NodeId(from)) = release.port else { panic!("{:?}", release.port) };
        let to = release.to.port() - 9000;
        left.push((release.at, from, to, release.bytes.to_vec(), release.ecn));
    }
}

fn run_out(engine: &mut Engine, left: &mut Vec<Passing>) {
    drain(engine, left);
    while let Some(due) = engine.poll_timeout() {
        engine.handle_timeout(due);
        drain(engine, left);
    }
}

/// Offers the same datagrams to a network, and returns the datagrams that the network delivers.
fn virtual_time(config: &RelayConfig, offers: &[Passing]) -> Vec<Passing> {
    let Form::Mesh(Mesh { programs, links }) = &config.form else { panic!() };
    let nodes = programs.iter().map(|program| program.name.clone()).collect();
    let mut network: Network<(Vec<u8>, Option<Ecn>)> =
        Network::new(NetworkConfig { seed: config.seed, nodes, general: true }, |from, to| links.between(from.index(), to.index()).clone());
    let mut left = Vec::new();
    let mut drain = |network: &mut Network<(Vec<u8>, Option<Ecn>)>| {
        while let Some(event) = network.poll_event() {
            if let Fate::Delivered(when) = event.fate {
                let (marked, Path { from, to }) = (event.marked, event.path);
                let (mut bytes, ecn) = event.payload;
                event.damage.iter().for_each(|damage| damage.apply(&mut bytes));
                left.push((when, from.0, to.0, bytes, if marked { Some(Ecn::Ce) } else { ecn }));
            }
        }
    };
    for (when, from, to, bytes, ecn) in offers {
        let info =
            PacketInfo { size: Bytes::new(bytes.len() as u64), ecn: ecn.map_or(units::Ecn::NotCapable, |ecn| units::Ecn::from_bits(ecn as u8)) };
        network.handle_packet(*when, NodeId(*from), NodeId(*to), info, (bytes.clone(), *ecn)).unwrap();
        drain(&mut network);
    }
    while let Some(due) = network.poll_timeout() {
        network.handle_timeout(due).unwrap();
        drain(&mut network);
    }
    left
}

/// Links of every kind: direct links, stages, copies, damage, marks, and the kernel's netem.
const LINKS: [&[&str]; 7] = [
    &[],
    &["delay=24ms"],
    &["delay=2ms", "jitter=1ms", "loss=20%"],
    &["delay=2ms", "jitter=1ms", "duplicate=30%", "corrupt={ probability = 0.5, bits = 3, checksum = \"passes\" }"],
    &["rate=2Mbit", "queue={ limit = \"3 packets\" }", "delay=1ms", "duplicate=10%"],
    &["loss=50%", "mark-instead-of-loss=true", "delay=1ms", "duplicate=50%", "corrupt=10%"],
    &["netem=delay 2ms 1ms loss 10% duplicate 20% reorder 25% corrupt 5%", "netem-profile=kernel-6.6"],
];

fn any_link() -> impl Strategy<Value = LinkModel> {
    (0..LINKS.len()).prop_map(|place| link(LINKS[place]))
}

properties! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// The releases, with their instants, bits and marks, equal the deliveries of a network in virtual time for the same offers, and every datagram is
    /// accounted for.
    #[test]
    fn the_fates_are_those_of_virtual_time(
        usual in any_link(), own in any_link(),
        sent in prop::collection::vec((0_u64..3000, 0_u16..3, 1_u16..3, 0_usize..200, 0_usize..4), 1..120),
    ) {
        let config = three(usual, &[((0, 1), own)]);
        let mut now = 0;
        let mut offers = Vec::new();
        for (n, (gap, from, by, length, ecn)) in sent.into_iter().enumerate() {
            now += gap;
            let bytes = vec![u8::try_from(n % 256).unwrap(); length];
            offers.push((at(now), from, (from + by) % 3, bytes, [None, Some(Ecn::Ect0), Some(Ecn::Ect1), Some(Ecn::Ce)][ecn]));
        }
        let mut engine = Engine::new(config.clone()).unwrap();
        let mut left = Vec::new();
        for (when, from, to, bytes, ecn) in &offers {
            prop_assert_eq!(engine.handle_datagram(arrival(*when, *from, *to, bytes, *ecn)), Intake::Offered);
            drain(&mut engine, &mut left);
            let stats = pairs().map(|(from, to)| engine.link_stats(from, to).unwrap().0);
            prop_assert_eq!(engine.held().0, stats.map(|stats| stats.in_flight()).sum::<u64>());
        }
        run_out(&mut engine, &mut left);
        prop_assert_eq!(&left, &virtual_time(&config, &offers));
        prop_assert_eq!(engine.held(), (0, Bytes::new(0)));
        let counts = *engine.counts();
        prop_assert_eq!((counts.offered, counts.overload, counts.clamped), (offers.len() as u64, 0, 0));
        for (from, to) in pairs() {
            let lengths = left.iter().filter(|passing| (passing.1, passing.2) == (from.0, to.0)).map(|passing| passing.3.len() as u64);
            let (stats, link) = engine.link_stats(from, to).unwrap();
            prop_assert_eq!((stats.delivered(), link.delivered_bytes), (lengths.clone().count() as u64, lengths.sum()));
        }
    }

    /// Datagrams read from several sockets in any order are offered in the order of their arrival.
    #[test]
    fn what_is_staged_is_offered_in_order_of_time(mut instants in prop::collection::vec(0_u64..1000, 1..50)) {
        let mut engine = Engine::new(three(link(&["delay=1ms"]), &[])).unwrap();
        for (n, micros) in instants.iter().enumerate() {
            let from = u16::try_from(n % 3).unwrap();
            engine.stage(arrival(at(*micros), from, (from + 1) % 3, &[1], None));
        }
        engine.offer_staged();
        let mut left = Vec::new();
        run_out(&mut engine, &mut left);
        instants.sort_unstable();
        prop_assert_eq!(left.iter().map(|(when, ..)| *when).collect::<Vec<_>>(), instants.iter().map(|micros| at(micros + 1000)).collect::<Vec<_>>());
        prop_assert_eq!(engine.counts().clamped, 0);
    }
}

fn pairs() -> impl Iterator<Item = (NodeId, NodeId)> {
    (0..3).flat_map(|from| (0..3).map(move |to| (NodeId(from), NodeId(to)))).filter(|(from, to)| from != to)
}

#[test]
fn strangers_and_those_who_speak_to_themselves_are_dropped_and_counted() {
    let mut engine = Engine::new(three(link(&["delay=1ms"]), &[])).unwrap();
    let stranger = Arrival { from: address(1), ..arrival(at(0), 0, 1, b"x", None) };
    assert_eq!(engine.handle_datagram(stranger), Intake::Stranger);
    assert_eq!(engine.handle_datagram(Arrival { port: Port::Listen, ..arrival(at(0), 0, 1, b"x", None) }), Intake::Stranger);
    // The same port number at another address is another sender.
    let elsewhere = Arrival { from: "[::1]:9000".parse().unwrap(), ..stranger };
    assert_eq!(engine.handle_datagram(elsewhere), Intake::Stranger);
    assert_eq!(engine.handle_datagram(arrival(at(0), 1, 1, b"x", None)), Intake::ToItself);
    assert_eq!((engine.counts().strangers, engine.counts().to_itself, engine.counts().offered), (3, 1, 0));
    assert_eq!((engine.held().0, engine.poll_timeout()), (0, None));
}

#[test]
fn beyond_the_bounds_the_datagram_that_comes_is_dropped_and_its_link_counts_it() {
    let limits = Limits { packets: 4, bytes: Bytes::new(100), ..Limits::default() };
    let mut engine = Engine::new(RelayConfig { limits, ..three(link(&["delay=10ms"]), &[]) }).unwrap();
    let mut take = |micros, from, to, length: usize| engine.handle_datagram(arrival(at(micros), from, to, &vec![0; length], None));
    assert_eq!((0..6).map(|n| take(n, 0, 1, 10)).collect::<Vec<_>>()[3..], [Intake::Offered, Intake::Overload, Intake::Overload]);
    assert_eq!(take(7, 2, 0, 0), Intake::Overload, "an empty one is one too");
    // All four datagrams have left, so there is room for packets and for a hundred bytes.
    engine.handle_timeout(at(10_003));
    let mut left = Vec::new();
    drain(&mut engine, &mut left);
    assert_eq!((left.len(), engine.held()), (4, (0, Bytes::new(0))));
    let mut take = |micros, from, to, length: usize| engine.handle_datagram(arrival(at(micros), from, to, &vec![0; length], None));
    assert_eq!([take(10_004, 0, 1, 60), take(10_004, 0, 1, 41), take(10_004, 1, 2, 40)], [Intake::Offered, Intake::Overload, Intake::Offered]);
    let overload = |from, to| engine.link_stats(NodeId(from), NodeId(to)).unwrap().1.overload;
    assert_eq!([overload(0, 1), overload(2, 0), overload(1, 2), engine.counts().overload], [3, 1, 0, 4]);
    // The datagrams offered to the link and the datagrams dropped before the link are all that arrived.
    assert_eq!(engine.link_stats(NodeId(0), NodeId(1)).unwrap().0.offered(), 5);
}

#[test]
fn what_comes_to_a_program_that_nobody_has_heard_of_is_counted() {
    let config = mesh(&[("a", address(7000), None), ("b", address(7001), None)], link(&["delay=1ms"]), &[]);
    let mut engine = Engine::new(config).unwrap();
    let hello = |micros, from: u16, to| Arrival { at: at(micros), port: Port::Program(NodeId(to)), from: address(from), bytes: b"hello", ecn: None };
    assert_eq!(engine.handle_datagram(hello(0, 4000, 1)), Intake::Offered);
    engine.handle_timeout(at(1000));
    assert_eq!(engine.poll_release(), None);
    assert_eq!(engine.link_stats(NodeId(0), NodeId(1)).unwrap().1.undeliverable, 1);
    assert_eq!((engine.program_address(NodeId(0)), engine.program_address(NodeId(1))), (Some(address(4000)), None));
    // Program b becomes known while the second hello is in flight.
    engine.handle_datagram(hello(2000, 4000, 1));
    engine.handle_datagram(hello(2500, 4001, 0));
    engine.handle_timeout(at(3000));
    let release = engine.poll_release().unwrap();
    assert_eq!((release.port, release.to, release.bytes), (Port::Program(NodeId(0)), address(4001), &b"hello"[..]));
    assert_eq!(engine.poll_release(), None);
    assert_eq!(engine.held().0, 1);
}

#[test]
fn what_came_before_time_was_let_pass_is_late_and_says_by_how_much() {
    let mut engine = Engine::new(three(link(&["delay=1ms"]), &[])).unwrap();
    engine.handle_timeout(at(500));
    engine.handle_datagram(arrival(at(200), 0, 1, b"x", None));
    assert_eq!((engine.counts().clamped, engine.poll_timeout()), (1, Some(at(1500))));
    assert!(engine.clamped().summary().max.abs_diff(Duration::from_micros(300)) < Duration::from_micros(1));
    assert_eq!(engine.recent_delays(NodeId(0), NodeId(1)), []);
    // Time never goes back.
    engine.handle_timeout(at(100));
    assert_eq!(engine.poll_timeout(), Some(at(1500)));
    // The next datagram reuses the memory of the first, and is on time.
    for (due, late) in [(1500, 300), (2600, 0)] {
        engine.handle_timeout(at(due));
        let release = engine.poll_release().unwrap();
        assert_eq!((release.at, release.late), (at(due), Duration::from_micros(late)));
        assert_eq!(engine.poll_release(), None);
        engine.handle_datagram(arrival(at(1600), 0, 1, b"y", None));
    }
    // A late offer is no delay of the link.
    assert_eq!(engine.recent_delays(NodeId(0), NodeId(1)), [Duration::from_millis(1); 2]);
    assert_eq!(engine.recent_delays(NodeId(1), NodeId(0)), []);
}

#[test]
fn links_change_at_their_time_and_when_told() {
    let change = Change { at: at(5000), from: NodeId(0), to: NodeId(1), model: link(&["delay=9ms"]) };
    let config = RelayConfig { changes: vec![change.clone()], ..three(link(&["delay=1ms"]), &[]) };
    let mut engine = Engine::new(config.clone()).unwrap();
    assert_eq!(engine.poll_timeout(), Some(at(5000)));
    for micros in [4999, 5000] {
        engine.handle_datagram(arrival(at(micros), 0, 1, b"x", None));
    }
    engine.set_link(at(6000), NodeId(0), NodeId(1), link(&["delay=0ms"])).unwrap();
    assert!(engine.set_link(at(6000), NodeId(0), NodeId(0), link(&[])).is_err());
    engine.handle_datagram(arrival(at(7000), 0, 1, b"y", None));
    let mut left = Vec::new();
    run_out(&mut engine, &mut left);
    assert_eq!(left.iter().map(|(when, ..)| *when).collect::<Vec<_>>(), [at(5999), at(7000), at(14_000)]);
    let missing = RelayConfig { changes: vec![Change { to: NodeId(3), ..change }], ..config };
    assert_eq!(Engine::new(missing).unwrap_err(), ConfigError::NoLink { from: NodeId(0), to: NodeId(3) });
}

#[test]
fn a_relay_that_cannot_be_is_refused_and_a_file_becomes_one() {
    let mut config = three(link(&[]), &[]);
    config.form = match config.form {
        Form::Mesh(mesh) => Form::Mesh(Mesh { links: LinkTable::uniform(2, LinkModel::default()), ..mesh }),
        form @ Form::Proxy(_) => form,
    };
    assert_eq!(Engine::new(config).unwrap_err(), ConfigError::Programs { programs: 3, links: 2 });
    let text = "relay = { seed = 3, most-packets = 9 }\nlink = { delay = \"1ms\" }\n\
        programs = [{ name = \"a\", port = \"[::1]:1\", address = \"[::1]:9\" }, { name = \"b\", port = \"[::1]:2\" }]\n\
        timeline = [{ at = \"1s\", link = \"all\", set = { delay = \"2ms\" } }]\n";
    let config = RelayConfig::from(RelayFile::parse(text, "r.toml".as_ref(), &[]).unwrap());
    assert_eq!((config.seed, config.limits.packets, config.changes.len()), (3, 9, 2));
    let mut engine = Engine::new(config).unwrap();
    assert_eq!(engine.names(), ["a", "b"]);
    let hello = Arrival { at: at(0), port: Port::Program(NodeId(1)), from: "[::1]:9".parse().unwrap(), bytes: b"x", ecn: None };
    assert_eq!(engine.handle_datagram(hello), Intake::Offered);
}

/// The loop of a relay comes by during a silence, and the engine computes the cross packets of the silence then. Releases are the same with any calls, also over a
/// link that gets its cross-traffic by a change.
#[test]
fn a_silence_beside_cross_traffic_changes_no_release() {
    let crossed = link(&["delay=1ms", "rate=1Mbit", "cross-traffic={ poisson = { rate = \"900kbit\", size = \"1500B\" } }"]);
    let run = |look_ms: Option<u64>| {
        let mut config = three(link(&["delay=1ms", "rate=1Mbit"]), &[((0, 1), crossed.clone())]);
        config.changes = vec![Change { at: at(5_000_000), from: NodeId(0), to: NodeId(2), model: crossed.clone() }];
        let mut engine = Engine::new(config).unwrap();
        let mut left = Vec::new();
        for begin in [0, 20_000, 45_000_u64] {
            for to in [1, 2] {
                engine.handle_datagram(arrival(at(begin * 1_000), 0, to, b"after a silence", None));
            }
            run_out(&mut engine, &mut left);
            for look in look_ms.into_iter().flat_map(|look| (begin..begin + 15_000).step_by(usize::try_from(look).unwrap())) {
                engine.handle_timeout(at(look * 1_000));
                drain(&mut engine, &mut left);
            }
        }
        (left, [1, 2].map(|to| engine.link_stats(NodeId(0), NodeId(to)).unwrap().0))
    };
    let (left, stats) = run(None);
    assert_eq!(left.len(), 6);
    assert!(stats.iter().all(|stats| stats.cross_traffic().offered > 2_000), "{stats:?}");
    for look_ms in [1, 7, 50] {
        assert_eq!(run(Some(look_ms)), (left.clone(), stats), "a look each {look_ms} ms");
    }
}
