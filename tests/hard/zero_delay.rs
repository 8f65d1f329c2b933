//! Links without any delay in a cycle: what is sent is there at the same instant, and who answers at once for ever is stopped, with an error.

use std::panic::{AssertUnwindSafe, catch_unwind};

use cohaptic_harness::Model;
use cohaptic_testkit::Instant;
use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};
use cohaptic_tests::{Draft, run};
use cohaptic_units::Bytes;
use cohaptic_wan::{Delay, Fate, LinkConfig, Network, NetworkConfig, NodeId};

/// Among four peers every pair is a cycle. All sample before anyone computes, so every tick acts on the states of that tick: the mean of three others is their sum
/// in their order, (a + b) + c, divided by three, to the bit.
#[test]
fn over_links_without_delay_each_tick_acts_on_the_states_of_that_tick() {
    let mut draft = Draft { duration: 500, ..Draft::calm(4) };
    for (peer, x) in draft.peers.iter_mut().zip([0.1, -0.37, 0.011, 0.3]) {
        peer.position = Some([x, 0.0, 0.0]);
    }
    for model in [Model::Least, Model::General] {
        let log = run(&draft.scene(), model);
        assert_eq!(log.ticks.len(), 2000);
        for rows in log.ticks.chunks_exact(4) {
            for row in rows {
                let [a, b, c] = std::array::from_fn(|place| rows[place + usize::from(place >= row.peer)].object.position[0]);
                assert_eq!(row.target.position[0], ((a + b) + c) / 3.0, "peer {} at {}", row.peer, row.at);
            }
        }
        for packet in &log.packets {
            assert_eq!(packet.fate, Fate::Delivered(packet.offered));
        }
    }
}

/// A node that passes on whatever it gets to the next of `nodes`, at once; the first begins.
struct PassesOn {
    place: usize,
    nodes: usize,
    passed: u64,
    pending: Option<Transmit>,
}

impl PassesOn {
    fn new(place: usize, nodes: usize) -> Self {
        let pending = (place == 0).then(|| Transmit::to(1 % nodes, "round and round"));
        Self { place, nodes, passed: 0, pending }
    }
}

impl Node for PassesOn {
    fn handle_packet(&mut self, _now: Instant, packet: Packet) {
        self.passed += 1;
        self.pending = Some(Transmit::to((self.place + 1) % self.nodes, packet.bytes));
    }

    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.pending.take()
    }
}

fn ring(nodes: usize) -> Nodes {
    (0..nodes).fold(Nodes::new(), |ring, place| ring.add(&format!("n{place}"), PassesOn::new(place, nodes)))
}

/// The rule: so many packets sent, and packets and timers handled, at one instant, and the run is given up (`Nodes::patience`).
#[test]
fn a_ring_that_answers_at_once_without_delay_ends_with_an_error() {
    for nodes in [2, 3, 7] {
        let ended = catch_unwind(AssertUnwindSafe(|| {
            let mut run = ring(nodes).patience(100_000).start();
            run.run_until_idle();
        }));
        let message = *ended.unwrap_err().downcast::<String>().unwrap();
        assert!(message.starts_with("time stands still at 0 s after 100000 packets and timers: node `n"), "{message}");
        assert!(message.contains("answers without end over links without delay: give the links a delay, or let the nodes stop"), "{message}");
    }
}

/// With a nanosecond a link, time passes: hop n is there after n ns.
#[test]
fn a_nanosecond_is_enough_for_time_to_pass() {
    let mut run = ring(3).links(LinkConfig { delay: Delay::constant(std::time::Duration::from_nanos(1)), ..LinkConfig::default() }).start();
    run.run_until(Instant::from_nanos(30_000));
    for node in ["n0", "n1", "n2"] {
        assert_eq!((run.node::<PassesOn>(node).passed, run.counts(node).arrived), (10_000, 10_000));
    }
}

/// One delay in the ring is enough too: all other hops are at the instants at which that one arrives.
#[test]
fn one_link_with_a_delay_is_enough_for_a_ring() {
    let mut run = ring(3).link("n2", "n0", "delay 1ms").start();
    run.run_until(Instant::from_nanos(1_000_000_000));
    let passed = ["n0", "n1", "n2"].map(|node| run.node::<PassesOn>(node).passed);
    // n1 and n2 are reached at 0 s too.
    assert_eq!(passed, [1000, 1001, 1001]);
}

/// The network itself knows no patience: a driver that passes a packet on a hundred thousand times at one instant is served each time, and time stands.
#[test]
fn a_network_serves_any_number_of_hops_at_one_instant() {
    let names = ["a", "b", "c"].map(str::to_owned).to_vec();
    for general in [false, true] {
        let mut network = Network::new(NetworkConfig { seed: 0, nodes: names.clone(), general }, |_, _| LinkConfig::default());
        let now = Instant::from_nanos(5);
        network.handle_packet(now, NodeId(0), NodeId(1), Bytes::new(1), 0_u64).unwrap();
        for hop in 0..100_000 {
            assert_eq!(network.poll_timeout(), Some(now));
            let event = network.poll_event().unwrap();
            assert_eq!((event.payload, event.at, event.sequence, event.fate), (hop, now, hop / 3, Fate::Delivered(now)));
            let to = NodeId((event.path.to.0 + 1) % 3);
            network.handle_packet(now, event.path.to, to, Bytes::new(1), hop + 1).unwrap();
        }
    }
}
