//! The blocks of docs/testing.md on programs without sockets, as they stand there.

use std::time::Duration;

use cohaptic_testkit::Instant;
use cohaptic_testkit::node::{Node, Nodes, Packet, Transmit};

/// Server that sends back each packet.
#[derive(Default)]
struct Echo(Vec<Transmit>);

impl Node for Echo {
    fn handle_packet(&mut self, _now: Instant, packet: Packet) {
        self.0.push(packet.answer(packet.bytes.clone()));
    }
    fn poll_transmit(&mut self, _now: Instant) -> Option<Transmit> {
        self.0.pop()
    }
}

/// Client that asks every 100 ms until there is an answer.
#[derive(Default)]
struct Client {
    next: Instant,
    asked: u32,
    answered: Option<Instant>,
}

impl Node for Client {
    fn handle_packet(&mut self, now: Instant, _packet: Packet) {
        self.answered.get_or_insert(now);
    }
    fn poll_timeout(&mut self) -> Option<Instant> {
        self.answered.is_none().then_some(self.next)
    }
    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        if self.answered.is_some() || now < self.next {
            return None;
        }
        self.next = now + Duration::from_millis(100);
        self.asked += 1;
        Some(Transmit::to(1, "there?"))
    }
}

#[test]
fn a_state_machine_asks_until_it_is_answered() {
    let mut run = Nodes::new().add("client", Client::default()).add("server", Echo::default()).links("delay 130ms").start();
    run.run_until_idle();
    let client = run.node::<Client>("client");
    assert_eq!((client.asked, client.answered), (3, Some(Instant::from_nanos(260_000_000))));
}
