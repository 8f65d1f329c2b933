//! The gateway between an end of TCP without sockets and real sockets, without links between.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream, UdpSocket};
use std::time::Duration;

use cohaptic_realtime::{Clock as _, MonotonicClock};
use cohaptic_router::Framing;
use cohaptic_tcp::{Connection, Error, Segment, State, TcpConfig};
use rustix::net::sockopt::set_socket_linger;

use super::*;

/// Time limit of a wait for an event, far above the time of any event on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Program inside with one connection.
struct Inside {
    gateway: Gateway,
    connection: Connection,
    clock: MonotonicClock,
}

impl Inside {
    /// Connects to the port of the machine's loopback interface.
    fn connect(port: u16) -> Self {
        let clock = MonotonicClock::start();
        let ends = [SocketAddr::new(HOST[0], 40_000), SocketAddr::new(GATEWAY[0], port)];
        let connection = Connection::connect(clock.now(), TcpConfig::default(), ends[0], ends[1], 7).unwrap();
        Self { gateway: Gateway::new(None).unwrap(), connection, clock }
    }

    /// Passes packets and events until `is_done`.
    fn until(&mut self, mut is_done: impl FnMut(&mut Connection) -> bool) {
        loop {
            let now = self.clock.now();
            assert!(now.saturating_duration_since(Instant::ZERO) < PATIENCE, "it never happens");
            self.gateway.poll(now).unwrap();
            self.gateway.handle_timeout(now);
            self.connection.handle_timeout(now);
            while let Some(segment) = self.connection.poll_transmit(now) {
                self.gateway.handle_packet(now, &Packet::new(segment.to_packet(), Framing::Ip));
            }
            while let Some(packet) = self.gateway.poll_packet() {
                self.connection.handle_segment(now, &Segment::parse(packet.bytes()).unwrap());
            }
            if is_done(&mut self.connection) {
                return;
            }
            self.clock.block(Some(now.saturating_add(Duration::from_millis(1))), &[self.gateway.readable()]).unwrap();
        }
    }
}

/// Returns a server, and a connection inside that the server has accepted.
fn connected() -> (Inside, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut inside = Inside::connect(listener.local_addr().unwrap().port());
    inside.until(|connection| connection.state() == State::Established);
    let (server, _) = listener.accept().unwrap();
    server.set_read_timeout(Some(PATIENCE)).unwrap();
    (inside, server)
}

#[test]
fn each_direction_ends_by_itself() {
    let (mut inside, mut server) = connected();
    inside.connection.write(b"question").unwrap();
    inside.connection.shutdown();
    inside.until(|connection| connection.state() == State::FinWait2);
    let mut question = String::new();
    // One more turn moves bytes and end that have not gone out yet.
    inside.until(|_| true);
    server.read_to_string(&mut question).unwrap();
    assert_eq!(question, "question");
    assert!(inside.gateway.is_delivered());
    server.write_all(b"answer").unwrap();
    server.shutdown(Shutdown::Write).unwrap();
    let mut answer = [0; 16];
    inside.until(|connection| connection.is_read_closed());
    assert_eq!(inside.connection.read(&mut answer), Ok(6));
    assert_eq!(inside.connection.read(&mut answer), Ok(0));
    // The gateway's own end has ended too, and keeps no socket.
    inside.until(|connection| connection.state() == State::TimeWait);
    assert!(inside.gateway.sockets.owners.is_empty());
}

#[test]
fn a_reset_outside_is_a_reset_inside_and_the_other_way_round() {
    let (mut inside, server) = connected();
    set_socket_linger(&server, Some(Duration::ZERO)).unwrap();
    drop(server);
    inside.until(|connection| connection.state() == State::Closed);
    assert_eq!(inside.connection.read(&mut [0]), Err(Error::ConnectionReset));
    assert!(inside.gateway.sockets.owners.is_empty());

    let (mut inside, mut server) = connected();
    inside.connection.abort();
    inside.until(|connection| connection.state() == State::Closed);
    assert_eq!(server.read(&mut [0]).unwrap_err().kind(), ErrorKind::ConnectionReset);
}

/// A server that does not read holds the program inside, and the gateway keeps no more than its windows.
#[test]
fn a_server_that_does_not_read_stops_the_program_inside() {
    let (mut inside, mut server) = connected();
    let (piece, mut written) = (vec![1; 1 << 16], 0_usize);
    let mut idle = 0;
    inside.until(|connection| {
        match connection.write(&piece) {
            Ok(count) => {
                written += count;
                idle = 0;
            }
            Err(_) => idle += 1,
        }
        idle > 300
    });
    assert!(written < 64 << 20, "{written}");
    let mut read = 0;
    let mut buffer = vec![0; 1 << 16];
    server.set_nonblocking(true).unwrap();
    inside.connection.shutdown();
    inside.until(|_| {
        while let Ok(count @ 1..) = server.read(&mut buffer) {
            read += count;
        }
        read == written
    });
}

#[test]
fn a_port_without_a_server_is_refused() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut inside = Inside::connect(port);
    inside.until(|connection| connection.state() == State::Closed);
    assert_eq!(inside.connection.read(&mut [0]), Err(Error::ConnectionRefused));
}

/// Datagrams of one flow share a socket, and a flow is forgotten after a long silence.
#[test]
fn a_silent_flow_is_forgotten() {
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    server.set_read_timeout(Some(PATIENCE)).unwrap();
    let outside = SocketAddr::new(GATEWAY[0], server.local_addr().unwrap().port());
    let mut gateway = Gateway::new(None).unwrap();
    let send = |gateway: &mut Gateway, seconds: u64| {
        let packet = Packet::datagram(SocketAddr::new(HOST[0], 5000), outside, b"hello").unwrap();
        gateway.handle_packet(Instant::from_nanos(seconds * 1_000_000_000), &packet);
        server.recv_from(&mut [0; 16]).unwrap().1
    };
    let first = send(&mut gateway, 0);
    assert_eq!(send(&mut gateway, 200), first);
    let at = |seconds: u64| Instant::from_nanos(seconds * 1_000_000_000);
    assert_eq!(gateway.poll_timeout(), Some(at(300)));
    gateway.handle_timeout(at(300));
    assert_eq!((gateway.sockets.owners.len(), gateway.poll_timeout()), (1, Some(at(500))));
    gateway.handle_timeout(at(500));
    assert_eq!((gateway.sockets.owners.len(), gateway.poll_timeout()), (0, None));
}

/// Packets from inside that are not passed on are dropped and counted, or answered.
#[test]
fn packets_of_other_kinds_are_counted() {
    use etherparse::PacketBuilder;
    let mut gateway = Gateway::new(None).unwrap();
    let mut bytes = Vec::new();
    PacketBuilder::ipv4([10, 0, 2, 15], [192, 0, 2, 1], 64).icmpv4_echo_request(7, 8).write(&mut bytes, b"data").unwrap();
    gateway.handle_packet(Instant::ZERO, &Packet::new(bytes, Framing::Ip));
    gateway.handle_packet(Instant::ZERO, &Packet::new(vec![0x45; 30], Framing::Ip));
    let mut damaged = Packet::datagram(SocketAddr::new(HOST[0], 1), SocketAddr::new(GATEWAY[0], 2), b"hello").unwrap().bytes().to_vec();
    damaged[29] ^= 1;
    gateway.handle_packet(Instant::ZERO, &Packet::new(damaged, Framing::Ip));
    assert_eq!(gateway.dropped(), 3);
    assert!(gateway.poll_packet().is_none());
    // A question to a name server that the machine does not have, and a segment of no connection.
    let question = Packet::datagram(SocketAddr::new(HOST[0], 1), SocketAddr::new(NAMES[0], DNS), b"?").unwrap();
    gateway.handle_packet(Instant::ZERO, &question);
    assert_eq!(gateway.poll_packet().unwrap().bytes()[20..22], [3, 3]);
}
