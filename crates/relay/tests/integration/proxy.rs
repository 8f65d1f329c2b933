//! The proxy in virtual time.

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_relay::{Arrival, Engine, Form, Intake, Limits, Port, Proxy, RelayConfig};
use cohaptic_units::Instant;
use cohaptic_wan::NodeId;

use super::{at, link};

const SERVER: &str = "[2001:db8::1]:5000";

fn engine(most_clients: u32) -> Engine {
    let proxy = Proxy {
        listen: "[::1]:7000".parse().unwrap(),
        to: SERVER.parse().unwrap(),
        forth: link(&["delay=10ms"]),
        back: link(&["delay=20ms"]),
        most_clients,
    };
    let limits = Limits { forget_after: Duration::from_secs(30), ..Limits::default() };
    Engine::new(RelayConfig { seed: 0, form: Form::Proxy(proxy), limits, changes: Vec::new() }).unwrap()
}

fn client(port: u16) -> SocketAddr {
    format!("[2001:db8::2]:{port}").parse().unwrap()
}

fn second(count: u64) -> Instant {
    at(count * 1_000_000)
}

fn forth(engine: &mut Engine, when: Instant, port: u16) -> Intake {
    engine.handle_datagram(Arrival { at: when, port: Port::Listen, from: client(port), bytes: b"ask", ecn: None })
}

fn back(engine: &mut Engine, when: Instant, slot: u32, from: &str) -> Intake {
    engine.handle_datagram(Arrival { at: when, port: Port::Client(slot), from: from.parse().unwrap(), bytes: b"answer", ecn: None })
}

#[test]
fn each_client_has_a_port_of_its_own_and_gets_its_own_answers() {
    let mut engine = engine(8);
    assert_eq!(forth(&mut engine, at(0), 1), Intake::FromNewClient(0));
    assert_eq!(forth(&mut engine, at(1), 2), Intake::FromNewClient(1));
    assert_eq!(forth(&mut engine, at(2), 1), Intake::Offered);
    assert_eq!(back(&mut engine, at(3), 1, SERVER), Intake::Offered);
    // Only the server may answer at a client's port.
    assert_eq!(back(&mut engine, at(4), 1, "[2001:db8::3]:5000"), Intake::Stranger);
    assert_eq!(back(&mut engine, at(5), 2, SERVER), Intake::Stranger);
    engine.handle_timeout(second(1));
    let mut left = Vec::new();
    while let Some(release) = engine.poll_release() {
        left.push((release.at, release.port, release.to, release.bytes.to_vec()));
    }
    let server: SocketAddr = SERVER.parse().unwrap();
    let ask = |micros: u64, slot| (at(10_000 + micros), Port::Client(slot), server, b"ask".to_vec());
    assert_eq!(left, [ask(0, 0), ask(1, 1), ask(2, 0), (at(20_003), Port::Listen, client(2), b"answer".to_vec())]);
    assert_eq!((engine.clients(), engine.counts().strangers), (2, 2));
    assert_eq!(engine.link_stats(NodeId(1), NodeId(0)).unwrap().0.delivered(), 1);
}

#[test]
fn clients_are_bounded_and_idle_ones_are_forgotten() {
    let mut engine = engine(2);
    forth(&mut engine, second(0), 1);
    forth(&mut engine, second(20), 2);
    assert_eq!(forth(&mut engine, second(21), 3), Intake::NoRoom);
    while engine.poll_release().is_some() {}
    // First the datagrams in flight end, then the silence of the first client.
    engine.handle_timeout(at(20_010_000));
    while engine.poll_release().is_some() {}
    assert_eq!(engine.poll_timeout(), Some(second(30)));
    engine.handle_timeout(second(30));
    assert_eq!((engine.clients(), engine.poll_closed(), engine.poll_closed()), (1, Some(0), None));
    assert_eq!(forth(&mut engine, second(31), 3), Intake::FromNewClient(0));
    assert_eq!(engine.counts().no_room, 1);
}

#[test]
fn an_answer_to_a_client_that_has_left_reaches_nobody_else() {
    let mut engine = engine(1);
    forth(&mut engine, second(0), 1);
    back(&mut engine, at(29_990_000), 0, SERVER);
    // Stands for a port that could not be opened.
    engine.close_client(0);
    assert_eq!(engine.poll_closed(), Some(0));
    assert_eq!(forth(&mut engine, at(29_991_000), 2), Intake::FromNewClient(0));
    engine.handle_timeout(at(30_010_000));
    let mut left = Vec::new();
    while let Some(release) = engine.poll_release() {
        left.push((release.port, release.to));
    }
    // The first client's ask left long before, the answer is dropped, and the second client's ask goes on.
    assert_eq!(left, [(Port::Client(0), SERVER.parse().unwrap())]);
    assert_eq!(engine.link_stats(NodeId(1), NodeId(0)).unwrap().1.undeliverable, 1);
}
