//! The relay on loopback. Asserted is only what no load can break: which datagrams arrive, in which order, with which marks, and that none is early.

use std::net::{SocketAddr, UdpSocket};
use std::os::fd::AsFd as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use cohaptic_realtime::udp::{Ecn, EndpointConfig, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing, Tolerance, Wishes};
use cohaptic_relay::{Control, Form, Limits, Proxy, Relay, RelayConfig, Report, RunOptions, View};
use cohaptic_units::Bytes;
use cohaptic_wan::{Fate, Network, NetworkConfig, NodeId};

use super::{link, mesh};

/// Bound of every wait. Any machine is faster; only a failing test waits so long.
const PATIENCE: Duration = Duration::from_secs(60);

/// Relay on a thread of its own.
struct Running {
    ports: Vec<SocketAddr>,
    control: Sender<Control>,
    stop: Arc<AtomicBool>,
    offered: Arc<AtomicU64>,
    clients: Arc<AtomicUsize>,
    thread: JoinHandle<Report>,
}

fn start(config: RelayConfig, pacing: Pacing) -> Running {
    run(Relay::bind(config, EndpointConfig::default()).unwrap(), pacing)
}

fn run(mut relay: Relay, pacing: Pacing) -> Running {
    let ports = relay.ports().map(|(_, address)| address).collect();
    let (control, changes) = channel();
    let stop = Arc::new(AtomicBool::new(false));
    let (is_over, offered) = (Arc::clone(&stop), Arc::new(AtomicU64::new(0)));
    let clients = Arc::new(AtomicUsize::new(0));
    let shown = (Arc::clone(&offered), Arc::clone(&clients));
    let options = RunOptions {
        pacing,
        wishes: Wishes::NONE,
        tolerance: Tolerance { limit: Duration::from_secs(3600) },
        look_every: Duration::from_millis(2),
        ..RunOptions::default()
    };
    let thread = std::thread::spawn(move || {
        let look = |view: &View<'_>| {
            shown.0.store(view.intake().offered, Ordering::Relaxed);
            shown.1.store(view.clients(), Ordering::Relaxed);
        };
        relay.run(&options, &changes, &is_over, look).unwrap()
    });
    Running { ports, control, stop, offered, clients, thread }
}

impl Running {
    /// Waits until the relay has offered `count` datagrams to its links.
    fn has_offered(&self, count: u64) {
        let end = Instant::now() + PATIENCE;
        while self.offered.load(Ordering::Relaxed) < count {
            assert!(Instant::now() < end, "{} were offered", self.offered.load(Ordering::Relaxed));
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn end(self) -> Report {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

fn program(family: &str) -> UdpSocket {
    let socket = UdpSocket::bind(family).unwrap();
    socket.set_read_timeout(Some(PATIENCE)).unwrap();
    socket
}

fn number(bytes: &[u8]) -> u64 {
    u64::from_le_bytes(bytes[..8].try_into().unwrap())
}

fn receive(socket: &UdpSocket) -> (u64, SocketAddr) {
    let mut bytes = [0; 2048];
    let (length, from) = socket.recv_from(&mut bytes).unwrap();
    (number(&bytes[..length]), from)
}

#[test]
fn nothing_is_early_or_out_of_order_and_a_seeded_link_loses_what_it_loses_in_virtual_time() {
    const COUNT: u64 = 200;
    for (family, pacing) in [("127.0.0.1:0", Pacing::Sleep), ("[::1]:0", Pacing::SPIN)] {
        let (left, right) = (program(family), program(family));
        let model = link(&["delay=8ms", "loss=20%"]);
        let place = |socket: &UdpSocket| Some(socket.local_addr().unwrap());
        let port = family.parse().unwrap();
        let config = mesh(&[("left", port, place(&left)), ("right", port, place(&right))], model.clone(), &[]);
        let seed = config.seed;
        let relay = start(config, pacing);

        // The losses of the link in virtual time: one draw per packet, at any instant.
        let nodes = vec!["left".to_owned(), "right".to_owned()];
        let mut network = Network::new(NetworkConfig { seed, nodes, general: false }, |_, _| model.clone());
        for sequence in 0..COUNT {
            network.handle_packet(cohaptic_units::Instant::from_nanos(sequence), NodeId(0), NodeId(1), Bytes::new(64), sequence).unwrap();
        }
        network.handle_timeout(cohaptic_units::Instant::from_nanos(1_000_000_000)).unwrap();
        let mut delivered = Vec::new();
        while let Some(event) = network.poll_event() {
            if let Fate::Delivered(_) = event.fate {
                delivered.push(event.payload);
            }
        }
        assert!(delivered.len() > 100 && delivered.len() < 200);

        let there = relay.ports[1];
        let sender = std::thread::spawn(move || {
            let mut sent = Vec::new();
            for sequence in 0..COUNT {
                let mut bytes = [0; 64];
                bytes[..8].copy_from_slice(&sequence.to_le_bytes());
                sent.push(Instant::now());
                left.send_to(&bytes, there).unwrap();
                std::thread::sleep(Duration::from_micros(200));
            }
            sent
        });
        let received: Vec<(u64, SocketAddr, Instant)> = delivered
            .iter()
            .map(|_| {
                let (sequence, from) = receive(&right);
                (sequence, from, Instant::now())
            })
            .collect();
        let sent = sender.join().unwrap();
        assert_eq!(received.iter().map(|(sequence, ..)| *sequence).collect::<Vec<_>>(), delivered);
        for (sequence, from, when) in received {
            // The datagram comes from the port standing for the sender, so that the receiver can answer.
            assert_eq!(from, relay.ports[0]);
            let delay = when - sent[usize::try_from(sequence).unwrap()];
            assert!(delay >= Duration::from_millis(8), "number {sequence} after {delay:?}");
        }
        // The last datagrams may be among the lost ones, so the relay may not have read them yet.
        relay.has_offered(COUNT);
        let report = relay.end();
        assert_eq!((report.intake.offered, report.release.count(), report.held.0), (COUNT, delivered.len() as u64, 0));
        assert_eq!((report.ports[0].counts.sent, report.ports[1].counts.received), (delivered.len() as u64, COUNT));
        assert_eq!(report.ports.iter().map(|port| port.kernel_drops).collect::<Vec<_>>(), [Some(0), Some(0)]);
        let stats = report.links[0].stats;
        assert_eq!((stats.offered(), stats.delivered()), (COUNT, delivered.len() as u64));
        assert!(report.validity.is_valid());
    }
}

#[test]
fn three_programs_speak_to_each_other_through_their_own_links() {
    let programs = [program("127.0.0.1:0"), program("127.0.0.1:0"), program("127.0.0.1:0")];
    let port = "127.0.0.1:0".parse().unwrap();
    // The address of the third program is learnt.
    let place = |n: usize| (n < 2).then(|| programs[n].local_addr().unwrap());
    let config =
        mesh(&[("a", port, place(0)), ("b", port, place(1)), ("c", port, place(2))], link(&["delay=1ms"]), &[((1, 0), link(&["loss=100%"]))]);
    let relay = start(config, Pacing::Sleep);
    let mut offered = 0;
    for from in [2, 1, 0] {
        for to in (0..3).filter(|to| *to != from) {
            let name = u64::try_from(10 * from + to).unwrap();
            programs[from].send_to(&name.to_le_bytes(), relay.ports[to]).unwrap();
            offered += 1;
        }
        // The third program sends first, so that its address is known before any other program sends to it.
        relay.has_offered(offered);
    }
    for (to, expected) in [(0, vec![20]), (1, vec![1, 21]), (2, vec![2, 12])] {
        let mut found: Vec<u64> = Vec::new();
        for _ in &expected {
            let (name, from) = receive(&programs[to]);
            assert_eq!(from, relay.ports[usize::try_from(name / 10).unwrap()]);
            found.push(name);
        }
        found.sort_unstable();
        assert_eq!(found, expected);
    }
    // The answer goes to the address of the question.
    programs[2].send_to(&7_u64.to_le_bytes(), relay.ports[0]).unwrap();
    let (name, from) = receive(&programs[0]);
    programs[0].send_to(&8_u64.to_le_bytes(), from).unwrap();
    assert_eq!((name, receive(&programs[2]).0), (7, 8));
    let report = relay.end();
    let of = |from: &str, to: &str| report.links.iter().find(|link| link.from == from && link.to == to).unwrap().stats;
    assert_eq!((of("b", "a").dropped_in_all(), of("b", "a").delivered(), of("c", "a").delivered()), (1, 0, 2));
}

#[test]
fn congestion_bits_pass_and_a_link_that_marks_marks() {
    let clock = MonotonicClock::start();
    let port = || UdpEndpoint::bind("127.0.0.1:0".parse().unwrap(), EndpointConfig::default()).unwrap();
    let (mut left, mut right) = (port(), port());
    let port = "127.0.0.1:0".parse().unwrap();
    let config = mesh(
        &[("left", port, Some(left.local_address())), ("right", port, Some(right.local_address()))],
        link(&["delay=1ms"]),
        &[((1, 0), link(&["delay=1ms", "loss=100%", "mark-instead-of-loss=true"]))],
    );
    let relay = start(config, Pacing::Sleep);
    let pass = |from: &mut UdpEndpoint, port: SocketAddr, to: &mut UdpEndpoint, ecn: Option<Ecn>| {
        from.queue(port, b"marked?", ecn);
        from.flush();
        let (mut buffers, mut found) = (ReceiveBuffers::new(), None);
        let end = clock.now() + PATIENCE;
        while found.is_none() && clock.now() < end {
            Pacer::new(Pacing::Sleep).wait(&clock, Some(end), &[to.as_fd()]).unwrap();
            to.receive(&mut buffers, &clock, |datagram| found = Some(datagram.ecn)).unwrap();
        }
        found.unwrap()
    };
    for ecn in [None, Some(Ecn::Ect0), Some(Ecn::Ect1), Some(Ecn::Ce)] {
        assert_eq!(pass(&mut left, relay.ports[1], &mut right, ecn), ecn);
    }
    for ecn in [Ecn::Ect0, Ecn::Ect1] {
        assert_eq!(pass(&mut right, relay.ports[0], &mut left, Some(ecn)), Some(Ecn::Ce));
    }
    relay.end();
}

#[test]
fn a_link_changes_when_it_is_told_and_one_that_is_not_there_is_counted() {
    let (left, right) = (program("127.0.0.1:0"), program("127.0.0.1:0"));
    let port = "127.0.0.1:0".parse().unwrap();
    let place = |socket: &UdpSocket| Some(socket.local_addr().unwrap());
    let config = mesh(&[("left", port, place(&left)), ("right", port, place(&right))], link(&["loss=100%"]), &[]);
    let relay = start(config, Pacing::Sleep);
    let set = |from, to| Control::SetLink { from: NodeId(from), to: NodeId(to), model: Box::new(link(&[])) };
    relay.control.send(set(0, 0)).unwrap();
    relay.control.send(set(1, 1)).unwrap();
    relay.control.send(set(0, 1)).unwrap();
    // The relay reads the message within 2 ms, or later on a busy machine, so the sender repeats until a datagram passes.
    right.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let mut bytes = [0; 8];
    let mut tries = 0;
    while tries < 3000 && right.recv(&mut bytes).is_err() {
        left.send_to(&1_u64.to_le_bytes(), relay.ports[1]).unwrap();
        tries += 1;
    }
    let report = relay.end();
    assert!(number(&bytes) == 1 && report.links[0].stats.delivered() > 0);
    assert_eq!(report.refused_changes, 2);
}

/// More datagrams wait at a port than are read at once. Time does not pass before all of them have been read, so no datagram is offered late.
#[test]
fn what_waits_at_a_port_is_read_before_time_passes() {
    const COUNT: u64 = 1000;
    let (left, right) = (program("127.0.0.1:0"), program("127.0.0.1:0"));
    let port = "127.0.0.1:0".parse().unwrap();
    let place = |socket: &UdpSocket| Some(socket.local_addr().unwrap());
    let config = mesh(&[("left", port, place(&left)), ("right", port, place(&right))], link(&["delay=1h"]), &[]);
    let relay = Relay::bind(config, EndpointConfig::default()).unwrap();
    let (_, there) = relay.ports().nth(1).unwrap();
    for sequence in 0..COUNT {
        left.send_to(&sequence.to_le_bytes(), there).unwrap();
    }
    let relay = run(relay, Pacing::Sleep);
    // The kernel may have had no room for some datagrams.
    let end = Instant::now() + Duration::from_millis(300);
    while Instant::now() < end && relay.offered.load(Ordering::Relaxed) < COUNT {
        std::thread::sleep(Duration::from_millis(1));
    }
    relay.has_offered(1);
    let report = relay.end();
    assert_eq!((report.intake.clamped, report.clamped.count()), (0, 0), "{:?}", report.clamped.summary());
}

#[test]
fn clients_of_a_proxy_reach_the_server_and_get_their_answers() {
    for family in ["127.0.0.1:0", "[::1]:0"] {
        let server = program(family);
        let proxy = Proxy {
            listen: family.parse().unwrap(),
            to: server.local_addr().unwrap(),
            forth: link(&["delay=1ms"]),
            back: link(&["delay=2ms"]),
            most_clients: 2,
        };
        let relay = start(RelayConfig { seed: 1, form: Form::Proxy(proxy), limits: Limits::default(), changes: Vec::new() }, Pacing::Sleep);
        let clients = [program(family), program(family)];
        let echo = std::thread::spawn(move || {
            let mut froms = Vec::new();
            for _ in 0..6 {
                let (name, from) = receive(&server);
                server.send_to(&(name + 100).to_le_bytes(), from).unwrap();
                froms.push((name % 2, from));
            }
            froms
        });
        for round in 0..3_u64 {
            for (n, client) in clients.iter().enumerate() {
                let name = 2 * round + u64::try_from(n).unwrap();
                let before = Instant::now();
                client.send_to(&name.to_le_bytes(), relay.ports[0]).unwrap();
                assert_eq!(receive(client), (name + 100, relay.ports[0]));
                assert!(before.elapsed() >= Duration::from_millis(3));
            }
        }
        let froms = echo.join().unwrap();
        // Each client has a port of its own, and keeps the port.
        assert!(froms.iter().all(|(client, from)| froms.iter().all(|(other, port)| (client == other) == (from == port))));
        let report = relay.end();
        assert_eq!(report.without_socket, 0);
        assert_eq!(report.ports.iter().map(|port| port.name.as_str()).collect::<Vec<_>>(), ["listen", "clients"]);
        assert_eq!(report.ports[1].counts.received, 6);
    }
}

/// The counts of a client's port outlast the client.
#[test]
fn a_client_that_has_left_is_still_in_the_report() {
    let (server, client) = (program("127.0.0.1:0"), program("127.0.0.1:0"));
    let to = server.local_addr().unwrap();
    let proxy = Proxy { listen: "127.0.0.1:0".parse().unwrap(), to, forth: link(&[]), back: link(&[]), most_clients: 2 };
    let limits = Limits { forget_after: Duration::from_millis(200), ..Limits::default() };
    let relay = start(RelayConfig { seed: 1, form: Form::Proxy(proxy), limits, changes: Vec::new() }, Pacing::Sleep);
    server.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    // A datagram read so late that its sender is forgotten by then goes nowhere, so the client repeats until one arrives.
    let mut bytes = [0; 8];
    let arrived = (0..3000).any(|_| {
        client.send_to(&[1; 8], relay.ports[0]).unwrap();
        server.recv(&mut bytes).is_ok()
    });
    assert!(arrived);
    // The first look after the reading shows the client, unless the client is forgotten by then.
    relay.has_offered(1);
    let end = Instant::now() + PATIENCE;
    while relay.clients.load(Ordering::Relaxed) > 0 {
        assert!(Instant::now() < end, "the client is not forgotten");
        std::thread::sleep(Duration::from_millis(1));
    }
    let report = relay.end();
    assert!(report.ports[1].counts.sent >= 1, "{:?}", report.ports);
}
