//! A network of some links is that part of a network of all.

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{LinkModel, Network, NetworkConfig, NetworkError, NodeId};

/// To whom each of five nodes sends.
const RECEIVERS: [&[u16]; 5] = [&[1, 4], &[0], &[], &[0, 1, 2], &[3]];

fn link(from: NodeId, to: NodeId) -> LinkModel {
    let words = if from < to { "delay 20ms 6ms loss 20%" } else { "delay 9ms duplicate 10%" };
    Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap().into()
}

/// Broadcasts over some links, and the same packets one by one over all: the same events and counters.
#[test]
fn what_becomes_of_a_packet_does_not_depend_on_other_links() {
    let config = || NetworkConfig { seed: 3, nodes: ["a", "b", "c", "d", "e"].map(String::from).to_vec(), general: false };
    let receivers = |from: NodeId| RECEIVERS[from.index()].iter().copied().map(NodeId);
    let mut some = Network::of_some(config(), receivers, link);
    let mut all = Network::new(config(), link);
    let mut events = (Vec::new(), Vec::new());
    for number in 0..200_u64 {
        let now = Instant::from_nanos(number * 4_000_000);
        for from in (0..5).map(NodeId) {
            some.handle_broadcast(now, from, Bytes::new(64), number).unwrap();
            for to in receivers(from) {
                all.handle_packet(now, from, to, Bytes::new(64), number).unwrap();
            }
        }
        some.handle_timeout(now).unwrap();
        all.handle_timeout(now).unwrap();
        events.0.extend(std::iter::from_fn(|| some.poll_event()));
        events.1.extend(std::iter::from_fn(|| all.poll_event()));
    }
    assert!(events.0.len() > 1000 && events.0 == events.1);
    for (from, to) in (0..5).flat_map(|from| (0..5).map(move |to| (NodeId(from), NodeId(to)))) {
        let there = RECEIVERS[from.index()].contains(&to.0);
        assert_eq!(some.link_stats(from, to), all.link_stats(from, to).filter(|_| there));
    }
    for (from, to) in (0..5).flat_map(|from| (0..5).map(move |to| (NodeId(from), NodeId(to)))) {
        let sent = some.handle_packet(Instant::from_nanos(2_000_000_000), from, to, Bytes::new(64), 0);
        let there = RECEIVERS[from.index()].contains(&to.0);
        assert_eq!(sent, if there { Ok(()) } else { Err(NetworkError::NoLink { from, to }) });
    }
}

#[test]
#[should_panic(expected = "receivers are other nodes, in order")]
fn receivers_that_are_not_in_order_are_refused() {
    let config = NetworkConfig { seed: 0, nodes: ["a", "b", "c"].map(String::from).to_vec(), general: false };
    let _ = Network::<u64>::of_some(config, |_| [NodeId(2), NodeId(1)], link);
}
